"""The sources: nothing generated has drifted, and the Mega's image compiles within its budget."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import time
from pathlib import Path
from types import ModuleType

import pytest
from board_under_test import PARAMETERS, ROOT
from rig.board._firmware import ffi, lib

FIRMWARE = ROOT / "firmware"
CORE = FIRMWARE / "rig_mega" / "src" / "core"
ALLOWED_HEADERS = {"stdint.h", "stddef.h", "string.h", "math.h"}
ARDUINO_CORE = Path("/usr/share/arduino/hardware/arduino/avr/cores/arduino")
MICROSECONDS_PER_MILLISECOND = 0.4


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate", FIRMWARE / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_generated_sources_are_those_of_the_schema() -> None:
    for name, content in generator().generated_files().items():
        committed = (CORE / "generated" / name).read_text(encoding="utf-8")
        assert committed == content, f"{name} is out of date: run python firmware/generate.py"


def test_the_core_includes_nothing_that_a_mega_lacks() -> None:
    for path in [*CORE.glob("*.h"), *CORE.glob("*.cpp")]:
        system = set(re.findall(r"#include <([^>]+)>", path.read_text(encoding="utf-8")))
        assert system <= ALLOWED_HEADERS, path


def test_the_core_allocates_nothing() -> None:
    for path in [*CORE.glob("*.h"), *CORE.glob("*.cpp")]:
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        assert not re.search(r"\b(new|delete|malloc|free|throw|try|String)\b", code), path


def test_the_manual_lists_every_parameter_as_the_firmware_has_it() -> None:
    manual = (FIRMWARE / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \| (\S+) \| (\S+) \| (\S+) \| (\w+) \|", manual, re.M)
    assert [row[1] for row in rows] == sorted(PARAMETERS, key=PARAMETERS.__getitem__)
    for row in rows:
        index = int(row[0])
        assert PARAMETERS[row[1]] == index
        assert float(row[2]) == pytest.approx(lib.rig_host_parameter_default(index))
        assert float(row[3]) == pytest.approx(lib.rig_host_parameter_min(index))
        assert float(row[4]) == pytest.approx(lib.rig_host_parameter_max(index))
        assert (row[5] == "any") == bool(lib.rig_host_parameter_live(index))


def test_the_manual_lists_every_fault() -> None:
    from board_under_test import SCHEMA

    manual = (FIRMWARE / "README.md").read_text(encoding="utf-8")
    for name in SCHEMA.get_message_by_name("FAULT").get_signal_by_name("code").choices.values():
        assert str(name) == "none" or f"| `{name}` |" in manual


@pytest.mark.skipif(shutil.which("avr-g++") is None, reason="avr-g++ is not installed")
@pytest.mark.skipif(not ARDUINO_CORE.exists(), reason="arduino-core-avr is not installed")
def test_the_megas_image_compiles_without_warnings_and_fits(tmp_path: Path) -> None:
    result = subprocess.run(
        ["make", "-C", str(FIRMWARE), "mega", f"BUILD={tmp_path}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr[-2000:]
    assert "warning" not in result.stderr
    flash, memory = map(int, re.findall(r"flash (\d+) .* memory (\d+) ", result.stdout)[0])
    assert 0 < flash < 0.6 * 256 * 1024
    assert 0 < memory < 0.5 * 8 * 1024
    assert (tmp_path / "rig_mega.hex").stat().st_size > flash


def test_a_simulated_millisecond_costs_less_than_its_budget() -> None:
    host = ffi.gc(lib.rig_host_new(0, 1), lib.rig_host_free)
    lib.rig_host_receive(host, b"O\r", 2)
    count = 200_000
    best_s = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        lib.rig_host_run(host, lib.rig_test_bench_idle, ffi.NULL, count, 0)
        best_s = min(best_s, time.perf_counter() - start)
    assert best_s / count * 1e6 < MICROSECONDS_PER_MILLISECOND
