"""Errors of the virtual bench: a scene that cannot be built, a specimen that cannot exist."""

from __future__ import annotations

from rig.errors import RigError


class PlantError(RigError):
    """The virtual bench cannot be built or run as described."""


class SceneError(PlantError):
    """The camera cannot see what it has to see: it does not fit into the picture."""


class SpecimenError(PlantError):
    """The drawn specimen is no usable actuator."""
