"""The largest stresses and strains of a solution: how much, where, and what to make of it.

A maximum next to a re-entrant edge or the end of a clamp grows with every finer mesh; it is marked
as such. Beside every maximum stands the value that 99.5 % of the material's volume stays below:
it has a limit as the mesh is refined, notch or not, because the volume above a given stress has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.fields import (
    Fields,
    all_point_fields,
    recovered,
)
from rig.mechanics.fe.model import Model
from rig.mechanics.fe.notches import near_notches
from rig.mechanics.fe.path import Solution

Array = NDArray[np.float64]

BULK_SHARE = 0.995
"""Share of the volume at rest that stays below the value told as `Peak.bulk`."""


@dataclass(frozen=True)
class Peak:
    """The largest value of a field."""

    value: float
    """Recovered at the nodes."""
    place: Array
    """Where, in m at rest, (dim,)."""
    solid: int
    """In which of the model's solids."""
    at_notch: bool
    """Whether it is in an element at a singular edge: then it has no limit on finer meshes."""
    bulk: float
    """Value at quadrature points that 99.5 % of the volume stays below; of all solids asked for."""


@dataclass(frozen=True)
class Extremes:
    """Largest stresses and strains at one pressure."""

    pressure: float
    """Pressure of the cavity in Pa."""
    von_mises: Peak
    """Equivalent Cauchy stress in Pa."""
    principal_stress: Peak
    """Largest principal Cauchy stress in Pa."""
    nominal_stress: Peak
    """Largest principal nominal stress in Pa: what a data sheet's strength is."""
    principal_strain: Peak
    """Largest engineering principal strain: what a data sheet's elongation is."""
    compression: Peak
    """Largest shortening, 1 less the smallest principal stretch."""


PEAKS = tuple(field.name for field in fields(Extremes) if field.name != "pressure")
"""Names of the peaks in Extremes."""


def summarise(model: Model, solution: Solution, solids: int | None = None) -> Extremes:
    """Largest stresses and strains of a model at one of its solutions.

    Of its first `solids` solids, or of all: what is of another material has a strength of its own.
    """
    inside = all_point_fields(model, solution.state)[:solids]
    outside = [recovered(s, at) for s, at in zip(model.solids[:solids], inside, strict=True)]
    nodes, near = model.discretisation.nodes, near_notches(model)
    volumes = np.concatenate([fields.weights.reshape(-1) for fields in inside])

    def peak(measure: Callable[[Fields], Array]) -> Peak:
        at_nodes = [measure(fields) for fields in outside]
        solid = int(np.argmax([values.max() for values in at_nodes]))
        largest = int(np.argmax(at_nodes[solid]))
        node = int(outside[solid].nodes[largest])
        at_points = np.concatenate([measure(fields).reshape(-1) for fields in inside])
        return Peak(
            value=float(at_nodes[solid][largest]),
            place=nodes[node],
            solid=solid,
            at_notch=bool(near[node]),
            bulk=volume_percentile(at_points, volumes, BULK_SHARE),
        )

    return Extremes(
        pressure=solution.pressure,
        von_mises=peak(lambda fields: fields.von_mises),
        principal_stress=peak(lambda fields: fields.principal_stress[0]),
        nominal_stress=peak(lambda fields: fields.nominal_stress[0]),
        principal_strain=peak(lambda fields: fields.principal_stretch[0] - 1),
        compression=peak(lambda fields: 1 - fields.principal_stretch[2]),
    )


def volume_percentile(values: Array, volumes: Array, share: float) -> float:
    """The smallest of `values` (n,) that `share` of the `volumes` (n,) is not above."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(volumes[order])
    return float(values[order][np.searchsorted(below, share * below[-1])])
