"""Response surfaces and analysis of variance: a published study, and identities that must hold."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from rig.study import plots
from rig.study.errors import StudyError
from rig.study.factors import (
    Factor,
    actual,
    coded,
    model_matrix,
    quadratic_terms,
    term_name,
)
from rig.study.optimum import Goal, Limit, Nature, optimum, stationary_point
from rig.study.plots import plot_residuals, plot_surface
from rig.study.surface import NO_PURE_ERROR, NO_REPLICATES, Surface, fit_surface

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "auysakul2023"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the shared reference data are not here")
FACTORS = (Factor("A", 3, 6), Factor("B", 3, 9), Factor("C", 2, 4))
HALF_DIGIT = {"D": 0.005, "E": 0.05}
"""Rounding of the printed responses."""
EQUATIONS = {
    "D": dict(zip(
        ("constant", "A", "B", "C", "A^2", "B^2", "C^2", "A*B", "A*C", "B*C"),
        (76.26, -10.287, -3.811, -13.65, 0.3843, 0.0861, 0.947, 0.1939, 0.767, 0.4429),
        strict=True,
    )),
    "E": dict(zip(
        ("constant", "A", "B", "C", "A^2", "B^2", "C^2", "A*B", "A*C", "B*C"),
        (85.2, 105.06, 0.94, 6.92, -12.146, -0.027, 0.55, -0.381, -3.280, 0.215),
        strict=True,
    )),
}  # fmt: skip
"""Equations (13) and (14) of the paper, in the factors' own units."""


def rows(name: str) -> list[dict[str, str]]:
    text = (DATA / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in text if not line.startswith("#")))


def published(response: str) -> tuple[np.ndarray, Surface]:
    table = rows("table2.csv")
    points = np.array([[float(row[name]) for name in "ABC"] for row in table])
    values = np.array([float(row[response]) for row in table])
    return points, fit_surface(response, FACTORS, points, values)


def printed_anova(response: str) -> dict[str, tuple[float, float | None]]:
    """Adjusted sum of squares and F by source, as printed."""
    names = {"AA": "A^2", "BB": "B^2", "CC": "C^2", "AB": "A*B", "AC": "A*C", "BC": "B*C"}
    return {
        names.get(row["source"], row["source"]): (
            float(row["adj_ss"]),
            float(row["f_value"]) if row["f_value"] else None,
        )
        for row in rows("anova.csv")
        if row["response"] == response
    }


@needs_data
@pytest.mark.parametrize("response", "DE")
def test_printed_f_values_come_out_within_two_and_a_half_percent(response: str) -> None:
    """But for two terms of F below 0.25, of which the rounding of Table 2 leaves no more."""
    _, surface = published(response)
    beyond = []
    for name, (_, f) in printed_anova(response).items():
        if f is not None:
            got = surface.source(name).f
            assert got is not None
            if abs(got / f - 1) > 0.025:
                beyond.append(name)
                assert f < 0.25
    assert beyond == ([] if response == "D" else ["B^2", "B*C"])


@needs_data
@pytest.mark.parametrize("response", "DE")
def test_printed_sums_of_squares_are_within_what_rounding_leaves_open(response: str) -> None:
    """A coefficient moves by at most half a digit times the sum of its row of the inverse."""
    points, surface = published(response)
    matrix = model_matrix(coded(FACTORS, points), surface.terms)
    inverse = np.linalg.pinv(matrix)
    reach = HALF_DIGIT[response] * np.abs(inverse).sum(axis=1)
    unscaled = np.diag(np.linalg.inv(matrix.T @ matrix))
    for at, term in enumerate(surface.terms):
        if not term:
            continue
        printed, _ = printed_anova(response)[term_name(term, FACTORS)]
        size = abs(surface.coefficients[at])
        low, high = max(size - reach[at], 0) ** 2, (size + reach[at]) ** 2
        digits = 0.005 if printed > 1 else 5e-5
        assert low / unscaled[at] - digits <= printed <= high / unscaled[at] + digits


@needs_data
@pytest.mark.parametrize("response", "DE")
def test_printed_equations_are_the_surface_in_actual_units(response: str) -> None:
    points, surface = published(response)
    matrix = model_matrix(points, surface.terms)
    reach = HALF_DIGIT[response] * np.abs(np.linalg.pinv(matrix)).sum(axis=1)
    found = surface.actual_coefficients()
    for at, (name, printed) in enumerate(EQUATIONS[response].items()):
        assert found[name] == pytest.approx(printed, abs=reach[at] + 0.005 * abs(printed))


@needs_data
def test_printed_quality_of_the_displacements_model_comes_out() -> None:
    _, surface = published("D")
    assert round(surface.r2, 3) == 0.998
    assert round(surface.r2_adjusted, 4) == 0.9943
    assert 100 * surface.coefficient_of_variation == pytest.approx(3.2, abs=0.05)
    assert surface.adequate_precision == pytest.approx(51.55, rel=0.01)
    assert surface.r2_predicted < surface.r2_adjusted
    assert surface.remark == NO_PURE_ERROR


@needs_data
def test_the_stationary_point_is_that_of_the_printed_equation() -> None:
    _, surface = published("D")
    eq = EQUATIONS["D"]
    hessian = np.array(
        [
            [2 * eq["A^2"], eq["A*B"], eq["A*C"]],
            [eq["A*B"], 2 * eq["B^2"], eq["B*C"]],
            [eq["A*C"], eq["B*C"], 2 * eq["C^2"]],
        ]
    )
    printed = np.linalg.solve(hessian, [-eq["A"], -eq["B"], -eq["C"]])
    found = stationary_point(surface)
    assert np.all(np.abs(found.actual - printed) < found.spread)
    assert found.nature is Nature.MINIMUM
    assert not found.inside  # so the largest displacement is at the border
    assert actual(FACTORS, found.coded[None])[0] == pytest.approx(found.actual)


@needs_data
def test_the_optimum_is_trial_5_or_better() -> None:
    """Largest displacement without more stress than trial 5 has."""
    table = rows("table2.csv")
    displacement, stress = published("D")[1], published("E")[1]
    limit = Limit(stress, high=float(table[4]["E"]))
    # a Box-Behnken design has no runs in the corners: once within its sphere, once anywhere
    for radius, least in ((np.sqrt(2), 20.0), (None, 23.0)):
        best = optimum(displacement, Goal.MAXIMISE, [limit], radius=radius)
        assert best.value > float(table[4]["D"])
        assert best.value > least
        assert best.limited[0] <= 288.2 * (1 + 1e-6)
        assert best.interval[0] < best.value < best.interval[1]
        assert best.actual[0] == pytest.approx(3, abs=1e-3)
        assert best.on_bounds[0]


def some_runs(seed: int, noise: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
    """A face-centred composite design with four centre runs and a noisy quadratic."""
    corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    axial = np.vstack([np.eye(3), -np.eye(3)])
    points = actual(FACTORS, np.vstack([corners, axial, np.zeros((4, 3))]))
    x = coded(FACTORS, points)
    rng = np.random.default_rng(seed)
    values = 5 + x @ [2, -1, 0.5] - 3 * x[:, 0] ** 2 - 2 * x[:, 1] ** 2 - x[:, 2] ** 2
    return points, values + noise * rng.standard_normal(len(points))


def test_adjusted_sums_of_squares_are_what_leaving_a_term_out_costs() -> None:
    points, values = some_runs(0)
    surface = fit_surface("y", FACTORS, points, values)
    matrix = model_matrix(coded(FACTORS, points), surface.terms)
    full = np.linalg.lstsq(matrix, values, rcond=None)[1][0]
    assert surface.source("Error").sum_of_squares == pytest.approx(full)
    for at, term in enumerate(surface.terms):
        if term:
            rest = np.delete(matrix, at, axis=1)
            without = np.linalg.lstsq(rest, values, rcond=None)[1][0]
            found = surface.source(term_name(term, FACTORS)).sum_of_squares
            assert found == pytest.approx(without - full, rel=1e-8)


def test_lack_of_fit_and_pure_error_are_the_error() -> None:
    points, values = some_runs(1)
    surface = fit_surface("y", FACTORS, points, values)
    pure = surface.source("Pure error")
    assert surface.remark == ""
    assert pure.dof == 3
    assert pure.sum_of_squares == pytest.approx(np.var(values[-4:]) * 4)
    both = pure.sum_of_squares + surface.source("Lack of fit").sum_of_squares
    assert both == pytest.approx(surface.source("Error").sum_of_squares)
    p = surface.source("Lack of fit").p
    assert p is not None
    assert p > 0.01  # the model is the truth
    cubic = values + 5 * coded(FACTORS, points).prod(axis=1)
    p = fit_surface("y", FACTORS, points, cubic).source("Lack of fit").p
    assert p is not None
    assert p < 0.01


def test_predicted_r2_is_that_of_leaving_each_run_out() -> None:
    points, values = some_runs(2)
    surface = fit_surface("y", FACTORS, points, values)
    errors = []
    for i in range(len(values)):
        rest = fit_surface("y", FACTORS, np.delete(points, i, 0), np.delete(values, i))
        errors.append(values[i] - rest.predict(coded(FACTORS, points[[i]]))[0])
    press = np.sum(np.square(errors))
    total = np.sum((values - values.mean()) ** 2)
    assert surface.r2_predicted == pytest.approx(1 - press / total)


def test_a_known_maximum_is_found_within_its_uncertainty() -> None:
    truth = actual(FACTORS, np.array([[2 / 6, -1 / 4, 0.25]]))[0]
    outside = 0
    for seed in range(10):
        found = stationary_point(fit_surface("y", FACTORS, *some_runs(seed)), seed)
        assert found.nature is Nature.MAXIMUM
        assert found.inside
        outside += int(np.sum(np.abs(found.actual - truth) > 2 * found.spread))
    best = optimum(fit_surface("y", FACTORS, *some_runs(9)), Goal.MAXIMISE)
    assert best.actual == pytest.approx(found.actual, abs=1e-3)
    assert outside <= 5  # of 30, of which 5 % should be


def test_a_limit_is_kept_and_one_that_nothing_meets_is_refused() -> None:
    points, values = some_runs(0)
    surface = fit_surface("y", FACTORS, points, values)
    other = fit_surface("z", FACTORS, points, points @ [1.0, 0.5, 0.2] + 0.01 * values)
    best = optimum(surface, Goal.MAXIMISE, [Limit(other, high=6.5)])
    assert best.limited[0] == pytest.approx(6.5, abs=1e-4)
    with pytest.raises(StudyError, match="relax"):
        optimum(surface, Goal.MAXIMISE, [Limit(other, low=100)])


def test_aliased_terms_are_named() -> None:
    half = np.array([[-1, -1, 1], [1, -1, -1], [-1, 1, -1], [1, 1, 1.0]])
    points = actual(FACTORS, np.vstack([half, half, half, half]))
    with pytest.raises(StudyError, match=r"aliases") as caught:
        fit_surface("y", FACTORS, points, np.arange(16.0))
    assert "C" in str(caught.value)
    assert "A*B" in str(caught.value)


def test_unusable_responses_are_refused() -> None:
    points, values = some_runs(0)
    with pytest.raises(StudyError, match="no factor acts"):
        fit_surface("y", FACTORS, points, np.full(len(points), 2.0))
    with pytest.raises(StudyError, match="run 3 has no value"):
        fit_surface("y", FACTORS, points, np.where(np.arange(len(points)) == 2, np.nan, values))
    with pytest.raises(StudyError, match="more runs than terms"):
        fit_surface("y", FACTORS, points[:10], values[:10])
    with pytest.raises(StudyError, match="not below"):
        Factor("A", 3, 3)


def test_runs_without_replicates_are_told_of() -> None:
    points, values = some_runs(0)
    assert fit_surface("y", FACTORS, points[:-3], values[:-3]).remark == NO_REPLICATES


def test_actual_coefficients_are_the_same_surface() -> None:
    points, values = some_runs(4)
    surface = fit_surface("y", FACTORS, points, values)
    found = list(surface.actual_coefficients().values())
    by_actual = model_matrix(points, quadratic_terms(3)) @ found
    assert by_actual == pytest.approx(surface.diagnostics.fitted, rel=1e-9)


def test_axes_carry_the_units_of_factors_and_response(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figures = []
    monkeypatch.setattr(plots, "save", lambda figure, path: figures.append(figure))
    points, values = some_runs(0)
    surface = fit_surface("y", FACTORS, points, values)
    names = [factor.name for factor in FACTORS]
    units = dict.fromkeys(names, "mm") | {"y": "kPa"}
    plot_surface(tmp_path / "s.png", surface, coded(FACTORS, points), units)
    plot_residuals(tmp_path / "r.svg", surface, units)
    flat, solid = figures[0].axes[0], figures[0].axes[1]
    assert (flat.get_xlabel(), flat.get_ylabel()) == (f"{names[0]} (mm)", f"{names[1]} (mm)")
    assert solid.get_zlabel() == "y (kPa)"
    assert figures[1].axes[0].get_ylabel() == "residual (kPa)"


def test_pictures_are_written(tmp_path: Path) -> None:
    points, values = some_runs(0)
    surface = fit_surface("y", FACTORS, points, values)
    plot_surface(tmp_path / "s.png", surface, coded(FACTORS, points), {})
    plot_residuals(tmp_path / "r.svg", surface, {})
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "r.svg").read_text()
    with pytest.raises(StudyError, match="cannot be written"):
        plot_residuals(tmp_path / "none" / "r.svg", surface, {})
