"""Builds the extension `rig.board._firmware`: the firmware core with the host HAL, by cffi.

setuptools runs it from the root of the source tree; `python setup.py build_ext --inplace` compiles
in place.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from cffi import FFI

HOST = "firmware/host"
CORE = "firmware/rig_mega/src/core"
HEADERS = (f"{HOST}/rig_host.h", f"{HOST}/rig_host_test.h")
ROOT = Path(__file__).resolve().parents[2]


def declarations(header: str) -> str:
    """What cffi understands of a header: no comments, no preprocessor, no C++ guards."""
    text = (ROOT / header).read_text(encoding="utf-8")
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.DOTALL)
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


def relative(pattern: str) -> list[str]:
    """Files of the tree as setuptools wants them: relative, with slashes, in a fixed order."""
    return sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob(pattern))


def compiler_arguments() -> list[str]:
    """Warnings are errors where the developers say so, not on whatever compiler a user has."""
    if sys.platform == "win32":
        return ["/std:c++14", "/O2"]
    strict = ["-Werror"] if os.environ.get("RIG_WARNINGS_AS_ERRORS") else []
    return ["-std=c++14", "-O2", "-Wall", "-Wextra", *strict]


ffibuilder = FFI()
ffibuilder.cdef("".join(declarations(header) for header in HEADERS))
# for benches written in Python (tests)
ffibuilder.cdef(
    'extern "Python" void rig_bench_in_python(void *, const rig_pins_out *, rig_pins_in *);'
)
ffibuilder.set_source(
    "rig.board._firmware",
    '#include "rig_host_test.h"',
    source_extension=".cpp",
    sources=[*relative(f"{CORE}/*.cpp"), *relative(f"{HOST}/*.cpp")],
    include_dirs=[HOST, CORE],
    depends=[*relative(f"{CORE}/**/*.[hc]"), *relative(f"{HOST}/*.h")],
    extra_compile_args=compiler_arguments(),
)
