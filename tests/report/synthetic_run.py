"""A made-up but plausible run for developing and testing the report: no simulator involved.

The actuator of `models/actuators/bellow-bending.yaml` bends a little less than beam theory says,
with scatter, creep between repeats, hysteresis and a second-order pressure loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from rig.record.documents import (
    DeformationReading,
    Direction,
    ExitStatus,
    ExperimentName,
    PointDocument,
    PointKey,
    ResumeDocument,
    StartDocument,
    StopDocument,
    UncertaintyPart,
)
from rig.record.writer import RunWriter
from rig.spec.workspace import Setup, Workspace, library_root

UNITS = {
    "PRESSURE": {"pressure_kpa": "kPa", "setpoint_kpa": "kPa", "plunger_ml": "mL"},
    "LOAD_CELL": {"load_cell_counts": ""},
}
SETTLED_AFTER_S = 2.4
TOP_KPA = 10.0


@dataclass(frozen=True)
class Story:
    """What kind of run to make up."""

    seed: int = 1
    repeats: int = 5
    descending_repeats: int = 1
    step_kpa: float = 1.0
    hold_s: float = 30.0
    frames: int = 5
    telemetry_hz: float = 50.0
    ending: ExitStatus | None = "success"
    """None for a run that was killed."""
    stop_after: int | None = None
    """Points after which it ends early."""
    resumed_after: int | None = None
    """Points after which it was killed and taken up again."""
    experiments: tuple[ExperimentName, ...] = ("deformation", "blocked_force")


SHORT = {"repeats": 3, "step_kpa": 2.5, "hold_s": 4.0, "frames": 2}
"""Changes that make a story quick to write and to read."""


def library_setup() -> Setup:
    """The set-up of the shipped library, with the prediction of beam theory alone."""
    actuator = Path(__file__).parents[1] / "specs/bellow-bending.yaml"
    return Workspace(library_root(), is_library=True).setup(actuator)


def write_synthetic_run(folder: Path, story: Story | None = None) -> Path:
    """Record the run that `story` tells; returns its folder."""
    story = story or Story()
    files = {name: text.encode() for name, text in library_setup().attachments().items()}
    files["protocol.yaml"] = _protocol(story).encode()
    teller = _Teller(story)
    keys = teller.keys()[: story.stop_after]
    writer = RunWriter.create(folder, _start(story), files, UNITS)
    writer.event(0.0, "hello", {"board": "virtual"})
    for number, key in enumerate(keys):
        if number == story.resumed_after:
            writer.close()
            writer = RunWriter.resume(folder, units=UNITS)
            note = ResumeDocument(resumed_s=teller.now_s, points_kept=number, seed=story.seed)
            writer.resume_note(note, teller.now_s)
        teller.point(writer, key)
    if story.ending is not None:
        reasons = {
            "success": "all points were measured",
            "aborted": "somebody pressed Ctrl-C",
            "failed": "the board reports the fault leak: the plunger moves, the pressure does not",
        }
        stop = StopDocument(exit_status=story.ending, reason=reasons[story.ending])
        writer.stop(stop, teller.now_s)
    writer.close()
    return folder


def _start(story: Story) -> StartDocument:
    return StartDocument(
        actuator="bellow-bending",
        bench="virtual",
        board="virtual",
        protocol="synthetic",
        material="Agilus30",
        seed=story.seed,
        created=None,
        versions={"rig": "0.1.0", "firmware": "abc123", "python": "3.11.2", "numpy": "2.4.6"},
        parameters={"proportional_ml_s_kpa": 1.5, "deadband_kpa": 0.005},
    )


def _protocol(story: Story) -> str:
    text = "kind: protocol\nname: synthetic\n"
    for name in story.experiments:
        count = f"frames: {story.frames}" if name == "deformation" else "readings: 200"
        down = story.descending_repeats if name == "deformation" else 0
        text += (
            f"{name}:\n"
            f"  pressures: {{start: 0 kPa, stop: {TOP_KPA} kPa, step: {story.step_kpa} kPa}}\n"
            f"  repeats: {story.repeats}\n"
            f"  descending_repeats: {down}\n"
            f"  hold: {story.hold_s} s\n"
            f"  {count}\n"
        )
    return text


def part(
    name: str, u: float, kind: str, sensitivity: float = 1.0, dof: float | None = None
) -> UncertaintyPart:
    values = {"name": name, "u": u, "kind": kind, "sensitivity": sensitivity, "dof": dof}
    return UncertaintyPart.model_validate(values | {"distribution": "normal", "unit": ""})


class _Teller:
    """Makes up one point after another."""

    def __init__(self, story: Story) -> None:
        self._story = story
        self._rng = np.random.default_rng(story.seed)
        self._last_kpa = 0.0
        self.now_s = 12.0

    def keys(self) -> list[PointKey]:
        story = self._story
        up = np.arange(0, TOP_KPA + story.step_kpa / 2, story.step_kpa)
        keys = []
        for name in story.experiments:
            for repeat in range(1, story.repeats + 1):
                keys += [self._key(name, repeat, "up", kpa) for kpa in up]
                last = story.repeats - story.descending_repeats
                if name == "deformation" and repeat > last:
                    keys += [self._key(name, repeat, "down", kpa) for kpa in up[-2::-1]]
        return keys

    @staticmethod
    def _key(name: ExperimentName, repeat: int, direction: Direction, kpa: float) -> PointKey:
        target = round(float(kpa), 6)
        return PointKey(experiment=name, repeat=repeat, direction=direction, target_kpa=target)

    def point(self, writer: RunWriter, key: PointKey) -> None:
        story, began = self._story, self.now_s
        if key.target_kpa == 0 and key.direction == "up":
            self._last_kpa = 0.0
        from_s = began + SETTLED_AFTER_S + story.hold_s
        to_s = from_s + (1.0 if key.experiment == "deformation" else 20.0)
        pressure = self._telemetry(writer, key, began, from_s, to_s)
        value, u = self._value(key)
        readings = 200
        rejected: tuple[str, ...] = ()
        if key.experiment == "deformation":
            rejected = self._frames(writer, key, value, from_s)
            readings = story.frames
        document = PointDocument(
            key=key,
            started_s=began,
            settled_s=began + SETTLED_AFTER_S,
            measured_from_s=from_s,
            measured_to_s=to_s,
            pressure_kpa=float(pressure.mean()),
            pressure_sd_kpa=float(pressure.std(ddof=1)),
            pressure_u_kpa=0.008,
            value=value,
            value_sd=0.05,
            value_u=float(np.hypot(u, 0.05 / np.sqrt(readings))),
            value_parts=(
                part("readings", 0.05 / np.sqrt(readings), "A", dof=max(1, readings - 1)),
                part("instrument", u, "B"),
            ),
            pressure_parts=(
                part("readings", pressure.std(ddof=1) / np.sqrt(pressure.size), "A", dof=20),
                part("pressure gain", 0.001, "B", sensitivity=key.target_kpa),
                part("pressure zero", 0.005, "B"),
            ),
            unit="deg" if key.experiment == "deformation" else "g",
            readings=readings,
            rejected=rejected,
        )
        self._last_kpa = key.target_kpa
        self.now_s = to_s
        writer.point(document, to_s)

    def _value(self, key: PointKey) -> tuple[float, float]:
        kpa = key.target_kpa
        if key.experiment == "blocked_force":
            value = 3.5 * kpa - 0.03 * kpa**2 + self._rng.normal(0, 0.06)
            return float(value), float(np.hypot(0.001 * value, 0.02))
        share = kpa / TOP_KPA
        value = 1.1 + 11.0 * kpa - 0.09 * kpa**2 + 0.15 * key.repeat * share
        if key.direction == "down":
            value += 6.0 * share * (1 - share)
        return float(value + self._rng.normal(0, 0.25)), 0.08

    def _telemetry(
        self, writer: RunWriter, key: PointKey, began: float, from_s: float, to_s: float
    ) -> np.ndarray:
        times = np.arange(round((to_s - began) * self._story.telemetry_hz)) + 1
        times = began + times / self._story.telemetry_hz
        since = times - began
        decay = np.exp(-2.2 * since)
        step = key.target_kpa - self._last_kpa
        pressure = key.target_kpa - step * decay * (np.cos(2 * since) + 1.1 * np.sin(2 * since))
        pressure += self._rng.normal(0, 0.006, times.size)
        rows = [
            {"pressure_kpa": round(p, 3), "setpoint_kpa": key.target_kpa, "plunger_ml": 3.0}
            for p in pressure.tolist()
        ]
        writer.event(began, "set_pressure", {"pressure_kpa": key.target_kpa})
        writer.telemetry("PRESSURE", times, rows)
        cell = times[:: max(1, round(self._story.telemetry_hz / 10))]
        counts = self._rng.normal(2000 * key.target_kpa, 40, cell.size)
        writer.telemetry(
            "LOAD_CELL",
            cell,
            [{"load_cell_counts": round(c), "load_cell_status": 0} for c in counts.tolist()],
        )
        return pressure[times > from_s]

    def _frames(
        self, writer: RunWriter, key: PointKey, value: float, from_s: float
    ) -> tuple[str, ...]:
        rejected = []
        picture = _picture(value)
        for frame in range(self._story.frames):
            time_s = from_s + (frame + 1) / self._story.frames
            accepted = self._rng.random() > 0.01
            reason = "" if accepted else "the frame is blurred"
            if not accepted:
                rejected.append(reason)
            writer.image(time_s, picture, key, frame)
            reading = DeformationReading(
                key=key,
                frame=frame,
                value=value + self._rng.normal(0, 0.05) if accepted else None,
                unit="deg",
                u=0.05,
                parts=(),
                quality=0.9 if accepted else 0.0,
                accepted=accepted,
                reason=reason,
            )
            writer.deformation(reading, time_s)
        return tuple(rejected)


def _picture(angle_deg: float) -> bytes:
    """A crude side view: connector, arc and cap, 1280 by 720 pixels."""
    image = np.full((720, 1280, 3), 225, np.uint8)
    start = np.array([640.0, 120.0])
    steps = 40
    heading = np.radians(90 + angle_deg * (np.arange(steps) + 0.5) / steps)
    path = start + np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0) * 10
    cv2.polylines(image, [path.astype(np.int32)], False, (120, 150, 190), 90, cv2.LINE_AA)
    cv2.rectangle(image, (560, 60), (720, 120), (170, 90, 20), -1)
    across = np.array([-np.sin(heading[-1]), np.cos(heading[-1])]) * 60
    ends = np.array([path[-1] - across, path[-1] + across]).astype(np.int32)
    cv2.line(image, ends[0].tolist(), ends[1].tolist(), (170, 90, 20), 24, cv2.LINE_AA)
    _, encoded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 85])
    return encoded.tobytes()
