"""A real serial line, or any URL that pyserial opens (`socket://`, `rfc2217://`, `loop://`)."""

from __future__ import annotations

import errno
import time
from pathlib import Path

import serial

from rig.link.errors import PortError
from rig.link.ports import describe


class SerialTransport:
    """Bytes over a serial port; bench time is the host's monotonic clock."""

    def __init__(
        self, port: str, baudrate: int = 115200, *, boot_s: float = 2.0, start_s: float = 0.0
    ) -> None:
        """Open `port`; waits `boot_s` for a board that resets when its port is opened.

        Bench time begins at `start_s`.

        Raises PortError when the port does not exist or cannot be opened.
        """
        self._port = port
        # two programs at one port would each read half of what the board says
        exclusive = None if "://" in port else True
        try:
            self._serial = serial.serial_for_url(
                port, baudrate=baudrate, timeout=0, exclusive=exclusive
            )
        except (serial.SerialException, ValueError, OSError) as error:
            raise PortError(_why_closed(port, error)) from error
        self._zero_s = time.monotonic() - start_s
        if boot_s > 0:
            time.sleep(boot_s)

    @property
    def name(self) -> str:
        """The port."""
        return self._port

    @property
    def now_s(self) -> float:
        """Bench time in seconds."""
        return time.monotonic() - self._zero_s

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._serial.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._gone(error) from error

    def read(self, duration_s: float) -> bytes:
        """Wait `duration_s`; return all bytes that arrived."""
        end_s = time.monotonic() + duration_s
        data = bytearray()
        try:
            while (left_s := end_s - time.monotonic()) > 0:
                self._serial.timeout = left_s
                data += self._serial.read(max(1, self._serial.in_waiting))
        except (serial.SerialException, OSError) as error:
            raise self._gone(error) from error
        return bytes(data)

    def close(self) -> None:
        """Close the port."""
        self._serial.close()

    def _gone(self, error: Exception) -> PortError:
        return PortError(
            f"the port {self._port} vanished ({error}): was the cable pulled? The firmware's own "
            "watchdog vents the bench. Plug it in again and `rig resume` the run."
        )


def require_port(port: str) -> None:
    """Raise PortError unless `port` is a serial device of this machine, and no URL."""
    from serial.tools import list_ports

    if "://" in port:
        raise PortError(f"{port} is a URL; expected a serial port of this machine.")
    known = {device.device for device in list_ports.comports()}
    if port not in known and not Path(port).exists():
        raise PortError(
            f"there is no port {port}. Expected a serial port with the board, as /dev/ttyACM0 or "
            f"COM3. {_known_ports()}"
        )


def _why_closed(port: str, error: Exception) -> str:
    number = getattr(error, "errno", None)
    if number in (errno.EACCES, errno.EPERM):
        return (
            f"the port {port} may not be used by you ({error}). On Linux, join the group that owns "
            "it, mostly `sudo usermod -a -G dialout $USER`, and log in again."
        )
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        return (
            f"the port {port} is in use by another program ({error}). Close the serial monitor, "
            "the CAN viewer or the other `rig` that holds it."
        )
    if "://" in port:
        return f"{port} cannot be opened ({error}). Check host, port number and what listens there."
    return (
        f"the port {port} cannot be opened ({error}). Expected a serial port with the board, as "
        f"/dev/ttyACM0 or COM3, or `auto`. {_known_ports()}"
    )


def _known_ports() -> str:
    from serial.tools import list_ports

    ports = describe(list_ports.comports())
    return f"Ports of this machine: {ports}." if ports else "This machine has no ports."
