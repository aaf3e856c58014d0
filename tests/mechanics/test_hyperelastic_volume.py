"""Volumetric parts: derivatives, the common limit, and what they say of impossible volumes."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.hyperelastic import (
    LogarithmicVolume,
    QuadraticVolume,
    Volumetric,
    abaqus_volume,
)

PARTS = [QuadraticVolume(7.5e6), LogarithmicVolume(7.5e6), abaqus_volume(2 / 7.5e6)]


@pytest.mark.parametrize("part", PARTS, ids=["quadratic", "logarithmic", "Abaqus"])
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


def test_only_the_logarithm_forbids_to_vanish() -> None:
    gone = np.array([0.0, -0.1])
    assert np.isposinf(LogarithmicVolume(1.0).energy(gone)).all()
    assert np.isnan(LogarithmicVolume(1.0).pressure(gone)).all()
    assert np.isnan(LogarithmicVolume(1.0).stiffness(gone)).all()
    assert np.isfinite(QuadraticVolume(1.0).energy(gone)).all()
