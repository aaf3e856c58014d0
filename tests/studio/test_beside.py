"""Two designs beside each other: only what differs was typed, and figures at a common pressure."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rig.spec.workspace import Workspace, library_root
from rig.studio.beside import NONE, Design, compared
from rig.studio.curves import Beam
from rig.studio.design import LIMIT, Draft, check, open_draft

LIBRARY = Workspace(library_root())
DEFAULT = open_draft(LIBRARY, "bellow-bending")


def design(draft: Draft) -> tuple[Design, Beam]:
    checked = check(draft, LIBRARY)
    assert checked.spec is not None
    assert checked.material is not None
    beam = Beam.of(checked.spec, checked.material)
    assert beam is not None
    return Design(draft, beam.curve(), beam.mass_g), beam


def test_only_what_differs_is_listed_with_figures_at_the_lower_top() -> None:
    pinned, pinned_beam = design(DEFAULT)
    thin, thin_beam = design(
        DEFAULT.with_value("geometry.wall_thickness", "1.3 mm").with_value(LIMIT, "8 kPa")
    )
    rows = {row.what: (row.pinned, row.now) for row in compared(pinned, thin)}
    assert list(rows)[:2] == ["pressure limit", "wall thickness"]
    assert rows["wall thickness"] == ("1.5 mm", "1.3 mm")
    top = thin_beam.top_pressure
    assert top < pinned_beam.top_pressure
    for (what, unit), at in zip(
        (("bending angle", "deg"), ("blocked force", "g")),
        (lambda b: b.angle_deg, lambda b: b.force_g),
        strict=True,
    ):
        one, other = rows[f"{what} at {top / 1e3:.3g} kPa"]
        assert float(one.removesuffix(unit)) == pytest.approx(at(pinned_beam.bent(top)), rel=2e-3)
        assert float(other.removesuffix(unit)) == pytest.approx(at(thin_beam.bent(top)), rel=2e-3)
    heavy, light = (float(text.removesuffix("g")) for text in rows["mass of the soft part"])
    assert heavy > light > 0


def test_the_same_design_differs_in_nothing() -> None:
    one, _ = design(DEFAULT)
    assert all(row.pinned == row.now for row in compared(one, one))


def test_a_bare_number_is_shown_in_the_unit_that_it_is_taken_in() -> None:
    one, _ = design(DEFAULT)
    bare, _ = design(DEFAULT.with_value("geometry.wall_thickness", "1.4").with_value(LIMIT, "8"))
    rows = {row.what: row.now for row in compared(one, bare)}
    assert rows["wall thickness"] == "1.4 mm"
    assert rows["pressure limit"] == "8 kPa"
    same, _ = design(DEFAULT.with_value("geometry.wall_thickness", "1.5"))
    assert "wall thickness" not in {row.what for row in compared(one, same)}


def test_what_a_model_does_not_know_is_left_blank() -> None:
    one, _ = design(DEFAULT)
    silent = replace(one, curve=replace(one.curve, force_g=None), mass_g=None)
    blanks = [row for row in compared(one, silent) if row.now == NONE]
    assert len(blanks) == 2
