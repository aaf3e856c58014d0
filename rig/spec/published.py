"""Reference values that papers report, for the report to show beside ours."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from rig.spec.base import Number, SpecModel


class PublishedValue(SpecModel):
    """One figure of a paper, as printed there."""

    experiment: Literal["deformation", "blocked_force"] = Field(description="what was measured")
    model: Literal["beam", "fe"] = Field(description="which model was compared")
    statistic: Literal["rmse"] = Field(description="of the model's error")
    value: Number = Field(description="in `unit`, as printed")
    unit: Literal["deg", "g"] = Field(description="of `value`")
    where: str = Field(min_length=1, description="section of the paper")


class PublishedReference(SpecModel):
    """Figures of one paper; where the paper contradicts itself both versions are listed."""

    kind: Literal["published"] = Field(description="tells that this is a file of this kind")
    name: str = Field(min_length=1, description="of the entry")
    citation: str = Field(min_length=1, description="of the paper")
    note: str = Field("", description="what must be known to read the values")
    actuator_family: str = Field(description="family of the actuators that were measured")
    values: tuple[PublishedValue, ...] = Field(min_length=1, description="as they are printed")
