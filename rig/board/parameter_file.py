"""The board's parameters as a YAML file: names of the schema, values in the unit of the name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, create_model

from rig.link.schema import ParameterRule
from rig.spec.loading import read

_HEADER = "# Parameters of a rig board; `rig firmware parameters load FILE` writes them.\n"


def format_parameters(values: Mapping[str, float], rules: Iterable[ParameterRule]) -> str:
    """YAML with a line for each parameter that has a value; range and meaning as comments."""
    lines = [
        f"{rule.name}: {format_value(values[rule.name])}"
        f"  # {rule.low:g} to {rule.high:g} {rule.unit}".rstrip()
        + f"; {rule.meaning}"
        for rule in rules
        if rule.name in values
    ]
    return _HEADER + "\n".join(lines) + "\n"


def format_value(value: float) -> str:
    """Seven digits, which is what the board's single precision holds."""
    return f"{value:.7g}"


def read_parameters(path: Path, rules: Mapping[str, ParameterRule]) -> dict[str, float]:
    """Parameters of the file `path`, in the board's order; it need not name all.

    Raises SpecError with every unknown name and every value that is no number or out of range.
    """
    spec = read(path, _model(rules)).spec
    given = spec.model_dump(exclude_unset=True)
    return {name: float(given[name]) for name in rules if name in given}


def _model(rules: Mapping[str, ParameterRule]) -> type[BaseModel]:
    fields = {
        name: (float, Field(rule.default, ge=rule.low, le=rule.high, allow_inf_nan=False))
        for name, rule in rules.items()
    }
    config = ConfigDict(extra="forbid", frozen=True, strict=False)
    model: type[BaseModel] = create_model("Parameters", __config__=config, **fields)  # type: ignore[call-overload]
    return model
