"""How long the finite elements take: kernels, the default bellow to 10 kPa, refinement, growth.

Run `python -m tests.bench.bench_fe`, or name some of the tables: kernels, run, refinement,
blocked, growth.
Targets: 20 s for the default run on two cores, meshing included; discretisation error of the
angle at 10 kPa below 0.5 %; time growing no worse than N^1.3 with the number of convolutions.
"""

from __future__ import annotations

import resource
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from rig.mechanics.fe import Point, Result, follow
from rig.mechanics.fe.linear import SuperLU, default_solver
from rig.mechanics.mesh.bellow_bending import BendingResolution
from rig.mechanics.simulate.bending import FREE_OPTIONS, BendingModel, bending_model
from rig.mechanics.simulate.blocked import BLOCKED_OPTIONS, Blocked
from rig.spec.actuator import BellowBendingGeometry
from rig.spec.material import MaterialSpec
from rig.spec.quantity import STANDARD_GRAVITY
from rig.spec.workspace import Workspace

TARGET_S = 20.0
PRESSURES = np.linspace(0.0, 10e3, 11)
TOLD = (2e3, 4e3, 6e3, 8e3, 10e3)
NUMBERS = (3, 6, 9, 12)
PITCH_MM = 11
DEFAULT = BendingResolution(wall=1)
"""What predictions take."""
REFINED = {
    "coarse, as specimens": replace(DEFAULT, crown=4),
    "as predictions": DEFAULT,
    "two through walls": replace(DEFAULT, wall=2),
    "round and across": replace(DEFAULT, crown=9, plate=5),
    "along the arcs": replace(
        DEFAULT,
        trough_columns=2,
        trough_ring=2,
        trough_rows=2,
        crest_rows=2,
        crest_columns=2,
        flank=2,
    ),
    "side, floor, ends": replace(DEFAULT, side=2, heel=2, floor=2, end_wall=2),
}
"""The mesh of predictions, and that refined in one direction at a time."""
FORCED = ("coarse, as specimens", "as predictions", "two through walls")


def main(wanted: Sequence[str] = ()) -> None:
    """Print the tables."""
    tables = {
        "kernels": kernels,
        "run": run,
        "refinement": refinement,
        "blocked": blocked,
        "growth": growth,
    }
    for name in wanted or tables:
        print(f"\n{name}")
        for row in tables[name]():
            print(row)


def kernels() -> Iterator[str]:
    """One residual, one tangent, one factorisation of the default mesh."""
    start = time.perf_counter()
    actuator = _actuator()
    yield _row("mesh, basis, pattern", f"{time.perf_counter() - start:.2f} s")
    model, solid = actuator.model, actuator.soft
    state = model.start()
    free = solid.free_points(state.x, state.points[0])
    yield _row("elements", f"{len(solid.elements)}")
    yield _row("unknowns", f"{len(model.free)}")
    yield _row("residual and tangent", timed(lambda: solid.evaluate(state.x, free)))
    yield _row("residual", timed(lambda: solid.evaluate(state.x, free, tangent=False)))
    yield _row("assembly of all", timed(lambda: model.assemble(state)))
    assembly = model.assemble(state)
    assert assembly.data is not None
    matrix = model.free_matrix(assembly.data)
    ours, superlu = default_solver(model.symmetric, False), SuperLU()
    start = time.perf_counter()
    ours.factorise(matrix)
    yield _row(f"analyse and factorise, {ours.name}", f"{time.perf_counter() - start:.3f} s")
    yield _row(f"factorise, {ours.name}", timed(lambda: ours.factorise(matrix)))
    yield _row("factorise, SuperLU", timed(lambda: superlu.factorise(matrix)))


def run() -> Iterator[str]:
    """The default actuator to 10 kPa in eleven points."""
    start = time.perf_counter()
    actuator = _actuator()
    result = follow(actuator.model, [Point(p) for p in PRESSURES], options=FREE_OPTIONS)
    seconds = time.perf_counter() - start
    yield _row(f"0 to 10 kPa with meshing (target {TARGET_S:.0f} s)", f"{seconds:.1f} s")
    yield _row("  assembly", f"{result.assembly_seconds:.1f} s")
    yield _row("  linear systems", f"{result.solve_seconds:.1f} s")
    yield _row("  linear systems solved", f"{result.solves}")
    yield _row("  memory", f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    for pressure, angle in _angles(actuator, result).items():
        yield _row(f"  angle at {pressure / 1e3:.0f} kPa", f"{angle:.3f} deg")


def refinement() -> Iterator[str]:
    """The angle with the mesh refined in one direction after the other."""
    head = "".join(f"{p / 1e3:>9.0f}" for p in TOLD)
    yield f"{'angle in deg at kPa':<20}{head}{'elements':>10}{'s':>7}{'solves':>8}{'assembly':>10}"
    for name, resolution in REFINED.items():
        actuator = _actuator(resolution)
        result = follow(actuator.model, [Point(p) for p in PRESSURES], options=FREE_OPTIONS)
        found = _angles(actuator, result)
        angles = "".join(f"{found.get(p, np.nan):9.3f}" for p in TOLD)
        share = result.assembly_seconds / (result.assembly_seconds + result.solve_seconds)
        yield (
            f"{name:<20}{angles}{len(actuator.soft.elements):>10}{result.seconds:>7.0f}"
            f"{result.solves:>8}{share:>10.0%}"
        )


def blocked() -> Iterator[str]:
    """The blocked force on meshes of three finenesses."""
    head = "".join(f"{p / 1e3:>9.0f}" for p in TOLD)
    yield f"{'force in g at kPa':<20}{head}{'elements':>10}{'s':>7}{'solves':>8}{'assembly':>10}"
    for name in FORCED:
        held = Blocked(partial(bending_model, resolution=REFINED[name]))(*_setup())
        result = follow(held.model, [Point(p) for p in PRESSURES], options=BLOCKED_OPTIONS)
        weight = held.measures(result.solutions[0])["force"]
        found = {
            round(s.pressure): 1e3 * (held.measures(s)["force"] - weight) / STANDARD_GRAVITY
            for s in result.solutions
        }
        forces = "".join(f"{found.get(round(p), np.nan):9.3f}" for p in TOLD)
        share = result.assembly_seconds / (result.assembly_seconds + result.solve_seconds)
        yield (
            f"{name:<20}{forces}{len(held.bending.soft.elements):>10}{result.seconds:>7.0f}"
            f"{result.solves:>8}{share:>10.0%}"
        )


def growth() -> Iterator[str]:
    """Processor seconds against the number of equal convolutions; the angle grows with them."""
    numbers, seconds = [], []
    for number in NUMBERS:
        start = time.process_time()
        actuator = _actuator(
            geometry=BellowBendingGeometry(
                family="bellow-bending",
                bellow_number=number,
                effective_length=f"{PITCH_MM * number} mm",
            )
        )
        result = follow(
            actuator.model, [Point(p) for p in (0.0, 1e3, 2e3, 3e3)], options=FREE_OPTIONS
        )
        numbers.append(number)
        seconds.append(time.process_time() - start)
        yield _row(f"{number} convolutions, {result.solves} systems", f"{seconds[-1]:.1f} s")
    exponent = np.polyfit(np.log(numbers), np.log(seconds), 1)[0]
    yield _row("exponent (target 1.3)", f"{exponent:.2f}")


def timed(work: Callable[[], object], repeats: int = 5) -> str:
    """Median wall time in seconds."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return f"{statistics.median(seconds):.3f} s"


def _actuator(
    resolution: BendingResolution = DEFAULT, geometry: BellowBendingGeometry | None = None
) -> BendingModel:
    known, material = _setup()
    return bending_model(geometry or known, material, resolution=resolution)


def _setup() -> tuple[BellowBendingGeometry, MaterialSpec]:
    setup = Workspace.find().setup("bellow-bending")
    known = setup.actuator.geometry
    assert isinstance(known, BellowBendingGeometry)
    return known, setup.material


def _angles(actuator: BendingModel, result: Result) -> dict[float, float]:
    """Bending angle in deg at the pressures told that were reached."""
    return {
        p: float(np.degrees(actuator.angle(s.state)))
        for p in TOLD
        for s in result.solutions
        if abs(s.pressure - p) < 1.0
    }


def _row(name: str, value: str) -> str:
    return f"{name:<48}{value:>14}"


if __name__ == "__main__":
    main(sys.argv[1:])
