"""Opens the bus that a bench names: a serial port, a URL of pyserial, or a CAN adapter."""

from __future__ import annotations

from rig.link.bus import FrameBus, PythonCanBus, SlcanBus
from rig.link.errors import PortError
from rig.link.ports import find_board
from rig.link.serial import SerialTransport

AUTOMATIC = "auto"
CAN_PREFIX = "can:"


def open_bus(
    port: str, baudrate: int = 115200, *, boot_s: float = 2.0, start_s: float = 0.0
) -> FrameBus:
    """Open `port`: `auto`, `/dev/ttyACM0`, `socket://host:port`, or `can:socketcan:can0`.

    Bench time begins at `start_s`; `boot_s` is waited for a board that resets when its serial port
    is opened. Raises PortError that says what to do.
    """
    if port.startswith(CAN_PREFIX):
        return _open_can(port, start_s)
    if port == AUTOMATIC:
        from serial.tools import list_ports

        port = find_board(list_ports.comports())
    return SlcanBus(SerialTransport(port, baudrate, boot_s=boot_s, start_s=start_s))


def _open_can(port: str, start_s: float) -> FrameBus:
    import can

    _, interface, *rest = port.split(":", 2)
    if not interface or not rest or not rest[0]:
        raise PortError(
            f"'{port}' names no CAN adapter; expected can:INTERFACE:CHANNEL with an interface of "
            "python-can, as can:socketcan:can0 or can:pcan:PCAN_USBBUS1."
        )
    try:
        bus = can.Bus(interface=interface, channel=rest[0])
    except (can.CanError, OSError, ValueError, ImportError) as error:
        raise PortError(
            f"the CAN channel {rest[0]} of '{interface}' cannot be opened ({error}). Check the "
            "adapter and its driver; for socketcan: ip link set can0 up type can bitrate 500000."
        ) from error
    return PythonCanBus(bus, start_s=start_s)
