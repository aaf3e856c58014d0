"""Ways to move CAN frames: SLCAN over bytes, or any python-can interface.

A bus knows bench time. `poll(duration_s)` lets that much bench time pass and returns what came:
on a real port it waits, on a virtual board it advances firmware and bench together.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Protocol

from rig.link import slcan
from rig.link.errors import PortError
from rig.link.slcan import RawFrame, SlcanParser

if TYPE_CHECKING:
    import can


class ByteTransport(Protocol):
    """A serial line with a clock."""

    @property
    def name(self) -> str:
        """What to call it in messages, as `/dev/ttyACM0`."""
        ...

    @property
    def now_s(self) -> float:
        """Bench time in seconds."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes; raises PortError if the line is gone."""
        ...

    def read(self, duration_s: float) -> bytes:
        """Let `duration_s` of bench time pass; return all bytes that arrived."""
        ...

    def close(self) -> None:
        """Release the line."""
        ...


class FrameBus(Protocol):
    """CAN frames with bench time."""

    @property
    def name(self) -> str:
        """What to call it in messages."""
        ...

    @property
    def now_s(self) -> float:
        """Bench time in seconds."""
        ...

    def send(self, frame_id: int, payload: bytes) -> None:
        """Send a standard data frame."""
        ...

    def poll(self, duration_s: float) -> list[RawFrame]:
        """Let `duration_s` of bench time pass; return the frames received, oldest first."""
        ...

    def reopen(self) -> None:
        """Open the channel again: a board that restarted keeps silent until somebody does."""
        ...

    def close(self) -> None:
        """Release the bus."""
        ...


class SlcanBus:
    """Frames over a serial line that speaks SLCAN."""

    def __init__(self, transport: ByteTransport) -> None:
        self._transport = transport
        self._parser = SlcanParser()
        transport.write(slcan.OPEN_WITH_TIMESTAMPS)

    @property
    def name(self) -> str:
        """Name of the serial line."""
        return self._transport.name

    @property
    def now_s(self) -> float:
        """Bench time in seconds."""
        return self._transport.now_s

    @property
    def malformed(self) -> int:
        """Lines that were no valid frame."""
        return self._parser.malformed

    def send(self, frame_id: int, payload: bytes) -> None:
        """Send a standard data frame."""
        # the empty line before it ends whatever noise came since the last one
        self._transport.write(b"\r" + slcan.encode_frame(frame_id, payload))

    def poll(self, duration_s: float) -> list[RawFrame]:
        """Let bench time pass; return the frames received, oldest first."""
        data = self._transport.read(duration_s)
        frames = self._parser.feed(data, self._transport.now_s)
        # a bell instead of frames: the board started after the channel was opened, or anew
        if slcan.BELL in data and not frames:
            self.reopen()
        return frames

    def reopen(self) -> None:
        """Open the channel again; the board's time stamps may start anew."""
        self._parser.forget_clock()
        self._transport.write(slcan.OPEN_WITH_TIMESTAMPS)

    def close(self) -> None:
        """Close the channel and the line."""
        self._transport.write(slcan.CLOSE)
        self._transport.close()


class PythonCanBus:
    """Frames over a python-can bus: socketcan, pcan, slcan, ...; bench time is the bus's clock."""

    def __init__(self, bus: can.BusABC, *, start_s: float = 0.0) -> None:
        self._bus = bus
        self._start_s = time.monotonic() - start_s

    @property
    def name(self) -> str:
        """What python-can calls the channel."""
        return str(self._bus.channel_info)

    @property
    def now_s(self) -> float:
        """Seconds since the bus was wrapped, plus `start_s`."""
        return time.monotonic() - self._start_s

    def send(self, frame_id: int, payload: bytes) -> None:
        """Send a standard data frame."""
        import can

        message = can.Message(arbitration_id=frame_id, data=payload, is_extended_id=False)
        try:
            self._bus.send(message)
        except can.CanError as error:
            raise self._gone(error) from error

    def poll(self, duration_s: float) -> list[RawFrame]:
        """Receive for `duration_s`; frames carry the host's time of reception."""
        import can

        end_s = self.now_s + duration_s
        frames: list[RawFrame] = []
        while (left_s := end_s - self.now_s) > 0:
            try:
                message = self._bus.recv(left_s)
            except can.CanError as error:
                raise self._gone(error) from error
            if message is not None and not message.is_extended_id:
                frames.append(RawFrame(self.now_s, message.arbitration_id, bytes(message.data)))
        return frames

    def reopen(self) -> None:
        """Nothing: a CAN adapter stays open whatever the board does."""

    def close(self) -> None:
        """Shut the bus down."""
        self._bus.shutdown()

    def _gone(self, error: Exception) -> PortError:
        return PortError(
            f"the CAN adapter {self.name} failed ({error}): was it unplugged, or is the bus off? "
            "The firmware's own watchdog vents the bench. Mend it, then `rig resume` the run."
        )
