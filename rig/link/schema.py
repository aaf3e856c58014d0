"""The one schema of the link: `firmware/rig.dbc`, read by cantools.

The firmware's pack and unpack code is generated from the same file.
"""

from __future__ import annotations

import binascii
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from rig.link.errors import LinkError

PACKAGE = Path(__file__).resolve().parents[1]
_READ_AND_WRITE = "DUMMY_NODE_VECTOR3"


def schema_path() -> Path:
    """Where the DBC file is: inside an installed package, or at its place in a checkout."""
    for candidate in (
        PACKAGE / "_library" / "firmware" / "rig.dbc",
        PACKAGE.parent / "firmware" / "rig.dbc",
    ):
        if candidate.is_file():
            return candidate
    raise LinkError(
        "the link's schema firmware/rig.dbc is missing from this installation; install rig again"
    )


@dataclass(frozen=True)
class ParameterRule:
    """One parameter of the board, in the unit of its name."""

    index: int
    name: str
    unit: str
    """Empty where the parameter is a plain number."""
    default: float
    low: float
    high: float
    live: bool
    """Whether the board takes it while it moves or is under pressure."""
    meaning: str


class Schema:
    """Messages of the link by name, with their enumerations."""

    def __init__(self, text: str) -> None:
        self.text = text.replace("\r\n", "\n")
        self._database = _parse(self.text)
        self._by_id = {m.frame_id: m for m in self._database.messages}
        self._decimals = {m.name: _scaled_signals(m) for m in self._database.messages}
        self._by_name = {m.name: m for m in self._database.messages}

    @cached_property
    def crc(self) -> int:
        """CRC-16/CCITT-FALSE of the schema's text; the firmware holds the same number."""
        return binascii.crc_hqx(self.text.encode(), 0xFFFF)

    @cached_property
    def protocol_version(self) -> int:
        """Version that both ends must agree on."""
        return int(self._database.dbc.attributes["ProtocolVersion"].value)

    def frame_id(self, message: str) -> int:
        """Identifier of a message."""
        return int(self._by_name[message].frame_id)

    def encode(self, message: str, values: Mapping[str, float]) -> tuple[int, bytes]:
        """Identifier and payload of a message; crc and alive are left zero."""
        definition = self._by_name[message]
        complete = {s.name: 0 for s in definition.signals} | dict(values)
        return int(definition.frame_id), bytes(definition.encode(complete, strict=True))

    def decode(self, frame_id: int, payload: bytes) -> tuple[str, dict[str, float | int]] | None:
        """Name and values of a frame, or None if the schema does not know it.

        CRC and alive counter protect the frame on its way and are not part of the values.
        """
        definition = self._by_id.get(frame_id)
        if definition is None or len(payload) != definition.length:
            return None
        values: dict[str, float | int] = definition.decode(payload, decode_choices=False)
        del values["crc"], values["alive"]
        for signal, decimals in self._decimals[definition.name]:
            # a scaled signal is a decimal number: 0.05, not 0.05000000000000071
            values[signal] = round(values[signal], decimals)
        return definition.name, values

    def choices(self, message: str, signal: str) -> dict[int, str]:
        """Names of the values of an enumerated signal."""
        named = self._by_name[message].get_signal_by_name(signal).choices or {}
        return {int(value): str(name) for value, name in named.items()}

    @cached_property
    def parameters(self) -> dict[str, ParameterRule]:
        """The board's parameters by name, in the order of their indices."""
        variables = self._database.dbc.environment_variables.values()
        return {
            variable.name: ParameterRule(
                index=variable.env_id,
                name=variable.name,
                unit=variable.unit or "",
                default=float(variable.initial_value),
                low=float(variable.minimum),
                high=float(variable.maximum),
                live=variable.access_type == _READ_AND_WRITE,
                meaning=variable.comment,
            )
            for variable in sorted(variables, key=lambda v: v.env_id)
        }

    def units(self) -> dict[str, dict[str, str]]:
        """Unit of every signal, by message and signal name; empty text where it has none."""
        return {
            message.name: {signal.name: signal.unit or "" for signal in message.signals}
            for message in self._database.messages
        }


def _scaled_signals(message: Any) -> list[tuple[str, int]]:
    """Signals with a decimal scale, and how many decimals their values have."""
    return [
        (signal.name, -int(Decimal(str(signal.scale)).normalize().as_tuple().exponent))
        for signal in message.signals
        if isinstance(signal.scale, float) and signal.scale != int(signal.scale)
    ]


def _parse(text: str) -> Any:
    import cantools.database  # 0.3 s: only where a link is opened

    return cantools.database.load_string(text, "dbc")


@lru_cache(maxsize=1)
def load_schema() -> Schema:
    """The schema that this version of rig speaks."""
    return Schema(schema_path().read_text(encoding="utf-8"))
