"""A study's response as a function of many points at once."""

from __future__ import annotations

import numpy as np

from rig.spec.study import StudyResponse
from rig.study.beams import ManyBeams
from rig.study.errors import StudyError
from rig.study.factors import Array, coded
from rig.study.plan import Space
from rig.study.sensitivity import Model
from rig.study.surface import Surface


def beam_model(space: Space, response: StudyResponse) -> Model:
    """Beam theory itself, of points in SI; the response is an angle, in deg.

    Raises StudyError for anything else.
    """
    if response.model != "beam" or response.quantity != "angle":
        raise StudyError(
            f"'{response.name}' is no angle of beam theory; others take the surface of a finished "
            f"study."
        )

    def answers(points: Array) -> Array:
        values = {f.name: points[:, i] for i, f in enumerate(space.factors)}
        beams = ManyBeams.of(space.actuator, space.material, space.fields, values)
        return np.degrees(beams.angle(response.pressure))

    return answers


def surface_model(surface: Surface, space: Space) -> Model:
    """The response surface of a finished study, of points in SI."""
    return lambda points: surface.predict(coded(space.factors, points))
