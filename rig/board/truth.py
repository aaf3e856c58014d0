"""The virtual bench's truth, in a file of its own that no experiment opens.

One channel `/truth`: time, pressure, deformation, force as they really were, at every poll of the
link.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.writer import CompressionType, Writer

from rig.plant.plant import Truth
from rig.record.channels import LOG_FILE
from rig.spec.measurand import Measurand
from rig.spec.quantity import STANDARD_GRAVITY


def _schema(measurand: Measurand) -> bytes:
    properties = {
        "time_s": "bench time, s",
        "pressure_kpa": "gauge pressure in the syringe, kPa",
        "deformation": f"{measurand.quantity}, {measurand.unit}",
        "force_g": "tip force, gram-force",
        "volume_ml": "cavity volume, mL",
    }
    schema = {
        "type": "object",
        "title": "truth",
        "properties": {n: {"type": "number", "description": d} for n, d in properties.items()},
    }
    return json.dumps(schema).encode()


class TruthFile:
    """Writes truth samples to an MCAP file, from the moment the run's own log stands beside it."""

    def __init__(self, path: Path, measurand: Measurand) -> None:
        self._path = path
        self._measurand = measurand
        self._stream: BinaryIO | None = None

    def _begin(self) -> None:
        self._stream = self._path.open("wb")
        self._writer = Writer(self._stream, chunk_size=1 << 18, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="rig truth")
        schema = self._writer.register_schema("rig.Truth", "jsonschema", _schema(self._measurand))
        self._channel = self._writer.register_channel("/truth", "json", schema)

    def write(self, time_s: float, truth: Truth) -> None:
        """Add a sample at bench time `time_s`."""
        if self._stream is None:
            if not self._path.with_name(LOG_FILE).exists():
                return
            self._begin()
        stamp = round(time_s * 1e9)
        row = (
            f'{{"time_s":{time_s:.3f},"pressure_kpa":{truth.gauge_pressure / 1e3:.6f},'
            f'"deformation":{truth.deformation * self._measurand.per_si:.6f},'
            f'"force_g":{truth.force / STANDARD_GRAVITY * 1e3:.6f},'
            f'"volume_ml":{truth.actuator_volume * 1e6:.6f}}}'
        )
        self._writer.add_message(self._channel, stamp, row.encode(), stamp)

    def close(self) -> None:
        """Finish the file."""
        if self._stream is not None:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._stream.close()


@dataclass(frozen=True)
class TruthSample:
    """One row of a truth file."""

    time_s: float
    pressure_kpa: float
    deformation: float
    """In deg of an actuator that bends, in mm of one that lengthens."""
    force_g: float
    volume_ml: float


def read_truth(path: Path) -> list[TruthSample]:
    """All samples of a truth file, oldest first."""
    from mcap.reader import make_reader

    with path.open("rb") as stream:
        return [
            TruthSample(**json.loads(message.data))
            for _, _, message in make_reader(stream).iter_messages(topics=["/truth"])
        ]


def truth_path(folder: Path, segment: int) -> Path:
    """Where the virtual bench writes what it knew; each resumption of a run has its own file."""
    return folder / ("truth.mcap" if segment == 0 else f"truth-{segment + 1}.mcap")
