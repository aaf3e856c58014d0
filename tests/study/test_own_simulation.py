"""The published Box-Behnken study again, from our own finite elements (dead pressure)."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from rig.study.optimum import Goal, optimum
from rig.study.surface import fit_surface

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "mechanics"))
from auysakul import FOLDER, displacements, table_2
from test_surface import FACTORS, printed_anova

from rig.spec.actuator import BellowAxisymmetricGeometry

AT_50_KPA = np.array([5e3, 15e3, 30e3, 50e3])


@pytest.mark.slow
@pytest.mark.skipif(not FOLDER.is_dir(), reason="the shared reference data are not here")
def test_our_thirteen_cases_lead_to_the_published_conclusions_and_a_better_design() -> None:
    """All terms significant as printed; sums of squares within 10 %.

    F is not within 2.5 %, but 5 to 20 % above the print: our displacements differ by 0.05 mm RMS,
    and the residual that F divides by is 0.3 mm only, 12 % less than the printed one.
    """
    designs = table_2()
    designs += [designs[-1]] * 2  # the centre is run three times in the plan
    known: dict[str, float] = {}
    for design in designs:
        if design.name not in known:
            known[design.name] = displacements(
                design.geometry, follower=False, pressures=AT_50_KPA
            )[-1]
    points = np.array(
        [
            [g.wall_thickness * 1e3, g.bellow_number, g.divided_ratio]
            for g in (d.geometry for d in designs)
        ]
    )
    values = np.array([known[d.name] for d in designs])
    surface = fit_surface("D", FACTORS, points, values)
    for name, (printed, f) in printed_anova("D").items():
        got = surface.source(name)
        if f is not None:
            assert got.sum_of_squares == pytest.approx(printed, rel=0.1)
            assert got.f == pytest.approx(f, rel=0.2)
            assert got.p is not None
            assert got.p < 0.05
    best = optimum(surface, Goal.MAXIMISE)
    wall, count, ratio = best.actual
    geometry = BellowAxisymmetricGeometry.model_validate(
        {
            "family": "bellow-axisymmetric",
            "wall_thickness": f"{wall} mm",
            "bellow_number": round(count),
            "divided_ratio": ratio,
        }
    )
    found = displacements(geometry, follower=False, pressures=AT_50_KPA)[-1]
    assert found > 19.02  # trial 5, printed
    assert found > max(values)
