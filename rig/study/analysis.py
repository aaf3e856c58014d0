"""The statistics of a finished study: one response surface a response, and the optimum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.spec.study import FractionalFactorialDesign, FullFactorialDesign
from rig.study.design import power_of_two
from rig.study.errors import StudyError
from rig.study.factors import (
    Array,
    Factor,
    Term,
    coded,
    interaction_terms,
    linear_terms,
    quadratic_terms,
)
from rig.study.optimum import Goal, Limit, Optimum, StationaryPoint, optimum, stationary_point
from rig.study.plan import Plan, Point
from rig.study.quantities import UNITS
from rig.study.run import Study
from rig.study.surface import Surface, fit_surface

_WRITTEN = {"kpa": "kPa", "ml": "mL", "percent": "%", "1": ""}


@dataclass(frozen=True)
class Analysis:
    """What the runs tell; each part may be missing, with why."""

    factors: tuple[Factor, ...]
    """In lab units."""
    points: Array
    """Runs that surfaces are fitted to, in lab units, (n, k)."""
    surfaces: dict[str, Surface]
    checks: dict[str, Check]
    """Response to the error of its surface, where the study has check points."""
    stationary: dict[str, StationaryPoint]
    best: Optimum | None
    limited: tuple[str, ...]
    """Responses with limits, in the order of `best.limited`."""
    remarks: tuple[str, ...]


def units_of(plan: Plan) -> dict[str, str]:
    """Units of factors and responses by name, as people write them; empty for a pure number."""
    factors = {name: field.lab_unit for name, field in plan.fields.items()}
    asked = {one.name: UNITS[one.quantity] for one in plan.spec.responses}
    return {name: _WRITTEN.get(unit, unit) for name, unit in (factors | asked).items()}


def analyse(study: Study) -> Analysis:
    """Surfaces in the factors' lab units; failed points are left out, which is remarked."""
    plan = study.plan
    factors = lab_factors(plan)
    fitted = [point for point, _ in study.fitted]
    remarks = [f"point {p.name} is left out: {a.error}" for p, a in study.failed]
    design = plan.spec.design
    if design.kind == "sobol" and design.points != power_of_two(design.points):
        remarks.append(
            f"{design.points} points of a Sobol sequence are not balanced; a power of two, as "
            f"{power_of_two(design.points)}, would be."
        )
    surfaces: dict[str, Surface] = {}
    checks: dict[str, Check] = {}
    stationary: dict[str, StationaryPoint] = {}
    for response in plan.spec.responses:
        try:
            surface = surface_of(study, response.name)
        except StudyError as error:
            remarks.append(f"{response.name} has no surface: {error}")
            continue
        surfaces[response.name] = surface
        check = check_of(study, surface)
        if check is not None:
            checks[response.name] = check
        if surface.remark:
            remarks.append(f"{response.name}: {surface.remark}")
        remarks += [
            f"{response.name}: the residual of point {fitted[run].name} stands out."
            for run in surface.diagnostics.outlying
        ]
        try:
            stationary[response.name] = stationary_point(surface)
        except StudyError as error:
            remarks.append(str(error))
    best = None
    try:
        best = _optimum(study, surfaces)
    except StudyError as error:
        remarks.append(str(error))
    limited = tuple(one.name for one in plan.spec.responses if one.is_limited)
    return Analysis(
        factors,
        points_of(plan, fitted),
        surfaces,
        checks,
        stationary,
        best,
        limited,
        tuple(remarks),
    )


def surface_of(study: Study, response: str) -> Surface:
    """The surface of one response in lab units; raises StudyError where the runs give none."""
    factors = lab_factors(study.plan)
    values = np.array([values[response] for _, values in study.fitted])
    points = points_of(study.plan, [point for point, _ in study.fitted])
    return fit_surface(response, factors, points, values, model_terms(study.plan))


@dataclass(frozen=True)
class Check:
    """How far a surface is from points that it was not fitted to, in the response's field unit."""

    points: int
    rmse: float
    largest: float
    share: float
    """The root mean square over the range of the response, of all points."""

    @property
    def words(self) -> str:
        """One line for people."""
        return (
            f"{self.points} points that it was not fitted to, the surface is off by "
            f"{self.rmse:.3g} (root mean square, {100 * self.share:.2g} % of the range), "
            f"{self.largest:.3g} at most"
        )


def check_of(study: Study, surface: Surface) -> Check | None:
    """The surface's error at the study's check points; None where there are none."""
    if not study.checked:
        return None
    name = surface.response
    truth = np.array([values[name] for _, values in study.checked])
    points = points_of(study.plan, [point for point, _ in study.checked])
    error = surface.predict(coded(surface.factors, points)) - truth
    known = [values[name] for _, values in (*study.fitted, *study.checked)]
    rmse = float(np.sqrt(np.mean(error**2)))
    return Check(error.size, rmse, float(np.max(np.abs(error))), rmse / float(np.ptp(known)))


def lab_factors(plan: Plan) -> tuple[Factor, ...]:
    """A plan's factors with levels in lab units."""
    return tuple(
        Factor(f.name, plan.in_lab_units(f.name, f.low), plan.in_lab_units(f.name, f.high))
        for f in plan.factors
    )


def points_of(plan: Plan, points: Sequence[Point]) -> Array:
    """Points in lab units, (n, k)."""
    rows = [[plan.in_lab_units(f.name, p.values[f.name]) for f in plan.factors] for p in points]
    return np.array(rows).reshape(len(points), len(plan.factors))


def model_terms(plan: Plan) -> tuple[Term, ...]:
    """The model that the design is made for."""
    count = len(plan.factors)
    match plan.spec.design:
        case FractionalFactorialDesign():
            return linear_terms(count)
        case FullFactorialDesign(levels=2):
            return interaction_terms(count)
        case _:
            return quadratic_terms(count)


def _optimum(study: Study, surfaces: dict[str, Surface]) -> Optimum | None:
    responses = study.plan.spec.responses
    wanted = [(one.name, one.goal) for one in responses if one.goal and one.name in surfaces]
    if not wanted:
        return None
    name, goal = wanted[0]
    limited = [one for one in responses if one.is_limited]
    for one in limited:
        if one.name not in surfaces:
            raise StudyError(f"no optimum: the limit on '{one.name}' cannot be judged: no surface.")
    limits = [
        Limit(
            surfaces[one.name],
            -np.inf if one.at_least is None else one.at_least,
            np.inf if one.at_most is None else one.at_most,
        )
        for one in limited
    ]
    return optimum(surfaces[name], Goal(goal), limits)
