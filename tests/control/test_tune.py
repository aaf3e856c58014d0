"""Margins against closed forms and poles; designs against what they promise."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.control.errors import ControlError
from rig.control.loop import (
    FILTER_TICKS,
    REPORT_AHEAD_S,
    TICK_S,
    Gains,
    closed_loop,
    margins,
    plant,
)
from rig.control.tune import Wanted, design, margins_of_draws, tune
from rig.control.tuning_file import board_gains, provenance
from tests.control.families import NOISE_KPA, UNCERTAINTY, family_of, integrator, realistic

CORE = Path(__file__).resolve().parents[2] / "firmware/rig_mega/src/core"
GAINS = Gains(25.0, 60.0)
MODEL = realistic(8.0)


def radius(model, gains: Gains) -> float:
    """Of the outermost pole of the closed loop: below 1 it is stable."""
    followed, _ = closed_loop(model, gains)
    return float(np.max(np.abs(followed.poles())))


def test_tick_and_filter_are_the_firmwares() -> None:
    tick = re.search(r"kTickMs = (\d+);", (CORE / "tick.h").read_text())
    taps = re.search(r"kFilterTicks = (\d+);", (CORE / "transducer.h").read_text())
    assert tick is not None
    assert taps is not None
    assert float(tick[1]) / 1e3 == TICK_S
    assert int(taps[1]) == FILTER_TICKS


@pytest.mark.parametrize("delay_s", [0.006, 0.0137])
def test_margins_of_an_integrator_with_delay_have_closed_forms(delay_s: float) -> None:
    gain, kp = 1.2, 20.0
    found = margins(integrator(gain, delay_s), Gains(kp, 0.0))
    # held for a tick, and a tick late by the report: w = kp K, phase 90 deg less w times the delay
    late = delay_s - REPORT_AHEAD_S + TICK_S / 2
    crossover = kp * gain
    assert found.crossover == pytest.approx(crossover, rel=1e-3)
    assert found.phase_deg == pytest.approx(90 - math.degrees(crossover * late), abs=0.1)
    assert found.phase_crossover == pytest.approx(math.pi / 2 / late, rel=0.01)
    assert found.gain == pytest.approx(math.pi / 2 / late / crossover, rel=0.02)
    # at 3 dB more gain, where the crossover is further up
    fast = crossover * 10 ** (3 / 20)
    assert found.delay_s == pytest.approx(math.pi / 2 / fast - late, rel=0.05)


def test_the_plant_integrates_a_flow_with_its_delay() -> None:
    import control

    stiffness, delay_s = 1.3, 0.0075
    time_s = TICK_S * np.arange(200)
    pressure = control.step_response(plant(integrator(stiffness, delay_s)), time_s).outputs
    expected = stiffness * np.maximum(time_s - (delay_s - REPORT_AHEAD_S), 0)
    assert np.max(np.abs(pressure - expected)) < stiffness * TICK_S / 2


def test_the_gain_margin_is_where_the_poles_leave_the_circle() -> None:
    found = margins(MODEL, GAINS)
    for factor, stable in ((0.97, True), (1.03, False)):
        by = factor * found.gain
        gains = Gains(by * GAINS.proportional, by * GAINS.integral)
        assert (radius(MODEL, gains) < 1) == stable


def test_the_delay_margin_is_where_the_poles_leave_the_circle() -> None:
    found = margins(MODEL, GAINS)
    quick = Gains(1.4125 * GAINS.proportional, 1.4125 * GAINS.integral)  # 3 dB
    for factor, stable in ((0.93, True), (1.07, False)):
        late = replace(MODEL, delay_s=MODEL.delay_s + factor * found.delay_s)
        assert (radius(late, quick) < 1) == stable
        assert radius(replace(MODEL, delay_s=MODEL.delay_s + 0.93 * found.delay_s), GAINS) < 1


def test_a_design_keeps_its_margins_for_every_level_and_volume() -> None:
    family = family_of(realistic(1.5), realistic(5.0), realistic(10.0))
    wanted = Wanted(noise_flow_ml_s=1.0)
    made = design(family, family.levels, wanted)
    assert len(made.members) == 9
    for one in made.members:
        found = margins(one.member.model, made.gains)
        assert found.gain_db >= wanted.gain_db - 1e-6
        assert found.phase_deg >= wanted.phase_deg
        assert found.peak_sensitivity <= wanted.peak_sensitivity
        assert radius(one.member.model, made.gains) < 1
    assert made.worst.setpoint_kpa == 10.0
    assert made.worst.volume == pytest.approx(0.7)
    # and it is not slower than it must be
    faster = Gains(made.gains.proportional / 0.85, made.gains.integral / 0.85)
    found = margins(made.worst.model, faster)
    assert found.gain_db < wanted.gain_db or found.peak_sensitivity > wanted.peak_sensitivity


def test_noise_bounds_the_gain_where_margins_would_not() -> None:
    family = family_of(realistic(5.0))
    made = design(family, family.levels, Wanted(noise_flow_ml_s=0.05))
    assert made.gains.proportional == pytest.approx(0.05 / NOISE_KPA)
    assert made.bound_by == "noise of the drive"


def test_a_wanted_bandwidth_is_that_of_the_slowest_plant() -> None:
    family = family_of(realistic(1.5), realistic(10.0))
    made = design(family, family.levels, Wanted(bandwidth_hz=2.0))
    assert made.bandwidth_hz == pytest.approx(2.0, rel=0.05)
    assert made.gain_db > 8
    with pytest.raises(ControlError, match=r"At most 5\.\d Hz is possible"):
        design(family, family.levels, Wanted(bandwidth_hz=30.0))


def test_the_integral_gain_makes_a_pure_integrator_critically_damped() -> None:
    family = family_of(integrator(1.0, REPORT_AHEAD_S))
    wanted = Wanted(volume_share=0.0, noise_flow_ml_s=5 * NOISE_KPA)
    made = design(family, family.levels, wanted)
    assert made.gains.integral == pytest.approx(5.0**2 / 4, rel=0.01)


def test_gains_stay_within_the_boards_parameters() -> None:
    family = family_of(realistic(5.0))
    made = design(family, family.levels, Wanted(most=Gains(3.0, 1.0)))
    assert made.gains == Gains(3.0, 1.0)


def test_a_schedule_pays_where_the_levels_differ_and_margins_bind() -> None:
    wanted = Wanted(noise_flow_ml_s=10.0)
    alike = tune(family_of(realistic(5.0), realistic(5.5)), wanted)
    assert not alike.schedule_pays
    differing = tune(family_of(realistic(1.0), realistic(5.0).scaled(3.0)), wanted)
    # scheduled, the slow plant may be driven as near to its margins as the fast one
    assert differing.schedule_pays
    assert set(differing.schedule) == {1.0, 5.0}


def test_impossible_margins_and_volumes_are_told() -> None:
    family = family_of(realistic(5.0))
    with pytest.raises(ControlError, match="no gains keep"):
        design(family, family.levels, Wanted(phase_deg=100.0))
    with pytest.raises(ControlError, match="volumes"):
        tune(family, Wanted(volume_share=1.0))


def test_margins_of_likely_plants_scatter_about_those_of_the_estimate() -> None:
    family = family_of(realistic(8.0))
    made = design(family, family.levels, Wanted())
    drawn = margins_of_draws(family.levels[0], made.worst, made.gains, 20, seed=1)
    decibels = np.array([m.gain_db for m in drawn])
    assert decibels.mean() == pytest.approx(made.gain_db, abs=0.5)
    assert 0.5 * UNCERTAINTY < decibels.std() / 8.686 < 5 * UNCERTAINTY


def test_gains_are_named_as_the_board_names_them_and_say_where_they_come_from() -> None:
    family = family_of(realistic(5.0))
    tuning = tune(family, Wanted())
    given = board_gains(tuning.single)
    assert given["proportional_ml_s_kpa"] == tuning.single.gains.proportional
    boyle = (101.325 + 5.0) / 71.0
    assert given["feed_forward"] == pytest.approx(
        boyle / abs(realistic(5.0).response(np.array([1.0]))[0])
    )
    text = provenance(family, tuning)
    assert all(line.startswith("# ") for line in text.splitlines())
    assert "firmware abc123" in text
    assert f"gain margin {tuning.single.gain_db:.1f} dB" in text
