"""`rig firmware`: image, flashing, identity and parameters, on the virtual board and a port."""

from __future__ import annotations

import json
import re
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.board.emulator_build import missing_packages
from rig.board.revision import firmware_revision
from rig.board.virtual import virtual_board
from rig.link.bus import SlcanBus
from rig.link.client import RigLink
from rig.link.schema import load_schema
from rig.link.serial import SerialTransport
from rig.spec.workspace import Workspace
from tests.boards import served

from .conftest import ROOT, Command

RULES = load_schema().parameters


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A board on a pseudo-terminal; nothing resets it when the port is opened."""
    boots = SerialTransport.__init__.__kwdefaults__
    assert boots is not None
    monkeypatch.setitem(boots, "boot_s", 0.1)
    setup = Workspace(ROOT).setup("bellow-bending", "virtual-beam")
    with served(virtual_board(setup, 1)) as name:
        yield name


@pytest.fixture
def avrdude(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A program of that name which notes what it was asked for."""
    noted = tmp_path / "noted"
    program = tmp_path / "bin" / "avrdude"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\necho "$@" > {noted}\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(program.parent), prepend=":")
    return noted


@pytest.fixture
def image(tmp_path: Path) -> Path:
    path = tmp_path / "some.hex"
    path.write_text(":00000001FF\n")
    return path


# --- identity -----------------------------------------------------------------------------------


def test_identity_tells_who_why_and_how(rig: Command) -> None:
    facts = json.loads(rig("firmware", "identify", "--bench", "virtual-beam", "--json").out)
    assert facts["commit"] == f"{firmware_revision():06x}"
    assert facts["protocol"] == load_schema().protocol_version
    assert facts["schema"] == f"{load_schema().crc:04x}"
    assert (facts["board"], facts["reset_cause"], facts["state"]) == ("host", "power_on", "idle")
    assert "reset_cause power_on" in rig("firmware", "identify", "--bench", "virtual-beam").out


def test_a_port_that_is_not_there_is_named_with_those_that_are(rig: Command) -> None:
    outcome = rig("firmware", "identify", "--port", "/dev/ttyNONE")
    assert outcome.code == 1
    assert "/dev/ttyNONE cannot be opened" in outcome.err
    assert "of this machine" in " ".join(outcome.err.split()) or "has no ports" in outcome.err


def test_a_port_that_another_program_uses_is_left_alone(rig: Command, port: str) -> None:
    user = SerialTransport(port)
    try:
        outcome = rig("firmware", "identify", "--port", port)
    finally:
        user.close()
    assert outcome.code == 1
    assert "in use by another program" in " ".join(outcome.err.split())


# --- flashing -----------------------------------------------------------------------------------


def test_a_dry_run_prints_the_command_and_asks_nobody(rig: Command) -> None:
    outcome = rig("firmware", "flash", "--port", "COM3", "--image", "x.hex", "--dry-run")
    expected = "avrdude -p atmega2560 -c wiring -P COM3 -b 115200 -D -U flash:w:x.hex:i"
    assert outcome.out.strip() == expected


def test_an_idle_board_is_flashed_and_asked_who_it_is(
    rig: Command, port: str, avrdude: Path, image: Path
) -> None:
    outcome = rig("firmware", "flash", "--port", port, "--image", image)
    assert outcome.code == 0, outcome.err
    assert f"-P {port} -b 115200 -D -U flash:w:{image}:i" in avrdude.read_text()
    assert "state       idle" in outcome.out


def test_a_board_at_work_is_not_flashed_unless_forced(
    rig: Command, port: str, avrdude: Path, image: Path
) -> None:
    bus = SlcanBus(SerialTransport(port))
    link = RigLink(bus)
    link.open()
    link.write_parameter("communication_timeout_s", 60.0)
    link.command("hold")
    bus.close()
    outcome = rig("firmware", "flash", "--port", port, "--image", image)
    assert outcome.code == 1
    assert "not idle but in the state 'hold'" in " ".join(outcome.err.split())
    assert not avrdude.exists()
    assert rig("firmware", "flash", "--port", port, "--image", image, "--force").code == 0
    assert avrdude.exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--port", "/dev/ttyNONE"], "there is no port /dev/ttyNONE"),
        (["--port", "socket://lab:2000"], "expected a serial port of this machine"),
        (["--bench", "virtual-beam"], "has no serial port"),
        (["--port", "/dev/null", "--image", "missing.hex"], "there is no image missing.hex"),
    ],
)
def test_what_cannot_be_flashed_is_said_before(
    rig: Command, avrdude: Path, image: Path, arguments: list[str], said: str
) -> None:
    given = arguments if "--image" in arguments else [*arguments, "--image", str(image)]
    outcome = rig("firmware", "flash", *given)
    assert outcome.code == 1
    assert said in " ".join(outcome.err.split())
    assert not avrdude.exists()


@pytest.mark.parametrize(
    ("verb", "tool"),
    [(["build"], "make"), (["flash", "--image", "x.hex", "--port", "/dev/null"], "avrdude")],
)
def test_a_missing_tool_is_named_with_its_package(
    rig: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, verb: list[str], tool: str
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    outcome = rig("firmware", *verb)
    assert outcome.code == 1
    said = " ".join(outcome.err.split())
    assert f"{tool} is not installed" in said
    assert "apt-get install" in said


def test_what_avrdude_complains_of_is_passed_on(
    rig: Command, port: str, avrdude: Path, image: Path
) -> None:
    program = avrdude.parent / "bin" / "avrdude"
    program.write_text("#!/bin/sh\necho 'stk500v2_ReceiveMessage(): timeout' >&2\nexit 1\n")
    outcome = rig("firmware", "flash", "--port", port, "--image", image)
    assert outcome.code == 1
    assert "stk500v2_ReceiveMessage(): timeout" in outcome.err


# --- parameters ---------------------------------------------------------------------------------


def test_the_list_has_every_parameter_with_its_range(rig: Command) -> None:
    rows = json.loads(
        rig("firmware", "parameters", "list", "--bench", "virtual-beam", "--json").out
    )
    assert [row["name"] for row in rows] == list(RULES)
    assert all(row["low"] <= row["value"] <= row["high"] for row in rows)
    shown = rig("firmware", "parameters", "list", "--bench", "virtual-beam").out
    for name in RULES:
        assert name in shown


def test_a_parameter_is_set_kept_and_read_back(rig: Command, port: str) -> None:
    said = rig("firmware", "parameters", "set", "leak_volume_ml", "5", "--port", port)
    assert said.code == 0, said.err
    assert "leak_volume_ml: 3 -> 5 mL" in said.out
    assert rig("firmware", "parameters", "get", "leak_volume_ml", "--port", port).out == "5\n"
    assert rig("firmware", "parameters", "defaults", "--port", port).code == 0
    assert rig("firmware", "parameters", "get", "leak_volume_ml", "--port", port).out == "3\n"
    assert rig("firmware", "parameters", "save", "--port", port).code == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["leak_volume", "5"], "did you mean 'leak_volume_ml'"),
        (["leak_volume_ml", "500"], "the board takes 0.1 to 64 mL"),
        (["leak_volume_ml", "nan"], "the board takes 0.1 to 64 mL"),
    ],
)
def test_a_wrong_parameter_is_refused_before_the_board_is_asked(
    rig: Command, arguments: list[str], said: str
) -> None:
    outcome = rig("firmware", "parameters", "set", *arguments, "--port", "/dev/ttyNONE")
    assert outcome.code == 2
    assert said in " ".join(outcome.err.replace("│", " ").split())


def test_parameters_survive_the_way_through_a_file(rig: Command, tmp_path: Path, port: str) -> None:
    file = tmp_path / "board.yaml"
    assert rig("firmware", "parameters", "set", "deadband_kpa", "0.0123", "--port", port).code == 0
    assert rig("firmware", "parameters", "dump", file, "--port", port).code == 0
    assert rig("firmware", "parameters", "defaults", "--port", port).code == 0
    said = rig("firmware", "parameters", "load", file, "--port", port)
    assert "deadband_kpa: 0.008 -> 0.0123 kPa" in said.out
    assert said.out.count("->") == 1


def test_everything_wrong_in_a_file_is_said_with_its_line(rig: Command, tmp_path: Path) -> None:
    file = tmp_path / "board.yaml"
    file.write_text("deadband_kpa: 7\nleek_volume_ml: 1\nstuck_time_s: soon\n")
    outcome = rig("firmware", "parameters", "load", file, "--port", "/dev/ttyNONE")
    said = " ".join(outcome.err.split())
    assert outcome.code == 2
    for place in (
        "board.yaml:1:15: deadband_kpa",
        "board.yaml:2:1: leek",
        "board.yaml:3:15: stuck",
    ):
        assert place in said


# --- signals ------------------------------------------------------------------------------------


def changes_of(text: str, signal: str) -> list[tuple[float, str]]:
    """Times in s and values of a signal of one bit in a VCD file."""
    assert "$timescale 10ns $end" in text
    declared = re.search(rf"^\$var wire 1 (\S+) {signal} \$end$", text, re.MULTILINE)
    assert declared is not None
    changes, now = [], 0.0
    for line in text[text.index("$enddefinitions") :].splitlines():
        if line.startswith("#"):
            now = int(line[1:]) * 10e-9
        elif line[1:] == declared[1] and line[0] in "01":
            changes.append((now, line[0]))
    return changes


@pytest.mark.skipif(bool(missing_packages()), reason="the emulator's packages are not installed")
def test_the_pins_of_the_emulated_board_are_traced(rig: Command, tmp_path: Path) -> None:
    file = tmp_path / "homing.vcd"
    said = rig("firmware", "trace", str(file), "--seconds", "0.2").out
    pulses = int(said.split()[-3])
    steps = changes_of(file.read_text(encoding="ascii"), "step")
    rises = [time for time, level in steps if level == "1"]
    falls = [time for time, level in steps if level == "0"]
    assert len(rises) == pulses > 300
    assert min(f - r for r, f in zip(rises, falls[-len(rises) :], strict=True)) > 1.9e-6


def test_a_command_that_the_board_does_not_have_is_not_traced(rig: Command, tmp_path: Path) -> None:
    outcome = rig("firmware", "trace", str(tmp_path / "x.vcd"), "--command", "nosuch")
    assert outcome.code == 2
    assert "no command 'nosuch'" in outcome.err
    assert not (tmp_path / "x.vcd").exists()


def test_a_board_without_pins_is_not_traced(rig: Command, tmp_path: Path) -> None:
    outcome = rig("firmware", "trace", str(tmp_path / "x.vcd"), "--bench", "virtual")
    assert outcome.code == 2
    assert "no emulated board" in outcome.err


def test_who_asks_the_board_waits_for_no_finite_elements(
    rig: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("finite elements")

    monkeypatch.setattr("rig.plant.specimen.finite_element_truth", refuse)
    assert "virtual" in rig("firmware", "identify", "--bench", "virtual").out
