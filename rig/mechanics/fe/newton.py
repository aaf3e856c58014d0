"""Newton's method for one step of a model, every iteration on the record.

The unknowns are the free degrees of freedom, those of rigid bodies and, under volume or
displacement control, the pressure. The last two border the tangent of the first: they are solved
for by block elimination, so that the factorised matrix stays symmetric, sparse and well posed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.control import Control, Situation
from rig.mechanics.fe.errors import SingularError
from rig.mechanics.fe.linear import LinearSolver
from rig.mechanics.fe.model import Assembly, Model
from rig.mechanics.fe.state import State

Array = NDArray[np.float64]
_LENIENT = 2e-5
"""Largest residual that may pass for equilibrium."""
_ARRIVING = 2e-3
"""A correction below this part of the largest displacement may be the last: the tangent behind it
is computed only when it turns out to be needed."""
Clock = Callable[[], float]


@dataclass(frozen=True)
class Options:
    """How hard to try; the defaults suit shells of rubber."""

    tolerance: float = 1e-7
    """Residual over the size of the element forces that balance in it."""
    correction: float = 1e-6
    """A residual up to 2e-5 is good enough as well where the next correction would be below this
    part of the largest displacement; 0 insists on the residual."""
    iterations: int = 14
    """Iterations before a step counts as failed."""
    mixed_points: bool = True
    """Independent strain and stress at the quadrature points during the iterations."""
    alternate: bool = True
    """Try a step that failed with mixed points without them before it is cut."""
    line_search: bool = True
    """Without mixed points: shorten steps that overshoot equilibrium."""
    least_step: float = 1 / 256
    """Smallest part of the way between two reported points before giving up."""
    first_step: float = 1.0
    """Part of the way to the next reported point that the first step along a path tries, which has
    no others to be extrapolated from; not where several loads change at once."""
    extrapolate: bool = True
    """Start each step from where the last ones point to."""


@dataclass(frozen=True)
class Iteration:
    """One Newton iteration."""

    residual: float
    """Norm of the unbalanced forces over that of the element forces, before the iteration."""
    control_error: float
    """Controlled quantity less its target, relative, before the iteration."""
    gap: float
    """Largest difference between independent strain and strain of the displacements."""
    correction: float
    """Largest displacement of the iteration in m."""
    length: float
    """Part of the correction that was applied: 1 but for the line search."""


@dataclass(frozen=True)
class Target:
    """What a step must reach."""

    control: float
    dead: float
    motion: float


@dataclass(frozen=True)
class Outcome:
    """Where Newton ended."""

    state: State
    assembly: Assembly
    converged: bool
    iterations: tuple[Iteration, ...]
    reason: str
    """Empty when converged."""
    worst_node: int
    """Displacement node of the largest unbalanced force."""
    assembly_seconds: float
    solve_seconds: float


class _Timer:
    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.assembly = 0.0
        self.solve = 0.0

    def assemble(self, model: Model, state: State, tangent: bool = True) -> Assembly:
        start = self._clock()
        try:
            return model.assemble(state, tangent)
        finally:
            self.assembly += self._clock() - start


def solve_step(
    model: Model,
    start: State,
    target: Target,
    control: Control,
    solver: LinearSolver,
    options: Options,
    clock: Clock = time.perf_counter,
    assembly: Assembly | None = None,
) -> Outcome:
    """Newton from `start` to equilibrium at `target`; never raises for lack of convergence.

    `assembly` is that of `start`, tangent included, where it is known already.
    """
    timer = _Timer(clock)
    state = start
    record: list[Iteration] = []
    if assembly is None or assembly.data is None:
        assembly = timer.assemble(model, state)
    reason = ""
    while True:
        residual = _relative_residual(model, state, assembly, target)
        miss = target.control - control.value(Situation(model, state, assembly))
        control_error = (
            abs(miss) / max(abs(target.control), 1e-300) if target.control else abs(miss)
        )
        if not np.isfinite(residual):
            reason = "the material or the geometry broke down (not a number)"
            break
        needed = _needed(record, residual, state, options)
        arrived = (
            (residual <= needed or _at_rest(model, record))
            and assembly.gap <= 0.3 * needed**0.5
            and assembly.volume_error <= needed
            and control_error <= 10 * options.tolerance
            and len(record) > 0
        )
        if arrived:
            break
        if len(record) >= options.iterations:
            reason = f"no equilibrium after {options.iterations} iterations"
            break
        if assembly.data is None:
            assembly = timer.assemble(model, state)
        begin = clock()
        try:
            step = _newton_direction(model, state, assembly, target, control, miss, solver)
        except SingularError as error:
            reason = str(error)
            break
        finally:
            timer.solve += clock() - begin
        correction = float(np.abs(step.dx).max()) if step.dx.size else 0.0
        arriving = correction <= _ARRIVING * float(np.abs(state.x).max(initial=0.0))
        length, state_next, assembly_next = _search(
            model, state, assembly, step, options, timer, tangent=not arriving
        )
        record.append(Iteration(residual, control_error, assembly.gap, correction, length))
        if state_next is None or assembly_next is None:
            reason = "elements turn inside out"
            break
        state, assembly = state_next, assembly_next
    record.append(Iteration(residual, control_error, assembly.gap, 0.0, 0.0))
    forces = np.abs(np.nan_to_num(assembly.residual[model.free], nan=np.inf))
    displacement = model.free < model.discretisation.displacement_size
    worst = int(model.free[displacement][np.argmax(forces[displacement])]) if forces.size else 0
    return Outcome(
        state=state,
        assembly=assembly,
        converged=not reason,
        iterations=tuple(record),
        reason=reason,
        worst_node=worst // model.discretisation.dim,
        assembly_seconds=timer.assembly,
        solve_seconds=timer.solve,
    )


def _at_rest(model: Model, record: list[Iteration]) -> bool:
    """Whether only round-off moves the model: without load, forces have no size to compare with."""
    if not record or record[-1].length < 1:
        return False
    extent = float(np.ptp(model.discretisation.nodes, axis=0).max())
    return record[-1].correction <= float(np.finfo(float).eps) * extent


def _needed(record: list[Iteration], residual: float, state: State, options: Options) -> float:
    """The residual to reach: less strict where the next correction would hardly be seen."""
    if not record or record[-1].residual <= 0 or record[-1].length < 1:
        return options.tolerance
    # Newton's corrections shrink at least as the residual does
    coming = record[-1].correction * residual / record[-1].residual
    if coming <= options.correction * float(np.abs(state.x).max()):
        return max(options.tolerance, _LENIENT)
    return options.tolerance


@dataclass(frozen=True)
class _Step:
    dx: Array
    """Displacements of all degrees of freedom, rigid nodes along their tangent."""
    freedoms: Array
    pressure: float
    dead: float
    target: Target


def _newton_direction(
    model: Model,
    state: State,
    assembly: Assembly,
    target: Target,
    control: Control,
    miss: float,
    solver: LinearSolver,
) -> _Step:
    assert assembly.data is not None
    matrix = model.pattern.matrix(assembly.data)
    free, n_q = model.free, model.body_size
    # what is known of the step: supports on the move, dead loads, the pressure if it is prescribed
    known = np.zeros(model.size)
    known[model.held] = model.prescribed(target.motion) - state.x[model.held]
    d_dead = target.dead - state.dead
    slope = control.slope(Situation(model, state, assembly))
    d_pressure = miss if slope is None else 0.0
    driving = assembly.residual + d_pressure * assembly.pressure_slope - d_dead * model.dead_load
    if np.any(known):
        driving = driving + matrix @ known
    directions = model.body_directions(state)
    columns = [-driving[free]]
    # only the bodies' own nodes follow them
    coupled = matrix[:, model.tied] @ directions[model.tied]
    columns.extend(coupled[free].T)
    if slope is not None:
        columns.append(assembly.pressure_slope[free])
    factor = solver.factorise(model.free_matrix(assembly.data))
    solved = factor.solve(np.stack(columns, axis=1))
    if not np.all(np.isfinite(solved)):
        raise SingularError("the tangent is singular: some part is not held.")
    # all solutions as displacements of the whole model: the first, then per unit of the others
    whole = np.zeros((model.size, solved.shape[1]))
    whole[free] = solved
    whole[:, 1:] *= -1
    whole[:, 1 : 1 + n_q] += directions
    unknowns = n_q + (slope is not None)
    if not unknowns:
        return _Step(known + whole[:, 0], np.zeros(0), d_pressure, d_dead, target)
    # where the matrix is symmetric its product with the directions is there already
    coupling = coupled.T if model.symmetric else directions.T @ matrix
    bodies = coupling @ whole if n_q else np.zeros((0, whole.shape[1]))
    system = np.zeros((unknowns, unknowns))
    right = np.zeros(unknowns)
    system[:n_q] = bodies[:, 1:]
    system[:n_q, :n_q] += model.body_curvature(state, assembly.residual)
    right[:n_q] = -(directions.T @ driving) + target.dead * model.body_load - bodies[:, 0]
    if slope is not None:
        system[:n_q, n_q] += directions.T @ assembly.pressure_slope
        system[n_q] = slope.x @ whole[:, 1:]
        system[n_q, :n_q] += slope.freedoms
        system[n_q, n_q] += slope.pressure
        right[n_q] = miss - slope.x @ (known + whole[:, 0])
    # rows of moments, forces and the controlled quantity differ by orders of magnitude
    weight = 1 / np.maximum(np.abs(system).max(axis=1), 1e-300)
    try:
        answer = np.linalg.solve(system * weight[:, None], right * weight)
    except np.linalg.LinAlgError as error:
        raise SingularError(
            "the rigid bodies or the pressure are not determined: the controlled quantity does "
            "not react to the pressure, or a body moves without resistance."
        ) from error
    if slope is not None:
        d_pressure = float(answer[n_q])
    return _Step(
        known + whole[:, 0] + whole[:, 1:] @ answer, answer[:n_q], d_pressure, d_dead, target
    )


def _search(
    model: Model,
    state: State,
    assembly: Assembly,
    step: _Step,
    options: Options,
    timer: _Timer,
    tangent: bool,
) -> tuple[float, State | None, Assembly | None]:
    """The state after the step, shortened while elements are inverted or, searching, overshot."""
    searching = options.line_search and not options.mixed_points
    slope_0 = _work(model, state, assembly, step)
    length, best = 1.0, None
    for _ in range(6):
        trial = _applied(model, state, assembly, step, length)
        found = timer.assemble(model, trial, tangent)
        valid = np.all(np.isfinite(found.residual)) and found.least_volume_ratio > 0
        if not valid:
            length /= 2
            continue
        best = (length, trial, found)
        if not searching:
            break
        slope = _work(model, trial, found, step)
        if abs(slope) <= 0.9 * abs(slope_0) or slope * slope_0 > 0:
            break
        # overshot: regula falsi on the work of the unbalanced forces
        length = float(np.clip(length * slope_0 / (slope_0 - slope), length / 10, length / 1.5))
    return best if best is not None else (length, None, None)


def _work(model: Model, state: State, assembly: Assembly, step: _Step) -> float:
    """Work of the unbalanced forces on the step."""
    free = model.free
    work = float(step.dx[free] @ assembly.residual[free])
    if model.bodies:
        directions = model.body_directions(state)
        force = directions.T @ assembly.residual - state.dead * model.body_load
        work += float(step.freedoms @ force)
    return work


def _applied(model: Model, state: State, assembly: Assembly, step: _Step, length: float) -> State:
    moved = model.advanced(state, assembly, step.dx, step.freedoms, length)
    return replace(
        moved,
        pressure=state.pressure + length * step.pressure,
        dead=state.dead + length * step.dead,
        motion=step.target.motion,
    )


def _relative_residual(model: Model, state: State, assembly: Assembly, target: Target) -> float:
    """Unbalanced forces and moments, with what is still missing of loads and supports."""
    n_u = model.discretisation.displacement_size
    free = model.free[model.free < n_u]
    driving = assembly.residual - (target.dead - state.dead) * model.dead_load
    norm = float(np.linalg.norm(driving[free])) ** 2
    if model.bodies:
        force = model.body_directions(state).T @ driving - target.dead * model.body_load
        norm += float(np.sum((force / model.body_scale()) ** 2))
    pending = np.abs(model.prescribed(target.motion) - state.x[model.held])
    if pending.size and pending.max() > 1e-12 * max(np.abs(state.x[:n_u]).max(), 1e-300):
        return 1.0 if np.isfinite(norm) else np.inf
    if norm == 0.0:
        return 0.0
    return float(np.sqrt(norm) / max(assembly.scale, 1e-300))
