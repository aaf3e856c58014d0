"""Slit shells by finite elements: they bend or lengthen, what is kept goes on, decks, stress."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from deck_reader import read_deck

from rig.mechanics.deck.elements import Program
from rig.mechanics.deck.write import write_deck
from rig.mechanics.fe import Point, follow
from rig.mechanics.fe.fields import all_point_fields
from rig.mechanics.job import Job
from rig.mechanics.mesh.slit_shell import ShellResolution
from rig.mechanics.shells import SlitShell
from rig.mechanics.simulate.bending import FREE_OPTIONS
from rig.mechanics.simulate.blocked import Blocked
from rig.mechanics.simulate.inflation import Inflation
from rig.mechanics.simulate.prediction import inflations
from rig.mechanics.simulate.shells import (
    BLOCKED_SHELL_OPTIONS,
    shell_bending_model,
    shell_linear_model,
)
from rig.mechanics.store import Remembering
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry
from rig.spec.workspace import Workspace

COARSE = ShellResolution(ring=1, slit=1, around=6, wall=1)
BENDING = ShellReinforcedBendingGeometry.model_validate(
    {"family": "shell-reinforced-bending", "slit_number": 1, "total_length": 12}
)
LINEAR = ShellReinforcedLinearGeometry.model_validate(
    {"family": "shell-reinforced-linear", "slit_number": 1, "total_length": 8}
)


@pytest.fixture(scope="module")
def ecoflex():
    return Workspace.find().material("ecoflex-00-30")


def test_the_strip_keeps_its_length_and_so_it_bends(ecoflex):
    actuator = shell_bending_model(BENDING, ecoflex, resolution=COARSE)
    result = follow(actuator.model, [Point(5e3), Point(10e3)], options=FREE_OPTIONS)
    assert result.failure is None
    bent = result.solutions[-1].state
    assert np.degrees(actuator.angle(bent)) > 3.0
    d = actuator.model.discretisation
    line = np.flatnonzero((np.abs(d.nodes[:, 1]) < 1e-9) & (np.abs(d.nodes[:, 2] + 4e-3) < 1e-9))
    line = line[np.argsort(d.nodes[line, 0])]
    moved = d.nodes[line] + bent.x[3 * line[:, None] + np.arange(3)]
    length = np.linalg.norm(np.diff(moved, axis=0), axis=1).sum()
    assert length == pytest.approx(np.ptp(d.nodes[line, 0]), rel=5e-3)
    felt = actuator.model.interfaces[0].grip(bent.x, bent.memories[0])
    assert felt.pressure.max() > 1e3
    assert np.nanmin(felt.gap) > -2e-5, "1 % of the wall"


def test_what_is_kept_goes_on_with_the_friction_that_was_there(ecoflex):
    def inflation():
        return Inflation(
            "tip free",
            lambda: shell_linear_model(LINEAR, ecoflex, resolution=COARSE),
            key="linear",
            limit=12e3,
        )

    kept = Remembering(Job().store)
    inflation().curves(2e3, Job(store=kept))
    later = inflation().curves(3e3, Job(store=kept)).measured["displacement"]
    _, kept_states = inflation().solutions(3e3, Job(store=kept))
    model = shell_linear_model(LINEAR, ecoflex, resolution=COARSE)
    straight = follow(model.model, [Point(p) for p in (0.0, 1e3, 2e3, 3e3)])
    assert straight.failure is None
    here, there = (s[-1].state.memories[0] for s in (kept_states, straight.solutions))
    assert here == pytest.approx(there, rel=1e-3, abs=1e-2 * np.abs(there).max())
    assert np.abs(there[:, -2:]).max() > 0
    expected = model.measures(straight.solutions[-1])["displacement"]
    assert later[-1] == pytest.approx(expected, rel=1e-3)
    assert later[-1] > later[-2] > 0


def test_the_blocked_tip_presses_on_its_stop(ecoflex):
    from functools import partial

    build = Blocked(partial(shell_bending_model, resolution=COARSE))
    actuator = build(BENDING, ecoflex)
    result = follow(actuator.model, [Point(0.0), Point(4e3)], options=BLOCKED_SHELL_OPTIONS)
    assert result.failure is None
    forces = [actuator.measures(s)["force"] for s in result.solutions]
    assert forces[1] > 10 * abs(forces[0])
    assert forces[1] > 1e-3


def test_a_deck_has_both_parts_and_their_contact(ecoflex, tmp_path: Path):
    actuator = shell_linear_model(LINEAR, ecoflex, resolution=COARSE)
    for program in Program:
        path = tmp_path / f"{program.value}.inp"
        write_deck(path, actuator, pressure=10e3, program=program)
        deck = read_deck(path)
        shape = SlitShell.of(LINEAR)
        assert 4 * deck.volume() == pytest.approx(
            1e9 * (shape.core_volume + shape.shell_volume), rel=5e-3
        )
        (pair,) = deck.all("CONTACT PAIR")
        surfaces = {b.parameters["NAME"] for b in deck.all("SURFACE")}
        assert set(pair.lines[0]) <= surfaces
        (friction,) = deck.all("FRICTION")
        assert float(friction.lines[0][0]) == LINEAR.friction
        (behaviour,) = deck.all("SURFACE BEHAVIOR")
        stiffness = actuator.model.interfaces[0].penalty
        assert float(behaviour.lines[0][0]) == pytest.approx(1e-9 * stiffness)


def shell_stress(model, solution):
    """Largest von Mises stress at quadrature points of the shell in Pa."""
    return float(all_point_fields(model, solution.state)[1].von_mises.max())


@pytest.mark.slow
def test_more_slits_strain_the_shell_less_for_the_same_stroke(ecoflex):
    """Agarwal et al., demo 4, section 7: 13 and 21 slits on 40 mm."""
    found = []
    for slits in (13, 21):
        geometry = ShellReinforcedLinearGeometry(
            family="shell-reinforced-linear", slit_number=slits
        )
        model = shell_linear_model(geometry, ecoflex, resolution=ShellResolution())
        result = follow(model.model, [Point(p) for p in (0.0, 5e3, 10e3)])
        assert result.failure is None
        last = result.solutions[-1]
        found.append((shell_stress(model.model, last), model.measures(last)["displacement"]))
    (few, few_stroke), (many, many_stroke) = found
    # at one pressure it is about the same: with 21 slits it lengthens further
    assert many / many_stroke < 0.75 * few / few_stroke


@pytest.mark.slow
@pytest.mark.parametrize("specimen", [False, True])
def test_the_default_that_bends_reaches_its_limit_free_and_blocked(specimen):
    setup = Workspace.find().setup("shell-reinforced-bending")
    limit = setup.actuator.limits.pressure
    for curves in inflations(setup.actuator, setup.material, limit, Job(), specimen=specimen):
        assert curves is not None
        assert curves.stopped is None
        assert curves.pressure[-1] == pytest.approx(limit)
        driven = curves.measured.get("force", curves.measured["angle"])
        assert np.all(np.diff(driven) > 0)
        assert np.all(curves.measured.get("clearance", driven) > -1e-9)
