"""Families of known plants, as an identification would have found them."""

from __future__ import annotations

from dataclasses import asdict

from rig.control.family import Estimate, Family, IdentifiedLevel, PhysicsCheck, RelayCheck
from rig.control.identify import LevelModel
from rig.control.loop import KNOWN_DELAY_S

NOISE_KPA = 0.005
UNCERTAINTY = 0.02


def integrator(gain: float, delay_s: float) -> LevelModel:
    """A gas without heat, creep or shape: nothing but stiffness and delay."""
    return LevelModel(5.0, 5.0, gain, (), (), delay_s, 0.0)


def realistic(level_kpa: float) -> LevelModel:
    """As the virtual bench is."""
    rise = 1 + 0.02 * level_kpa
    gains = (-0.22 * rise, -1.15 * rise)
    return LevelModel(level_kpa, level_kpa, 2.3 * rise, gains, (0.34, 0.014), KNOWN_DELAY_S, 0.012)


def family_of(*models: LevelModel) -> Family:
    return Family(
        actuator="test",
        bench="virtual-beam",
        board="virtual",
        seed=1,
        created=None,
        versions={"firmware": "abc123"},
        parameters={
            "ambient_pressure_kpa": 101.325,
            "system_volume_ml": 76.0,
            "max_flow_ml_s": 8.0,
            "max_flow_acceleration_ml_s2": 40.0,
        },
        levels=tuple(_level(model) for model in models),
    )


def _level(model: LevelModel) -> IdentifiedLevel:
    terms = range(1, len(model.gains) + 1)
    values = {
        "offset": model.level_kpa,
        "drift": 0.0,
        "direct gain": model.direct,
        **{f"gain {i}": model.gains[i - 1] for i in terms},
        **{f"time constant {i}": model.times_s[i - 1] for i in terms},
        "delay": model.delay_s,
        "backlash": model.backlash_ml,
    }
    estimates = {
        name: Estimate(value=value, deviation=abs(UNCERTAINTY * value), unit="")
        for name, value in values.items()
    }
    deviations = [one.deviation for one in estimates.values()]
    covariance = tuple(
        tuple(d**2 if i == j else 0.0 for j in range(len(deviations)))
        for i, d in enumerate(deviations)
    )
    check = dict.fromkeys(RelayCheck.model_fields, 1.0)
    physics = dict.fromkeys(PhysicsCheck.model_fields, 1.0) | {
        "gas_volume_ml": 76.0 - model.plunger_ml
    }
    return IdentifiedLevel(
        setpoint_kpa=model.level_kpa,
        **asdict(model),
        estimates=estimates,
        covariance=covariance,
        samples=1000,
        noise_kpa=NOISE_KPA,
        fit_percent=98.0,
        whiteness_p=0.5,
        criteria={},
        relay=RelayCheck(**check),
        physics=PhysicsCheck(**physics),
    )
