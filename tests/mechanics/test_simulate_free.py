"""Free inflation: every rung computed once, kept when stopped, honest about where it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from rig.mechanics.fe import Model, Progress, State, rotation_vector, summarise
from rig.mechanics.job import Job
from rig.mechanics.simulate.free import RUNGS, ActuatorModel, FreeInflation
from rig.mechanics.store import Entry
from tests.mechanics.fe_problems import bending_tube

LIMIT = 12e3


@dataclass
class Memory:
    """A store in memory."""

    entries: dict[str, Entry] = field(default_factory=dict)

    def load(self, key: str) -> Entry | None:
        return self.entries.get(key)

    def save(self, key: str, entry: Entry) -> None:
        self.entries[key] = entry


class BendingTube:
    mirror = 1

    def __init__(self) -> None:
        self.model: Model = bending_tube(along=2).model

    def angle(self, state: State) -> float:
        return float(rotation_vector(state.poses[0].rotation)[1])

    def displacement(self, state: State) -> float:
        return float(state.poses[0].shift[0])

    def volume(self, modelled: float) -> float:
        return 2 * modelled


def question(build: Callable[[], ActuatorModel] = BendingTube) -> FreeInflation:
    return FreeInflation(build, "tube", LIMIT)


def never() -> ActuatorModel:
    raise AssertionError("the entry should have answered")


@pytest.fixture(scope="module")
def complete() -> Memory:
    memory = Memory()
    question().curves(LIMIT / 4, Job(memory))
    return memory


def test_rungs_are_twelfths_of_the_limit_and_cover_what_was_asked(complete: Memory) -> None:
    curves = question(never).curves(0.99 * LIMIT / 4, Job(complete))
    np.testing.assert_allclose(curves.pressure, LIMIT / RUNGS * np.arange(4))
    assert curves.stopped is None
    assert np.all(np.diff(curves.angle) > 0)
    assert np.all(np.diff(curves.volume) > 0)
    actuator, solutions = question().solutions(LIMIT / 4, Job(complete))
    largest = [summarise(actuator.model, s).von_mises.value for s in solutions]
    np.testing.assert_allclose(curves.max_von_mises, largest, rtol=1e-12)


def test_a_lower_question_gets_only_what_it_asked_for(complete: Memory) -> None:
    assert question(never).curves(1.5e3, Job(complete)).pressure.size == 3


def test_fields_are_those_of_the_rungs_asked_for(complete: Memory) -> None:
    _, solutions = question().solutions(1.5e3, Job(complete))
    assert [s.pressure for s in solutions] == pytest.approx([0.0, 1e3, 2e3])


def test_a_higher_question_goes_on_where_the_last_one_ended(complete: Memory) -> None:
    memory = Memory(dict(complete.entries))
    told: list[Progress] = []
    more = question().curves(5e3, Job(memory, lambda _, p: not told.append(p)))
    assert {p.points for p in told} == {2}, "only the two missing rungs are computed"
    at_once = question().curves(5e3, Job(Memory()))
    # both are converged to the solver's tolerance, on different paths
    np.testing.assert_allclose(more.angle, at_once.angle, rtol=1e-5)


def test_a_stopped_calculation_keeps_its_rungs_and_is_continued() -> None:
    memory = Memory()

    def until_the_third_rung(_: str, progress: Progress) -> bool:
        return progress.point < 2

    partial = question().curves(LIMIT / 4, Job(memory, until_the_third_rung))
    assert partial.stopped is not None
    assert "cancelled" in partial.stopped
    assert partial.pressure.size == 2
    whole = question().curves(LIMIT / 4, Job(memory))
    assert whole.stopped is None
    assert whole.pressure.size == 4


def test_a_path_that_ends_is_not_tried_again() -> None:
    memory = Memory()
    question = FreeInflation(BendingTube, "tube", 60e6)
    first = question.curves(60e6, Job(memory))
    assert first.stopped is not None
    assert "the path stopped at" in first.stopped
    again = FreeInflation(never, "tube", 60e6).curves(60e6, Job(memory))
    assert again.stopped == first.stopped


def test_stored_equilibria_are_those_that_were_found(complete: Memory) -> None:
    actuator, solutions = question().solutions(LIMIT / 4, Job(complete))
    for solution in solutions:
        found = actuator.model.assemble(solution.state, tangent=False)
        assert found.volume == pytest.approx(solution.volume, rel=1e-12)
        np.testing.assert_allclose(
            found.residual[actuator.model.free], 0.0, atol=1e-5 * found.scale
        )
