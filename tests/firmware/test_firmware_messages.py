"""The firmware packs and unpacks the messages of rig.dbc as cantools does."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Any

import pytest
from board_under_test import SCHEMA, protected
from hypothesis import given
from hypothesis import strategies as st
from rig.board._firmware import ffi, lib

alive = st.integers(0, 14)
byte = st.integers(0, 255)
single = st.floats(width=32, allow_nan=False, allow_infinity=False)
FLAGS = [
    "home_switch",
    "end_switch",
    "emergency_stop",
    "valve_open",
    "motor_enabled",
    "homed",
    "zeroed",
    "tared",
]


def packed(pack: Callable[..., None], *values: Any) -> bytes:
    buffer = ffi.new("uint8_t[8]")
    pack(*values, buffer)
    return bytes(ffi.buffer(buffer))


@given(alive, st.integers(0, 6), byte, byte, st.integers(0, 7), st.integers(0, 4), byte)
def test_heartbeats_agree(
    counter: int, state: int, fault: int, number: int, result: int, cause: int, flags: int
) -> None:
    uptime_s = (number * 257 + flags) & 0xFFFF
    ours = packed(
        lib.rig_test_pack_heartbeat, counter, state, fault, number, result, cause, flags, uptime_s
    )
    theirs = protected(
        "HEARTBEAT",
        counter,
        {
            "state": state,
            "fault_code": fault,
            "command_number": number,
            "command_result": result,
            "reset_cause": cause,
            "uptime_s": uptime_s,
            **{name: flags >> bit & 1 for bit, name in enumerate(FLAGS)},
        },
    )
    assert ours == theirs


@given(alive, st.booleans(), st.booleans(), *[st.integers(0, 65535)] * 3)
def test_pressure_reports_agree(
    counter: int, plausible: bool, saturated: bool, raw_p: int, raw_sp: int, raw_v: int
) -> None:
    pressure, setpoint, volume = raw_p / 1000 - 10, raw_sp / 1000 - 10, raw_v / 1000 - 1
    ours = packed(
        lib.rig_test_pack_pressure, counter, plausible, saturated, pressure, setpoint, volume
    )
    theirs = protected(
        "PRESSURE",
        counter,
        {
            "plausible": int(plausible),
            "saturated": int(saturated),
            "pressure_kpa": pressure,
            "setpoint_kpa": setpoint,
            "plunger_ml": volume,
        },
    )
    assert ours == theirs


@given(alive, st.integers(-32767, 32767), st.integers(-32767, 32767), st.integers(0, 65535))
def test_controller_reports_agree(counter: int, raw_v: int, raw_i: int, raw_u: int) -> None:
    velocity, integral, voltage = raw_v / 1000, raw_i / 1000, raw_u / 10000
    ours = packed(lib.rig_test_pack_controller, counter, velocity, integral, voltage)
    theirs = protected(
        "CONTROLLER",
        counter,
        {
            "plunger_velocity_ml_s": velocity,
            "integral_ml_s": integral,
            "transducer_v": voltage,
        },
    )
    assert ours == theirs


@given(alive, st.integers(0, 3), st.integers(-(1 << 24), (1 << 24) - 1), st.integers(0, 65535))
def test_load_cell_reports_agree(counter: int, status: int, counts: int, sample: int) -> None:
    ours = packed(lib.rig_test_pack_load_cell, counter, status, counts, sample)
    theirs = protected(
        "LOAD_CELL",
        counter,
        {"load_cell_status": status, "load_cell_counts": counts, "load_cell_sample": sample},
    )
    assert ours == theirs


@given(alive, st.integers(0, 15), single, st.integers(0, 255))
def test_fault_reports_agree(counter: int, code: int, value: float, raw_age: int) -> None:
    ours = packed(lib.rig_test_pack_fault, counter, code, value, raw_age / 10)
    theirs = protected(
        "FAULT", counter, {"code": code, "fault_value": value, "age_s": raw_age / 10}
    )
    assert ours == theirs


@given(alive, st.integers(0, 4), byte, byte, single)
def test_parameter_reports_agree(
    counter: int, result: int, number: int, index: int, value: float
) -> None:
    ours = packed(lib.rig_test_pack_parameter, counter, result, number, index, value)
    theirs = protected(
        "PARAMETER",
        counter,
        {
            "parameter_result": result,
            "number": number,
            "parameter_index": index,
            "parameter_value": value,
        },
    )
    assert ours == theirs


@given(alive, st.integers(0, 1), st.integers(0, 0xFFFFFF))
def test_identities_agree(counter: int, kind: int, git: int) -> None:
    ours = packed(lib.rig_test_pack_identity, counter, kind, git)
    values = SCHEMA.decode_message("IDENTITY", ours, decode_choices=False)
    assert ours == protected("IDENTITY", counter, values)
    assert (values["board_kind"], values["firmware_git"]) == (kind, git)


@given(st.integers(0, 15), st.integers(1, 255), st.floats(width=32))
def test_commands_are_understood_whatever_the_argument(
    opcode: int, number: int, argument: float
) -> None:
    values = {"opcode": opcode, "number": number, "argument": argument}
    out = ffi.new("uint8_t *"), ffi.new("uint8_t *"), ffi.new("float *")
    lib.rig_test_unpack_command(protected("COMMAND", 3, values), *out)
    assert (out[0][0], out[1][0]) == (opcode, number)
    assert struct.pack("<f", out[2][0]) == struct.pack("<f", argument) or math.isnan(argument)


@pytest.mark.parametrize(("value", "end"), [(99.0, 55.535), (-99.0, -10.0)])
def test_a_pressure_beyond_its_signal_stays_at_the_end_and_does_not_wrap(
    value: float, end: float
) -> None:
    frame = packed(lib.rig_test_pack_pressure, 0, 1, 0, value, value, 0.0)
    decoded = SCHEMA.decode_message("PRESSURE", frame)
    assert decoded["pressure_kpa"] == pytest.approx(end)
    assert decoded["setpoint_kpa"] == pytest.approx(end)


def test_an_old_fault_is_reported_as_old() -> None:
    frame = packed(lib.rig_test_pack_fault, 0, 1, 0.0, 3600.0)
    assert SCHEMA.decode_message("FAULT", frame)["age_s"] == pytest.approx(25.5)
