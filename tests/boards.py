"""Boards that are served on a pseudo-terminal, in wall time, while a test talks to them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can

from rig.board.pty import PtyServer
from rig.board.simulated import SimulatedBoard
from rig.link import e2e
from rig.link.schema import load_schema


@contextmanager
def running(work: Callable[[Callable[[], bool]], object]) -> Iterator[None]:
    """`work` in a thread of its own; what it is given tells when to end."""
    stop = threading.Event()
    thread = threading.Thread(target=work, args=(stop.is_set,))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@contextmanager
def served(board: SimulatedBoard) -> Iterator[str]:
    """The port at which a board is to be found."""
    server = PtyServer(board)
    try:
        with running(server.serve):
            yield server.port
    finally:
        server.close()


def seen_by_stock_slcan(port: str, duration_s: float = 1.0) -> list[str]:
    """Names of the messages that python-can's own slcan receives; each must be intact."""
    schema = load_schema()
    bus = can.Bus(interface="slcan", channel=port, sleep_after_open=0.1)
    names = []
    end = time.monotonic() + duration_s
    try:
        while time.monotonic() < end:
            message = bus.recv(0.2)
            if message is not None:
                assert e2e.is_intact(message.arbitration_id, bytes(message.data))
                decoded = schema.decode(message.arbitration_id, bytes(message.data))
                assert decoded is not None
                names.append(decoded[0])
    finally:
        bus.shutdown()
    return names
