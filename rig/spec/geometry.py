"""What all geometry families share."""

from __future__ import annotations

from typing import ClassVar, Self

from rig.spec.base import SpecModel
from rig.spec.measurand import Deformation


class ActuatorGeometry(SpecModel):
    """Dimensions of an actuator of one family."""

    deformation: ClassVar[Deformation]
    """What it does under pressure."""
    wall_field: ClassVar[tuple[str, ...]] = ("wall_thickness",)
    """Where its wall thickness stands."""

    def with_wall(self, thickness: float) -> Self:
        """The same with another wall, `thickness` in m, checked again.

        Raises pydantic's ValidationError where there is no such actuator.
        """
        values = self.model_dump(mode="json")
        *outer, name = self.wall_field
        section = values
        for part in outer:
            section = section[part]
        section[name] = f"{thickness!r} m"
        return type(self).model_validate(values)
