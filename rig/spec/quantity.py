"""Physical quantities in specs: text with a unit, or a number in the field's lab unit; SI inside.

`Length` accepts `66 mm`, `"6.6 cm"` or plain `66` (millimetres) and validates to metres as `float`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

if TYPE_CHECKING:
    import pint


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    import pint  # 0.2 s: only where a spec is read

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    return registry


@lru_cache(maxsize=1024)
def to_si(text: str, si: str) -> float:
    """Value of `text` (number with a unit, as `10 kPa`) in the unit `si`.

    Raises ValueError for text that is no quantity or has another dimension.
    """
    import pint

    try:
        quantity = _registry().Quantity(text)
        return float(quantity.to(si).magnitude)
    except pint.DimensionalityError as error:
        raise ValueError(f"'{text}' is not convertible to {si}") from error
    except Exception as error:  # pint raises many kinds for malformed text, tokenizer errors too
        raise ValueError(f"'{text}' is not a number with a unit") from error


@dataclass(frozen=True)
class Unit:
    """Marks a `float` field as a physical quantity for pydantic.

    `si` is the unit inside, `lab` the unit of bare numbers in YAML and of examples.
    """

    si: str
    lab: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        inner = handler(source)
        return core_schema.no_info_before_validator_function(self._parse, inner)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {
            "anyOf": [{"type": "number"}, {"type": "string"}],
            "description": f"a number in {self.lab}, or text with a unit such as '10 {self.lab}'",
        }

    def _parse(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise PydanticCustomError(
                "quantity",
                "expected a number in {lab} or text with a unit such as '10 {lab}'",
                {"lab": self.lab},
            )
        text = value if isinstance(value, str) else f"{value} {self.lab}"
        if isinstance(value, str) and _is_bare(value):
            text = f"{float(Fraction(value.strip()))} {self.lab}"
        try:
            return to_si(text, self.si)
        except ValueError as error:
            raise PydanticCustomError(
                "quantity",
                "{why}; expected a number in {lab} or text with a unit such as '10 {lab}'",
                {"why": str(error), "lab": self.lab},
            ) from None


def _is_bare(text: str) -> bool:
    try:
        Fraction(text.strip())
    except (ValueError, ZeroDivisionError):
        return False
    return True


Length = Annotated[float, Unit("m", "mm")]
Area = Annotated[float, Unit("m**2", "mm**2")]
Volume = Annotated[float, Unit("m**3", "mL")]
Pressure = Annotated[float, Unit("Pa", "kPa")]
Modulus = Annotated[float, Unit("Pa", "kPa")]
Strength = Annotated[float, Unit("Pa", "MPa")]
Density = Annotated[float, Unit("kg/m**3", "kg/m**3")]
Duration = Annotated[float, Unit("s", "s")]
Frequency = Annotated[float, Unit("Hz", "Hz")]
Temperature = Annotated[float, Unit("K", "degC")]
Voltage = Annotated[float, Unit("V", "V")]
Angle = Annotated[float, Unit("rad", "deg")]
Mass = Annotated[float, Unit("kg", "g")]
Flow = Annotated[float, Unit("m**3/s", "mL/s")]
FlowGain = Annotated[float, Unit("m**3/s/Pa", "mL/s/kPa")]
FlowIntegralGain = Annotated[float, Unit("m**3/s**2/Pa", "mL/s**2/kPa")]
Acceleration = Annotated[float, Unit("m**3/s**2", "mL/s**2")]
PressureRate = Annotated[float, Unit("Pa/s", "kPa/s")]
TransducerGain = Annotated[float, Unit("Pa/V", "kPa/V")]
Ratio = Annotated[float, Unit("dimensionless", "")]
