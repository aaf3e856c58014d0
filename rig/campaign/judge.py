"""Whether rig took a fault as it must: within its bound, safely, and without losing data."""

from __future__ import annotations

from dataclasses import dataclass

from rig.campaign.scenario import Outcome, wrong_points

PRESSURE_MARGIN = 1.1
"""No fault may drive the true pressure above this multiple of the board's limit."""


@dataclass(frozen=True)
class Verdict:
    """The outcome of a scenario and everything that is wrong with it; nothing if it passed."""

    outcome: Outcome
    wrong_points: int
    """Recorded points that are not what the unbroken bench measures."""
    complaints: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether rig did what the script expects."""
        return not self.complaints


def judge(outcome: Outcome, healthy: Outcome) -> Verdict:
    """Compare an outcome with what its script expects, and its points with an unbroken run's."""
    expect = outcome.script.expect
    wrong = wrong_points(outcome, healthy)
    complaints: list[str] = []
    if outcome.script.faults and outcome.injected_s is None:
        complaints.append("the moment of the fault never came")
    bound_kpa = PRESSURE_MARGIN * outcome.limit_kpa
    if outcome.peak_kpa > bound_kpa:
        complaints.append(f"{outcome.peak_kpa:.2f} kPa is above {bound_kpa:.2f} kPa")
    if (outcome.code not in expect.codes) if expect.codes else outcome.code != "none":
        wanted = " or ".join(expect.codes) or "none"
        complaints.append(f"the fault code is {outcome.code}, expected {wanted}")
    elif expect.within is not None:
        if outcome.reacted_s is None:
            complaints.append("no reaction was seen")
        elif outcome.reacted_s > expect.within + 1e-9:
            complaints.append(f"reacted after {outcome.reacted_s:.3f} s, not {expect.within:g} s")
    if outcome.run != expect.run:
        complaints.append(f"the run ended as {outcome.run}, expected {expect.run}")
    if outcome.actuator != expect.actuator:
        complaints.append(f"the actuator ended {outcome.actuator}, expected {expect.actuator}")
    if outcome.log_problem is not None:
        complaints.append(f"the log: {outcome.log_problem}")
    if outcome.points != outcome.told:
        complaints.append("the log has other points than the run said were safe")
    if outcome.run == "success" and len(outcome.points) != len(healthy.points):
        complaints.append("a successful run lacks points")
    if wrong and not expect.wrong_points:
        complaints.append(f"{len(wrong)} points are wrong and nobody was told")
    return Verdict(outcome, len(wrong), tuple(complaints))
