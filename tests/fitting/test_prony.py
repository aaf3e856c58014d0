"""Prony series: known terms come back, the number that pays is chosen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.fitting.errors import FittingError, TestDataError
from rig.fitting.prony import Relaxation, fit_prony, read_relaxation

TIME = np.concatenate([[0.0], np.geomspace(0.05, 1000, 200)])
WEIGHTS, TIMES = (0.12, 0.2), (1.5, 90.0)


def relaxation(seed: int, noise: float) -> Relaxation:
    lost = sum(g * -np.expm1(-TIME / tau) for g, tau in zip(WEIGHTS, TIMES, strict=True))
    rng = np.random.default_rng(seed)
    return Relaxation(TIME, 80e3 * (1 - lost + noise * rng.standard_normal(TIME.size)), "made up")


def test_terms_come_back() -> None:
    found = fit_prony(relaxation(0, 0.0), 2)
    assert [t.weight for t in found.terms] == pytest.approx(WEIGHTS, rel=1e-3)
    assert [t.time for t in found.terms] == pytest.approx(TIMES, rel=1e-3)
    assert found.long_term == pytest.approx(0.68, rel=1e-3)
    assert found.instant_stress == pytest.approx(80e3, rel=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_noise_does_not_add_terms_and_errors_cover_the_truth(seed: int) -> None:
    found = fit_prony(relaxation(seed, 0.002))
    assert len(found.terms) == 2
    for term, weight, time in zip(found.terms, WEIGHTS, TIMES, strict=True):
        assert term.weight_error is not None
        assert term.time_error is not None
        assert abs(term.weight - weight) < 3.5 * term.weight_error
        assert abs(term.time - time) < 3.5 * term.time_error
    assert found.stress(np.array([0.0]))[0] == pytest.approx(found.instant_stress)


def test_more_terms_than_the_data_carry_are_refused() -> None:
    few = Relaxation(TIME[:10], relaxation(0, 0).stress[:10], "few.csv")
    with pytest.raises(FittingError, match="1 to 2"):
        fit_prony(few, 3)


def test_files_that_go_back_in_time_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    rows = "\n".join(f"{t:g},{5 - t / 10:g}" for t in (0, 1, 2, 3, 2.5, 4, 5, 6, 7))
    path.write_text(f"Time (s),Stress (kPa)\n{rows}\n")
    with pytest.raises(TestDataError, match=r"r\.csv:6"):
        read_relaxation(path)
