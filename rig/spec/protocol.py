"""Protocols: the pressures to visit, how long to wait, how often to repeat."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Integer, Name, SpecModel, require
from rig.spec.quantity import Duration, Pressure
from rig.spec.trial import DAY_S, Trial

MAX_STEPS = 1000


class PressureSteps(SpecModel):
    """Gauge pressures from `start` to `stop` in equal steps, both ends included."""

    start: Pressure = Field(0.0, ge=0, description="lowest gauge pressure")
    stop: Pressure = Field(10e3, gt=0, description="highest gauge pressure")
    step: Pressure = Field(1e3, gt=0, description="between neighbours")

    @model_validator(mode="after")
    def _whole_steps(self) -> PressureSteps:
        count = (self.stop - self.start) / self.step
        require(
            1 <= round(count) <= MAX_STEPS and abs(count - round(count)) <= 1e-6,
            f"start to stop is {count:.4g} steps; expected a whole number from 1 to {MAX_STEPS}",
        )
        return self

    def values(self) -> tuple[float, ...]:
        """The pressures in pascals, ascending."""
        count = round((self.stop - self.start) / self.step)
        return tuple(self.start + i * self.step for i in range(count + 1))


class Settling(SpecModel):
    """A pressure has settled when it stayed within `tolerance` for `window`."""

    tolerance: Pressure = Field(50.0, gt=0, description="of the pressure about the set-point")
    window: Duration = Field(1.0, gt=0, description="for which it must stay within")
    timeout: Duration = Field(60.0, gt=0, le=DAY_S, description="after which the run fails")

    @model_validator(mode="after")
    def _window_before_timeout(self) -> Settling:
        require(
            self.window < self.timeout,
            f"window is {self.window:g} s, timeout {self.timeout:g} s; expected window below "
            "timeout, or no pressure ever settles",
        )
        return self


class SweepProtocol(SpecModel):
    """What both experiments share: visit each pressure, settle, hold, measure, repeat."""

    pressures: PressureSteps = Field(PressureSteps(), description="the levels of a sweep")
    repeats: Count = Field(5, le=1000, description="ascending sweeps, each from the vented state")
    descending_repeats: Integer = Field(
        0, ge=0, description="how many of the last repeats also come down again (hysteresis)"
    )
    settling: Settling = Field(Settling(), description="when a level counts as reached")
    hold: Duration = Field(30.0, ge=0, le=DAY_S, description="wait after settling, against creep")
    conditioning: Integer = Field(
        0,
        ge=0,
        le=100,
        description="cycles to the top pressure before the first sweep, and after a resumption",
    )
    rest: Duration = Field(
        10.0, ge=0, le=DAY_S, description="vented rest before each repeat (our choice)"
    )

    @model_validator(mode="after")
    def _descending_within_repeats(self) -> SweepProtocol:
        require(
            self.descending_repeats <= self.repeats,
            f"descending_repeats is {self.descending_repeats}; expected at most the "
            f"{self.repeats} of repeats",
        )
        return self


class DeformationProtocol(SweepProtocol):
    """Bending angle by camera at each pressure."""

    frames: Count = Field(5, le=1000, description="camera frames averaged at each point")


class BlockedForceProtocol(SweepProtocol):
    """Tip force on the load cell at each pressure."""

    readings: Count = Field(200, le=100_000, description="HX711 readings averaged at each point")


class ProtocolSpec(SpecModel):
    """A protocol file; an experiment that is absent is not run."""

    kind: Literal["protocol"] = Field(description="tells that this is a file of this kind")
    name: Name
    description: str = Field("", description="one line for people: what it is and what it is for")
    deformation: DeformationProtocol | None = Field(
        None, description="sweeps with the tip free; none if it is left out"
    )
    blocked_force: BlockedForceProtocol | None = Field(
        None, description="sweeps with the tip at the load cell; none if it is left out"
    )
    trials: tuple[Trial, ...] = Field(
        (), max_length=100, description="what follows the sweeps, in this order"
    )

    @model_validator(mode="after")
    def _at_least_one_experiment(self) -> ProtocolSpec:
        require(
            self.deformation is not None or self.blocked_force is not None or bool(self.trials),
            "no experiment to run; expected 'deformation', 'blocked_force' or 'trials'",
        )
        names = [trial.name for trial in self.trials]
        require(len(set(names)) == len(names), "two trials have the same name")
        return self
