"""The native firmware on a pseudo-terminal, driven by python-can's own slcan and by pyserial.

These run in wall time, for a second or two each.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from rig.board.virtual import virtual_board
from rig.link.bus import PythonCanBus, SlcanBus
from rig.link.client import RigLink
from rig.link.errors import PortError
from rig.link.serial import SerialTransport
from rig.spec.workspace import Workspace
from tests.boards import seen_by_stock_slcan, served

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def port() -> Iterator[str]:
    setup = Workspace(ROOT).setup("bellow-bending", "virtual-beam")
    with served(virtual_board(setup, 1)) as name:
        yield name


def test_python_cans_slcan_sees_live_frames(port: str) -> None:
    names = seen_by_stock_slcan(port)
    # 50 a second and 10 a second, less what opening and a busy machine cost
    assert names.count("PRESSURE") > 25
    assert names.count("HEARTBEAT") > 5


def test_the_host_works_through_python_cans_slcan(port: str) -> None:
    link = RigLink(PythonCanBus(can.Bus(interface="slcan", channel=port, sleep_after_open=0.1)))
    try:
        assert link.open().board == "host"
        assert link.write_parameter("deadband_kpa", 0.01) == pytest.approx(0.01)
    finally:
        link.close()


def test_the_host_works_through_pyserial(port: str) -> None:
    link = RigLink(SlcanBus(SerialTransport(port, boot_s=0.0)))
    try:
        link.open()
        link.command("home")
        messages = link.wait(0.5)
        assert link.status is not None
        assert link.status.state == "homing"
        assert link.statistics.corrupt == 0
        assert any(m.name == "PRESSURE" for m in messages)
    finally:
        link.close()


def test_a_port_that_is_not_there_is_named() -> None:
    with pytest.raises(PortError, match="/dev/no-such-port"):
        SerialTransport("/dev/no-such-port")


def test_python_cans_viewer_shows_the_boards_frames(port: str, tmp_path: Path) -> None:
    # the viewer wants a terminal: give it one, for a moment, and read what it drew
    script = (
        "import os, pty, signal, sys, threading\n"
        "pid, fd = pty.fork()\n"
        "if pid == 0:\n"
        "    os.environ['TERM'] = 'xterm'\n"
        "    os.execv(sys.executable, [sys.executable, '-m', 'can.viewer', '-i', 'slcan',"
        f" '-c', '{port}'])\n"
        "threading.Timer(5.0, os.kill, (pid, signal.SIGKILL)).start()\n"
        "screen = b''\n"
        "try:\n"
        "    while chunk := os.read(fd, 65536):\n"
        "        screen += chunk\n"
        "except OSError:\n"
        "    pass\n"
        "sys.stdout.buffer.write(screen)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, timeout=30, check=True
    )
    screen = result.stdout.decode(errors="replace")
    assert "0x110" in screen
    assert "0x100" in screen
