"""The two measurements: deformation by camera, blocked force by load cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from rig.experiment.bench import Camera
from rig.experiment.deformation import DeformationMeter, Sight, rejected
from rig.experiment.errors import ExperimentError
from rig.experiment.evaluate import budget_lines, deformation_point, force_point
from rig.experiment.plan import MEASURE_S
from rig.experiment.sweep import Arrival, cell_readings
from rig.link.client import Message, RigLink
from rig.link.schema import Schema
from rig.record.documents import DeformationReading, PointDocument, PointKey
from rig.record.writer import RunWriter
from rig.spec.calibration import LoadCellCalibration
from rig.vision.segment import UNREADABLE, decoded

RETRY_FACTOR = 2
"""At most this many times the wanted readings are taken to make up for rejected ones."""


def sighted(meter: DeformationMeter, jpeg: bytes) -> Sight:
    """What a picture as it was recorded tells."""
    image = decoded(jpeg)
    return rejected(UNREADABLE) if image is None else meter.see(image)


def read_deformation(
    meter: DeformationMeter, jpeg: bytes, key: PointKey, frame: int
) -> DeformationReading:
    """Vision result of one recorded frame; the same for a live run and a replay."""
    sight = sighted(meter, jpeg)
    return DeformationReading(
        key=key,
        frame=frame,
        value=sight.value,
        unit=meter.measurand.unit,
        u=sight.u,
        parts=budget_lines(sight.parts),
        quality=sight.quality,
        accepted=sight.accepted,
        reason=sight.reason,
    )


class Measurement(Protocol):
    """Measures a point that has arrived."""

    def __call__(self, link: RigLink, record: RunWriter, arrival: Arrival) -> PointDocument:
        """Measure now and put the readings on record."""
        ...


@dataclass(frozen=True)
class DeformationMeasurement:
    """Takes frames of a still actuator, spread over a second, and measures its deformation."""

    camera: Camera
    meter: DeformationMeter
    frames: int
    frame_period_s: float

    def __call__(self, link: RigLink, record: RunWriter, arrival: Arrival) -> PointDocument:
        """Measure now; rejected frames are replaced, up to as many again."""
        from_s = link.now_s
        spacing_s = max(self.frame_period_s, MEASURE_S / self.frames)
        messages: list[Message] = []
        readings: list[DeformationReading] = []
        while (
            sum(r.accepted for r in readings) < self.frames
            and len(readings) < RETRY_FACTOR * self.frames
        ):
            messages += link.wait(spacing_s)
            time_s, jpeg = self.camera.grab()
            reading = read_deformation(self.meter, jpeg, arrival.key, len(readings))
            record.image(time_s, jpeg, arrival.key, reading.frame)
            record.deformation(reading, time_s)
            readings.append(reading)
        if not any(r.accepted for r in readings):
            raise ExperimentError(
                f"none of {len(readings)} camera frames at {arrival.key.target_kpa:g} kPa can be "
                f"trusted; the last one: {readings[-1].reason}. They are in the log. Check light, "
                "focus and view (`rig measure` on a frame tells more), then `rig resume` the run."
            )
        visit = arrival.visit(from_s, messages)
        return deformation_point(visit, readings, self.meter.measurand.unit)


@dataclass(frozen=True)
class ForceMeasurement:
    """Averages conversions of the load cell."""

    calibration: LoadCellCalibration
    readings: int
    reading_period_s: float
    schema: Schema

    def __call__(self, link: RigLink, record: RunWriter, arrival: Arrival) -> PointDocument:
        """Measure now; the readings are on record already, as telemetry."""
        del record
        from_s = link.now_s
        end_s = from_s + RETRY_FACTOR * self.readings * self.reading_period_s + 1.0
        messages: list[Message] = []
        good = 0
        while good < self.readings and link.now_s < end_s:
            new = [m for m in link.receive() if m.time_s > from_s]
            messages += new
            good += sum(r.status == "ok" for r in cell_readings(new, self.schema))
        if good < self.readings:
            raise ExperimentError(
                f"only {good} of {self.readings} load-cell readings came in "
                f"{link.now_s - from_s:.0f} s; check the HX711 and its cable."
            )
        readings = cell_readings(messages, self.schema)
        return force_point(arrival.visit(from_s, messages), readings, self.calibration)
