"""End-to-end protection: published check values, and what it must catch."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.link.e2e import ALIVE_COUNT, AliveMonitor, crc8_j1850, frame_crc, is_intact, protect

# Check values of AUTOSAR SWS CRC Library, 7.2.1.1 (SAE J1850).
AUTOSAR_EXAMPLES = [
    ("00000000", 0x59),
    ("F20183", 0x37),
    ("0FAA0055", 0x79),
    ("00FF5511", 0xB8),
    ("332255AABBCCDDEEFF", 0xCB),
    ("926B55", 0x8C),
    ("FFFFFFFF", 0x74),
]
payloads = st.binary(min_size=8, max_size=8)
frame_ids = st.integers(0, 0x7FF)


@pytest.mark.parametrize(("data", "expected"), AUTOSAR_EXAMPLES)
def test_the_crc_has_the_published_check_values(data: str, expected: int) -> None:
    assert crc8_j1850(bytes.fromhex(data)) == expected


def test_the_frame_crc_covers_identifier_and_payload_in_order() -> None:
    assert frame_crc(0x123, bytes(range(8))) == crc8_j1850(bytes([0x23, 0x01, 1, 2, 3, 4, 5, 6, 7]))


@given(frame_ids, payloads, st.integers(0, 100))
def test_a_protected_frame_is_intact_and_keeps_its_other_bits(
    frame_id: int, payload: bytes, alive: int
) -> None:
    protected = protect(frame_id, payload, alive)
    assert is_intact(frame_id, protected)
    assert protected[1] & 0x0F == alive % ALIVE_COUNT
    assert protected[1] & 0xF0 == payload[1] & 0xF0
    assert protected[2:] == payload[2:]


@given(frame_ids, payloads, st.integers(0, 63))
def test_any_single_wrong_bit_is_found(frame_id: int, payload: bytes, bit: int) -> None:
    protected = bytearray(protect(frame_id, payload, 3))
    protected[bit // 8] ^= 1 << (bit % 8)
    assert not is_intact(frame_id, bytes(protected))


@given(frame_ids, payloads, st.integers(0, 10))
def test_a_frame_under_a_wrong_identifier_is_found(frame_id: int, payload: bytes, bit: int) -> None:
    assert not is_intact(frame_id ^ (1 << bit), protect(frame_id, payload, 0))


def test_lost_and_repeated_frames_are_counted_for_each_identifier() -> None:
    monitor = AliveMonitor()
    for frame_id, alive in [(0x100, 0), (0x110, 7), (0x100, 1), (0x100, 1), (0x110, 8), (0x100, 4)]:
        monitor.observe(frame_id, bytes([0, alive, 0, 0, 0, 0, 0, 0]))
    assert monitor.repeated == 1
    assert monitor.lost == 2


def test_the_alive_counter_wraps_from_14_to_0_without_a_loss() -> None:
    monitor = AliveMonitor()
    for count in range(40):
        assert monitor.observe(0x100, bytes([0, count % ALIVE_COUNT, 0, 0, 0, 0, 0, 0]))
    assert (monitor.lost, monitor.repeated) == (0, 0)
