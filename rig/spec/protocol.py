"""Protocols: the pressures to visit, how long to wait, how often to repeat."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, PositiveInt, model_validator
from pydantic_core import PydanticCustomError

from rig.spec.base import SpecModel
from rig.spec.quantity import Duration, Pressure


class PressureSteps(SpecModel):
    """Gauge pressures from `start` to `stop` in equal steps, both ends included."""

    start: Pressure = Field(0.0, ge=0)
    stop: Pressure = Field(10e3, gt=0)
    step: Pressure = Field(1e3, gt=0)

    @model_validator(mode="after")
    def _whole_steps(self) -> PressureSteps:
        count = (self.stop - self.start) / self.step
        if count < 1 or abs(count - round(count)) > 1e-6:
            raise PydanticCustomError(
                "steps",
                "start to stop is {count} steps; it must be a whole number of at least one",
                {"count": f"{count:.4g}"},
            )
        return self

    def values(self) -> tuple[float, ...]:
        """The pressures in pascals, ascending."""
        count = round((self.stop - self.start) / self.step)
        return tuple(self.start + i * self.step for i in range(count + 1))


class Settling(SpecModel):
    """A pressure has settled when it stayed within `tolerance` for `window`."""

    tolerance: Pressure = Field(50.0, gt=0)
    window: Duration = Field(1.0, gt=0)
    timeout: Duration = Field(60.0, gt=0)


class SweepProtocol(SpecModel):
    """What both experiments share: visit each pressure, settle, hold, measure, repeat."""

    pressures: PressureSteps = PressureSteps()
    repeats: PositiveInt = Field(5, description="ascending sweeps, each from the vented state")
    descending_repeats: int = Field(
        0, ge=0, description="how many of the last repeats also come down again (hysteresis)"
    )
    settling: Settling = Settling()
    hold: Duration = Field(30.0, ge=0, description="wait after settling, against creep")

    @model_validator(mode="after")
    def _descending_within_repeats(self) -> SweepProtocol:
        if self.descending_repeats > self.repeats:
            raise PydanticCustomError(
                "repeats", "descending_repeats cannot exceed repeats", {}
            )
        return self


class DeformationProtocol(SweepProtocol):
    """Bending angle by camera at each pressure."""

    frames: PositiveInt = Field(5, description="camera frames averaged at each point")


class BlockedForceProtocol(SweepProtocol):
    """Tip force on the load cell at each pressure."""

    readings: PositiveInt = Field(200, description="HX711 readings averaged at each point")


class ProtocolSpec(SpecModel):
    """A protocol file; an experiment that is absent is not run."""

    kind: Literal["protocol"]
    name: str = Field(min_length=1)
    description: str = ""
    deformation: DeformationProtocol | None = None
    blocked_force: BlockedForceProtocol | None = None
