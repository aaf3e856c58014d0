"""Which lines and branches of the firmware's core its tests reach; fails where one is missing.

    python firmware/coverage.py [FOLDER]

Compiles the extension with clang's source-based coverage, runs tests/firmware on it and has
llvm-cov count. A branch is one outcome of one condition.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

FIRMWARE = Path(__file__).resolve().parent
ROOT = FIRMWARE.parent
CORE = FIRMWARE / "rig_mega" / "src" / "core"
COMPILED_AWAY = ("crc.cpp", "tick.h")
AT_COMPILE_TIME = "   the other lines are computed by the compiler"
FLAGS = ["-std=c++14", "-O1", "-g", "-fprofile-instr-generate", "-fcoverage-mapping"]

# the instrumented extension stands in for the one of the package
_RUN_TESTS = """
import importlib.util, sys
name = "rig.board._firmware"
spec = importlib.util.spec_from_file_location(name, {extension!r})
sys.modules[name] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sys.modules[name])
import pytest
options = ["-q", "-p", "no:cacheprovider", "-k", "not firmware_build"]
sys.exit(pytest.main([*options, "tests/firmware"]))
"""


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build" / "coverage").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    extension = compiled(folder)
    raw, profile = folder / "tests.profraw", folder / "tests.profdata"
    run_tests(extension, raw)
    subprocess.run(["llvm-profdata", "merge", "-o", profile, raw], check=True)
    missing = report(extension, profile)
    if missing:
        sys.exit(f"{missing} lines and branches of the core are reached by no test")


def compiled(folder: Path) -> Path:
    """The extension with counters, in `folder`."""
    sys.path.insert(0, str(FIRMWARE / "host"))
    from build_firmware import ffibuilder

    settings = ffibuilder._assigned_source[3]
    binding = folder / "_firmware.cpp"
    ffibuilder.emit_c_code(str(binding))
    extension = folder / "_firmware.so"
    headers = [*settings["include_dirs"], sysconfig.get_paths()["include"]]
    command = ["clang++", *FLAGS, "-shared", "-fPIC", *(f"-I{h}" for h in headers)]
    sources = [str(binding), *settings["sources"]]
    subprocess.run([*command, *sources, "-o", str(extension)], cwd=ROOT, check=True)
    return extension


def run_tests(extension: Path, raw: Path) -> None:
    """Run the firmware's tests on the extension; its counts go to `raw`."""
    environment = {"PYTHONPATH": str(ROOT), "LLVM_PROFILE_FILE": str(raw)}
    code = _RUN_TESTS.format(extension=str(extension))
    subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env={**os.environ, **environment}, check=True
    )


def report(extension: Path, profile: Path) -> int:
    """Print a line for each file of the core; return how many lines and branches were missed."""
    command = ["llvm-cov", "export", f"-instr-profile={profile}", str(extension)]
    found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    missed = 0
    print(f"{'file':24}{'lines':>14}{'branches':>14}")
    for entry in found["data"][0]["files"]:
        path = (ROOT / entry["filename"]).resolve()
        if path.parent != CORE:
            continue
        lines, outcomes = entry["summary"]["lines"], outcomes_of(entry, path)
        reached = sum(outcomes.values())
        cells = f"{lines['covered']} of {lines['count']}", f"{reached} of {len(outcomes)}"
        note = AT_COMPILE_TIME if path.name in COMPILED_AWAY else ""
        print(f"{path.name:24}" + "".join(f"{cell:>14}" for cell in cells) + note)
        missed += len(outcomes) - reached
        for (line, column, outcome), hit in outcomes.items():
            if not hit:
                print(f"  {path.name}:{line}:{column} is never {str(outcome).lower()}")
        if not note:
            missed += lines["count"] - lines["covered"]
    return missed


def outcomes_of(entry: dict[str, Any], path: Path) -> dict[tuple[int, int, bool], bool]:
    """Whether each outcome (true, false) of each condition of a file was seen.

    A condition in a template or an inline function counts once, however often it is compiled. The
    implicit default of a switch over an enumeration does not count: the cases name all of it, and
    the compiler checks that.
    """
    text = path.read_text(encoding="utf-8").splitlines()
    seen: dict[tuple[int, int, bool], bool] = {}
    for line, column, _, _, true, false, *_ in entry["branches"]:
        if text[line - 1][: column - 1].endswith("switch ("):
            continue
        for outcome, count in ((True, true), (False, false)):
            key = (line, column, outcome)
            seen[key] = seen.get(key, False) or count > 0
    return seen


if __name__ == "__main__":
    main()
