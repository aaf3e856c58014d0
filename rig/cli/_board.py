"""A conversation with a board by itself, for the verbs that need no experiment."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rig.board.virtual import ready_at_once, virtual_board
from rig.link.bus import SlcanBus
from rig.link.client import RigLink
from rig.link.errors import LinkError
from rig.link.serial import SerialTransport
from rig.spec.bench import SerialBoard
from rig.spec.workspace import Workspace

ACTUATOR = "bellow-bending"
"""What hangs on a simulated bench while nobody looks at it."""


def serial_port(bench: str, port: str | None) -> str:
    """The port that was given, else that of the bench; raises LinkError if it has none."""
    if port is not None:
        return port
    board = Workspace.find().bench(bench).board
    if not isinstance(board, SerialBoard):
        raise LinkError(f"the bench '{bench}' has no serial port; give one with --port.")
    return board.port


def is_simulated(bench: str, port: str | None) -> bool:
    """Whether the board starts anew, with nothing kept, every time it is opened."""
    return port is None and not isinstance(Workspace.find().bench(bench).board, SerialBoard)


@contextmanager
def talking(bench: str, port: str | None) -> Iterator[RigLink]:
    """An open link to the board at `port`, else to that of the bench; it raises no faults."""
    bus = _bus(bench, port)
    try:
        link = RigLink(bus)
        link.open()
        yield link
    finally:
        bus.close()


def _bus(bench: str, port: str | None) -> SlcanBus:
    if port is not None:
        return SlcanBus(SerialTransport(port))
    workspace = Workspace.find()
    board = workspace.bench(bench).board
    if isinstance(board, SerialBoard):
        return SlcanBus(SerialTransport(board.port, board.baudrate))
    return SlcanBus(virtual_board(ready_at_once(workspace.setup(ACTUATOR, bench)), 1))
