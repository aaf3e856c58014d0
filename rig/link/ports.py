"""Which serial port the board is at, by the identifiers of its USB chip."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from rig.link.errors import PortError

BOARDS = {
    (0x2341, 0x0010): "Arduino Mega 2560",
    (0x2341, 0x0042): "Arduino Mega 2560 R3",
    (0x2341, 0x0210): "Arduino Mega 2560",
    (0x2341, 0x0242): "Arduino Mega 2560",
    (0x2A03, 0x0010): "Arduino Mega 2560",
    (0x2A03, 0x0042): "Arduino Mega 2560 R3",
}
"""USB vendor and product of a Mega's own chip (boards.txt of the Arduino AVR core)."""
ADAPTERS = {
    (0x1A86, 0x7523): "CH340, as on many copies of the Mega",
    (0x1A86, 0x5523): "CH341",
    (0x1A86, 0x55D4): "CH9102",
    (0x0403, 0x6001): "FTDI FT232",
    (0x0403, 0x6015): "FTDI FT231X",
    (0x10C4, 0xEA60): "CP2102",
}
"""USB-to-serial chips behind which a Mega may be, or anything else."""


class PortInfo(Protocol):
    """What pyserial knows of a port."""

    device: str
    vid: int | None
    pid: int | None


def find_board(ports: Iterable[PortInfo]) -> str:
    """The one port with a Mega; failing that, the one with an adapter that may have a Mega.

    Raises PortError that lists the candidates if there is none, or more than one.
    """
    known = sorted(ports, key=lambda port: port.device)
    for table in (BOARDS, ADAPTERS):
        found = [port for port in known if (port.vid, port.pid) in table]
        if len(found) == 1:
            return found[0].device
        if found:
            raise PortError(
                f"several ports may be the board: {describe(found)}. Write the right one into "
                "board.port of the bench, or unplug the others."
            )
    raise PortError(
        "no port looks like an Arduino Mega or a USB-serial adapter. "
        f"{describe(known) or 'This machine has no serial ports'}. Plug the board in; if it is "
        "there, write its port into board.port of the bench."
    )


def describe(ports: Iterable[PortInfo]) -> str:
    """Ports with what is known of them, for people."""
    return ", ".join(f"{port.device} ({_what(port)})" for port in ports)


def _what(port: PortInfo) -> str:
    if port.vid is None or port.pid is None:
        return "not USB"
    identity = (port.vid, port.pid)
    name = BOARDS.get(identity) or ADAPTERS.get(identity) or "unknown device"
    return f"{name}, USB {port.vid:04x}:{port.pid:04x}"
