"""Long work in another process: progress, result, failure, cancelling."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

from rig.studio.calculation import Calculation, Status
from rig.studio.errors import StudioError
from rig.studio.state import MOST_CALCULATIONS, Workshop
from tests.studio import works

PATIENT_S = 60.0
"""Against a test that hangs; nothing is asserted of it."""


def finished(calculation: Calculation) -> Status:
    while calculation.poll() == "running":
        time.sleep(0.01)
    return calculation.status


def test_a_result_comes_back_with_progress_on_the_way() -> None:
    calculation = Calculation(works.square, 12)
    assert finished(calculation) == "done"
    assert calculation.result == 144
    assert calculation.progress == "half way"


@pytest.mark.parametrize(
    ("work", "said"),
    [
        (works.fail, "the wall is too thin."),
        (works.break_down, "defect in rig, not in your design: ZeroDivisionError"),
        (works.vanish, "ended without a word"),
    ],
)
def test_a_failure_is_told_in_words(work: Callable[..., Any], said: str) -> None:
    calculation = Calculation(work)
    assert finished(calculation) == "failed"
    assert said in calculation.error


def test_a_cancelled_one_ends_after_its_step_and_others_may_begin() -> None:
    workshop = Workshop()
    running = [workshop.start(works.until_told) for _ in range(MOST_CALCULATIONS)]
    with pytest.raises(StudioError, match="going on already"):
        workshop.start(works.square, 1)
    for calculation in running:
        while calculation.progress != "going on":
            calculation.poll()
            time.sleep(0.01)
        calculation.cancel()
        assert finished(calculation) == "cancelled"
    unseen = [workshop.start(works.square, 2) for _ in range(MOST_CALCULATIONS)]
    for calculation in unseen:  # as the report after a run, which no page waits for
        assert calculation._heard.poll(PATIENT_S)
        calculation._process.join(PATIENT_S)
        assert not calculation._process.is_alive()
    last = workshop.start(works.until_told)
    workshop.close()
    assert last.status == finished(last) == "cancelled"
