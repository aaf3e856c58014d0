"""What an experiment is asked to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date

from rig.experiment.errors import ExperimentError
from rig.experiment.plan import Plan
from rig.experiment.prepare import parameters_for
from rig.experiment.program import TrialPlan
from rig.spec.workspace import BenchCalibrations, Setup


def expired_calibrations(calibrations: BenchCalibrations, today: date) -> str | None:
    """Which calibrations have run out, in a sentence; None if all hold."""
    expired = calibrations.expired(today)
    if not expired:
        return None
    listed = ", ".join(f"{role.replace('_', ' ')} (until {day})" for role, day in expired.items())
    return f"the calibration of {listed} is no longer valid on {today}."


def require_valid_calibrations(calibrations: BenchCalibrations, today: date) -> None:
    """Raise ExperimentError if a calibration has expired; nothing has been moved yet."""
    why = expired_calibrations(calibrations, today)
    if why is not None:
        raise ExperimentError(
            f"{why} Nothing was moved. Calibrate again (`rig calibrate --help`) and name the new "
            "file in the bench of a new run, or use it all the same with --expired-calibrations: "
            "the log and the report will say so."
        )


@dataclass(frozen=True)
class RunRequest:
    """Validated specs, the plan made from them, and what the specs do not hold."""

    setup: Setup
    plan: Plan
    seed: int
    cavity_volume: float
    """Of the undeformed actuator in m3, for the controller's feed-forward."""
    created: str | None = None
    """ISO date and time on a real bench; None in simulated time."""
    enclosures: Mapping[str, str] = field(default_factory=dict)
    """Texts to attach to the log besides the specs, by file name."""
    trials: tuple[TrialPlan, ...] = ()
    """Those of the protocol, planned; they follow the sweeps."""
    cautions: tuple[str, ...] = ()
    """What whoever reads the run must know of how it was begun; the log warns of it."""

    def board_parameters(self) -> dict[str, float]:
        """What the board is told before it moves; raises LimitError for what it would refuse."""
        return parameters_for(self.setup, self.cavity_volume)
