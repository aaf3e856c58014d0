"""The shipped models and calibrations: sound, sourced, and true to the paper."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from rig.spec.check import check_file, yaml_beneath
from rig.spec.workspace import FOLDERS, Workspace

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = Workspace(ROOT)
BENDING = [
    name
    for name in LIBRARY.names("actuator")
    if LIBRARY.actuator(name).geometry.family == "bellow-bending"
]
"""Benches measure how actuators bend."""
SHIPPED = yaml_beneath(ROOT / "models") + yaml_beneath(ROOT / "calibration")
TOOLBOX = ROOT.parent / "shared" / "data" / "bellow_toolbox.md"
PAPERS = ROOT.parent / "shared" / "papers"


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_shipped_file_checks_clean(path: Path) -> None:
    assert check_file(path).problems == ()


@pytest.mark.parametrize("kind", FOLDERS)
def test_files_lie_in_the_folder_of_their_kind_and_name_its_schema(kind: str) -> None:
    names = LIBRARY.names(kind)
    assert names
    for name in names:
        path = LIBRARY.path(kind, name)
        assert check_file(path).kind == kind
        first = path.read_text(encoding="utf-8").splitlines()[0]
        modeline = re.fullmatch(r"# yaml-language-server: \$schema=(.*)", first)
        assert modeline is not None
        assert (path.parent / modeline[1]).resolve() == ROOT / f"models/schemas/{kind}.json"


def test_names_in_files_are_their_file_names() -> None:
    for kind in ("actuator", "bench", "protocol"):
        for name in LIBRARY.names(kind):
            spec = getattr(LIBRARY, kind)(name)
            assert spec.name == name


@pytest.mark.skipif(not TOOLBOX.is_file(), reason="reference data are not beside this checkout")
def test_young_moduli_are_those_of_the_toolbox() -> None:
    text = TOOLBOX.read_text(encoding="utf-8")
    for family in ("Agilus30", "TangoPlus"):
        row = re.search(rf"{family} ((?:[\d.]+ / ){{4}}[\d.]+)", text)
        assert row is not None
        grades = ["", "-dm40", "-dm50", "-dm60", "-dm70"]
        for grade, kilopascals in zip(grades, row[1].rstrip(".").split(" / "), strict=True):
            material = LIBRARY.material(f"{family.lower()}{grade}")
            assert material.young_modulus.value == pytest.approx(float(kilopascals) * 1e3)
            assert material.poisson_ratio.value == 0.49
            assert material.density.value == 1160


@pytest.mark.skipif(not PAPERS.is_dir(), reason="the papers are not beside this checkout")
def test_published_errors_are_printed_in_the_paper() -> None:
    (path,) = PAPERS.glob("000_*.txt")
    text = path.read_text(encoding="utf-8")
    (reference,) = LIBRARY.published()
    for value in reference.values:
        number = f"{value.value:.2f}"
        assert re.search(rf"{number}\s?(◦|g\b)", text), number


def test_both_versions_of_the_papers_errors_are_listed() -> None:
    (reference,) = LIBRARY.published()
    versions = {
        (v.model, v.value) for v in reference.values if v.experiment == "deformation"
    }  # fmt: skip
    assert versions == {("beam", 9.0), ("beam", 7.4), ("fe", 9.0), ("fe", 7.4)}
    assert "section V\nthe reverse" in reference.note or "section V the reverse" in reference.note


def test_the_default_protocol_is_the_papers() -> None:
    protocol = LIBRARY.protocol("default")
    assert protocol.deformation is not None
    assert protocol.blocked_force is not None
    for sweep in (protocol.deformation, protocol.blocked_force):
        assert sweep.pressures.values() == pytest.approx([1e3 * i for i in range(11)])
        assert (sweep.repeats, sweep.hold) == (5, 30)
    assert protocol.deformation.descending_repeats == 1
    assert protocol.blocked_force.descending_repeats == 0
    assert protocol.blocked_force.readings == 200


@pytest.mark.parametrize("actuator", BENDING)
@pytest.mark.parametrize("bench", LIBRARY.names("bench"))
def test_every_bending_actuator_may_go_on_every_bench(actuator: str, bench: str) -> None:
    setup = LIBRARY.setup(actuator, bench)
    assert setup.protocol.deformation is not None
    highest = max(setup.protocol.deformation.pressures.values())
    assert highest <= setup.actuator.limits.pressure <= setup.bench.safety.pressure


@pytest.mark.parametrize("bench", LIBRARY.names("bench"))
def test_bench_figures_agree_with_each_other(bench: str) -> None:
    spec = LIBRARY.bench(bench)
    calibrations = LIBRARY.resolve_bench(spec)
    area = math.pi / 4 * spec.syringe.inner_diameter**2
    steps = spec.stepper.steps_per_revolution * spec.stepper.microsteps
    step_rate = spec.controller.max_flow / area / spec.lead_screw.lead * steps
    assert step_rate < spec.stepper.max_step_rate
    sensor = spec.transducer
    slope = (sensor.pressure_high - sensor.pressure_low) / (
        sensor.voltage_high - sensor.voltage_low
    )
    assert calibrations.transducer.gain == pytest.approx(slope)
    assert calibrations.transducer.offset_voltage == pytest.approx(sensor.voltage_low)
    # the HX711 has 24 bits with sign
    assert calibrations.load_cell.counts_per_gram * spec.load_cell.capacity * 1e3 < 2**23


def test_the_virtual_camera_sees_a_hand_at_its_distance() -> None:
    bench = LIBRARY.bench("virtual")
    assert bench.virtual is not None
    camera = LIBRARY.resolve_bench(bench).camera
    width = camera.width / camera.focal_x * bench.virtual.optics.distance
    assert width == pytest.approx(0.2)
