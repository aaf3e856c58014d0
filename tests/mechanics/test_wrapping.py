"""An arm of two bellows around a cylinder that its free bend would cut into."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import Point, follow
from rig.mechanics.mesh.chamber_row import RowResolution
from rig.mechanics.simulate.chambers import rectangular_bellow_model
from rig.mechanics.simulate.wrapping import Wrap, wrap
from rig.spec.chambers import BellowRectangularGeometry
from rig.spec.workspace import Workspace, library_root

MATERIAL = Workspace(library_root(), is_library=True).material("ninjaflex-85a")
ARM = BellowRectangularGeometry(family="bellow-rectangular", bellow_number=2)
COARSE = RowResolution(along=9e-3, across=9e-3, through=1)
PRESSURES = (5e3, 30e3, 50e3)


@pytest.fixture(scope="module")
def wrapped() -> Wrap:
    return wrap(ARM, MATERIAL, PRESSURES, cylinder_radius=0.2, gap=1e-3, resolution=COARSE)


def test_an_arm_is_free_until_it_touches_and_grips_more_and_more_then(wrapped: Wrap) -> None:
    assert wrapped.failure is None
    assert wrapped.grip[0] == 0.0
    assert wrapped.contact[0] == 0.0
    assert 0 < wrapped.grip[1] < wrapped.grip[2]
    assert 0 < wrapped.contact[2] < 1


def test_the_cylinder_takes_bend_and_volume_from_the_arm(wrapped: Wrap) -> None:
    free = rectangular_bellow_model(ARM, MATERIAL, resolution=COARSE)
    rest, *found = follow(free.model, [Point(p) for p in (0.0, *PRESSURES)]).solutions
    angle = np.array([free.angle(s.state) for s in found])
    volume = np.array([free.volume(s) - free.volume(rest) for s in found])
    assert wrapped.angle[0] == pytest.approx(angle[0], rel=1e-5)
    assert wrapped.volume[0] == pytest.approx(volume[0], rel=1e-5)
    assert np.all(wrapped.angle[1:] < 0.999 * angle[1:])
    assert np.all(wrapped.volume[1:] < volume[1:])


@pytest.mark.parametrize(("radius", "gap"), [(0.0, 1e-3), (0.06, -1e-3)])
def test_an_impossible_cylinder_is_refused(radius: float, gap: float) -> None:
    with pytest.raises(MechanicsError, match="impossible: expected"):
        wrap(ARM, MATERIAL, PRESSURES, cylinder_radius=radius, gap=gap, resolution=COARSE)
