"""The Mega's image and the emulator's extension, built on first use and kept.

What is built is named by the content of its sources and the commit, so that nothing stale is ever
run. In a checkout it is kept in build/emulator, else in the user's cache.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from types import ModuleType

import platformdirs

from rig.board.errors import BoardError
from rig.board.image import build_image
from rig.board.revision import firmware_revision
from rig.spec.workspace import library_root

SOURCES = ("Makefile", "rig_mega/**/*", "emulator/*", "host/rig_host.h")
"""Of the folder firmware; what is built depends on nothing else there."""
IMAGE = "rig_mega.elf"
EXTENSION = "_emulator"
TRANSLATION = "translation.so"


def missing_packages() -> list[str]:
    """Debian packages that the build needs and that are not there."""
    arduino = os.environ.get("ARDUINO", "/usr/share/arduino/hardware/arduino/avr")
    there = {
        "make": shutil.which("make"),
        "g++": shutil.which("c++") or shutil.which("g++"),
        "gcc-avr": shutil.which("avr-g++"),
        "avr-libc": Path("/usr/lib/avr/include/avr/io.h").exists(),
        "arduino-core-avr": Path(arduino, "cores").exists(),
        "libsimavr-dev": Path("/usr/include/simavr/sim_avr.h").exists(),
    }
    return [package for package, found in there.items() if not found]


@lru_cache(maxsize=1)
def firmware_image() -> Path:
    """The ELF that is flashed onto a Mega; raises BoardError if it cannot be built."""
    return _built() / IMAGE


@lru_cache(maxsize=1)
def translated_image() -> Path:
    """The same image compiled for this machine; raises BoardError if it cannot be built."""
    return _built() / TRANSLATION


@lru_cache(maxsize=1)
def emulator() -> ModuleType:
    """The extension with `ffi` and `lib`; raises BoardError if it cannot be built."""
    path = next(_built().glob(f"{EXTENSION}*.so"))
    spec = importlib.util.spec_from_file_location(EXTENSION, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _built() -> Path:
    sources = library_root() / "firmware"
    folder = _kept_in() / _fingerprint(sources)
    if not folder.is_dir():
        _build(sources, folder)
    return folder


def _kept_in() -> Path:
    root = library_root()
    if root.name != "_library":
        return root / "build" / "emulator"
    return platformdirs.user_cache_path("rig") / "emulator"


def _fingerprint(sources: Path) -> str:
    digest = hashlib.sha256(f"{firmware_revision():06x} {sys.version}".encode())
    for file in _files(sources):
        digest.update(file.relative_to(sources).as_posix().encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _files(sources: Path) -> Iterable[Path]:
    return sorted(f for glob in SOURCES for f in sources.glob(glob) if f.is_file())


def _build(sources: Path, folder: Path) -> None:
    missing = missing_packages()
    if missing:
        raise BoardError(
            f"the emulated board needs the Debian packages {', '.join(missing)}, which are not "
            f"installed: apt-get install {' '.join(missing)}. The bench 'virtual' runs the same "
            "firmware without them."
        )
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        work, done = Path(scratch, "work"), Path(scratch, "done")
        done.mkdir()
        build_image(work)
        _build_emulator(sources / "emulator" / "build_emulator.py", work)
        for product in (work / IMAGE, work / TRANSLATION, *work.glob(f"{EXTENSION}*.so")):
            shutil.copy(product, done)
        try:
            done.rename(folder)
        except OSError:
            if not folder.is_dir():  # another process was faster otherwise
                raise


def _build_emulator(script: Path, folder: Path) -> None:
    command = [sys.executable, str(script), str(folder), str(folder / IMAGE)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise BoardError(
            f"the emulator could not be built; '{' '.join(command)}' said:\n{result.stderr[-2000:]}"
        )
