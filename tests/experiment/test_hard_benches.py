"""Runs on the benches that are hard in other ways than the default one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from .conftest import SHORT, make_request, take

ONE_SWEEP = {
    "kind": "protocol",
    "name": "one-sweep",
    "deformation": SHORT["deformation"]
    | {"pressures": {"start": 0, "stop": 6, "step": 6}, "descending_repeats": 0},
}


@pytest.mark.parametrize("bench", ["virtual-harsh", "virtual-water"])
def test_pressures_are_held_on_a_hard_bench(bench: str, tmp_path: Path) -> None:
    run = take(tmp_path / "run", make_request(ONE_SWEEP, bench=bench))
    assert run.outcome.stop.exit_status == "success", run.outcome.stop.reason
    assert not [e for e in run.reader.events() if e.level == "warning"]
    points = run.reader.points()
    assert [point.key.target_kpa for point in points] == [0, 6]
    assert points[1].settled_s is not None
    held = [
        sample.pressure_kpa
        for sample in run.truth()
        if points[1].measured_from_s <= sample.time_s <= points[1].measured_to_s
    ]
    assert np.mean(held) == pytest.approx(points[1].pressure_kpa, abs=3 * points[1].pressure_u_kpa)
    assert np.mean(held) == pytest.approx(6, abs=0.05)
    # there is gas to follow in one of them only
    assert bool(run.reader.gas()) == (bench == "virtual-harsh")
