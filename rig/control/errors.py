"""What can go wrong in identification, tuning and the judgement of control."""

from __future__ import annotations

from rig.errors import RigError


class ControlError(RigError):
    """Data that says nothing about the control loop; says which and why."""
