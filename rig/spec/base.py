"""The base of every spec: frozen, no unknown keys."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class SpecModel(BaseModel):
    """A validated, immutable piece of a spec; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)
