"""Intraclass correlation and regression against published figures and closed forms."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from rig.validate.agreement import intraclass_correlation, regression
from rig.validate.errors import ValidateError

# Shrout and Fleiss, Psychol. Bull. 86 (1979) 420, Table 2: six targets, four judges
RATINGS = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]]
# Anscombe, Am. Stat. 27 (1973) 17, first set
X = [10, 8, 13, 9, 11, 14, 6, 4, 12, 7, 5]
Y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68]


class TestIntraclassCorrelation:
    @pytest.fixture(autouse=True)
    def _library(self) -> None:
        pytest.importorskip("pingouin", reason="pingouin is not installed")

    def test_the_published_example_comes_out(self) -> None:
        found = intraclass_correlation(RATINGS)
        assert found.coefficient == pytest.approx(0.29, abs=5e-3)
        assert (found.low, found.high) == pytest.approx((0.02, 0.76), abs=5e-3)
        assert found.p_value == pytest.approx(1.35e-4, rel=1e-2)

    def test_it_is_the_ratio_of_mean_squares(self) -> None:
        y = np.array(RATINGS, dtype=float)
        n, k = y.shape
        rows = k * np.var(y.mean(axis=1), ddof=1)
        columns = n * np.var(y.mean(axis=0), ddof=1)
        rest = y - y.mean(axis=1, keepdims=True) - y.mean(axis=0) + y.mean()
        error = np.sum(rest**2) / ((n - 1) * (k - 1))
        expected = (rows - error) / (rows + (k - 1) * error + k * (columns - error) / n)
        assert intraclass_correlation(y).coefficient == pytest.approx(expected, rel=1e-9)

    def test_a_bias_of_one_rater_counts_against_agreement(self) -> None:
        rng = np.random.default_rng(1)
        y = rng.normal(size=(10, 1)) + 0.05 * rng.normal(size=(10, 5))
        biased = y + np.array([0, 0, 0, 0, 2.0])
        assert intraclass_correlation(y).coefficient > 0.98
        assert intraclass_correlation(biased).coefficient < 0.8

    @pytest.mark.parametrize("shape", [(4, 3), (5, 1), (5,)])
    def test_a_table_that_is_too_small_is_refused(self, shape: tuple[int, ...]) -> None:
        with pytest.raises(ValidateError, match="five targets by two raters"):
            intraclass_correlation(np.ones(shape))

    def test_targets_that_do_not_differ_are_refused(self) -> None:
        with pytest.raises(ValidateError, match="nothing to agree about"):
            intraclass_correlation(np.ones((6, 3)))


def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pingouin", None)
    with pytest.raises(ValidateError, match="pip install pingouin"):
        intraclass_correlation(RATINGS)


class TestRegression:
    def test_the_published_example_comes_out(self) -> None:
        found = regression(X, Y)
        assert (found.slope, found.intercept) == pytest.approx((0.500, 3.00), abs=1e-3)
        assert found.correlation == pytest.approx(0.816, abs=1e-3)
        assert found.p_value == pytest.approx(0.00217, rel=1e-2)
        assert found.slope_interval[0] < found.slope < found.slope_interval[1]

    def test_experiment_and_simulation_are_not_exchangeable(self) -> None:
        assert regression(Y, X).slope != pytest.approx(1 / regression(X, Y).slope, rel=0.1)

    def test_an_experiment_that_never_moves_is_not_foretold(self) -> None:
        found = regression(X, np.ones(len(X)))
        assert (found.slope, found.correlation, found.p_value) == pytest.approx((0.0, 0.0, 1.0))

    @pytest.mark.parametrize(
        ("x", "y", "why"),
        [
            ([1, 2], [1, 2], "at least three"),
            ([1, 2, 3], [1, 2], "equally many"),
            ([1, 2, np.nan], [1, 2, 3], "finite"),
            ([1, 1, 1], [1, 2, 3], "does not vary"),
        ],
    )
    def test_what_no_line_can_be_drawn_through_is_refused(self, x, y, why) -> None:
        with pytest.raises(ValidateError, match=why):
            regression(x, y)
