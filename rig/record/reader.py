"""Reads a run, finished or cut short: whatever is readable, and a sentence on what is not."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.message import DecodeError
from numpy.typing import NDArray
from pydantic import ValidationError

from rig.record.channels import (
    CAMERA_KEY_TOPIC,
    CAMERA_TOPIC,
    CAN_TOPIC,
    DEFORMATION_TOPIC,
    GAS_TOPIC,
    LEVELS,
    LOG_FILE,
    LOG_TOPIC,
    LOOKS_TOPIC,
    PARTS_TOPIC,
    POINTS_TOPIC,
    REST_TOPIC,
    RESUME_METADATA,
    START_METADATA,
    STOP_METADATA,
    TELEMETRY_PREFIX,
    Level,
    telemetry_topic,
)
from rig.record.documents import (
    DeformationReading,
    Document,
    GasDocument,
    LookDocument,
    PartDocument,
    PointDocument,
    PointKey,
    ResumeDocument,
    StartDocument,
    StopDocument,
)
from rig.record.errors import RecordError
from rig.record.mcap_format import MALFORMED, chunk_data, iter_messages, read_channel, scan_log
from rig.record.telemetry import columns
from rig.spec.workspace import Setup

AnyDocument = TypeVar("AnyDocument", bound=Document)
LEVEL_NAMES: dict[int, Level] = {number: name for name, number in LEVELS.items()}


@dataclass(frozen=True)
class CameraImage:
    """One recorded image; `key` is None if it belongs to no point."""

    key: PointKey | None
    frame: int
    time_s: float
    jpeg: bytes


@dataclass(frozen=True)
class Event:
    """Something that happened during the run."""

    time_s: float
    name: str
    data: dict[str, Any]
    level: Level


@dataclass(frozen=True)
class CanFrames:
    """Raw frames in the order of the link."""

    time_s: NDArray[np.float64]
    ids: NDArray[np.uint32]
    payloads: list[bytes]


class RunReader:
    """A recorded run: give its folder or its MCAP file.

    Raises RecordError if there is no such run, if the file is not an MCAP or not a run of rig's,
    or if it ends before the run's set-up was written.
    """

    def __init__(self, run: Path) -> None:
        self.path = run / LOG_FILE if run.is_dir() else run
        try:
            self._log = memoryview(self.path.read_bytes())
        except OSError as error:
            raise RecordError(
                f"{run}: there is no readable run here: {self.path.name}: {error.strerror}. Give "
                f"the folder that `rig characterise` made, or its {LOG_FILE}."
            ) from error
        self._found = scan_log(self.path, self._log)
        self._telemetry: dict[str, dict[str, NDArray[Any]]] = {}
        self._topics = {c.topic: c for c in self._found.channels.values()}
        starts = self._metadata(START_METADATA, StartDocument)
        if not starts:
            why = self._found.problem or "it has no start document"
            raise RecordError(
                f"{self.path}: this MCAP file does not hold the set-up of a run: {why}. If it is "
                f"a run of rig's it was cut off before the first point and must be repeated."
            )
        self._start = starts[0]

    @property
    def complete(self) -> bool:
        """Whether the run was stopped in order and its file closed."""
        return self._found.finished and self.stop() is not None

    @property
    def problem(self) -> str | None:
        """Why the log is not complete, as the end of a sentence; None if it is."""
        if self._found.problem is not None:
            return self._found.problem
        if self.stop() is None:
            return "the run was never stopped: it has no stop document"
        return None

    def start(self) -> StartDocument:
        """What the run set out to do."""
        return self._start

    def stop(self) -> StopDocument | None:
        """How the run ended; None if it was killed or is still going on."""
        stops = self._metadata(STOP_METADATA, StopDocument)
        return stops[-1] if stops else None

    def resumes(self) -> tuple[ResumeDocument, ...]:
        """Each time the run was taken up again."""
        return self._metadata(RESUME_METADATA, ResumeDocument)

    def attachments(self) -> dict[str, bytes]:
        """The attached files by name."""
        return {entry.index.name: entry.data for entry in self._found.attachments}

    def setup(self) -> Setup:
        """The specs and calibrations that the run was made with.

        Raises SpecError for attachments that are missing or broken.
        """
        texts = {
            name: data.decode(errors="replace")
            for name, data in self.attachments().items()
            if name.endswith(".yaml")
        }
        return Setup.from_attachments(texts, self.path)

    def points(self) -> tuple[PointDocument, ...]:
        """Every complete point in the order of measurement."""
        return self._documents(POINTS_TOPIC, PointDocument)

    def deformation_readings(self) -> tuple[DeformationReading, ...]:
        """Every vision result in the order of measurement."""
        return self._documents(DEFORMATION_TOPIC, DeformationReading)

    def parts(self) -> tuple[PartDocument, ...]:
        """Every complete part of the trials in the order of measurement."""
        return self._documents(PARTS_TOPIC, PartDocument)

    def looks(self) -> tuple[LookDocument, ...]:
        """The deformations that were looked at in trials, in order."""
        return self._documents(LOOKS_TOPIC, LookDocument)

    def gas(self) -> tuple[GasDocument, ...]:
        """What the gas did each time the valve was closed."""
        return self._documents(GAS_TOPIC, GasDocument)

    def rest_image(self) -> bytes | None:
        """JPEG of the actuator at rest, from which elongations count; None if there is none."""
        for topic, _, data in self._messages(REST_TOPIC):
            try:
                return bytes(CompressedImage.FromString(data).data)
            except DecodeError as error:
                raise self._foreign(topic, error) from error
        return None

    def images(self) -> Iterator[CameraImage]:
        """Every recorded image, one at a time."""
        topics = (CAMERA_KEY_TOPIC, CAMERA_TOPIC)
        note: dict[str, Any] = {"frame": 0}
        for topic, time_ns, data in self._messages(*topics):
            try:
                if topic == CAMERA_KEY_TOPIC:
                    note = json.loads(data)
                    continue
                image = CompressedImage.FromString(data)
                frame = int(note.pop("frame"))
                key = PointKey.model_validate(note) if note else None
            except (ValueError, KeyError, TypeError, AttributeError, DecodeError) as error:
                raise self._foreign(topic, error) from error
            yield CameraImage(key, frame, time_ns / 1e9, image.data)

    def events(self) -> tuple[Event, ...]:
        """Everything that was logged, in order."""
        found: list[Event] = []
        for topic, time_ns, data in self._messages(LOG_TOPIC):
            try:
                line = Log.FromString(data)
                values = json.loads(line.message)
            except (ValueError, DecodeError) as error:
                raise self._foreign(topic, error) from error
            level = LEVEL_NAMES.get(line.level, "info")
            found.append(Event(time_ns / 1e9, line.name, values, level))
        return tuple(found)

    def telemetry_messages(self) -> tuple[str, ...]:
        """Names of the CAN messages of which there is telemetry."""
        return tuple(
            topic.removeprefix(TELEMETRY_PREFIX).upper()
            for topic in sorted(self._topics)
            if topic.startswith(TELEMETRY_PREFIX)
        )

    def telemetry(self, message: str) -> dict[str, NDArray[Any]]:
        """Columns of the CAN message `message`, each (n,), with `time_s` in bench seconds.

        Numbers are float64 (NaN where a row had none), enumerations text. A message that was
        never received gives only an empty `time_s`.
        """
        known = self._telemetry.get(message)
        if known is None:
            known = self._telemetry[message] = self._read_telemetry(message)
            for column in known.values():
                column.flags.writeable = False  # the next caller gets the same arrays
        return dict(known)

    def _read_telemetry(self, message: str) -> dict[str, NDArray[Any]]:
        topic = telemetry_topic(message)
        channel = self._topics.get(topic)
        if channel is None:
            return {"time_s": np.empty(0)}
        time_s, payloads = self._bulk(topic)
        try:
            schema = json.loads(self._found.schemas[channel.schema_id].data)
            table = columns(payloads, schema["properties"])
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise self._foreign(topic, error) from error
        return {"time_s": time_s} | table

    def can_frames(self) -> CanFrames:
        """Every raw frame of the link, for replay."""
        time_s, encoded = self._bulk(CAN_TOPIC)
        return CanFrames(
            time_s=time_s,
            ids=np.array([int.from_bytes(e[1:5], "little") for e in encoded], dtype=np.uint32),
            payloads=[e[7:] for e in encoded],
        )

    def counts(self) -> dict[str, int]:
        """Number of readable messages of each topic."""
        totals = dict.fromkeys(sorted(self._topics), 0)
        for entry in self._found.chunks:
            for channel_id, count in entry.counts.items():
                totals[self._found.channels[channel_id].topic] += count
        return totals

    def _bulk(self, topic: str) -> tuple[NDArray[np.float64], list[bytes]]:
        """Bench times and payloads of all messages of one channel."""
        times: list[NDArray[np.int64]] = [np.empty(0, np.int64)]
        payloads: list[bytes] = []
        channel = self._topics.get(topic)
        for entry in self._found.chunks:
            if channel is None or channel.id not in entry.counts:
                continue
            try:
                chunk_times, chunk_payloads = read_channel(self._log, entry, channel.id)
            except MALFORMED as error:
                raise self._foreign(topic, error) from error
            times.append(chunk_times)
            payloads += chunk_payloads
        return np.concatenate(times) / 1e9, payloads

    def _messages(self, *topics: str) -> Iterator[tuple[str, int, bytes]]:
        """Topic, log time and payload of the messages of `topics`, in the order of the file."""
        wanted = {self._topics[topic].id: topic for topic in topics if topic in self._topics}
        if not wanted:
            return
        for entry in self._found.chunks:
            if not wanted.keys() & entry.counts.keys():
                continue
            try:
                records = chunk_data(self._log, entry.index)
                for channel_id, time_ns, _, start, end in iter_messages(records):
                    if channel_id in wanted:
                        yield wanted[channel_id], time_ns, records[start:end]
            except MALFORMED as error:
                raise self._foreign("/".join(topics), error) from error

    def _documents(self, topic: str, kind: type[AnyDocument]) -> tuple[AnyDocument, ...]:
        return tuple(self._document(topic, kind, data) for _, _, data in self._messages(topic))

    def _metadata(self, name: str, kind: type[AnyDocument]) -> tuple[AnyDocument, ...]:
        return tuple(
            self._document(name, kind, entry.metadata.metadata.get("document", "").encode())
            for entry in self._found.metadata
            if entry.metadata.name == name
        )

    def _document(self, where: str, kind: type[AnyDocument], data: bytes) -> AnyDocument:
        try:
            values = json.loads(data)
            # What is None was left out of the message; see `channels.document_schema`.
            absent = {name: None for name in kind.model_fields if name not in values}
            return kind.model_validate(values | absent)
        except (ValidationError, ValueError, TypeError) as error:
            raise self._foreign(where, error) from error

    def _foreign(self, where: str, error: Exception) -> RecordError:
        return RecordError(
            f"{self.path}: what {where} holds is not what this version of rig writes: {error}. "
            f"Read the run with the version that recorded it; {START_METADATA} names it."
        )
