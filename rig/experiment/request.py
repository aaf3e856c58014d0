"""From specs to a request that may be carried out: calibrations, plan, limits of the board."""

from __future__ import annotations

from datetime import date, datetime

from rig.experiment.errors import ExperimentError
from rig.experiment.plan import make_plan
from rig.experiment.program import plan_trials
from rig.experiment.setup import RunRequest, expired_calibrations, require_valid_calibrations
from rig.mechanics.outline import body_of
from rig.spec.workspace import Setup


def make_request(setup: Setup, seed: int, *, expired: bool = False) -> RunRequest:
    """What to do with a set-up; calibrations that have run out are used only if `expired`.

    Raises ExperimentError for those, LimitError for what actuator, bench or board do not allow.
    """
    today = date.today()
    if not expired:
        require_valid_calibrations(setup.calibrations, today)
    caution = expired_calibrations(setup.calibrations, today)
    cavity = body_of(setup.actuator.geometry).cavity_volume
    request = RunRequest(
        setup=setup,
        plan=make_plan(setup.protocol, setup.actuator, setup.bench),
        seed=seed,
        cavity_volume=cavity,
        trials=plan_trials(setup, cavity),
        created=created_now(setup),
        cautions=() if caution is None else (caution,),
    )
    request.board_parameters()  # a board would refuse them only once the bench is open
    return request


def created_now(setup: Setup) -> str | None:
    """ISO date and time for the log; None in simulated time."""
    if setup.bench.simulated:
        return None
    return datetime.now().astimezone().isoformat(timespec="seconds")


def require_measured_calibrations(setup: Setup) -> None:
    """Refuse a real bench with the calibrations of the virtual one: its figures would be false."""
    named = setup.calibrations.by_role().items()
    simulated = [role.replace("_", " ") for role, c in named if c.provenance.simulated]
    if simulated:
        raise ExperimentError(
            f"the bench '{setup.bench.name}' is a real one, but its calibrations of "
            f"{', '.join(simulated)} define the virtual bench (provenance.simulated). Nothing was "
            "moved. Calibrate these instruments, write what you found into files of their own in "
            "calibration/, and name those in the bench."
        )
