"""Finding and opening the board's port: by USB identifiers, and what is said when it fails."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Any

import pytest
import serial

from rig.link.errors import PortError
from rig.link.open import open_bus
from rig.link.ports import find_board


@dataclass
class Port:
    device: str
    vid: int | None = None
    pid: int | None = None


MEGA = Port("/dev/ttyACM0", 0x2341, 0x0042)
CLONE = Port("/dev/ttyUSB0", 0x1A86, 0x7523)
FTDI = Port("/dev/ttyUSB1", 0x0403, 0x6001)
MODEM = Port("/dev/ttyS0")
MOUSE = Port("/dev/ttyACM7", 0x046D, 0xC077)


@pytest.mark.parametrize(
    ("ports", "found"),
    [
        ([MODEM, MEGA], MEGA),
        ([CLONE, FTDI, MEGA], MEGA),
        ([MODEM, MOUSE, CLONE], CLONE),
        ([FTDI], FTDI),
    ],
)
def test_the_board_is_known_by_its_usb_chip(ports: list[Port], found: Port) -> None:
    assert find_board(ports) == found.device


@pytest.mark.parametrize(
    "ports", [[MEGA, Port("/dev/ttyACM1", 0x2A03, 0x0010), CLONE], [CLONE, FTDI]]
)
def test_two_candidates_are_named_and_none_is_taken(ports: list[Port]) -> None:
    with pytest.raises(PortError, match=r"several ports") as raised:
        find_board(ports)
    assert all(port.device in str(raised.value) for port in ports[:2])


@pytest.mark.parametrize("ports", [[], [MODEM, MOUSE]])
def test_what_is_no_board_is_not_taken(ports: list[Port]) -> None:
    with pytest.raises(PortError, match=r"no port looks like"):
        find_board(ports)


def refusing(number: int, text: str) -> Any:
    def refuse(*_: object, **__: object) -> None:
        raise serial.SerialException(number, text)

    return refuse


@pytest.mark.parametrize(
    ("number", "advice"),
    [
        (errno.EACCES, "dialout"),
        (errno.EBUSY, "another program"),
        (errno.EAGAIN, "another program"),
        (errno.ENOENT, "auto"),
    ],
)
def test_a_port_that_stays_closed_says_what_to_do(
    number: int, advice: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serial, "serial_for_url", refusing(number, "could not open port"))
    with pytest.raises(PortError, match=advice) as raised:
        open_bus("/dev/ttyACM0")
    assert "/dev/ttyACM0" in str(raised.value)


@pytest.mark.parametrize(
    ("port", "why"),
    [
        ("can:", "names no CAN adapter"),
        ("can:socketcan", "names no CAN adapter"),
        ("can:socketcan:", "names no CAN adapter"),
        ("can:nothing-like-it:can0", "cannot be opened"),
        ("can:socketcan:no-such-channel", "cannot be opened"),
        ("socket://127.0.0.1:1", "what listens there"),
        ("nonsense://x", "cannot be opened"),
    ],
)
def test_a_bad_address_is_explained(port: str, why: str) -> None:
    with pytest.raises(PortError, match=why):
        open_bus(port, boot_s=0.0)
