"""Builds the extension `rig.mechanics.fe._native` by cffi; run from the root of the source tree."""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

ROOT = Path(__file__).resolve().parents[4]
FOLDER = "rig/mechanics/fe/native"
PARTS = ("elements", "multifrontal")


def declarations(header: Path) -> str:
    """The plain C declarations of a header: comments, directives and C++ guards removed."""
    text = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


ffibuilder = FFI()
ffibuilder.cdef("".join(declarations(ROOT / FOLDER / f"{part}.h") for part in PARTS))
ffibuilder.set_source(
    "rig.mechanics.fe._native",
    "".join(f'#include "{part}.h"\n' for part in PARTS),
    source_extension=".cpp",
    sources=[f"{FOLDER}/{part}.cpp" for part in PARTS],
    include_dirs=[FOLDER],
    depends=[f"{FOLDER}/{part}.h" for part in PARTS] + [f"{FOLDER}/stiffness.inc"],
    extra_compile_args=["-std=c++17", "-O3", "-Wall", "-Wextra", "-pthread"],
    extra_link_args=["-pthread"],
)

if __name__ == "__main__":
    ffibuilder.compile(tmpdir=str(ROOT), verbose=False)
