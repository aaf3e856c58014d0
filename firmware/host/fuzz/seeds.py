"""Writes the seeds of both fuzz targets: `python seeds.py FOLDER`.

Each is a story that a person would tell a board; the fuzzer takes it from there.
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

FRESH, READY = b"\x00", b"\x01"
NONE, SET_PRESSURE, HOLD, VENT, ZERO, TARE, HOME, JOG, CLEAR, IDLE = range(10)
READ, WRITE, SAVE = range(3)
HOME_INVERTED, END, STOP, NO_CONVERSIONS, STALL = 1, 2, 4, 8, 16
AMBIENT = 128
LEVELS = 256


def wait(ticks: int) -> bytes:
    return bytes((0, ticks))


def talk(eighths: int) -> bytes:
    """Ticks with heartbeats of the host, in eights."""
    return bytes((7, eighths))


def noise(data: bytes) -> bytes:
    return bytes((1, len(data))) + data


def command(opcode: int, argument: float = 0.0) -> bytes:
    return bytes((2 | opcode << 4,)) + struct.pack("<f", argument)


def parameter(operation: int, index: int, value: float = 0.0) -> bytes:
    return bytes((3 | operation << 4, index)) + struct.pack("<f", value)


def pins(flags: int = 0, level: int = AMBIENT) -> bytes:
    """Switches, and an offset of the transducer in eights of a count."""
    return bytes((5, flags, level))


def word(counts: int) -> bytes:
    return b"\x06" + (counts & 0xFFFFFF).to_bytes(3, "big")


SESSIONS = {
    "home-zero-run-vent": FRESH
    + command(HOME)
    + talk(200)
    + command(ZERO)
    + talk(80)
    + command(SET_PRESSURE, 3.0)
    + talk(100)
    + command(VENT)
    + talk(200),
    "hold-and-on": READY + command(HOLD) + talk(20) + command(SET_PRESSURE, 5.0) + talk(50),
    "host-vanishes": READY + wait(255) + wait(255) + wait(255) + command(CLEAR),
    "emergency-stop": READY
    + pins(STOP)
    + wait(3)
    + command(CLEAR)
    + pins()
    + talk(2)
    + command(CLEAR)
    + command(HOME)
    + talk(200),
    "sensor-open": READY + pins(level=0) + wait(10) + pins() + talk(250) + command(CLEAR),
    "sensor-short": READY + pins(level=LEVELS - 1) + wait(10),
    "converter-stops": READY + pins(NO_CONVERSIONS) + wait(10),
    "end-switch": READY + command(SET_PRESSURE, 9.0) + talk(5) + pins(END) + talk(5),
    "stall": READY
    + pins(STALL)
    + command(SET_PRESSURE, 9.0)
    + talk(255)
    + command(VENT)
    + talk(255),
    "home-switch-stuck": FRESH + pins(HOME_INVERTED) + command(HOME) + talk(255),
    "load-cell": READY
    + b"".join(word(40_000 + i) + talk(2) for i in range(25))
    + command(TARE)
    + b"".join(word(80_001) + talk(2) for _ in range(12))
    + talk(200),
    "parameters": FRESH
    + parameter(READ, 3)
    + parameter(WRITE, 3, 0.02)
    + parameter(WRITE, 14, float("nan"))
    + parameter(WRITE, 8, 0.5)
    + parameter(WRITE, 12, 0.6)
    + parameter(SAVE, 0)
    + wait(2),
    "jog": READY + command(IDLE) + command(JOG, 4.0) + talk(10) + command(JOG, -4.0) + talk(40),
    "noise": FRESH + noise(b"C\rS6\r\rO\rO\rZ1\r") + noise(b"t2018zz\rV\r") + wait(200),
}

LINES = {
    "opening": b"C\rS6\r\rO\rO\r",
    "questions": b"V\rN\rF\rZ1\rZ0\r",
    "frame": b"O\rt20085500010000000000\r",
    "extended": b"O\rT0000012321122\rr1238\rR000001232\r",
    "broken": b"t\rt1\rt1009\rt80081122334455667788\rS9\rZ\rt1001!!\r\n",
    "long": b"t" + b"0" * 60 + b"\rO\r",
}


def main() -> None:
    folder = Path(sys.argv[1])
    for target, seeds in (("fuzz_session", SESSIONS), ("fuzz_line", LINES)):
        (folder / target).mkdir(parents=True, exist_ok=True)
        for name, data in seeds.items():
            (folder / target / name).write_bytes(data)


if __name__ == "__main__":
    main()
