"""Inflation: every rung computed once, kept when stopped, honest about where it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from rig.mechanics.fe import Model, Progress, Solution, rotation_vector
from rig.mechanics.fe.extremes import PEAKS, summarise
from rig.mechanics.job import Job
from rig.mechanics.simulate.families import Family, Meshing
from rig.mechanics.simulate.inflation import RUNGS, ActuatorModel, Inflation
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

    def measures(self, solution: Solution) -> dict[str, float]:
        turned = rotation_vector(solution.state.poses[0].rotation)
        return {
            "angle": float(turned[1]),
            "displacement": float(solution.state.poses[0].shift[0]),
            "volume": 2 * solution.volume,
            "force": 0.01 * solution.pressure,
        }


def tube(_geometry: object, _material: object) -> BendingTube:
    return BendingTube()


TUBES = Family(Meshing(tube, tube), Meshing(tube, tube))
"""In the place of a family whose models take longer than a test may."""


def question(build: Callable[[], ActuatorModel] = BendingTube) -> Inflation:
    return Inflation("tip free", build, "tube", LIMIT)


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
    assert np.all(np.diff(curves.measured["angle"]) > 0)
    assert np.all(np.diff(curves.measured["volume"]) > 0)


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
    np.testing.assert_allclose(more.measured["angle"], at_once.measured["angle"], rtol=1e-5)


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
    question = Inflation("tip free", BendingTube, "tube", 60e6)
    first = question.curves(60e6, Job(memory))
    assert first.stopped is not None
    assert "the path stopped at" in first.stopped
    again = Inflation("tip free", never, "tube", 60e6).curves(60e6, Job(memory))
    assert again.stopped == first.stopped


def test_stored_equilibria_are_those_that_were_found(complete: Memory) -> None:
    actuator, solutions = question().solutions(LIMIT / 4, Job(complete))
    for solution in solutions:
        found = actuator.model.assemble(solution.state, tangent=False)
        assert found.volume == pytest.approx(solution.volume, rel=1e-12)
        np.testing.assert_allclose(
            found.residual[actuator.model.free], 0.0, atol=1e-5 * found.scale
        )


def test_stored_extremes_are_those_of_the_equilibria(complete: Memory) -> None:
    actuator, solutions = question().solutions(LIMIT / 4, Job(complete))
    stored = question(never).curves(LIMIT / 4, Job(complete)).extremes
    for solution, found in zip(solutions, stored, strict=True):
        expected = summarise(actuator.model, solution)
        assert found.pressure == expected.pressure
        for name in PEAKS:
            ours, theirs = getattr(found, name), getattr(expected, name)
            assert (ours.value, ours.bulk) == (theirs.value, theirs.bulk)
            assert (ours.solid, ours.at_notch) == (theirs.solid, theirs.at_notch)
            np.testing.assert_array_equal(ours.place, theirs.place)
