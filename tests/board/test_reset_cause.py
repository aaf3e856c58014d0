"""Why the Mega started, as it knows it behind a bootloader that erased the processor's flags.

The image is the firmware's but for the one line that reads those flags: what the bootloader of the
Mega (stk500v2) leaves of them is zero.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from rig.board import emulator_build
from rig.board.emulated import EmulatedBoard
from rig.board.virtual import VirtualBench
from rig.link.bus import SlcanBus
from rig.link.client import BoardStatus, RigLink
from rig.spec.workspace import Workspace
from tests.benches import with_beam_specimen

ROOT = Path(__file__).resolve().parents[2]
MISSING = emulator_build.missing_packages()
pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The firmware as a bootloader starts it."""
    folder = tmp_path_factory.mktemp("behind-a-bootloader")
    firmware = folder / "firmware"
    shutil.copytree(ROOT / "firmware" / "rig_mega", firmware / "rig_mega")
    shutil.copy(ROOT / "firmware" / "Makefile", firmware)
    source = firmware / "rig_mega" / "src" / "hal" / "mega" / "reset.cpp"
    text = source.read_text(encoding="utf-8")
    assert text.count("flags = MCUSR;") == 1
    source.write_text(text.replace("flags = MCUSR;", "flags = 0;"), encoding="utf-8")
    subprocess.run(
        ["make", "-C", str(firmware), "mega", "GIT=abc123"], check=True, capture_output=True
    )
    return folder / "build" / "firmware" / "rig_mega.elf"


class Mega:
    """An emulated Mega with the host's link."""

    def __init__(self, image: Path) -> None:
        setup = with_beam_specimen(Workspace(ROOT).setup("bellow-bending", "emulated"))
        self.board = EmulatedBoard(VirtualBench(setup, 1).plant, image=image)
        self.link = RigLink(SlcanBus(self.board))
        self.link.open()

    @property
    def status(self) -> BoardStatus:
        assert self.link.status is not None
        return self.link.status

    def restarted(self) -> BoardStatus:
        """Status after the board came back and was greeted again."""
        self.board.read(1.0)
        self.board.write(b"O\r")
        self.link.wait(0.5)
        return self.status


def test_memory_that_was_lost_is_a_power_on(image: Path) -> None:
    mega = Mega(image)
    assert (mega.status.reset_cause, mega.status.fault) == ("power_on", "none")


def test_a_hang_is_remembered_and_reported_once(image: Path) -> None:
    mega = Mega(image)
    mega.board.hang()
    status = mega.restarted()
    assert (status.reset_cause, status.fault) == ("watchdog", "watchdog_reset")
    mega.board.brown_out(0.01)  # a restart of another cause, memory kept
    status = mega.restarted()
    assert (status.reset_cause, status.fault) == ("unknown", "none")
