"""How long the finite elements take: kernels, linear systems, the default bellow to 10 kPa.

Run `python -m tests.bench.bench_fe`. Target: 20 s for the bellow on two cores.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

from rig.mechanics.fe import (
    Model,
    Point,
    PressureSurface,
    RigidBody,
    Solid,
    Support,
    discretise,
    follow,
    gravity,
    rotation_vector,
)
from rig.mechanics.fe.linear import SuperLU, default_solver
from rig.mechanics.hyperelastic import neo_hookean_from
from rig.mechanics.mesh.bellow_bending import mesh_bending_bellow
from rig.spec.actuator import BellowBendingGeometry

TARGET_S = 20.0
PRESSURES = np.linspace(0.0, 10e3, 11)
DENSITY, GRAVITY = 1160.0, 9.81
YOUNG, POISSON = 450e3, 0.49


def main() -> None:
    """Print the table."""
    for row in table():
        print("{:<44}{:>14}".format(*row))


def bellow() -> tuple[Model, Solid]:
    """The default actuator of plain Agilus30, hanging, half by symmetry, with a rigid end cap."""
    body = mesh_bending_bellow(BellowBendingGeometry(family="bellow-bending"))
    d = discretise(body.mesh)
    material = neo_hookean_from(YOUNG, POISSON)
    assert material.volume is not None
    solid = Solid(d, material.distortion, material.volume)
    tip = d.nodes_on("cap")
    centre = d.nodes[tip].mean(axis=0) * [1, 0, 1]
    model = Model(
        d,
        [solid],
        supports=[
            Support.of(d, d.nodes_on("clamped"), (0, 1, 2)),
            Support.of(d, d.nodes_on("symmetry"), (1,)),
        ],
        surface=PressureSurface(d, d.facets_on("cavity")),
        dead_load=gravity(solid, DENSITY, np.array([GRAVITY, 0.0, 0.0])),
        bodies=[RigidBody(d, tip, free=("x", "z", "about_y"), centre=centre)],
    )
    return model, solid


def table() -> list[tuple[str, str]]:
    """What was measured, and how much."""
    start = time.perf_counter()
    model, solid = bellow()
    rows = [("mesh, basis, pattern", f"{time.perf_counter() - start:.2f} s")]
    state = model.start()
    free = solid.free_points(state.x, state.points[0])
    rows.append(("elements", f"{len(solid.elements)}"))
    rows.append(("unknowns", f"{len(model.free)}"))
    rows.append(("residual and tangent", timed(lambda: solid.evaluate(state.x, free))))
    rows.append(("residual", timed(lambda: solid.evaluate(state.x, free, tangent=False))))
    assembly = model.assemble(state)
    assert assembly.data is not None
    matrix = model.free_matrix(assembly.data)
    ours, superlu = default_solver(model.symmetric, False), SuperLU()
    ours.factorise(matrix)
    rows.append((f"factorise, {ours.name}", timed(lambda: ours.factorise(matrix))))
    rows.append(("factorise, SuperLU", timed(lambda: superlu.factorise(matrix))))
    result = follow(model, [Point(p) for p in PRESSURES])
    angle = np.degrees(rotation_vector(result.solutions[-1].state.poses[0].rotation)[1])
    rows.append((f"0 to 10 kPa (target {TARGET_S:.0f} s)", f"{result.seconds:.1f} s"))
    rows.append(("  assembly", f"{result.assembly_seconds:.1f} s"))
    rows.append(("  linear systems", f"{result.solve_seconds:.1f} s"))
    rows.append(("  linear systems solved", f"{result.solves}"))
    rows.append((f"  angle at {result.solutions[-1].pressure / 1e3:.0f} kPa", f"{angle:.3f} deg"))
    return rows


def timed(work: Callable[[], object], repeats: int = 5) -> str:
    """Median wall time in seconds."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return f"{statistics.median(seconds):.3f} s"


if __name__ == "__main__":
    main()
