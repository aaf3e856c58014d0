"""Designs: the points that textbooks list, and what cannot be made."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from pydantic import ValidationError

from rig.spec.study import (
    BoxBehnkenDesign,
    CentralCompositeDesign,
    FractionalFactorialDesign,
    FullFactorialDesign,
    SpaceFillingDesign,
    StudySpec,
)
from rig.study.design import coded_points
from rig.study.errors import StudyError


def test_box_behnken_of_three_factors_is_the_published_plan() -> None:
    points = coded_points(BoxBehnkenDesign(kind="box-behnken", centre_points=3), 3)
    edges = {tuple(p) for p in points.tolist() if any(p)}
    expected = {
        tuple(signs[pair.index(i)] if i in pair else 0.0 for i in range(3))
        for pair in ((0, 1), (0, 2), (1, 2))
        for signs in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))
    }
    assert edges == expected
    assert len(points) == 15


@pytest.mark.parametrize(("face", "reach"), [("faced", 1.0), ("inscribed", 1.0)])
def test_central_composite_stays_between_the_levels(face: str, reach: float) -> None:
    design = CentralCompositeDesign(kind="central-composite", face=face, centre_points=2)
    points = coded_points(design, 3)
    assert len(points) == 8 + 6 + 2
    assert np.max(np.abs(points)) == pytest.approx(reach)


def test_circumscribed_composite_goes_beyond_the_levels() -> None:
    design = CentralCompositeDesign(kind="central-composite", face="circumscribed", centre_points=1)
    points = coded_points(design, 2)
    assert np.max(np.abs(points)) > 1.2
    assert np.sum(np.all(np.abs(points) == 1, axis=1)) == 4


def test_factorials_are_orthogonal() -> None:
    full = coded_points(FullFactorialDesign(kind="full-factorial", levels=2), 4)
    assert len(full) == 16
    part = coded_points(
        FractionalFactorialDesign(
            kind="fractional-factorial", generators="a b c abc", centre_points=2
        ),
        4,
    )
    assert len(part) == 10
    for points in (full, part[:8]):
        np.testing.assert_allclose(points.T @ points, len(points) * np.eye(4), atol=1e-12)
    three = coded_points(FullFactorialDesign(kind="full-factorial", levels=3), 2)
    assert sorted(set(three[:, 0])) == [-1, 0, 1]


@pytest.mark.parametrize("kind", ["sobol", "latin-hypercube"])
def test_space_filling_points_fill_every_slice_and_come_back(kind: str) -> None:
    design = SpaceFillingDesign(kind=kind, points=32, seed=4)
    points = coded_points(design, 3)
    assert np.array_equal(points, coded_points(design, 3))
    for column in points.T:
        counts, _ = np.histogram(column, 8, (-1, 1))
        assert np.all(counts == 4)


def test_designs_that_cannot_be_are_refused() -> None:
    with pytest.raises(StudyError, match="at most"):
        coded_points(FullFactorialDesign(kind="full-factorial", levels=9), 8)


BASE = {
    "kind": "study",
    "name": "s",
    "actuator": "bellow-bending",
    "factors": [
        {"name": "a", "field": "actuator.geometry.wall_thickness", "low": "1 mm", "high": "2 mm"},
        {"name": "b", "field": "actuator.geometry.average_radius", "low": "5 mm", "high": "6 mm"},
    ],
    "design": {"kind": "full-factorial"},
    "responses": [{"name": "y", "quantity": "angle", "model": "beam", "pressure": "5 kPa"}],
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"design": {"kind": "box-behnken"}}, "three factors"),
        ({"design": {"kind": "fractional-factorial", "generators": "a b ab"}}, "3 words"),
        ({"factors": [BASE["factors"][0]] * 2}, "different names"),
        ({"responses": [{**BASE["responses"][0], "model": "run"}]}, "runs"),
        ({"responses": [{**BASE["responses"][0], "at_least": 2, "at_most": 1}]}, "at_most"),
    ],
)
def test_inconsistent_studies_are_refused(change: dict[str, object], words: str) -> None:
    StudySpec.model_validate(BASE)
    with pytest.raises(ValidationError, match=words):
        StudySpec.model_validate({**BASE, **change})


def test_a_sobol_sequence_of_any_count_is_scipys_without_its_warning() -> None:
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = coded_points(SpaceFillingDesign(kind="sobol", points=5, seed=3), 2)
    expected = 2 * qmc.Sobol(2, rng=np.random.default_rng(3)).random(8)[:5] - 1
    assert points == pytest.approx(expected)
