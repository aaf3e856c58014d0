"""Builds the emulator into a folder: `python build_emulator.py FOLDER IMAGE.elf`.

There come `_emulator`, an extension by cffi, and `translation.so`, which that image runs several
times faster with. It links libsimavr, which is GPL-3; so is this part (COPYING beside this file).
"""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

from cffi import FFI

HERE = Path(__file__).resolve().parent
HOST = HERE.parent / "host"


def declarations(header: Path) -> str:
    """The plain C declarations of a header: comments, directives and C++ guards removed."""
    text = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


def pin_declarations() -> str:
    """The wiring between bench and board: the pin structures and the bench function's type."""
    text = declarations(HOST / "rig_host.h")
    return text[text.index("typedef struct") : text.index("typedef struct rig_host")]


def build_extension(folder: Path) -> ModuleType:
    """Compile `_emulator` into `folder`, and load it."""
    builder = FFI()
    builder.cdef(pin_declarations() + declarations(HERE / "emulator.h"))
    builder.set_source(
        "_emulator",
        '#include "emulator.h"',
        source_extension=".cpp",
        sources=[str(source) for source in sorted(HERE.glob("*.cpp"))],
        include_dirs=[str(HERE), str(HOST)],
        libraries=["simavr"],
        extra_compile_args=["-std=c++14", "-O2", "-Wall", "-Wextra"],
    )
    path = builder.compile(tmpdir=str(folder))
    spec = importlib.util.spec_from_file_location("_emulator", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def translate(emulator: ModuleType, image: Path, folder: Path) -> None:
    """Compile the translation of `image` into `folder`."""
    ffi, lib = emulator.ffi, emulator.lib
    problem = ffi.new("char[]", 256)
    board = lib.rig_emulator_new(str(image).encode(), problem, 256)
    if board == ffi.NULL:
        sys.exit(f"{image}: {ffi.string(problem).decode(errors='replace')}")
    source = folder / "translation.cpp"
    if not lib.rig_emulator_translate(board, str(source).encode()):
        sys.exit(f"{source} cannot be written")
    lib.rig_emulator_free(board)
    compiler = shutil.which("c++") or "g++"
    # more optimisation takes longer and gains nothing
    flags = ["-std=c++14", "-O1", "-foptimize-sibling-calls", "-shared", "-fPIC", f"-I{HERE}"]
    output = ["-o", str(source.with_suffix(".so"))]
    subprocess.run([compiler, *flags, str(source), *output], check=True)


def main(folder: Path, image: Path) -> None:
    """Build everything into `folder`."""
    translate(build_extension(folder), image, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
