"""Moulds and what is cast in them fill their blocks, and share no place."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.cad.construct import Combined, Solid
from rig.mechanics.cad.errors import CadError
from rig.mechanics.cad.facets import triangulate
from rig.mechanics.cad.moulds import WALL, moulds_of
from rig.mechanics.cad.parts import box, parts_of
from rig.mechanics.cad.stl import is_watertight, printable, volume
from rig.mechanics.chambers import ChamberRow, Rectangle
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricBellow
from rig.spec.actuator import BellowAxisymmetricGeometry
from rig.spec.chambers import MultiChamberBendingGeometry, MultiChamberLinearGeometry
from rig.spec.shells import ShellReinforcedBendingGeometry

pytest.importorskip("manifold3d", reason="manifold3d is not installed")

BENDING = MultiChamberBendingGeometry(family="multi-chamber-bending")
LINEAR = MultiChamberLinearGeometry(family="multi-chamber-linear", chamber_number=2)
SHELL = ShellReinforcedBendingGeometry(family="shell-reinforced-bending")
AXISYMMETRIC = BellowAxisymmetricGeometry(family="bellow-axisymmetric", bellow_number=3)


def _volume(solid: Solid, chord: float = 2e-5) -> float:
    return volume(triangulate(solid, chord))


def _moulds(geometry) -> dict[str, Solid]:
    return {part.name: part.solid for part in moulds_of(geometry)}


def _box(piece: Solid) -> np.ndarray:
    surface = triangulate(piece, 2e-5).reshape(-1, 3)
    return np.array([surface.min(axis=0), surface.max(axis=0)])


@pytest.mark.parametrize("geometry", [BENDING, LINEAR, AXISYMMETRIC, SHELL])
def test_pieces_are_printable(geometry) -> None:
    for piece in _moulds(geometry).values():
        assert is_watertight(printable(triangulate(piece, 2e-5)))


@pytest.mark.parametrize("geometry", [AXISYMMETRIC, SHELL])
def test_jaws_and_core_leave_the_casting_its_place(geometry) -> None:
    soft = parts_of(geometry)[0].solid
    left = Combined((soft,), tuple(_moulds(geometry).values()))
    assert _volume(left) == pytest.approx(_volume(soft), rel=1e-6)


@pytest.mark.parametrize("geometry", [BENDING, LINEAR])
def test_either_tray_leaves_its_half_of_the_casting_its_place(geometry) -> None:
    trays, soft = _moulds(geometry), parts_of(geometry)[0].solid
    joint = _box(trays["upper-tray"])[0, 2] + WALL
    for name, low, high in (("upper-tray", -1.0, joint), ("lower-tray", joint, 1.0)):
        half = Combined((soft,), (box(Rectangle(1.0, low, high), -1.0, 1.0),))
        assert 0.4 < _volume(half) / _volume(soft) < 0.6
        assert _volume(Combined((half,), (trays[name],))) == pytest.approx(_volume(half), rel=1e-6)


@pytest.mark.parametrize("geometry", [BENDING, LINEAR])
def test_two_trays_hold_a_row_of_chambers_and_no_drop_more(geometry) -> None:
    trays = _moulds(geometry)
    blocks = sum(
        float(np.prod(np.diff(_box(trays[name]), axis=0))) for name in ("upper-tray", "lower-tray")
    )
    castings = blocks - _volume(trays["upper-tray"]) - _volume(trays["lower-tray"])
    assert castings == pytest.approx(_volume(parts_of(geometry)[0].solid), rel=1e-9)


def test_trays_meet_at_the_middle_of_the_chambers_and_open_away_from_it() -> None:
    row = ChamberRow.of(BENDING)
    joint = row.layer + BENDING.wall_thickness + BENDING.chamber_height / 2
    trays = _moulds(BENDING)
    upper, lower = _box(trays["upper-tray"])[:, 2], _box(trays["lower-tray"])[:, 2]
    np.testing.assert_allclose(upper, [joint - WALL, row.height], atol=1e-12)
    np.testing.assert_allclose(lower, [row.layer, joint + WALL], atol=1e-12)


def test_the_layer_has_its_own_tray() -> None:
    row, tray = ChamberRow.of(BENDING), _moulds(BENDING)["layer-tray"]
    block = float(np.prod(np.diff(_box(tray), axis=0)))
    layer = row.end * 2 * row.half_width * row.layer
    assert block - _volume(tray) == pytest.approx(layer, rel=1e-9)
    assert "layer-tray" not in _moulds(LINEAR)


def test_jaws_and_core_hold_an_axisymmetric_bellow() -> None:
    shape, pieces = AxisymmetricBellow.of(AXISYMMETRIC), _moulds(AXISYMMETRIC)
    low, high = _box(pieces["left-jaw"])[0], _box(pieces["right-jaw"])[1]
    np.testing.assert_allclose([low[2], high[2]], [0.0, shape.height], atol=1e-12)
    jaws = sum(_volume(pieces[f"{side}-jaw"], 5e-6) for side in ("left", "right"))
    held = float(np.prod(high - low)) - jaws
    assert held == pytest.approx(shape.soft_volume + shape.cavity_volume, rel=1e-3)
    base = _box(pieces["base"])
    plate = float(np.prod(np.diff(base[:, :2], axis=0))) * WALL
    assert _volume(pieces["base"], 5e-6) - plate == pytest.approx(shape.cavity_volume, rel=1e-3)
    assert base[1, 2] == pytest.approx(shape.height - shape.wall)


def test_jaws_and_pin_hold_the_core_of_a_slit_shell_and_no_drop_more() -> None:
    pieces = _moulds(SHELL)
    low, high = _box(pieces["lower-jaw"])[0], _box(pieces["upper-jaw"])[1]
    assert high[0] - low[0] == pytest.approx(SHELL.total_length)
    plate = Combined((box(Rectangle(high[1], low[2], high[2]), low[0] - WALL, low[0]),))
    inside = float(np.prod(high - low)) + _volume(plate)
    held = inside - sum(_volume(piece) for piece in pieces.values())
    assert held == pytest.approx(_volume(parts_of(SHELL)[0].solid), rel=1e-9)


def test_what_is_printed_has_no_mould(default_geometry) -> None:
    with pytest.raises(CadError, match="no mould for a bellow-bending: it is printed"):
        moulds_of(default_geometry)
