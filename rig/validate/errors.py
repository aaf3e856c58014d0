"""What can go wrong when numbers are compared."""

from __future__ import annotations

from rig.errors import RigError


class ValidateError(RigError):
    """Data that a statistic cannot be computed from; says which and why."""
