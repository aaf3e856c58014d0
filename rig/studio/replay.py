"""A recorded run to be looked at at any of its times: pictures, traces, and what was measured.

Everything comes from the log, through the calibrations it carries: deformations by
vision, forces by the load cell.
"""

from __future__ import annotations

import threading
from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.experiment.deformation import recorded_meter
from rig.experiment.errors import ExperimentError
from rig.record.channels import LOG_FILE
from rig.record.documents import PointDocument
from rig.record.reader import CameraImage, RunReader
from rig.report.data import Trace, load_run
from rig.spec.calibration import LoadCellCalibration
from rig.spec.measurand import Measurand
from rig.studio.curves import Array
from rig.studio.errors import StudioError
from rig.studio.look import looked_at

LARGEST_LOG = 256 << 20
"""Bytes of a log that is read as a whole."""
MOST_REPLAYS = 4
"""Runs that are kept; the one not asked for longest goes first."""


@dataclass(frozen=True)
class Series:
    """A quantity over bench time, (n,) each, ascending in time."""

    time_s: Array
    value: Array

    def before(self, time_s: float) -> float | None:
        """The last value until a time; None if there is none yet."""
        last = bisect_right(self.time_s, time_s) - 1
        return None if last < 0 else float(self.value[last])


@dataclass(frozen=True)
class Moment:
    """A run at one bench time; None where nothing was measured yet."""

    time_s: float
    pressure_kpa: float | None
    setpoint_kpa: float | None
    deformation: float | None
    measurand: Measurand
    force_g: float | None
    frame: int | None
    """Index of the picture that was the last one then."""
    frame_s: float | None
    doing: str

    @property
    def words(self) -> str:
        """The figures in a line."""
        said = [f"{self.time_s:.1f} s"]
        if self.pressure_kpa is not None:
            said.append(f"{self.pressure_kpa:z.2f} kPa")
        if self.force_g is not None:
            said.append(f"{self.force_g:z.2f} g")
        if self.deformation is not None:
            what = self.measurand
            said.append(f"last {what.quantity} {self.deformation:z.{what.decimals}f} {what.unit}")
        if self.frame_s is not None:
            said.append(f"picture of {self.frame_s:.1f} s")
        return ", ".join((*said, self.doing) if self.doing else said)


class Replay:
    """One run, read once. Raises what `RunReader` and `load_run` raise."""

    def __init__(self, folder: Path) -> None:
        reader = RunReader(folder)
        data = load_run(reader)
        self.name = folder.name
        self.trace: Trace = data.trace
        self.images: tuple[CameraImage, ...] = tuple(reader.images())
        self.measurand = data.setup.actuator.measurand
        self.deformation = _deformations(reader, self.images)
        self.force = _forces(reader, data.setup.calibrations.load_cell)
        self._points = data.points
        self._setup = data.setup
        self._rest = reader.rest_image()
        self._image_s = [image.time_s for image in self.images]

    @property
    def end_s(self) -> float:
        """Bench time at which nothing more comes."""
        ends = [times[-1] for times in (self.trace.time_s, self._image_s) if len(times)]
        return float(max(ends, default=0.0))

    def at(self, time_s: float) -> Moment:
        """What was known at a bench time."""
        frame = bisect_right(self._image_s, time_s) - 1
        trace = self.trace
        return Moment(
            time_s=time_s,
            pressure_kpa=Series(trace.time_s, trace.pressure_kpa).before(time_s),
            setpoint_kpa=Series(trace.time_s, trace.setpoint_kpa).before(time_s),
            deformation=self.deformation.before(time_s),
            measurand=self.measurand,
            force_g=self.force.before(time_s),
            frame=frame if frame >= 0 else None,
            frame_s=self._image_s[frame] if frame >= 0 else None,
            doing=_doing(self._points, time_s),
        )

    def beside(self, time_s: float, step: int) -> float:
        """Time of the picture `step` pictures after (or before) the one of a time."""
        if not self._image_s:
            return time_s
        index = bisect_right(self._image_s, time_s) - 1 + step
        return self._image_s[min(max(index, 0), len(self._image_s) - 1)]

    def picture(self, frame: int, overlay: bool) -> bytes:
        """JPEG of a picture, with what is measured in it if asked for; raises StudioError."""
        if not 0 <= frame < len(self.images):
            raise StudioError(f"{self.name} has {len(self.images)} pictures, none numbered so.")
        jpeg = self.images[frame].jpeg
        if not overlay:
            return jpeg
        try:
            meter = recorded_meter(self._setup, self._rest)
        except ExperimentError as error:
            raise StudioError(str(error)) from None
        return looked_at(jpeg, meter).jpeg


def _deformations(reader: RunReader, images: Sequence[CameraImage]) -> Series:
    """Accepted readings of points and of trials, at the times of their pictures."""
    taken_s = {(image.key, image.frame): image.time_s for image in images}
    found = [
        (taken_s[r.key, r.frame], r.value)
        for r in reader.deformation_readings()
        if r.accepted and r.value is not None and (r.key, r.frame) in taken_s
    ]
    began_s = {part.key: part.from_s for part in reader.parts()}
    found += [
        (began_s[look.key] + look.time_s, look.value)
        for look in reader.looks()
        if look.accepted and look.value is not None and look.key in began_s
    ]
    table = np.array(sorted(found), dtype=np.float64).reshape(-1, 2)
    return Series(table[:, 0], table[:, 1])


def _forces(reader: RunReader, calibration: LoadCellCalibration) -> Series:
    """What the load cell said while it was tared: before, its counts are of no force."""
    cell, beat = reader.telemetry("LOAD_CELL"), reader.telemetry("HEARTBEAT")
    if "load_cell_counts" not in cell or "tared" not in beat:
        return Series(np.empty(0), np.empty(0))
    last_beat = np.searchsorted(beat["time_s"], cell["time_s"], side="right") - 1
    tared = (last_beat >= 0) & (beat["tared"][last_beat] > 0)
    force = [calibration.grams(float(counts)) for counts in cell["load_cell_counts"][tared]]
    return Series(cell["time_s"][tared], np.array(force))


def _doing(points: Sequence[PointDocument], time_s: float) -> str:
    for point in points:
        if point.started_s <= time_s <= point.measured_to_s:
            key = point.key
            return (
                f"{key.experiment.replace('_', ' ')}, repeat {key.repeat}, {key.direction}, "
                f"{key.target_kpa:g} kPa"
            )
    return ""


class Replays:
    """Runs that somebody looks at; safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: OrderedDict[tuple[Path, int], Replay] = OrderedDict()

    def of(self, folder: Path) -> Replay:
        """The run in a folder; raises StudioError, RecordError or SpecError."""
        log = folder / LOG_FILE
        try:
            written = log.stat()
        except OSError:
            raise StudioError(f"{folder.name} is no run: there is no {LOG_FILE}.") from None
        if written.st_size > LARGEST_LOG:
            raise StudioError(
                f"the log of {folder.name} has {written.st_size >> 20} MiB; up to "
                f"{LARGEST_LOG >> 20} are replayed here. `rig watch` serves it to Foxglove."
            )
        key = (folder, written.st_mtime_ns)
        with self._lock:
            replay = self._kept.pop(key, None) or Replay(folder)
            self._kept[key] = replay
            while len(self._kept) > MOST_REPLAYS:
                self._kept.popitem(last=False)
        return replay
