"""Physical quantities in specs: text with a unit, or a number in the field's lab unit; SI inside.

`Length` accepts `66 mm`, `"6.6 cm"` or plain `66` (millimetres) and validates to metres as `float`.
A fraction such as `1/3` is a number, too. Not-a-number and infinity are refused.

In JSON a quantity is text in SI units ("0.066 m"), so that what is written reads back the same.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

if TYPE_CHECKING:
    import pint

STANDARD_GRAVITY = 9.80665
"""m/s2; newtons in a kilogram-force."""
CELSIUS = 273.15
"""K at 0 deg C."""
MAX_CHARACTERS = 60

# The grammar is checked before pint sees the text: pint evaluates arithmetic such as 2**9999999.
_QUANTITY = re.compile(
    r"""
    (?P<number> [+-]? (?: \d+ / \d+
                        | (?: \d+ (?: \.\d* )? | \.\d+ ) (?: [eE][+-]?\d{1,3} )? ) )
    \s* (?P<unit> .* )
    """,
    re.VERBOSE | re.ASCII,
)
_UNIT_FACTOR = re.compile(r"([A-Za-z]*H2O|[A-Za-zµμ°Ω%]+)(?:(?:\*\*|\^)?(-?[1-9])|([²³]))?")
_SEPARATOR = re.compile(r"\s*([*/·])\s*|\s+")
_SUPERSCRIPTS = {"²": "2", "³": "3"}


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    import pint  # 0.2 s: only where a spec is read

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    return registry


@lru_cache(maxsize=1024)
def to_si(text: str, si: str) -> float:
    """Value of `text` (number with a unit, as `10 kPa`) in the unit `si`.

    Raises ValueError for text that is no quantity, has another dimension or is not finite.
    """
    number, unit = _split(text)
    if _dimension(unit) != _dimension(si):
        raise ValueError(
            f"'{text.strip()}' is {_with_article(_dimension_name(unit))}, "
            f"not {_with_article(_dimension_name(si))}"
        )
    try:
        value = float(_registry().Quantity(number, unit).to(si).magnitude)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueError(f"'{text.strip()}' is too large to be a number")
    return value


def _split(text: str) -> tuple[float, str]:
    """Number and pint unit of `text`; the unit is empty for a bare number."""
    if len(text) > MAX_CHARACTERS:
        raise ValueError(f"'{text[:20]}...' is too long for a number with a unit")
    if re.match(r"[+-]?\d*,\d", text.strip()):
        raise ValueError(f"'{text.strip()}' has a comma; write a decimal point, as in 66.5")
    match = _QUANTITY.fullmatch(text.strip())
    if match is None:
        if re.match(r"[+-]?\.?(nan|inf)", text.strip(), re.IGNORECASE):
            raise ValueError(f"'{text.strip()}' is not a finite number")
        raise ValueError(f"'{text.strip()}' is not a number with a unit")
    try:
        number = float(Fraction(match["number"]))
    except ZeroDivisionError:
        raise ValueError(f"'{text.strip()}' divides by zero") from None
    except OverflowError:
        raise ValueError(f"'{text.strip()}' is too large to be a number") from None
    return number, _pint_unit(match["unit"])


def _pint_unit(text: str) -> str:
    """`mL/s2` as pint writes it, `mL/s**2`; refuses anything but products of units."""
    parts: list[str] = []
    position = 0
    while position < len(text):
        if parts:
            separator = _SEPARATOR.match(text, position)
            if separator is None:
                raise ValueError(f"'{text}' is not a unit")
            parts.append("/" if separator[1] == "/" else "*")
            position = separator.end()
        factor = _UNIT_FACTOR.match(text, position)
        if factor is None:
            raise ValueError(f"'{text}' is not a unit")
        name, power, superscript = factor.groups()
        name = {"%": "percent", "°": "degree", "°C": "degC"}.get(name, name)
        power = power or _SUPERSCRIPTS.get(superscript or "", "")
        parts.append(f"{name}**{power}" if power else name)
        position = factor.end()
    return "".join(parts)


@lru_cache(maxsize=256)
def _dimension(unit: str) -> tuple[pint.util.UnitsContainer, int]:
    """Physical dimension of `unit` and its power of angle, which pint takes for a plain number."""
    try:
        dimensionality = _registry().Unit(unit).dimensionality
    except Exception:  # pint raises many kinds for text that names no unit
        raise ValueError(f"'{unit}' is not a unit that is known") from None
    angle = 0
    for sign, name, power in re.findall(r"(^|[*/])([^*/\d]+)(?:\*\*(-?\d))?", unit):
        if name in _ANGLES:
            angle += int(power or 1) * (-1 if sign == "/" else 1)
    return dimensionality, angle


def _dimension_name(unit: str) -> str:
    """`length` for `mm`; the unit itself for dimensions that no spec uses."""
    for si, name in _DIMENSIONS.items():
        if _dimension(si) == _dimension(unit):
            return name
    return f"quantity in {unit}"


def _with_article(name: str) -> str:
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


_ANGLES = {"deg", "degree", "degrees", "rad", "radian", "radians", "mrad", "turn", "rpm"}
_DIMENSIONS = {
    "m": "length",
    "m**2": "area",
    "m**3": "volume",
    "Pa": "pressure",
    "Pa**-1": "compressibility",
    "kg/m**3": "density",
    "s": "time",
    "Hz": "frequency",
    "K": "temperature",
    "V": "voltage",
    "kg": "mass",
    "N": "force",
    "N*m": "torque",
    "N*s/m": "friction per speed",
    "m/N": "travel per force",
    "Pa*s": "viscosity",
    "m**3/s": "flow",
    "m**3/s/Pa": "flow per pressure",
    "m**3/s**2/Pa": "flow per pressure and time",
    "m**3/s**2": "flow per time",
    "Pa/s": "pressure per time",
    "Pa/V": "pressure per voltage",
    "rad": "angle",
    "": "plain number",
}


@dataclass(frozen=True)
class Unit:
    """Marks a `float` field as a physical quantity for pydantic.

    `si` is the unit inside, `lab` the unit of bare numbers in YAML and of examples, `what` the
    name of the quantity, `example` a typical value in the lab unit.
    """

    si: str
    lab: str
    what: str
    example: str = "10"

    @property
    def expected(self) -> str:
        """What a field of this quantity accepts, in words."""
        if not self.lab:
            return f"{_with_article(self.what)} such as {self.example}, '1/3' or '20 %'"
        return (
            f"{_with_article(self.what)} such as '{self.example} {self.lab}' "
            f"(a bare number is in {self.lab})"
        )

    def in_lab_units(self, value: float) -> str:
        """`66 mm` for 0.066: how people would write the SI value."""
        return f"{self.to_lab(value):.12g} {self.lab}".strip()

    def to_lab(self, value: float) -> float:
        """The SI value in the lab unit, rounded to 12 digits: 66.0 for 0.066."""
        scaled = _registry().Quantity(value, self.si).to(self.lab).magnitude
        return float(f"{scaled:.12g}")

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_before_validator_function(
            self._parse,
            handler(source),
            serialization=core_schema.plain_serializer_function_ser_schema(
                self._to_text, when_used="json"
            ),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        number = r"[+-]?(\d+/\d+|(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?)"
        return {
            "anyOf": [{"type": "number"}, {"type": "string", "pattern": rf"^\s*{number}.*$"}],
            "description": self.expected,
        }

    def _to_text(self, value: float) -> str | float:
        return f"{value!r} {self.si}" if self.lab else value

    def _parse(self, value: Any) -> float:
        try:
            return self._si_value(value)
        except ValueError as error:
            raise PydanticCustomError(
                "quantity",
                "{why}; expected {expected}",
                {"why": str(error), "expected": self.expected},
            ) from None

    def _si_value(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError(f"{_describe(value)} is no quantity")
        if isinstance(value, float) and not math.isfinite(value):
            raise ValueError(f"'{value}' is not a finite number")
        text = value if isinstance(value, str) else repr(_float(value))
        _, unit = _split(text)
        return to_si(text if unit else f"{text} {self.lab}", self.si)


def _float(value: int | float) -> float:
    try:
        return float(value)
    except OverflowError:
        raise ValueError("the whole number is too large") from None


def _describe(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict | list):
        return "a mapping" if isinstance(value, dict) else "a list"
    return f"'{value}'"


Length = Annotated[float, Unit("m", "mm", "length")]
Area = Annotated[float, Unit("m**2", "mm**2", "area")]
Volume = Annotated[float, Unit("m**3", "mL", "volume")]
Pressure = Annotated[float, Unit("Pa", "kPa", "pressure")]
Modulus = Annotated[float, Unit("Pa", "kPa", "modulus", "450")]
Strength = Annotated[float, Unit("Pa", "MPa", "strength", "2.4")]
Compressibility = Annotated[float, Unit("Pa**-1", "MPa**-1", "compressibility", "0.2")]
Density = Annotated[float, Unit("kg/m**3", "kg/m**3", "density", "1160")]
Duration = Annotated[float, Unit("s", "s", "time")]
Frequency = Annotated[float, Unit("Hz", "Hz", "frequency")]
Temperature = Annotated[float, Unit("K", "degC", "temperature", "23")]
Voltage = Annotated[float, Unit("V", "V", "voltage", "5")]
Angle = Annotated[float, Unit("rad", "deg", "angle")]
Mass = Annotated[float, Unit("kg", "g", "mass")]
Force = Annotated[float, Unit("N", "N", "force")]
Torque = Annotated[float, Unit("N*m", "N*m", "torque", "0.4")]
ViscousFriction = Annotated[float, Unit("N*s/m", "N*s/m", "friction per speed", "50")]
Compliance = Annotated[float, Unit("m/N", "mm/N", "travel per force", "0.001")]
Viscosity = Annotated[float, Unit("Pa*s", "mPa*s", "viscosity", "1")]
Flow = Annotated[float, Unit("m**3/s", "mL/s", "flow", "8")]
FlowGain = Annotated[float, Unit("m**3/s/Pa", "mL/s/kPa", "flow per pressure", "1.2")]
FlowIntegralGain = Annotated[
    float, Unit("m**3/s**2/Pa", "mL/s**2/kPa", "flow per pressure and time", "0.6")
]
Acceleration = Annotated[float, Unit("m**3/s**2", "mL/s**2", "flow per time", "40")]
PressureRate = Annotated[float, Unit("Pa/s", "kPa/s", "pressure per time", "2")]
TransducerGain = Annotated[float, Unit("Pa/V", "kPa/V", "pressure per voltage")]
Ratio = Annotated[float, Unit("", "", "plain number", "0.2")]
