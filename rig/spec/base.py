"""The base of every spec: frozen, no unknown keys; and plain numbers without surprises."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict
from pydantic_core import PydanticCustomError


class SpecModel(BaseModel):
    """A validated, immutable piece of a spec; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _no_timestamp(value: Any) -> Any:
    if isinstance(value, datetime) or not isinstance(value, date | str):
        raise PydanticCustomError("date", "expected a date as 2025-01-31")
    return value


def require(condition: bool, why: str) -> None:
    """For validators that compare fields: refuse, with `why`, unless `condition` holds."""
    if not condition:
        raise PydanticCustomError("consistency", "{why}", {"why": why})


# Strict: pydantic would otherwise take true for 1, "3" for 3, and the date 0 for 1970-01-01.
Number = Annotated[float, Strict()]
Integer = Annotated[int, Strict()]
Count = Annotated[int, Strict(), Field(gt=0)]
Name = Annotated[
    str,
    Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,79}$",
        description="letters, digits, '.', '_' and '-', beginning with a letter or digit",
    ),
]
"""What a thing is called; it becomes part of paths, so it must not be able to leave a folder."""
Label = Annotated[
    str,
    Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._ -]{0,79}$",
        description="letters, digits, spaces, '.', '_' and '-', beginning with a letter or digit",
    ),
]
"""As Name, with the spaces of trade names such as Agilus30 DM50."""
Date = Annotated[date, BeforeValidator(_no_timestamp)]
