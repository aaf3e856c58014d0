"""How long the finite elements take: kernels, linear systems, the default bellow to 10 kPa.

Run `python -m tests.bench.bench_fe`. Target: 20 s for the bellow on two cores.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

from rig.mechanics.fe import Point, follow
from rig.mechanics.fe.linear import SuperLU, default_solver
from rig.mechanics.simulate.bending import bending_model
from rig.spec.workspace import Workspace

TARGET_S = 20.0
PRESSURES = np.linspace(0.0, 10e3, 11)


def main() -> None:
    """Print the table."""
    for row in table():
        print("{:<44}{:>14}".format(*row))


def table() -> list[tuple[str, str]]:
    """What was measured, and how much."""
    start = time.perf_counter()
    setup = Workspace.find().setup("bellow-bending")
    actuator = bending_model(setup.actuator.geometry, setup.material)
    model, solid = actuator.model, actuator.soft
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
    angle = np.degrees(actuator.angle(result.solutions[-1].state))
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
