"""Numeric fields of specs by dotted path: their units, and specs with other values there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from rig.spec.actuator import ActuatorSpec
from rig.spec.explain import did_you_mean, first_problem, unit_of
from rig.spec.material import MaterialSpec
from rig.spec.quantity import Unit
from rig.study.errors import StudyError

S = TypeVar("S", bound=BaseModel)


@dataclass(frozen=True)
class NumericField:
    """A field below `actuator` or `material`."""

    root: str
    path: tuple[str, ...]
    unit: Unit | None
    """None of a plain number."""
    whole: bool
    """Whether it takes whole numbers only."""

    def parse(self, value: float | str) -> float:
        """A level as written in a study file, in SI; raises StudyError."""
        if self.unit is None:
            if isinstance(value, str):
                raise StudyError(f"'{value}' is no number; {self} has no unit.")
            if self.whole and value != int(value):
                raise StudyError(f"{value:g} is no whole number, but {self} takes only those.")
            return float(value)
        try:
            return TypeAdapter(Annotated[float, self.unit]).validate_python(value)
        except ValidationError as error:
            raise StudyError(f"{self}: {error.errors()[0]['msg']}.") from None

    def to_lab(self, value: float) -> float:
        """An SI value in the unit that people use."""
        return value if self.unit is None or not self.unit.lab else self.unit.to_lab(value)

    @property
    def lab_unit(self) -> str:
        """The unit that people use; empty of plain numbers."""
        return self.unit.lab if self.unit is not None else ""

    def __str__(self) -> str:
        return ".".join((self.root, *self.path))


def numeric_field(dotted: str, actuator: ActuatorSpec, material: MaterialSpec) -> NumericField:
    """The field that `dotted` means; raises StudyError, with what there is, for any other."""
    everything = [*_below(actuator, "actuator"), *_below(material, "material")]
    known = {str(found): found for found in everything}
    if dotted not in known:
        raise StudyError(f"'{dotted}' is no numeric field{did_you_mean(dotted, known)}.")
    return known[dotted]


def _below(spec: Any, root: str, path: tuple[str, ...] = ()) -> list[NumericField]:
    """All numeric fields below a part of a spec."""
    found: list[NumericField] = []
    if isinstance(spec, tuple):
        for i, item in enumerate(spec):
            found += _below(item, root, (*path, str(i)))
        return found
    if not isinstance(spec, BaseModel):
        return found
    for name, info in type(spec).model_fields.items():
        value = getattr(spec, name)
        if isinstance(value, int | float) and not isinstance(value, bool):
            found.append(_numeric(root, (*path, name), info, value))
        else:
            found += _below(value, root, (*path, name))
    return found


def _numeric(root: str, path: tuple[str, ...], info: FieldInfo, value: float) -> NumericField:
    return NumericField(root, path, unit_of(info), isinstance(value, int))


def value_of(spec: BaseModel, path: tuple[str, ...]) -> float:
    """The SI value of a numeric field."""
    at: Any = spec
    for part in path:
        at = at[int(part)] if isinstance(at, tuple) else getattr(at, part)
    return float(at)


def with_values(spec: S, values: dict[tuple[str, ...], float]) -> S:
    """A validated copy of `spec` with SI values at paths; raises StudyError where it cannot be."""
    data = spec.model_dump()
    for path, value in values.items():
        at: Any = data
        for part in path[:-1]:
            at = at[int(part)] if isinstance(at, list | tuple) else at[part]
        at[path[-1]] = value
    try:
        return type(spec).model_validate(_as_text(spec, data))
    except ValidationError as error:
        raise StudyError(first_problem(error)) from None


def _as_text(spec: BaseModel, data: dict[str, Any]) -> dict[str, Any]:
    """Quantities of dumped `data` with their SI unit: a bare number would be read in lab units."""
    return {
        name: _value_as_text(getattr(spec, name), type(spec).model_fields[name], data[name])
        for name in data
    }


def _value_as_text(original: Any, info: FieldInfo | None, value: Any) -> Any:
    if isinstance(original, BaseModel):
        return _as_text(original, value)
    if isinstance(original, tuple):
        pairs = zip(original, value, strict=True)
        return [_value_as_text(one, None, item) for one, item in pairs]
    unit = unit_of(info) if info is not None else None
    if unit is not None and unit.lab and value is not None:
        return f"{value!r} {unit.si}"
    return value
