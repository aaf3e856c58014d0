"""Reference values that papers report, for the report to show beside ours."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from rig.spec.base import Number, SpecModel


class PublishedValue(SpecModel):
    """One figure of a paper, as printed there."""

    experiment: Literal["deformation", "blocked_force"]
    model: Literal["beam", "fe"]
    statistic: Literal["rmse"]
    value: Number = Field(description="in `unit`, as printed")
    unit: Literal["deg", "g"]
    where: str = Field(min_length=1, description="section of the paper")


class PublishedReference(SpecModel):
    """Figures of one paper; where the paper contradicts itself both versions are listed."""

    kind: Literal["published"]
    name: str = Field(min_length=1)
    citation: str = Field(min_length=1)
    note: str = ""
    actuator_family: str = Field(description="family of the actuators that were measured")
    values: tuple[PublishedValue, ...] = Field(min_length=1)
