"""FElupe on the same axisymmetric bellow: displacements and volumes to how many digits?

Run `PYTHONPATH=DIR python -m tests.bench felupe` after `pip install --target DIR --no-deps felupe`.
FElupe is GPL: an independent check beside the project, never a dependency. Both have quadratic
displacements alone on the same quadrilaterals, three by three points, neo-Hookean, follower
pressure; FElupe turns about its first coordinate.
"""

from __future__ import annotations

import importlib.util
import time
from typing import Any

import numpy as np

from rig.mechanics.fe import (
    Kinematics,
    Model,
    Options,
    Point,
    PressureSurface,
    Solid,
    Support,
    discretise,
    follow,
)
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from rig.mechanics.mesh.bellow_axisymmetric import (
    AxisymmetricBellow,
    AxisymmetricResolution,
    mesh_axisymmetric_bellow,
)

SHEAR, BULK = 0.24e6, 12e6
PRESSURES = tuple(200.0 * i for i in range(1, 21))
"""Steps that FElupe's plain Newton can take."""
SHOWN = 5
BELLOW = AxisymmetricBellow(wall=2e-3, layers=4, divided_ratio=4.0)
TURNED = [0, 3, 2, 1, 7, 6, 5, 4, 8]
"""Nodes of a quadrilateral whose coordinates are exchanged, right-handed again."""
SHARP = 1e-11


def main() -> None:
    """Print the table."""
    if importlib.util.find_spec("felupe") is None:
        print("skipped: FElupe is not installed (`pip install --target DIR --no-deps felupe`)")
        return
    d, ours, our_seconds = _ours()
    theirs, their_seconds = _theirs(d)
    print(f"{len(d.connectivity)} quadrilaterals, {d.size} unknowns")
    print("{:>6}{:>20}{:>20}{:>12}".format("kPa", "ours: top mm", "FElupe: top mm", "difference"))
    (top,) = d.nodes_at(r=0.0, z=BELLOW.height)
    every = list(zip(PRESSURES, ours, theirs, strict=True))
    for pressure, a, b in every[SHOWN - 1 :: SHOWN]:
        relative = float(np.abs(b - a).max() / np.abs(a).max())
        rises = f"{1e3 * a[top, 1]:>20.12f}{1e3 * b[top, 1]:>20.12f}"
        print(f"{pressure / 1e3:>6.0f}{rises}{relative:>12.1e}")
    print("difference: the largest of all nodes', relative to the largest displacement")
    print(f"processor: ours {our_seconds:.1f} s, FElupe {their_seconds:.1f} s")


def _ours() -> tuple[Any, list[np.ndarray], float]:
    body = mesh_axisymmetric_bellow(BELLOW, AxisymmetricResolution())
    start = time.process_time()
    d = discretise(body.mesh, Kinematics.AXISYMMETRIC, mixed=False)
    axis = d.nodes_at(r=0.0)
    model = Model(
        d,
        [Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))],
        supports=[Support.of(d, d.nodes_on("clamped"), (0, 1)), Support.of(d, axis, (0,))],
        surface=PressureSurface(d, d.facets_on("cavity")),
    )
    result = follow(
        model, [Point(p) for p in PRESSURES], options=Options(tolerance=SHARP, correction=0.0)
    )
    if result.failure is not None:
        raise RuntimeError(result.failure)
    places = [s.state.x.reshape(-1, 2) for s in result.solutions]
    return d, places, time.process_time() - start


def _theirs(d: Any) -> tuple[list[np.ndarray], float]:
    import felupe as fem

    start = time.process_time()
    # in mm and MPa, so that its absolute tolerances mean something
    mesh = fem.Mesh(1e3 * d.nodes[:, ::-1], d.connectivity[:, TURNED], cell_type="quad9")
    region = fem.RegionBiQuadraticQuad(mesh)
    field = fem.FieldContainer([fem.FieldAxisymmetric(region, dim=2)])
    clamped, axis = d.nodes_on("clamped"), d.nodes_at(r=0.0)
    on_wall = np.isin(np.arange(len(d.nodes)), d.nodes_on("cavity"))
    wall = fem.RegionBiQuadraticQuadBoundary(mesh, mask=on_wall, ensure_3d=True)
    if len(wall.mesh.cells) != len(d.facets_on("cavity")):
        raise RuntimeError("FElupe found other facets on the cavity's wall")
    moved = fem.FieldContainer([fem.FieldAxisymmetric(wall, dim=2)])
    moved.link(field)
    pressure = fem.SolidBodyPressure(moved)
    held = {
        "clamped": fem.Boundary(field[0], mask=np.isin(np.arange(len(d.nodes)), clamped)),
        "axis": fem.Boundary(field[0], mask=np.isin(np.arange(len(d.nodes)), axis), skip=(1, 0)),
    }
    solid = fem.SolidBody(fem.NeoHooke(mu=SHEAR / 1e6, bulk=BULK / 1e6), field)
    step = fem.Step(
        items=[solid, pressure], ramp={pressure: np.array(PRESSURES) / 1e6}, boundaries=held
    )
    found: list[np.ndarray] = []
    job = fem.Job(
        steps=[step],
        callback=lambda _i, _j, substep: found.append(substep.x[0].values[:, ::-1].copy() / 1e3),
    )
    job.evaluate(verbose=False, tol=SHARP)
    return found, time.process_time() - start


if __name__ == "__main__":
    main()
