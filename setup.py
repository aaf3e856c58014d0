"""Builds rig; what the static metadata in pyproject.toml cannot say.

The model library lives beside the package, where people edit it; a wheel carries it inside.
Three extensions are compiled by cffi: the firmware's core for this machine, the bench's physics,
and the kernels of the finite elements.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

ROOT = Path(__file__).resolve().parent
SHIPPED_REVISION = "REVISION"
"""File of a source distribution that holds the commit it was made from."""
LIBRARY = (
    "models/**/*",
    "calibration/*",
    "firmware/rig.dbc",
    "firmware/Makefile",
    "firmware/rig_mega/**/*",
    "firmware/emulator/*",
    "firmware/host/rig_host.h",
)


def revision() -> str:
    """The commit that is built; zeros where nothing tells."""
    shipped = ROOT / SHIPPED_REVISION
    if shipped.is_file():
        return shipped.read_text(encoding="ascii").strip()
    if not (ROOT / ".git").exists():
        return "000000"  # git would answer with the commit of a repository around this folder
    try:
        answer = subprocess.run(
            ["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "000000"
    return answer.stdout.strip()


class SourceWithRevision(sdist):
    """Tells whoever builds from a source distribution which commit it is."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Copy the files as usual, then add the commit."""
        super().make_release_tree(base_dir, files)
        (Path(base_dir) / SHIPPED_REVISION).write_text(revision(), encoding="ascii")


class BuildWithLibrary(build_py):
    """Puts the files of LIBRARY into the wheel as rig/_library; a checkout uses them in place."""

    def run(self) -> None:
        """Build as usual, then copy the library."""
        super().run()
        if not self.editable_mode:
            for source, target in self._library_files():
                target.parent.mkdir(parents=True, exist_ok=True)
                self.copy_file(str(source), str(target), preserve_mode=False)
            self._revision_file().write_text(revision(), encoding="ascii")

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        """Every file that the build makes, so that an uninstall finds them all."""
        outputs = super().get_outputs(include_bytecode)
        if self.editable_mode:
            return outputs
        files = [target for _, target in self._library_files()] + [self._revision_file()]
        return [*outputs, *map(str, files)]

    def _revision_file(self) -> Path:
        return Path(self.build_lib) / "rig" / "_library" / "REVISION"

    def _library_files(self) -> list[tuple[Path, Path]]:
        library = Path(self.build_lib) / "rig" / "_library"
        sources = sorted(p for glob in LIBRARY for p in ROOT.glob(glob) if p.is_file())
        return [(source, library / source.relative_to(ROOT)) for source in sources]


setup(
    cmdclass={"build_py": BuildWithLibrary, "sdist": SourceWithRevision},
    cffi_modules=[
        "firmware/host/build_firmware.py:ffibuilder",
        "rig/plant/native/build_plant.py:ffibuilder",
        "rig/mechanics/fe/native/build_fe.py:ffibuilder",
    ],
)
