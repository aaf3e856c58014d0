"""What the studio computes in processes of their own: finite elements, files, comparisons."""

from __future__ import annotations

import io
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from rig.mechanics.job import Job
from rig.mechanics.store import FolderStore
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec
from rig.studio.calculation import Tell
from rig.studio.curves import CURVE_POINTS, Curve, curve_of

if TYPE_CHECKING:
    from rig.mechanics.fe import Progress

FINITE_ELEMENTS = "fe"
Format = Literal["stl", "step", "inp"]


@dataclass(frozen=True)
class FieldsAnswer:
    """What finite elements say of a design."""

    curve: Curve
    page: str
    """HTML of the 3D view with stresses, strains and safety factors."""
    margin: str
    """How far it is from tearing, in a sentence."""
    cautions: tuple[str, ...]


@dataclass(frozen=True)
class File:
    """Something to download."""

    name: str
    content: bytes


def finite_elements(
    tell: Tell, actuator: ActuatorSpec, material: MaterialSpec, pressure: float
) -> FieldsAnswer:
    """Curves, fields and margins up to `pressure` in Pa; raises MechanicsError."""
    from rig.mechanics.model import predict
    from rig.report.page import render_strength
    from rig.report.strength import strength_section

    job = job_of(tell)
    grid = np.linspace(0.0, pressure, CURVE_POINTS)
    response = predict(actuator, material, FINITE_ELEMENTS, grid, job)
    tell("stresses, strains and the 3D view")
    strength = strength_section(actuator, material, pressure, job)
    top = strength.rows[-1]
    if top.governing is None:
        margin = f"{material.name} tells neither strength nor elongation at break."
    else:
        low, high = top.factors[top.governing]
        margin = (
            f"At {top.pressure_kpa:.4g} kPa safety {low:.2g} to {high:.2g}, of {top.governing}."
        )
    return FieldsAnswer(
        curve=curve_of(response, f"{actuator.name}, finite elements"),
        page=render_strength(strength, f"{actuator.name}, {material.name}"),
        margin=margin,
        cautions=(*response.shortfalls, *response.cautions),
    )


def export(tell: Tell, actuator: ActuatorSpec, material: MaterialSpec, kind: Format) -> File:
    """The geometry as a file, in mm; several parts in one archive. Raises CadError and others."""
    tell(f"writing {kind.upper()}")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if kind == "stl":
            _write_stl(folder, actuator)
        elif kind == "step":
            from rig.mechanics.cad.brep import write_step
            from rig.mechanics.cad.parts import parts_of

            write_step(folder / f"{actuator.name}.step", parts_of(actuator.geometry))
        else:
            _write_deck(folder / f"{actuator.name}.inp", actuator, material)
        return _one_file(sorted(folder.iterdir()), f"{actuator.name}-{kind}.zip")


def _write_stl(folder: Path, actuator: ActuatorSpec) -> None:
    from rig.mechanics.cad.facets import triangulate
    from rig.mechanics.cad.parts import parts_of
    from rig.mechanics.cad.stl import write_stl

    for part in parts_of(actuator.geometry):
        suffix = "" if part.is_soft else f"-{part.name}"
        write_stl(folder / f"{actuator.name}{suffix}.stl", triangulate(part.solid))


def _write_deck(path: Path, actuator: ActuatorSpec, material: MaterialSpec) -> None:
    from rig.mechanics.deck.build import deck_model
    from rig.mechanics.deck.elements import Program
    from rig.mechanics.deck.write import write_deck

    write_deck(
        path,
        deck_model(actuator, material),
        pressure=actuator.limits.pressure,
        program=Program.CALCULIX,
        title=actuator.name,
    )


def _one_file(paths: list[Path], archive: str) -> File:
    if len(paths) == 1:
        return File(paths[0].name, paths[0].read_bytes())
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        for path in paths:
            file.write(path, path.name)
    return File(archive, packed.getvalue())


def comparison(tell: Tell, folders: tuple[Path, ...]) -> str:
    """HTML of the page that lays runs beside each other; raises ReportError and RecordError."""
    from rig.report.compare import read_runs, write_comparison

    runs = read_runs(folders, job_of(tell))
    with tempfile.TemporaryDirectory() as place:
        page = Path(place) / "comparison.html"
        write_comparison(page, runs)
        return page.read_text(encoding="utf-8")


def report(tell: Tell, folder: Path) -> None:
    """Write the report of a run anew; raises RecordError, SpecError and ReportError."""
    from rig.report.build import build_report

    build_report(folder, job=job_of(tell))


def job_of(tell: Tell) -> Job:
    """Finite elements that say how far they are, and stop when `tell` answers False."""

    def watch(what: str, progress: Progress) -> bool:
        return tell(
            f"finite elements, {what}: {progress.pressure / 1e3:.2f} kPa, "
            f"{progress.point + 1} of {progress.points} points"
        )

    return Job(FolderStore.of_user(), watch)
