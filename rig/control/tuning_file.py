"""Tuned gains as files: `tuning.json` with everything behind them, and what the board is told."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from rig.control.family import Family
from rig.control.physics import motor_limit_s
from rig.control.tune import Design, Tuning

TUNING_FILE = "tuning.json"
GAINS_FILE = "gains.yaml"


def board_gains(design: Design) -> dict[str, float]:
    """Parameters of the board by their names in the schema."""
    return {
        "proportional_ml_s_kpa": design.gains.proportional,
        "integral_ml_s2_kpa": design.gains.integral,
        "feed_forward": design.feed_forward,
    }


def provenance(family: Family, tuning: Tuning) -> str:
    """Where the gains come from, as lines of comment for a YAML file."""
    design, wanted = tuning.single, tuning.wanted
    levels = ", ".join(f"{level.setpoint_kpa:g}" for level in family.levels)
    volume = 100 * wanted.volume_share
    lines = (
        f"tuned for {family.actuator} on bench {family.bench} ({family.board} board, firmware "
        f"{family.versions.get('firmware', 'unknown')}, seed {family.seed})",
        f"identified at {levels} kPa" + (f" on {family.created}" if family.created else ""),
        f"worst case over these levels and volumes of ±{volume:g} %: gain margin "
        f"{design.gain_db:.1f} dB, phase margin {design.phase_deg:.0f} deg, delay margin "
        f"{1e3 * design.delay_s:.1f} ms",
        f"slowest crossover {design.bandwidth_hz:.2f} Hz, bound by {design.bound_by}",
    )
    return "".join(f"# {line}\n" for line in lines)


def tuning_document(family: Family, tuning: Tuning, step_ml: float) -> dict[str, Any]:
    """Everything that was decided, as JSON values; `step_ml` brings 8 kPa from rest."""
    return {
        "actuator": family.actuator,
        "bench": family.bench,
        "seed": family.seed,
        "created": family.created,
        "versions": family.versions,
        "wanted": asdict(tuning.wanted),
        "single": _design(tuning.single),
        "schedule": {f"{kpa:g}": _design(one) for kpa, one in tuning.schedule.items()},
        "schedule_gain": tuning.schedule_gain,
        "schedule_pays": tuning.schedule_pays,
        "motor": {
            "step_ml": step_ml,
            "limit_s": motor_limit_s(
                step_ml,
                family.parameters["max_flow_ml_s"],
                family.parameters["max_flow_acceleration_ml_s2"],
            ),
        },
    }


def _design(design: Design) -> dict[str, Any]:
    return {
        "parameters": board_gains(design),
        "gain_margin_db": design.gain_db,
        "phase_margin_deg": design.phase_deg,
        "delay_margin_s": design.delay_s,
        "peak_sensitivity": design.peak_sensitivity,
        "bandwidth_hz": design.bandwidth_hz,
        "bound_by": design.bound_by,
        "members": [
            {
                "setpoint_kpa": one.member.setpoint_kpa,
                "volume": one.member.volume,
                **{name: float(value) for name, value in vars(one.margins).items()},
            }
            for one in design.members
        ],
    }
