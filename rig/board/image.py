"""The Mega's image: made from the shipped sources, written by avrdude."""

from __future__ import annotations

import hashlib
import re
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from rig.board.errors import BoardError
from rig.board.revision import firmware_revision
from rig.link.serial import require_port
from rig.spec.workspace import library_root

MCU = "atmega2560"
PROGRAMMER = "wiring"
BAUDRATE = 115200
"""Of the Mega's bootloader, which is flashed through."""
IMAGE = "rig_mega.hex"
TOOLS = {"make": "make", "avr-g++": "gcc-avr avr-libc arduino-core-avr"}
"""What compiling calls, and the Debian packages it comes from."""

_SIZE = re.compile(r"^flash (\d+) of (\d+) bytes, memory (\d+) of (\d+) bytes$", re.MULTILINE)


@dataclass(frozen=True)
class Image:
    """A compiled image and what is known of it; sizes in bytes."""

    path: Path
    sha256: str
    commit: str
    """First six hexadecimal digits, as the board will report them."""
    flash: int
    flash_budget: int
    memory: int
    memory_budget: int


def build_image(folder: Path) -> Image:
    """Compile the firmware into `folder` by `make`.

    Raises BoardError when a tool is missing, the sources do not compile, or the image is larger
    than its budget.
    """
    for tool, packages in TOOLS.items():
        if shutil.which(tool) is None:
            raise BoardError(
                f"{tool} is not installed, and the Mega's image is compiled by it. On Debian or "
                f"Ubuntu: apt-get install {packages}. Or open firmware/rig_mega/rig_mega.ino in "
                "the Arduino IDE and upload it from there."
            )
    sources = library_root() / "firmware"
    commit = f"{firmware_revision():06x}"
    target = folder.resolve()
    made = subprocess.run(
        ["make", "-C", str(sources), "mega", f"BUILD={target}", f"GIT={commit}"],
        capture_output=True,
        text=True,
        check=False,
    )
    size = _SIZE.search(made.stdout)
    if made.returncode != 0 or size is None:
        said = (made.stderr or made.stdout).strip().splitlines()
        raise BoardError(
            f"the firmware in {sources} did not become an image (make ended with "
            f"{made.returncode}):\n" + "\n".join(said[-8:])
        )
    path = target / IMAGE
    flash, flash_budget, memory, memory_budget = map(int, size.groups())
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return Image(path, digest, commit, flash, flash_budget, memory, memory_budget)


def flash_command(image: Path, port: str) -> list[str]:
    """The avrdude command that writes `image` to the Mega at `port` and reads it back."""
    return [
        *("avrdude", "-p", MCU, "-c", PROGRAMMER, "-P", port, "-b", str(BAUDRATE)),
        "-D",  # the bootloader erases page by page
        *("-U", f"flash:w:{image}:i"),
    ]


def require_flashable(image: Path, port: str) -> None:
    """Raise BoardError or PortError for what would make flashing fail before it starts."""
    if shutil.which("avrdude") is None:
        raise BoardError(
            "avrdude is not installed, and the Mega is flashed by it. On Debian or Ubuntu: "
            "apt-get install avrdude."
        )
    if not image.is_file():
        raise BoardError(f"there is no image {image}; `rig firmware build` makes one.")
    require_port(port)


def flash_image(image: Path, port: str) -> None:
    """Write `image` to the Mega at `port`; raises BoardError with what avrdude said."""
    command = flash_command(image, port)
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        said = [line for line in ended.stderr.splitlines() if line.strip()]
        raise BoardError(
            f"avrdude could not flash the board at {port} (it ended with {ended.returncode}):\n"
            + "\n".join(said[-6:])
            + f"\nIs it a Mega 2560, and does nothing else use the port? The command was "
            f"{shlex.join(command)}"
        )
