"""What an experiment is asked to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rig.experiment.plan import Plan
from rig.experiment.prepare import board_parameters, require_board_takes
from rig.spec.workspace import Setup


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

    def board_parameters(self) -> dict[str, float]:
        """What the board is told before it moves; raises LimitError for what it would refuse."""
        setup = self.setup
        parameters = board_parameters(
            setup.bench, setup.actuator, setup.calibrations.transducer, self.cavity_volume
        )
        require_board_takes(parameters)
        return parameters
