"""End-to-end protection of frames: CRC-8 SAE J1850 and an alive counter (AUTOSAR E2E 1 in spirit).

Byte 0 holds the CRC over the identifier (low byte, high byte) and payload bytes 1 to 7; the low
half of byte 1 holds the alive counter, 0 to 14 for each identifier.
"""

from __future__ import annotations

POLYNOMIAL = 0x1D
ALIVE_COUNT = 15
"""Values of the alive counter; 15 itself never occurs."""


def _make_table() -> bytes:
    table = bytearray(256)
    for byte in range(256):
        remainder = byte
        for _ in range(8):
            carry = remainder & 0x80
            remainder = (remainder << 1) & 0xFF
            if carry:
                remainder ^= POLYNOMIAL
        table[byte] = remainder
    return bytes(table)


_TABLE = _make_table()
_START: dict[int, int] = {}


def crc8_j1850(data: bytes, crc: int = 0xFF) -> int:
    """CRC-8 SAE J1850 of `data` (start 0xFF, final XOR 0xFF).

    `crc` continues a calculation: pass the previous result XOR 0xFF.
    """
    table = _TABLE
    for byte in data:
        crc = table[crc ^ byte]
    return crc ^ 0xFF


def frame_crc(frame_id: int, payload: bytes) -> int:
    """CRC of a frame: over its 11-bit identifier and payload bytes 1 to 7."""
    start = _START.get(frame_id)
    if start is None:
        start = crc8_j1850(bytes((frame_id & 0xFF, frame_id >> 8))) ^ 0xFF
        _START[frame_id] = start
    return crc8_j1850(payload[1:], start)


def protect(frame_id: int, payload: bytes, alive: int) -> bytes:
    """`payload` (8 bytes) with alive counter and CRC filled in."""
    body = bytes(((payload[1] & 0xF0) | (alive % ALIVE_COUNT), *payload[2:]))
    return bytes((frame_crc(frame_id, b"\0" + body),)) + body


def is_intact(frame_id: int, payload: bytes) -> bool:
    """Whether the CRC of a received frame fits."""
    return len(payload) == 8 and payload[0] == frame_crc(frame_id, payload)


class AliveMonitor:
    """Counts frames that were lost or repeated, by the alive counter of each identifier."""

    def __init__(self) -> None:
        self._last: dict[int, int] = {}
        self.lost = 0
        self.repeated = 0

    def observe(self, frame_id: int, payload: bytes) -> bool:
        """Note a frame; False if it repeats the frame before it."""
        alive = payload[1] & 0x0F
        last = self._last.get(frame_id)
        self._last[frame_id] = alive
        if last is None:
            return True
        step = (alive - last) % ALIVE_COUNT
        if step == 0:
            self.repeated += 1
            return False
        self.lost += step - 1
        return True
