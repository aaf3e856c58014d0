"""What the finite elements ask of a material: energy, stress and tangent, vectorised over points.

Tensors come first, points last: a deformation gradient is (3, 3, ...), whatever the trailing shape.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Energy(Protocol):
    """Stored energy W(F) per reference volume, in J/m3 = Pa; zero at rest, where F = I.

    Most energies here are isochoric: they see only J^(-1/3) F and leave the change of volume to a
    `Volumetric`. Where det F <= 0 their energy is infinite and its derivatives are not finite,
    without a warning or an error: a line search may step there.
    """

    def energy(self, deformation_gradient: Array, /) -> Array:
        """W, shape (...), for F of shape (3, 3, ...)."""
        ...

    def first_piola(self, deformation_gradient: Array, /) -> Array:
        """First Piola-Kirchhoff stress P = dW/dF, shape (3, 3, ...), in Pa."""
        ...

    def tangent(self, deformation_gradient: Array, /) -> Array:
        """A_ijkl = dP_ij/dF_kl, shape (3, 3, 3, 3, ...), in Pa; A_ijkl = A_klij."""
        ...


class Volumetric(Protocol):
    """Stored energy U(J) of a change of volume J = det F, in Pa; zero at J = 1, of any shape."""

    def energy(self, volume_ratio: Array, /) -> Array:
        """U, in Pa."""
        ...

    def pressure(self, volume_ratio: Array, /) -> Array:
        """dU/dJ, in Pa: the mean Cauchy stress, positive in expansion."""
        ...

    def stiffness(self, volume_ratio: Array, /) -> Array:
        """d2U/dJ2, in Pa; the bulk modulus at J = 1."""
        ...


@runtime_checkable
class Flowing(Protocol):
    """A material whose stress depends on what it went through: a new `Energy` for every step.

    Its history is an array (components, ...) of the points' shape, kept by whoever keeps the points
    and replaced when a step is accepted, never while one is looked for.
    """

    def virgin(self, shape: tuple[int, ...], /) -> Array:
        """The history of points of a shape that nothing has happened to, (components, *shape)."""
        ...

    def since(self, history: Array, /) -> Energy:
        """Incremental energy from a history (components, ...) on: its derivatives are the stress
        at the end of a step and the consistent tangent, for F of the history's points."""
        ...

    def afterwards(self, history: Array, deformation_gradient: Array, /) -> Array:
        """The history after a step from `history` to F (3, 3, ...), of the same shape."""
        ...
