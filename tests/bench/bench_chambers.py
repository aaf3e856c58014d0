"""The 25 underwater bellows of Yin et al., Section III-A, their array, refinement of one bellow.

Answers of the designs are kept in the user's cache: a second run only prints them.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from rig.mechanics.chambers import ChamberRow
from rig.mechanics.fe import Point, follow
from rig.mechanics.job import Job
from rig.mechanics.kinematics import BellowRow
from rig.mechanics.mesh.chamber_row import RowResolution
from rig.mechanics.simulate.bending import FREE_OPTIONS, BendingModel
from rig.mechanics.simulate.chambers import rectangular_bellow_model
from rig.mechanics.simulate.prediction import free_inflation
from rig.mechanics.simulate.wrapping import wrap
from rig.mechanics.store import FolderStore
from rig.spec.chambers import BellowRectangularGeometry
from rig.spec.loading import load_actuator
from rig.spec.workspace import Workspace

ACTUATOR = Path("models/actuators/bellow-rectangular.yaml")
LENGTHS_MM = (1, 2, 3, 4, 5)
MESHES = (
    RowResolution(2.5e-3, 5e-3, 1),
    RowResolution(5e-3, 7e-3, 2),
    RowResolution(2.5e-3, 5e-3, 2),
    RowResolution(2.5e-3, 3.5e-3, 3),
    RowResolution(1.7e-3, 2e-3, 3),
)
PRESSURES = (5e3, 50e3, 100e3, 200e3)
ARMS, TUBE = 3, 0.0762
GRASP = tuple(1e3 * p for p in (13, 26, 26.5, 26.75, 27, 27.25, 27.5, 28, 29, 30, 35, 40, 45))
"""Close together where the tip arrives at the tube."""
GAPS = (2e-3,)
ARM_MESH = RowResolution(5e-3, 7e-3, 2)
"""The specimen's: 4 % stiff at 50 kPa."""


def main() -> None:
    """Print the tables."""
    refinement()
    designs()
    array()


def refinement() -> None:
    """One bellow between two spacers, at some pressures."""
    actuator = load_actuator(ACTUATOR)
    material = Workspace.find().material(actuator.material)
    one = actuator.geometry.model_copy(update={"bellow_number": 1})
    print(
        "along  across  through  elements   " + "  ".join(f"{p / 1e3:5.0f} kPa" for p in PRESSURES)
    )
    for mesh in MESHES:
        start = time.process_time()
        model = rectangular_bellow_model(one, material, resolution=mesh)
        found = follow(model.model, [Point(p) for p in PRESSURES], options=FREE_OPTIONS)
        angles = "  ".join(f"{np.degrees(model.angle(s.state)):9.3f}" for s in found.solutions)
        print(
            f"{1e3 * mesh.along:5.1f}  {1e3 * mesh.across:6.1f}  {mesh.through:7d}  "
            f"{len(model.model.discretisation.connectivity):8d}  {angles} deg, "
            f"{time.process_time() - start:.1f} s of processor"
        )


def designs() -> None:
    """Length, radius, angle, extension and volume of every design at 200 kPa."""
    actuator = load_actuator(ACTUATOR)
    material = Workspace.find().material(actuator.material)
    job = Job(FolderStore.of_user())
    print(
        "bellow  spacer  length  radius   angle  extension  volume  per mL  R2 volume  R2 pressure"
    )
    for bellow in LENGTHS_MM:
        for spacer in LENGTHS_MM:
            lengths = {"bellow_length": bellow / 1e3, "spacer_length": spacer / 1e3}
            geometry = actuator.geometry.model_copy(update=lengths)
            design = actuator.model_copy(update={"geometry": geometry})
            question = free_inflation(design, material)
            curves = question.curves(actuator.limits.pressure, job)
            model, solutions = question.solutions(actuator.limits.pressure, job)
            row = BellowRow.of(geometry)
            extension = row.number * row.extension(curves.measured["angle"])
            volume = 1e6 * (curves.measured["volume"] - curves.measured["volume"][0])
            radius = inner_radius(geometry, model, solutions[-1].state.x)
            slope = extension @ volume / (volume @ volume)
            total = ChamberRow.of(geometry).tip + geometry.end_length - geometry.wall_thickness
            print(
                f"{bellow:6d}  {spacer:6d}  {1e3 * total:6.1f}  {1e3 * radius:6.2f}  "
                f"{np.degrees(curves.measured['angle'][-1]):6.1f}  {1e3 * extension[-1]:9.2f}  "
                f"{volume[-1]:6.3f}  {1e3 * slope:6.2f}  {linearity(volume, extension):9.4f}  "
                f"{linearity(curves.pressure, extension):11.4f}"
                + (f"  ends at {curves.pressure[-1] / 1e3:.0f} kPa" if curves.stopped else "")
            )


def array() -> None:
    """Section IV: 24 bellows, 225 mm, three of them around a tube of 6 inches.

    The paper's lengths of bellow and spacer are "slightly" other than in the 25 designs: here they
    are equal, and such that the length comes out.
    """
    actuator = load_actuator(ACTUATOR)
    material = Workspace.find().material(actuator.material)
    count, whole = 24, 0.225
    geometry = actuator.geometry.model_copy(update={"bellow_number": count})
    fixed = 2 * count * geometry.face_thickness + 2 * geometry.end_length
    each = (whole - fixed) / (2 * count + 1)
    lengths = {"bellow_length": each, "spacer_length": each}
    geometry = geometry.model_copy(update=lengths)
    print(f"\n{ARMS} arms of {count} bellows, {1e3 * each:.3g} mm, tube of {2e3 * TUBE:.4g} mm")

    start = time.process_time()
    model = rectangular_bellow_model(geometry, material, resolution=ARM_MESH)
    pressures = (0.0, *GRASP)
    found = follow(model.model, [Point(p) for p in pressures], options=FREE_OPTIONS).solutions
    reached = np.array(pressures[: len(found)])
    angle = np.array([model.angle(s.state) for s in found])
    volume = np.array([model.volume(s) for s in found])
    radius = BellowRow.of(geometry).number * BellowRow.of(geometry).pitch / angle[1:]
    for p, r, v in zip(reached[1:], radius, volume[1:] - volume[0], strict=True):
        print(f"free:    {p / 1e3:6.1f} kPa  r1 {1e3 * r:7.1f} mm  {1e6 * v:6.2f} mL an arm")
    curvature = np.concatenate([[0.0], 1 / radius])
    if curvature[-1] > 1 / TUBE:
        print(
            f"an arm has the tube's radius at {np.interp(1 / TUBE, curvature, reached) / 1e3:.1f} "
            f"kPa and {1e6 * np.interp(1 / TUBE, curvature, volume - volume[0]):.2f} mL"
        )
    for gap in GAPS:
        held = wrap(geometry, material, GRASP, cylinder_radius=TUBE, gap=gap, resolution=ARM_MESH)
        for p, v, a, n, share in zip(
            held.pressure, held.volume, held.angle, held.grip, held.contact, strict=True
        ):
            print(
                f"gap {1e3 * gap:3.0f}: {p / 1e3:6.1f} kPa  {np.degrees(a):6.1f} deg  "
                f"{1e6 * v:6.2f} mL an arm, {ARMS * 1e6 * v:6.2f} mL in all  grip {n:6.2f} N an arm"
                f"  {100 * share:4.1f} % of it touches"
            )
        if held.failure:
            print(held.failure)
    print(f"{time.process_time() - start:.0f} s of processor")


def inner_radius(geometry: BellowRectangularGeometry, model: BendingModel, x: np.ndarray) -> float:
    """Of the circle through the strain-limiting layer below the bellows, in m."""
    d = model.model.discretisation
    line = d.nodes_at(y=0.0, z=0.0)
    first = geometry.wall_thickness + geometry.spacer_length
    last = ChamberRow.of(geometry).end - first
    line = line[(d.nodes[line, 0] > first) & (d.nodes[line, 0] < last)]
    moved = d.nodes[line] + x[3 * line[:, None] + np.arange(3)]
    # x^2 + z^2 = 2 a x + 2 b z + c
    terms = np.column_stack((2 * moved[:, 0], 2 * moved[:, 2], np.ones(len(moved))))
    a, b, c = np.linalg.lstsq(terms, moved[:, 0] ** 2 + moved[:, 2] ** 2, rcond=None)[0]
    return float(np.sqrt(c + a**2 + b**2))


def linearity(cause: np.ndarray, effect: np.ndarray) -> float:
    """Coefficient of determination of a straight line through the origin."""
    slope = cause @ effect / (cause @ cause)
    rest = effect - slope * cause
    spread = effect - effect.mean()
    return float(1 - rest @ rest / (spread @ spread))
