"""One of many joint bellows pressed flat: contact in both planes of symmetry, and flow."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import Options
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.simulate import folding
from rig.mechanics.simulate.folding import Fold, fold
from rig.mechanics.simulate.latitudes import Drive, Stroke, drive
from rig.spec.actuator import BellowJointGeometry
from rig.spec.workspace import Workspace, library_root

EVA = Workspace(library_root(), is_library=True).material("eva-18")
GEOMETRY = BellowJointGeometry(family="bellow-joint")
COARSE = JointResolution(wall=2, fifth=2)
WAY = np.linspace(0.0, 2.2e-3, 12)


@cache
def folded(contact: bool) -> Fold:
    return fold(GEOMETRY, EVA, WAY, resolution=COARSE, contact=contact)


def test_before_flanks_touch_contact_changes_nothing() -> None:
    free, held = folded(False), folded(True)
    apart = held.pushed.sum(axis=1) == 0
    assert apart[:9].all()
    np.testing.assert_allclose(held.force[apart], free.force[apart], rtol=1e-6)


def test_flanks_that_touch_resist_and_flow() -> None:
    free, held = folded(False), folded(True)
    assert held.pushed[-1].min() > 1.0, "both faces"
    assert held.force[-1] > 5 * free.force[-1]
    assert held.plastic[-1] > 0.05
    assert held.plastic[8] == 0.0


def test_a_long_row_is_one_of_its_bellows() -> None:
    """Middle of a row between discs that is moved by the same share; elastic, apart."""
    row = GEOMETRY.model_copy(update={"bellow_number": 9})
    stroke = Stroke(-9e-3, 1.0)
    moved = drive(row, EVA, stroke, Drive.DEFORMED, steps=2, resolution=COARSE)
    one = fold(GEOMETRY, EVA, np.array([0.0, 0.5e-3, 1e-3]), resolution=COARSE)
    # the row's end bellows give less: its middle is pressed a little more than one of many
    assert moved.greatest[:, 4].max() == pytest.approx(one.von_mises[-1], rel=0.1)


def test_force_is_the_same_in_both_planes(monkeypatch) -> None:
    """What the crest's plane is pressed with, the trough's supports and outer flanks hold."""
    seen = {}
    follow = folding.follow

    def watched(model, *arguments, **named):
        result = follow(model, *arguments, **named)
        seen["model"], seen["end"] = model, result.solutions[-1]
        return result

    monkeypatch.setattr(folding, "follow", watched)
    found = fold(GEOMETRY, EVA, WAY, resolution=COARSE)
    d = seen["model"].discretisation
    held = seen["end"].residual[d.dim * d.nodes_on("trough") + 1].sum()
    assert held + found.pushed[-1, 0] == pytest.approx(found.force[-1], rel=1e-6)


def test_a_fold_that_cannot_be_finished_is_refused_with_where_it_ended(monkeypatch) -> None:
    monkeypatch.setattr(folding, "_OPTIONS", Options(iterations=2, least_step=1.0))
    with pytest.raises(MechanicsError, match="cannot be folded by 2 mm: the path stopped"):
        fold(GEOMETRY, EVA, np.array([0.0, 2e-3]), resolution=COARSE)
