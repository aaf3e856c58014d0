"""Volumetric parts: derivatives, the common limit, and what they say of impossible volumes."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.hyperelastic import (
    HenckyVolume,
    LogarithmicVolume,
    QuadraticVolume,
    Volumetric,
    abaqus_volume,
)

PARTS = [
    QuadraticVolume(7.5e6),
    LogarithmicVolume(7.5e6),
    HenckyVolume(7.5e6),
    abaqus_volume(2 / 7.5e6),
]


@pytest.mark.parametrize("part", PARTS, ids=["quadratic", "logarithmic", "Hencky", "Abaqus"])
class TestEveryPart:
    def test_pressure_and_stiffness_are_derivatives(self, part: Volumetric) -> None:
        j = np.linspace(0.3, 3, 28)
        step = j + 1e-30j
        assert part.pressure(j) == pytest.approx(part.energy(step).imag / 1e-30, rel=1e-12)
        assert part.stiffness(j) == pytest.approx(part.pressure(step).imag / 1e-30, rel=1e-12)

    def test_nothing_at_rest_and_the_bulk_modulus_for_small_changes(self, part: Volumetric) -> None:
        rest = np.array([1.0])
        assert part.energy(rest) == 0
        assert part.pressure(rest) == 0
        assert part.stiffness(rest) == pytest.approx(7.5e6, rel=1e-15)

    def test_it_works_on_any_shape(self, part: Volumetric) -> None:
        j = np.array([[0.9, 1.0, 1.1]])
        assert part.energy(j).shape == part.pressure(j).shape == part.stiffness(j).shape == (1, 3)


@pytest.mark.parametrize("part", [LogarithmicVolume(1.0), HenckyVolume(1.0)])
def test_logarithms_forbid_to_vanish(part: Volumetric) -> None:
    gone = np.array([0.0, -0.1])
    assert np.isposinf(part.energy(gone)).all()
    assert np.isnan(part.pressure(gone)).all()
    assert np.isnan(part.stiffness(gone)).all()


def test_a_square_does_not_forbid_to_vanish() -> None:
    assert np.isfinite(QuadraticVolume(1.0).energy(np.array([0.0, -0.1]))).all()
