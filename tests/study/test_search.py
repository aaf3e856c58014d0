"""Searches: known optima, limits that are kept, fronts, and what was computed once."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from test_run import LIBRARY

from rig.spec.actuator import ActuatorSpec
from rig.spec.errors import SpecError
from rig.spec.loading import load_actuator, parse, read
from rig.spec.optimisation import OptimisationSpec
from rig.study.errors import StudyError
from rig.study.plan import Task, make_space
from rig.study.results import Folder, write_specs
from rig.study.search import Found, Memory, front, search
from rig.study.search_plots import plot_search

HEAD = """\
kind: optimisation
name: small
actuator: bellow-bending
factors:
  - {name: wall, field: actuator.geometry.wall_thickness, low: 1.2 mm, high: 2 mm}
  - {name: radius, field: actuator.geometry.average_radius, low: 5.5 mm, high: 7 mm}
"""
SEARCHES = {
    "cobyla": "{kind: cobyla, starts: 2, hops: 1, evaluations: 60}",
    "nsga2": "{kind: nsga2, population: 20, generations: 15}",
    "bayesian": "{kind: bayesian, evaluations: 60}",
}
BOWL = "{name: a, quantity: angle, model: beam, pressure: 4 kPa, goal: minimise}"
BAR = "{name: v, quantity: volume, model: beam, pressure: 4 kPa, at_least: 6.5}"


def bowl(task: Task) -> Mapping[str, float]:
    """Least at a wall of 1.6 mm and a radius of 6 mm; v is the radius in mm."""
    geometry = task.actuator.geometry
    wall, radius = 1e3 * geometry.wall_thickness, 1e3 * geometry.average_radius
    return {"a": (wall - 1.6) ** 2 + (radius - 6) ** 2, "v": radius, "w": -wall}


def run(
    responses: list[str], how: str, folder: Path | None = None, function: object = bowl
) -> Found:
    lines = "".join(f"  - {one}\n" for one in responses)
    text = f"{HEAD}responses:\n{lines}search: {SEARCHES[how]}\n"
    spec = parse(text, Path("small.yaml"), OptimisationSpec).spec
    space = make_space(Path("small.yaml"), LIBRARY, spec.actuator, spec.factors, spec.responses)
    kept = None if folder is None else Folder(folder)
    memory = Memory(space, spec.responses, kept, function=function)  # type: ignore[arg-type]
    return search(spec, memory)


@pytest.mark.parametrize(("how", "near"), [("cobyla", 0.01), ("nsga2", 0.1), ("bayesian", 0.2)])
def test_the_bottom_of_a_bowl_is_found(how: str, near: float) -> None:
    (best,) = run([BOWL], how).best
    assert 1e3 * best.point.values["wall"] == pytest.approx(1.6, abs=near)
    assert 1e3 * best.point.values["radius"] == pytest.approx(6.0, abs=near)


def test_an_optimum_on_two_bounds_is_met_exactly_where_answers_are_dear() -> None:
    def slope(task: Task) -> Mapping[str, float]:
        geometry = task.actuator.geometry
        return {"a": -1e3 * (geometry.wall_thickness + geometry.average_radius)}

    (best,) = run([BOWL], "bayesian", function=slope).best
    assert best.point.values == pytest.approx({"wall": 2e-3, "radius": 7e-3}, rel=1e-12)


@pytest.mark.parametrize(("how", "near"), [("cobyla", 0.02), ("nsga2", 0.12), ("bayesian", 0.3)])
def test_a_limit_is_kept(how: str, near: float) -> None:
    """The bowl's bottom at a radius of 6 mm is forbidden; the best is on the limit of 6.5 mm."""
    (best,) = run([BOWL, BAR], how).best
    assert best.answer.values is not None
    assert best.answer.values["v"] >= 6.5 * (1 - 1e-9)
    assert best.answer.values["v"] == pytest.approx(6.5, abs=near)


def test_the_front_of_two_goals_is_their_trade() -> None:
    """Small bowl against a large wall: the front lies at a radius of 6 and walls above 1.6 mm."""
    other = "{name: w, quantity: volume, model: beam, pressure: 4 kPa, goal: minimise}"
    found = run([BOWL, other], "nsga2")
    assert len(found.best) > 8
    values = np.array([one.objectives for one in found.best])
    assert np.all(np.diff(values[:, 0]) > 0)
    assert np.all(np.diff(values[:, 1]) < 0)
    for one in found.best:
        assert 1e3 * one.point.values["wall"] > 1.55
        assert 1e3 * one.point.values["radius"] == pytest.approx(6, abs=0.25)
    assert front(found.memory.evaluations) == found.best


def test_a_target_is_met_by_beam_theory() -> None:
    from rig.study.evaluate import evaluate

    wanted = "{name: a, quantity: angle, model: beam, pressure: 4 kPa, target: 40}"
    (best,) = run([wanted], "cobyla", function=evaluate).best
    assert best.answer.values is not None
    assert best.answer.values["a"] == pytest.approx(40, abs=0.05)


def test_points_without_an_answer_break_a_limit_and_cost_nothing_else() -> None:
    def half(task: Task) -> Mapping[str, float]:
        if task.actuator.geometry.average_radius < 6.3e-3:
            raise StudyError("too narrow")
        return bowl(task)

    (best,) = run([BOWL], "cobyla", function=half).best
    assert 6.3 <= 1e3 * best.point.values["radius"] < 6.4


@pytest.mark.parametrize("how", ["cobyla", "bayesian"])
def test_the_actuator_as_it_is_is_tried_first(how: str) -> None:
    first = run([BOWL], how).memory.evaluations[0].point.values
    assert first == pytest.approx({"wall": 1.5e-3, "radius": 6e-3})


def test_a_search_that_is_repeated_computes_nothing(tmp_path: Path) -> None:
    first = run([BOWL], "nsga2", tmp_path)
    again = run([BOWL], "nsga2", tmp_path)
    assert first.memory.computed > 100
    assert again.memory.computed == 0
    assert [e.point.values for e in again.best] == [e.point.values for e in first.best]


def test_the_best_is_written_as_a_spec_and_drawn(tmp_path: Path) -> None:
    found = run([BOWL, BAR], "cobyla")
    (best,) = found.best
    assert best.point.task is not None
    write_specs(tmp_path, "best-1", best.point.task, found.memory.space)
    written = load_actuator(tmp_path / "best-1.yaml")
    assert written.geometry == best.point.task.actuator.geometry
    plot_search(tmp_path / "search.png", found)
    assert (tmp_path / "search.png").read_bytes().startswith(b"\x89PNG")


def test_a_defect_is_not_remembered_beyond_the_search(tmp_path: Path) -> None:
    def starving(_: Task) -> Mapping[str, float]:
        raise MemoryError

    assert run([BOWL], "bayesian", tmp_path, starving).best == ()
    assert run([BOWL], "bayesian", tmp_path).best


def test_a_spec_is_written_with_its_material_if_that_was_called_by_a_path(tmp_path: Path) -> None:
    """`./mine.yaml` beside the drawing is nothing beside the written spec."""
    shipped = LIBRARY.path("actuator", "bellow-bending").read_text()
    assert "material: agilus30\n" in shipped
    drawing = tmp_path / "drawing.yaml"
    drawing.write_text(shipped.replace("material: agilus30\n", "material: ./mine.yaml\n"))
    material = LIBRARY.path("material", "agilus30").read_text()
    (tmp_path / "mine.yaml").write_text(material)
    text = f"{HEAD}responses: [{BOWL}]\nsearch: {SEARCHES['cobyla']}\n"
    spec = parse(text, Path("small.yaml"), OptimisationSpec).spec
    space = make_space(tmp_path / "s.yaml", LIBRARY, str(drawing), spec.factors, spec.responses)
    task = space.point("1", [1.5e-3, 6e-3]).task
    assert task is not None
    write_specs(tmp_path / "out", "best-1", task, space)
    written = tmp_path / "out" / "best-1.yaml"
    resolved = LIBRARY.resolve_actuator(read(written, ActuatorSpec))
    assert resolved.path == tmp_path / "out" / "best-1-material.yaml"
    assert resolved.spec == space.material


def test_two_factors_of_one_field_are_refused() -> None:
    twice = HEAD.replace("average_radius", "wall_thickness")
    text = f"{twice}responses: [{BOWL}]\nsearch: {SEARCHES['cobyla']}\n"
    with pytest.raises(SpecError, match="different fields"):
        parse(text, Path("small.yaml"), OptimisationSpec)


def test_several_objectives_need_the_search_for_fronts() -> None:
    other = "{name: w, quantity: volume, model: beam, pressure: 4 kPa, goal: minimise}"
    with pytest.raises(SpecError, match="nsga2"):
        run([BOWL, other], "cobyla")
    with pytest.raises(SpecError, match="goal"):
        run([BAR], "cobyla")
