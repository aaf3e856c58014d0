"""Small made-up runs for the tests of the record: contents known, nothing physical."""

from __future__ import annotations

from pathlib import Path

from rig.record.documents import (
    DeformationReading,
    PointDocument,
    PointKey,
    StartDocument,
    StopDocument,
)
from rig.record.writer import RunWriter

START = StartDocument(
    actuator="bellow",
    bench="bench",
    board="virtual",
    protocol="standard",
    material="rubber",
    seed=3,
    created=None,
    versions={"rig": "0.1"},
    parameters={"deadband_kpa": 0.01},
)
ATTACHMENTS = {"actuator.yaml": b"kind: actuator\n", "rig.dbc": b'VERSION "1"\n'}
UNITS = {"PRESSURE": {"pressure_kpa": "kPa", "setpoint_kpa": "kPa"}}
JPEG = bytes(range(256)) * 20
POINT_DURATION_S = 4.0
ROWS_PER_POINT = 200


def point(number: int) -> PointDocument:
    """Point `number` of an upward sweep, 0 first."""
    began = number * POINT_DURATION_S
    return PointDocument(
        key=PointKey(experiment="deformation", repeat=1, direction="up", target_kpa=float(number)),
        started_s=began,
        settled_s=None if number == 2 else began + 1,
        measured_from_s=began + 3,
        measured_to_s=began + 4,
        pressure_kpa=number + 0.001,
        pressure_sd_kpa=0.01,
        pressure_u_kpa=0.008,
        value=None if number == 2 else 5.0 * number,
        value_sd=0.1,
        value_u=0.2,
        value_parts=(),
        pressure_parts=(),
        unit="deg",
        readings=5,
        rejected=("blurred",) if number == 2 else (),
    )


def write_point(writer: RunWriter, number: int) -> None:
    """All that a run records for one point, the point document last."""
    document = point(number)
    times = [document.started_s + i * 0.02 for i in range(ROWS_PER_POINT)]
    writer.event(document.started_s, "set_pressure", {"pressure_kpa": number})
    writer.telemetry(
        "PRESSURE",
        times,
        [{"pressure_kpa": number + i / 1000, "setpoint_kpa": number} for i in range(len(times))],
    )
    writer.telemetry("HEARTBEAT", times[:2], [{"state": "run"}, {"state": "hold"}])
    writer.can_frames(times, [0x110] * len(times), [bytes([i, *range(7)]) for i in range(200)])
    for frame in range(2):
        time_s = document.measured_from_s + frame / 10
        writer.image(time_s, JPEG, document.key, frame)
        reading = DeformationReading(
            key=document.key,
            frame=frame,
            value=None if number == 2 else 5.0 * number,
            unit="deg",
            u=0.2,
            parts=(),
            quality=0.9,
            accepted=number != 2,
            reason="blurred" if number == 2 else "",
        )
        writer.deformation(reading, time_s)
    writer.point(document, document.measured_to_s)


def write_run(folder: Path, points: int = 4, stop: bool = True) -> Path:
    """A whole run; returns its folder."""
    with RunWriter.create(folder, START, ATTACHMENTS, UNITS) as writer:
        for number in range(points):
            write_point(writer, number)
        if stop:
            writer.stop(StopDocument(exit_status="success", reason=""), points * POINT_DURATION_S)
    return folder
