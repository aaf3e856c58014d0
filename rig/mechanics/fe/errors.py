"""Errors of the finite elements."""

from __future__ import annotations

from rig.mechanics.errors import MechanicsError


class FiniteElementError(MechanicsError):
    """A finite element model cannot be built or solved as asked."""


class MeshError(FiniteElementError):
    """The mesh does not fit: unknown element, inverted elements, missing boundary, open surface."""


class SingularError(FiniteElementError):
    """The tangent cannot be factorised: something moves without resistance."""
