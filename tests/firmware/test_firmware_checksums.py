"""Checksums of the firmware against published check values and bit-by-bit definitions."""

from __future__ import annotations

import pytest
from board_under_test import crc8
from hypothesis import given
from hypothesis import strategies as st
from rig.board._firmware import ffi, lib

CHECK = b"123456789"


def test_the_crc8_has_the_check_value_of_sae_j1850() -> None:
    assert lib.rig_test_crc8(CHECK, len(CHECK)) == 0x4B


def test_the_crc16_has_the_check_value_of_ccitt_false() -> None:
    assert lib.rig_test_crc16(CHECK, len(CHECK)) == 0x29B1


@given(st.binary(max_size=40))
def test_the_crc8_by_table_is_the_crc8_by_bits(data: bytes) -> None:
    assert lib.rig_test_crc8(data, len(data)) == crc8(data)


@given(st.integers(0, 0x7FF), st.integers(0, 14), st.binary(min_size=8, max_size=8))
def test_a_protected_frame_carries_counter_and_crc_over_id_and_payload(
    frame_id: int, alive: int, payload: bytes
) -> None:
    buffer = ffi.new("uint8_t[8]", payload)
    lib.rig_test_protect(frame_id, alive, buffer)
    result = bytes(ffi.buffer(buffer))
    assert result[1] == (payload[1] & 0xF0) | alive
    assert result[2:] == payload[2:]
    assert result[0] == crc8(bytes((frame_id & 0xFF, frame_id >> 8)) + result[1:])


@pytest.mark.parametrize("bit", range(8, 64))
def test_every_single_flipped_bit_changes_the_crc(bit: int) -> None:
    payload = bytes(range(1, 9))
    flipped = (int.from_bytes(payload, "little") ^ 1 << bit).to_bytes(8, "little")
    identifier = b"\x00\x01"
    before, after = identifier + payload[1:], identifier + flipped[1:]
    assert lib.rig_test_crc8(before, 9) != lib.rig_test_crc8(after, 9)
