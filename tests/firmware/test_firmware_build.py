"""The sources: nothing generated has drifted, and the Mega's image compiles within its budget."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from board_under_test import PARAMETERS, ROOT
from rig.board._firmware import ffi, lib

from rig.link.faults import VALUE_UNITS
from rig.link.schema import load_schema

FIRMWARE = ROOT / "firmware"
CORE = FIRMWARE / "rig_mega" / "src" / "core"
ALLOWED_HEADERS = {"stdint.h", "stddef.h", "string.h", "math.h"}
ARDUINO_CORE = Path("/usr/share/arduino/hardware/arduino/avr/cores/arduino")
NAME_OF_UNIT = {
    "": "",
    "kPa": "_kpa",
    "kPa/s": "_kpa_s",
    "kPa/V": "_kpa_v",
    "mL": "_ml",
    "mL/s": "_ml_s",
    "mL/s^2": "_ml_s2",
    "mL/s/kPa": "_ml_s_kpa",
    "mL/s^2/kPa": "_ml_s2_kpa",
    "s": "_s",
    "uL": "_ul",
    "V": "_v",
}
MICROSECONDS_PER_MILLISECOND = 0.4


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate", FIRMWARE / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_is_generated_is_that_of_the_schema() -> None:
    for path, content in generator().generated_files().items():
        committed = path.read_text(encoding="utf-8")
        assert committed == content, f"{path} is out of date: run python firmware/generate.py"


def test_the_core_includes_nothing_that_a_mega_lacks() -> None:
    for path in [*CORE.glob("*.h"), *CORE.glob("*.cpp")]:
        system = set(re.findall(r"#include <([^>]+)>", path.read_text(encoding="utf-8")))
        assert system <= ALLOWED_HEADERS, path


def test_the_core_allocates_nothing() -> None:
    for path in [*CORE.glob("*.h"), *CORE.glob("*.cpp")]:
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        assert not re.search(r"\b(new|delete|malloc|free|throw|try|String)\b", code), path


def test_the_firmware_has_the_ranges_that_the_schema_tells_the_host() -> None:
    parameters = load_schema().parameters
    assert list(parameters) == sorted(PARAMETERS, key=PARAMETERS.__getitem__)
    assert len(parameters) == lib.rig_host_parameter_count()
    for name, rule in parameters.items():
        index = PARAMETERS[name]
        assert rule.index == index
        assert np.float32(rule.default) == lib.rig_host_parameter_default(index)
        assert np.float32(rule.low) == lib.rig_host_parameter_min(index)
        assert np.float32(rule.high) == lib.rig_host_parameter_max(index)
        assert rule.live == bool(lib.rig_host_parameter_live(index))
        assert name.endswith(NAME_OF_UNIT[rule.unit])
        assert rule.meaning


def test_the_manual_has_every_fault_with_the_unit_that_the_host_shows() -> None:
    manual = (ROOT / "docs" / "firmware" / "faults.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\|[^|]*\| ([^|]*)\|", manual, re.M)
    names = load_schema().choices("FAULT", "code").values()
    assert [name for name, _ in rows] == [name for name in names if name != "none"]
    assert {name: unit.strip() for name, unit in rows if unit.strip()} == VALUE_UNITS


def make(
    target: str, *settings: str, firmware: Path = FIRMWARE
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["make", "-C", str(firmware), target, *settings],
        capture_output=True,
        text=True,
        check=False,
    )


needs_avr = pytest.mark.skipif(
    shutil.which("avr-g++") is None or not ARDUINO_CORE.exists(),
    reason="gcc-avr or arduino-core-avr is not installed",
)


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str, str]:
    """Folder of a fresh build of commit abc123, and what make printed and complained of."""
    folder = tmp_path_factory.mktemp("mega")
    result = make("mega", f"BUILD={folder}", "GIT=abc123")
    assert result.returncode == 0, result.stderr[-2000:]
    return folder, result.stdout, result.stderr


@needs_avr
def test_the_megas_image_compiles_without_warnings_and_fits(build: tuple[Path, str, str]) -> None:
    folder, said, complained = build
    assert "warning" not in complained
    flash, memory = map(int, re.findall(r"flash (\d+) .* memory (\d+) ", said)[0])
    assert 0 < flash < 0.6 * 256 * 1024
    assert 0 < memory < 0.5 * 8 * 1024
    assert (folder / "rig_mega.hex").stat().st_size > flash


@needs_avr
@pytest.mark.parametrize("budget", ["FLASH_BUDGET=20000", "MEMORY_BUDGET=1000"])
def test_an_image_beyond_its_budget_is_an_error(build: tuple[Path, str, str], budget: str) -> None:
    result = make("size", f"BUILD={build[0]}", "GIT=abc123", budget)
    assert result.returncode != 0
    assert "beyond the budget" in result.stdout


@needs_avr
def test_one_commit_gives_one_image_wherever_and_whenever_it_is_built(
    build: tuple[Path, str, str], tmp_path: Path
) -> None:
    elsewhere = tmp_path / "some" / "where" / "else"
    shutil.copytree(FIRMWARE, elsewhere)
    for source in elsewhere.rglob("*.cpp"):
        os.utime(source, (1e9, 1e9))
    assert make("mega", "GIT=abc123", firmware=elsewhere).returncode == 0
    for name in ("rig_mega.hex", "rig_mega.elf"):
        copy = tmp_path / "some" / "where" / "build" / "firmware" / name
        assert copy.read_bytes() == (build[0] / name).read_bytes()


@needs_avr
def test_the_commit_is_in_the_image_and_a_new_one_is_noticed(
    build: tuple[Path, str, str],
) -> None:
    folder = build[0]
    first = (folder / "rig_mega.hex").read_bytes()
    assert make("mega", f"BUILD={folder}", "GIT=def456").returncode == 0
    assert (folder / "rig_mega.hex").read_bytes() != first
    assert make("mega", f"BUILD={folder}", "GIT=abc123").returncode == 0
    assert (folder / "rig_mega.hex").read_bytes() == first


@needs_avr
@pytest.mark.skipif(
    shutil.which("arduino-builder") is None, reason="arduino-builder is not installed"
)
def test_the_arduino_ide_compiles_the_sketch_as_it_is(tmp_path: Path) -> None:
    result = make("arduino", f"BUILD={tmp_path}")
    assert result.returncode == 0, result.stderr[-2000:]
    assert "Sketch uses" in result.stdout
    ours = [line for line in result.stderr.splitlines() if "/sketch/" in line]
    assert not ours  # no warning in what is ours


def test_a_simulated_millisecond_costs_less_than_its_budget() -> None:
    host = ffi.gc(lib.rig_host_new(0, 1), lib.rig_host_free)
    lib.rig_host_receive(host, b"O\r", 2)
    count = 200_000
    best_s = float("inf")
    for _ in range(5):
        start = time.process_time()
        lib.rig_host_run(host, lib.rig_test_bench_idle, ffi.NULL, count, 0)
        best_s = min(best_s, time.process_time() - start)
    assert best_s / count * 1e6 < MICROSECONDS_PER_MILLISECOND
