"""Identification against plants that are known, simulated by other means."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.control.errors import ControlError
from rig.control.excitation import (
    Segment,
    duration_s,
    fastest_stroke,
    pseudo_random,
    ramp,
    step,
)
from rig.control.family import read_family
from rig.control.identify import (
    Fit,
    LevelModel,
    Mode,
    Recording,
    fit_percent,
    identify_level,
    play,
    predict,
    whiteness,
)
from rig.control.physics import GasColumn, compression_ml, motor_limit_s
from rig.control.relay import relay_point

TRUE = LevelModel(
    level_kpa=5.0,
    plunger_ml=3.0,
    direct=2.0,
    gains=(-0.25, -0.75),
    times_s=(0.35, 0.03),
    delay_s=0.006,
    backlash_ml=0.012,
)
NOISE_KPA = 0.005
FINE_S = 0.001
SAMPLE = 20
ACCELERATION = 40.0


def swept(segments: list[Segment]) -> np.ndarray:
    """Plunger positions every millisecond of a drive with limited acceleration."""
    flow, position, positions = 0.0, 0.0, [0.0]
    for segment in segments:
        for _ in range(round(segment.duration_s / FINE_S)):
            change = np.clip(segment.flow_ml_s - flow, -ACCELERATION * FINE_S, None)
            flow += min(change, ACCELERATION * FINE_S)
            position += flow * FINE_S
            positions.append(position)
    return np.array(positions)


def recorded(
    model: LevelModel, segments: list[Segment], seed: int = 1, noise: float = NOISE_KPA
) -> Recording:
    """What a board would report of `model`, computed by python-control on a fine grid."""
    plunger = swept(segments)
    time_s = FINE_S * np.arange(plunger.size)
    felt = play(plunger, model.backlash_ml)
    delayed = np.interp(time_s - model.delay_s, time_s, felt - felt[0])
    system = control.tf([model.direct], [1])
    for gain, constant in zip(model.gains, model.times_s, strict=True):
        system = system + control.tf([gain], [constant, 1])
    for gain, w, z in model.modes:
        system = system + control.tf([gain], [1 / w**2, 2 * z / w, 1])
    pressure = control.forced_response(system, time_s, delayed).outputs + model.level_kpa
    rng = np.random.default_rng(seed)
    shown = pressure[::SAMPLE] + rng.normal(0, noise, pressure[::SAMPLE].size)
    return Recording(time_s[::SAMPLE], plunger[::SAMPLE], shown)


STROKE = fastest_stroke(0.4, 8.0, ACCELERATION)


def excitation(bits: int = 6, seed: int = 1) -> list[Segment]:
    return [*step(STROKE, 3.0), *ramp(STROKE, 10.0, 3.0), *pseudo_random(STROKE, bits, seed)]


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(TRUE, excitation())


@pytest.fixture(scope="module")
def fit(recording: Recording) -> Fit:
    return identify_level(recording)


def test_a_known_plant_is_found_again_within_its_stated_uncertainty(fit: Fit) -> None:
    assert len(fit.model.gains) == 2  # as many terms as the plant has, by the criterion
    truth = dict(
        zip(
            [p.name for p in fit.parameters[2:]],
            [TRUE.direct, *TRUE.gains, *TRUE.times_s, TRUE.delay_s, TRUE.backlash_ml],
            strict=True,
        )
    )
    for parameter in fit.parameters[2:]:
        assert abs(parameter.value - truth[parameter.name]) < 4 * parameter.deviation, parameter
    assert fit.model.static_gain == pytest.approx(TRUE.static_gain, rel=0.01)
    assert fit.residual_deviation_kpa == pytest.approx(NOISE_KPA, rel=0.1)
    assert fit.whiteness_p > 0.01


def test_the_swing_of_a_liquid_is_found_again() -> None:
    true = LevelModel(
        5.0, 3.0, 40.0, (-0.6,), (1.0,), 0.006, 0.011, modes=(Mode(-37.0, 26.0, 0.09),)
    )
    slow = fastest_stroke(0.15, 0.4, ACCELERATION)
    segments = [*step(slow, 3.0), *pseudo_random(slow, 5, 1)]
    fit = identify_level(recorded(true, segments), most_terms=1, modes=1)
    (mode,) = fit.model.modes
    assert mode.frequency == pytest.approx(26.0, rel=0.01)
    assert mode.damping == pytest.approx(0.09, rel=0.05)
    assert fit.model.static_gain == pytest.approx(true.static_gain, rel=0.03)
    # between samples the plunger is guessed; 0.1 µL of it are 4 Pa: more than noise is left
    assert fit.fit_percent > 98
    assert {p.name: p.unit for p in fit.parameters}["mode frequency 1"] == "rad/s"
    relay = recorded(true, [Segment(0.2, 0.4), Segment(0.2, -0.4)] * 5, seed=2)
    assert fit_percent(relay.pressure_kpa - predict(fit, relay), relay.pressure_kpa) > 94
    omega = np.geomspace(1.0, 100.0, 20)
    rational = fit.model.state_space()(1j * omega) * np.exp(-1j * omega * fit.model.delay_s)
    np.testing.assert_allclose(fit.model.response(omega), rational, rtol=1e-9)
    doubled = fit.model.scaled(2.0)
    np.testing.assert_allclose(doubled.response(omega), 2 * fit.model.response(omega), rtol=1e-12)


def test_the_stated_deviations_are_those_of_repeated_experiments() -> None:
    one_term = LevelModel(5.0, 3.0, 1.3, (-0.3,), (0.35,), 0.006, 0.012)
    segments = excitation(bits=3)
    scores = []
    for seed in range(10):
        fit = identify_level(recorded(one_term, segments, seed), most_terms=1)
        found = {p.name: p for p in fit.parameters}
        truth = {"direct gain": 1.3, "gain 1": -0.3, "time constant 1": 0.35, "delay": 0.006}
        scores += [(found[n].value - v) / found[n].deviation for n, v in truth.items()]
    # of 40 dependent draws: twice as much or half would be a wrong covariance
    assert 0.6 < float(np.std(scores)) < 1.6


def test_a_model_with_too_few_terms_leaves_a_residual_that_is_not_white(
    recording: Recording, fit: Fit
) -> None:
    poor = identify_level(recording, most_terms=0)
    assert poor.whiteness_p < 1e-6
    assert poor.fit_percent < fit.fit_percent - 1


def test_whiteness_is_that_of_ljung_and_box() -> None:
    diagnostic = pytest.importorskip("statsmodels.stats.diagnostic", reason="an independent check")
    residual = np.random.default_rng(3).normal(size=200).cumsum() + 4.0
    residual[1:] -= 0.95 * residual[:-1]
    theirs = float(diagnostic.acorr_ljungbox(residual, lags=[7])["lb_pvalue"].iloc[0])
    assert 1e-6 < theirs < 0.9
    assert whiteness(residual, lags=7) == pytest.approx(theirs, rel=1e-9)


def test_another_recording_of_the_same_plant_is_foretold(fit: Fit) -> None:
    other = recorded(TRUE, pseudo_random(STROKE, 5, 9), seed=7)
    unseen = other.pressure_kpa - predict(fit, other)
    assert float(np.std(unseen)) == pytest.approx(NOISE_KPA, rel=0.15)
    assert fit_percent(unseen, other.pressure_kpa) > 95


def test_white_noise_is_white_and_a_moving_average_is_not() -> None:
    noise = np.random.default_rng(3).normal(size=2000)
    assert whiteness(noise) > 0.01
    assert whiteness(np.convolve(noise, [0.5, 0.5], "valid")) < 1e-6


def test_fit_is_one_less_the_normalised_error() -> None:
    measured = np.array([0.0, 1.0, 2.0, 3.0])
    assert fit_percent(np.zeros(4), measured) == 100
    assert fit_percent(measured - measured.mean(), measured) == pytest.approx(0)


@pytest.mark.parametrize("damage", ["short", "unsorted", "still"])
def test_a_recording_that_says_nothing_is_refused(damage: str) -> None:
    time_s = np.arange(100) * 0.02
    plunger = np.linspace(0, 1, 100)
    if damage == "short":
        time_s, plunger = time_s[:20], plunger[:20]
    elif damage == "unsorted":
        time_s[50] = time_s[49]
    else:
        plunger = np.ones(100)
    with pytest.raises(ControlError):
        Recording(time_s, plunger, np.zeros(time_s.size))


# --- excitations ---------------------------------------------------------------------------------


@settings(max_examples=40)
@given(
    volume=st.floats(0.05, 2.0),
    flow=st.floats(0.5, 20.0),
    acceleration=st.floats(5.0, 500.0),
    bits=st.integers(3, 8),
    seed=st.integers(0, 1000),
)
def test_every_excitation_brings_the_plunger_home_within_the_drives_limits(
    volume: float, flow: float, acceleration: float, bits: int, seed: int
) -> None:
    stroke = fastest_stroke(volume, flow, acceleration)
    assert stroke.flow_ml_s <= flow * (1 + 1e-9)
    assert stroke.flow_ml_s / acceleration <= stroke.duration_s * (1 + 1e-9)
    for segments in (step(stroke, 1.0), ramp(stroke, 5.0, 1.0), pseudo_random(stroke, bits, seed)):
        moved = np.cumsum([s.duration_s * s.flow_ml_s for s in segments])
        assert moved[-1] == pytest.approx(0, abs=1e-9)
        assert np.all(moved > -1e-9)
        assert np.all(moved < 2 * volume + 1e-9)


def test_the_pseudo_random_sequence_has_the_autocorrelation_of_its_kind() -> None:
    bits = 6
    moves = pseudo_random(STROKE, bits, 5)
    positions = np.cumsum([s.duration_s * s.flow_ml_s for s in moves])[::2] / STROKE.volume_ml
    sequence = 2 * np.round(positions[:-1]) - 1
    length = 2**bits - 1
    assert sequence.size == length
    periodic = [float(sequence @ np.roll(sequence, k)) for k in range(1, length)]
    assert periodic == pytest.approx([-1.0] * (length - 1))
    assert duration_s(moves) == pytest.approx((length + 1) * STROKE.clock_s)


def test_what_is_no_excitation_is_refused() -> None:
    with pytest.raises(ControlError, match="positive"):
        fastest_stroke(0.0, 1.0, 1.0)
    with pytest.raises(ControlError, match="bits"):
        pseudo_random(STROKE, 2, 1)


# --- relay and physics ---------------------------------------------------------------------------


def test_a_limit_cycle_gives_the_response_at_its_frequency() -> None:
    omega, gain, phase = 13.0, 1.4, np.radians(7.0)
    t = np.arange(0, 6, 0.02)
    x = 3 + 0.2 * np.sin(omega * t) + 0.02 * np.sin(3 * omega * t)
    rng = np.random.default_rng(1)
    p = 5 + 0.01 * t + gain * 0.2 * np.sin(omega * t + phase) + rng.normal(0, 0.004, t.size)
    point = relay_point(Recording(t, x, p))
    assert point.omega == pytest.approx(omega, rel=2e-3)
    assert abs(point.response) == pytest.approx(gain, rel=0.02)
    assert np.angle(point.response) == pytest.approx(phase, abs=0.02)
    assert abs(abs(point.response) - gain) < 4 * point.deviation


def test_a_relay_that_did_not_oscillate_is_refused() -> None:
    t = np.arange(0, 2, 0.02)
    with pytest.raises(ControlError, match="oscillations"):
        relay_point(Recording(t, t, t))


def test_stiffness_is_the_slope_of_the_gas_law() -> None:
    ambient, gauge, volume, compliance = 101.3, 5.0, 70.0, 0.4
    column = GasColumn(gauge, ambient, volume, compliance)
    for exponent, stiffness in ((1.0, column.isothermal), (1.4, column.quick)):
        constant = (ambient + gauge) * volume**exponent
        pushed = 1e-4
        dp = 0.0
        for _ in range(200):  # damped fixed point of P V^n = constant
            there = constant / (volume - pushed + compliance * dp) ** exponent - ambient - gauge
            dp = 0.5 * (dp + there)
        assert stiffness == pytest.approx(dp / pushed, rel=1e-3)


def test_compression_follows_boyle() -> None:
    moved = compression_ml(0.0, 8.0, 101.325, 75.0, 2.0)
    left = 75.0 - (moved - 2.0)
    assert (101.325 + 8.0) * left == pytest.approx(101.325 * 75.0)


@pytest.mark.parametrize(("volume", "expected"), [(8.0, 8 / 8 + 8 / 40), (0.4, 2 * 0.1)])
def test_the_motor_limit_is_a_trapezoid_of_speed(volume: float, expected: float) -> None:
    assert motor_limit_s(volume, 8.0, 40.0) == pytest.approx(expected)


def test_a_file_that_is_no_identification_is_named(tmp_path) -> None:
    (tmp_path / "identification.json").write_text("{}")
    with pytest.raises(ControlError, match=r"identification\.json.*actuator"):
        read_family(tmp_path)
    with pytest.raises(ControlError, match="no identification can be read"):
        read_family(tmp_path / "nothing.json")
