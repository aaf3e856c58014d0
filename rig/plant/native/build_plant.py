"""Builds the extension `rig.plant._plant` by cffi; run from the root of the source tree."""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

ROOT = Path(__file__).resolve().parents[3]
NATIVE = ROOT / "rig" / "plant" / "native"
HOST = ROOT / "firmware" / "host"


def declarations(header: Path) -> str:
    """The plain C declarations of a header: comments, directives and C++ guards removed."""
    text = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


def pin_declarations() -> str:
    """The wiring between bench and board: the pin structures and the bench function's type."""
    text = declarations(HOST / "rig_host.h")
    return text[text.index("typedef struct") : text.index("typedef struct rig_host")]


ffibuilder = FFI()
ffibuilder.cdef(pin_declarations() + declarations(NATIVE / "plant.h"))
ffibuilder.set_source(
    "rig.plant._plant",
    '#include "plant.h"',
    source_extension=".cpp",
    sources=["rig/plant/native/plant.cpp"],
    include_dirs=["rig/plant/native", "firmware/host"],
    depends=[
        *(f"rig/plant/native/{header.name}" for header in sorted(NATIVE.glob("*.h"))),
        "firmware/host/rig_host.h",
    ],
    extra_compile_args=["-std=c++17", "-O2", "-Wall", "-Wextra"],
)

if __name__ == "__main__":
    ffibuilder.compile(tmpdir=str(ROOT), verbose=True)
