"""A study's response as a function of many points at once."""

from __future__ import annotations

import numpy as np

from rig.study.analysis import Analysis
from rig.study.beams import ManyBeams
from rig.study.errors import StudyError
from rig.study.factors import Array, Factor, coded
from rig.study.plan import Plan
from rig.study.sensitivity import Model


def beam_model(plan: Plan, response: str) -> Model:
    """Beam theory itself, of points in SI; the response is an angle, in deg.

    Raises StudyError for anything else.
    """
    (one,) = [r for r in plan.spec.responses if r.name == response]
    if one.model != "beam" or one.quantity != "angle":
        raise StudyError(
            f"'{response}' is no angle of beam theory; others take the surface of a finished study."
        )

    def answers(points: Array) -> Array:
        values = {f.name: points[:, i] for i, f in enumerate(plan.factors)}
        beams = ManyBeams.of(plan.space.actuator, plan.space.material, plan.fields, values)
        return np.degrees(beams.angle(one.pressure))

    return answers


def surface_model(analysis: Analysis, factors: tuple[Factor, ...], response: str) -> Model:
    """The response surface of a finished study, of points in the units of `factors`."""
    if response not in analysis.surfaces:
        raise StudyError(
            f"the study has no surface of '{response}': " + "; ".join(analysis.remarks)
        )
    surface = analysis.surfaces[response]
    return lambda points: surface.predict(coded(factors, points))
