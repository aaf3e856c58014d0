"""What models of bodies of revolution share: a whole meridian, standing on its foot, no weight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rig.mechanics.fe import Discretisation, Model, Solid, Support


@dataclass(frozen=True)
class MeridianModel:
    """A body of revolution as a finite element model."""

    model: Model
    soft: Solid
    density: float
    """Of its material in kg/m3."""

    @property
    def acceleration(self) -> tuple[float, float, float]:
        """No weight."""
        return (0.0, 0.0, 0.0)

    @property
    def mirror(self) -> None:
        """Nothing is mirrored."""
        return

    @property
    def planes(self) -> Mapping[str, int]:
        """The axis, and the component of displacement that it holds."""
        return {"axis": 0}


def supports_of(d: Discretisation) -> list[Support]:
    """Foot and axis, of a meridian with the boundaries `clamped` and `axis`."""
    return [
        Support.of(d, d.nodes_on("clamped"), (0, 1)),
        Support.of(d, d.nodes_on("axis"), (0,)),
    ]
