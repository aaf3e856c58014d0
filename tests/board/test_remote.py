"""The native firmware behind a TCP port, by socket and by RFC 2217, and behind a CAN adapter.

These run in wall time, for a second or two each.
"""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest
import serial
from serial.rfc2217 import PortManager

from rig.board.virtual import virtual_board
from rig.link import slcan
from rig.link.client import RigLink
from rig.link.errors import PortError
from rig.link.open import open_bus
from rig.link.slcan import SlcanParser
from rig.spec.workspace import Workspace
from tests.boards import running, served

ROOT = Path(__file__).resolve().parents[2]


class PtyLine(serial.Serial):
    """A pseudo-terminal has no modem lines; RFC 2217 asks for them."""

    cts = dsr = ri = cd = False

    def _update_rts_state(self) -> None: ...
    def _update_dtr_state(self) -> None: ...
    def _update_break_state(self) -> None: ...


@pytest.fixture
def port() -> Iterator[str]:
    setup = Workspace(ROOT).setup("bellow-bending", "virtual-beam")
    with served(virtual_board(setup, 1)) as name:
        yield name


@pytest.fixture(params=["socket", "rfc2217"])
def url(port: str, request: pytest.FixtureRequest) -> Iterator[str]:
    """The pty's port, served on TCP."""
    listener = socket.create_server(("127.0.0.1", 0))
    listener.settimeout(0.1)

    def bridge(until: Callable[[], bool]) -> None:
        connection = None
        while connection is None and not until():
            with contextlib.suppress(TimeoutError):
                connection, _ = listener.accept()
        if connection is None:
            return
        with PtyLine(port, timeout=0) as line, connection:
            connection.settimeout(0.005)
            manager = None
            if request.param == "rfc2217":
                writer = type("Writer", (), {"write": lambda _, data: connection.sendall(data)})
                manager = PortManager(line, writer())
            while not until():
                with contextlib.suppress(TimeoutError):
                    data = connection.recv(4096)
                    line.write(b"".join(manager.filter(data)) if manager else data)
                data = line.read(4096)
                with contextlib.suppress(OSError):
                    connection.sendall(b"".join(manager.escape(data)) if manager else data)

    with running(bridge):
        yield f"{request.param}://127.0.0.1:{listener.getsockname()[1]}"
    listener.close()


def test_the_host_works_over_the_network(url: str) -> None:
    link = RigLink(open_bus(url, boot_s=0.0))
    try:
        assert link.open().board == "host"
        assert link.write_parameter("deadband_kpa", 0.01) == pytest.approx(0.01)
        assert link.statistics.answers == 2
        assert 0 < link.statistics.round_trip_s <= link.statistics.longest_round_trip_s
    finally:
        link.close()


def test_a_port_is_not_shared(port: str) -> None:
    bus = open_bus(port, boot_s=0.0)
    try:
        with pytest.raises(PortError, match="another program"):
            open_bus(port, boot_s=0.0)
    finally:
        bus.close()


def test_the_host_works_through_a_can_adapter() -> None:
    board = virtual_board(Workspace(ROOT).setup("bellow-bending", "virtual-beam"), 1)
    board.write(slcan.OPEN_WITH_TIMESTAMPS)
    parser = SlcanParser()

    def adapter(until: Callable[[], bool]) -> None:
        with can.Bus(interface="virtual", channel="rig-test") as bus:
            start_s = time.monotonic() - board.now_s
            while not until():
                while (message := bus.recv(0.005)) is not None:
                    frame = slcan.encode_frame(message.arbitration_id, bytes(message.data))
                    board.write(frame)
                behind_s = time.monotonic() - start_s - board.now_s
                for frame_in in parser.feed(board.read(max(behind_s, 0.001)), board.now_s):
                    bus.send(
                        can.Message(
                            arbitration_id=frame_in.frame_id,
                            data=frame_in.payload,
                            is_extended_id=False,
                        )
                    )

    with running(adapter):
        link = RigLink(open_bus("can:virtual:rig-test", start_s=100.0))
        try:
            assert link.now_s >= 100.0
            assert link.open().board == "host"
            link.command("home")
            link.wait(0.3)
            assert link.status is not None
            assert link.status.state == "homing"
        finally:
            link.close()
