"""The joint bellow driven as in the paper: stress over time at ten latitudes of every bellow.

Guo et al. (Biocybern. Biomed. Eng. 40 (2020) 1359), Sections 2.2 to 2.4. Deformed at a constant
rate, the upper disc is moved evenly and nothing else acts. Pumped at a constant rate, pressure
moves it, and the amount of gas in the cavity, (p + ambient) V at constant temperature, changes
evenly. Nothing here depends on rate, and gas falls and grows with the elongation: the states on the
way are found by elongation, which passes limits of pressure, and their times from the gas. The
paper replays a recorded pressure instead, of which it prints the ends alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import DisplacementControl, Options, Point, Solution, follow
from rig.mechanics.fe.fields import nodal_fields
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.plasticity import plastic_strain
from rig.mechanics.simulate.joint import JointModel, joint_model, nodes_at
from rig.spec.actuator import BellowJointGeometry
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

LETTERS = "ABCDEFGHIJ"
"""Latitudes of a bellow: A at the trough, F at the crest."""
FACES = ("outside", "cavity")
"""Faces of the wall, in the order of `LatitudeRun.stress`."""
AMBIENT = 101325.0
"""Absolute pressure outside in Pa: the standard atmosphere."""
_OPTIONS = Options(least_step=1 / 32)


class Drive(StrEnum):
    """What moves the bellow."""

    PUMPED = "pumped"
    """Gas at a constant rate."""
    DEFORMED = "deformed"
    """The upper disc, moved at a constant speed."""


@dataclass(frozen=True)
class Stroke:
    """How far and how fast."""

    elongation: float
    """In m; negative shortens."""
    duration: float
    """In s."""


INFLATION = Stroke(13e-3, 0.5)
"""The paper's, Section 2.3."""
COMPRESSION = Stroke(-25e-3, 0.4)
"""The paper's, Section 2.3."""


@dataclass(frozen=True)
class LatitudeRun:
    """One stroke at k times, the first at rest."""

    time: Array
    """In s, (k,)."""
    elongation: Array
    """In m, (k,)."""
    pressure: Array
    """Gauge pressure in Pa, (k,); 0 where the disc is moved."""
    gap: Array
    """Smallest gap between flanks in m, (k,): not positive where they touch, which nothing
    resists; infinite where none is near."""
    stress: Array
    """Von Mises stress in Pa, (k, faces, bellows, latitudes)."""
    plastic: Array
    """Largest equivalent plastic strain, (k,)."""

    @property
    def greatest(self) -> Array:
        """Largest stress of each point on the way in Pa, (faces, bellows, latitudes)."""
        return np.asarray(self.stress.max(axis=0))

    @property
    def rate(self) -> Array:
        """Growth of stress in Pa/s, of the shape of `stress`."""
        return np.asarray(np.gradient(self.stress, self.time, axis=0))


def drive(
    geometry: BellowJointGeometry,
    material: MaterialSpec,
    stroke: Stroke,
    how: Drive,
    *,
    steps: int = 13,
    resolution: JointResolution | None = None,
) -> LatitudeRun:
    """Follow one stroke from rest in equal steps of elongation.

    Raises MechanicsError where it cannot be finished, or where the gas in the cavity changes its
    direction on the way: no constant pumping rate gets there.
    """
    moved = how is Drive.DEFORMED
    taken = 1.0 if moved else None  # by 1 m times the motion, which is the way
    actuator = joint_model(geometry, material, resolution=resolution, moved=taken)
    progress = np.arange(steps + 1) / steps
    way = stroke.elongation * progress
    if moved:
        result = follow(actuator.model, [Point(0.0, motion=u) for u in way], options=_OPTIONS)
    else:
        control = DisplacementControl((actuator.model.discretisation.dim * actuator.top + 1,))
        result = follow(actuator.model, [Point(u) for u in way], control, options=_OPTIONS)
    if result.failure is not None:
        raise MechanicsError(
            f"the joint bellow does not get to {1e3 * stroke.elongation:.4g} mm, {how}: "
            f"{result.failure}"
        )
    found = result.solutions
    pressure = np.zeros(len(found)) if moved else np.array([s.pressure for s in found])
    if not moved:
        gas = (pressure + AMBIENT) * np.array([s.volume for s in found])
        progress = (gas - gas[0]) / (gas[-1] - gas[0])
        if np.any(np.diff(progress) <= 0):
            raise MechanicsError(
                f"on the way to {1e3 * stroke.elongation:.4g} mm the gas in the cavity turns back: "
                "no constant pumping rate does this. Ask for a shorter stroke."
            )
    return LatitudeRun(
        time=stroke.duration * progress,
        elongation=way,
        pressure=pressure,
        gap=np.array([actuator.flanks.gap(s.state) for s in found]),
        stress=_stresses(actuator, found),
        plastic=np.array([_plastic(s) for s in found]),
    )


def _stresses(actuator: JointModel, solutions: tuple[Solution, ...]) -> Array:
    d = actuator.model.discretisation
    nodes = np.stack(
        [
            nodes_at(d, actuator.shape.latitudes("outside")),
            nodes_at(d, actuator.shape.latitudes("cavity")),
        ]
    )
    result = []
    for solution in solutions:
        (fields,) = nodal_fields(actuator.model, solution.state)
        everywhere = np.zeros(len(d.nodes))
        everywhere[fields.nodes] = fields.von_mises
        result.append(everywhere[nodes])
    return np.array(result)


def _plastic(solution: Solution) -> float:
    (points,) = solution.state.points
    return 0.0 if points.history is None else float(plastic_strain(points.history).max())
