"""What can go wrong in an experiment."""

from __future__ import annotations

from rig.errors import RigError


class ExperimentError(RigError):
    """The experiment cannot be done, or could not be finished."""


class LimitError(ExperimentError):
    """The protocol asks for more than actuator, sensor or board allow; nothing was moved."""


class AbortedError(ExperimentError):
    """Somebody asked to stop."""

    exit_code = 130
