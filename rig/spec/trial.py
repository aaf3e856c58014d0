"""Trials: what a protocol may do besides the two staircases, one model for each kind.

Each drives pressure or plunger volume along a line that is known before anything moves.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Integer, Name, SpecModel, require
from rig.spec.curve import Curve
from rig.spec.quantity import Angle, Duration, Flow, Length, Mass, Pressure, PressureRate, Volume

DAY_S = 86_400.0
BeyondMotor = Annotated[
    Literal["refuse", "slow"],
    Field(description="what to do with a drive that the motor cannot follow"),
]


class _Trial(SpecModel):
    """What all trials share."""

    name: Name
    repeats: Count = Field(1, le=1000, description="each from the vented state")
    rest: Duration = Field(10.0, ge=0, le=DAY_S, description="vented rest before each repeat")


class CreepTrial(_Trial):
    """A pressure is held, then released; the angle is looked at over logarithmic time."""

    kind: Literal["creep"] = Field(description="which trial this is")
    pressure: Pressure = Field(gt=0, description="gauge pressure that is held")
    rate: PressureRate = Field(2e3, gt=0, description="of the rise and of the release")
    hold: Duration = Field(gt=1, le=DAY_S, description="at the pressure")
    recovery: Duration = Field(gt=1, le=DAY_S, description="vented, after it")
    looks: Count = Field(12, ge=6, le=200, description="in the hold, and as many in the recovery")


class CyclesTrial(_Trial):
    """Ramps between two pressures, over and over; the angle is looked at in chosen cycles."""

    kind: Literal["cycles"] = Field(description="which trial this is")
    low: Pressure = Field(0.0, ge=0, description="gauge pressure between the cycles")
    high: Pressure = Field(gt=0, description="gauge pressure of the cycles")
    ramp: Duration = Field(ge=0.1, le=3600, description="from one to the other")
    dwell: Duration = Field(0.5, ge=0.2, le=3600, description="at either pressure")
    cycles: Count = Field(le=1_000_000, description="how many")
    block: Count = Field(
        10, le=1000, description="cycles that are safe once done: a resumed run goes on after them"
    )
    look_every: Count = Field(1, description="cycles from one look to the next")

    @model_validator(mode="after")
    def _low_below_high(self) -> CyclesTrial:
        require(self.low < self.high, "low is not below high; expected low < high")
        return self


class PumpingTrial(_Trial):
    """The plunger pushes a volume in at a constant rate, waits, and takes it back."""

    kind: Literal["pumping"] = Field(description="which trial this is")
    volume: Volume = Field(gt=0, description="that the plunger goes")
    duration: Duration = Field(gt=0, le=DAY_S, description="of the push; with the volume, its rate")
    hold: Duration = Field(2.0, ge=0.1, le=DAY_S, description="after it")
    beyond_motor: BeyondMotor = "refuse"


class DeformationTrial(_Trial):
    """The actuator deforms at a constant rate, by the pressures that a model says it takes."""

    kind: Literal["constant_deformation"] = Field(description="which trial this is")
    angle: Angle | None = Field(None, gt=0, description="that is wanted; none if a displacement is")
    displacement: Length | None = Field(
        None, gt=0, description="of the tip that is wanted; none if an angle is"
    )
    duration: Duration = Field(gt=0, le=DAY_S, description="of the way there")
    hold: Duration = Field(2.0, ge=0.1, le=DAY_S, description="after it")
    model: Literal["beam", "fe"] = Field("beam", description="that tells the pressure for it")
    beyond_motor: BeyondMotor = "refuse"

    @model_validator(mode="after")
    def _angle_or_displacement(self) -> DeformationTrial:
        require(
            (self.angle is None) != (self.displacement is None),
            "expected either 'angle' or 'displacement'",
        )
        return self


class VolumesTrial(_Trial):
    """The plunger steps through volumes and back; pressure and angle answer."""

    kind: Literal["volumes"] = Field(description="which trial this is")
    stop: Volume = Field(gt=0, description="largest volume of the plunger")
    steps: Count = Field(5, le=1000, description="from nothing to `stop`")
    flow: Flow = Field(1e-6, gt=0, description="of the plunger")
    hold: Duration = Field(5.0, ge=1, le=DAY_S, description="at each volume")


class PullTrial(_Trial):
    """The actuator grips at a pressure while the held object is pulled off it with the load cell.

    What pulls is a person or a robot; the peak of the force is found in the record.
    """

    kind: Literal["pull"] = Field(description="which trial this is")
    pressure: Pressure = Field(gt=0, description="gauge pressure during the pull")
    settle: Duration = Field(3.0, ge=0.1, le=DAY_S, description="before the pull")
    duration: Duration = Field(20.0, gt=0, le=DAY_S, description="in which the object slips off")
    prominence: Mass = Field(5e-3, gt=0, description="least height of a peak above its saddles")


class TrajectoryTrial(_Trial):
    """Any broken line of pressures or volumes: a prefix, a loop some times over, a suffix."""

    kind: Literal["trajectory"] = Field(description="which trial this is")
    prefix: Curve | None = Field(None, description="driven once before; none if it is left out")
    loop: Curve = Field(description="driven again and again")
    loops: Count = Field(1, le=100_000, description="how often")
    suffix: Curve | None = Field(None, description="driven once after; none if it is left out")
    looks: Integer = Field(0, ge=0, le=1000, description="at the angle, evenly over the time")

    @property
    def curves(self) -> dict[str, Curve]:
        """Those that there are, by field, in order."""
        parts = {"prefix": self.prefix, "loop": self.loop, "suffix": self.suffix}
        return {name: curve for name, curve in parts.items() if curve is not None}

    @model_validator(mode="after")
    def _one_drive(self) -> TrajectoryTrial:
        known = [c for c in self.curves.values() if c.file is None]
        require(
            len({bool(c.pressures) for c in known}) <= 1,
            "some curves are of pressures, others of volumes; expected all alike",
        )
        return self


Trial = Annotated[
    CreepTrial
    | CyclesTrial
    | PumpingTrial
    | DeformationTrial
    | VolumesTrial
    | PullTrial
    | TrajectoryTrial,
    Field(discriminator="kind"),
]
