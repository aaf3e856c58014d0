"""Builds the extension `_emulator` by cffi into a folder: `python build_emulator.py FOLDER`.

It links libsimavr, which is GPL-3; so is this part (COPYING beside this file).
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

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


def main(folder: str) -> None:
    """Compile into `folder`."""
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
    builder.compile(tmpdir=folder)


if __name__ == "__main__":
    main(sys.argv[1])
