"""Writes a run: one folder with `run.mcap` and a Foxglove layout beside it.

A point is durable when `point` returns: everything written before it is in closed chunks on disk.
A killed process therefore leaves a log that is readable up to its last complete point at least.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from types import TracebackType
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.timestamp_pb2 import Timestamp
from numpy.typing import NDArray

import rig
from rig.record.bulk_writer import BulkWriter, times_to_ns
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
    Level,
    camera_key_schema,
    can_frame_schema,
    document_schema,
    protobuf_schema,
    telemetry_schema,
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
from rig.record.layout import LAYOUT_FILE, foxglove_layout
from rig.record.lock import FolderLock
from rig.record.mcap_format import Scan, scan_log
from rig.record.telemetry import RowFormatter

MEDIA_TYPES = {".yaml": "application/yaml", ".json": "application/json", ".dbc": "text/plain"}
LIBRARY = f"rig {rig.__version__}"
Units = Mapping[str, Mapping[str, str]]
"""Unit of each signal of each CAN message, as {"PRESSURE": {"pressure_kpa": "kPa"}}."""


class RunWriter:
    """The log of one run, open for writing; use it as a context manager.

    Times are bench seconds since the run began. Raises RecordError when the disk refuses.
    """

    def __init__(self, folder: Path, log: BulkWriter, lock: FolderLock, stream: Any) -> None:
        self.folder = folder
        self._log = log
        self._lock = lock
        self._stream = stream
        self._units: Units = {}
        self._formatters: dict[str, tuple[int, RowFormatter]] = {}
        self._can_channel: int | None = None
        self._closed = False
        self.is_live = False
        """Whether bench time is the clock's, so that somebody may watch the log while it grows."""
        log.keep_uncompressed("camera")

    @classmethod
    def create(
        cls,
        folder: Path,
        start: StartDocument,
        attachments: Mapping[str, bytes],
        units: Units | None = None,
    ) -> RunWriter:
        """Begin a run in `folder`, which must not exist or be empty.

        `attachments` are files by name (specs, calibrations, DBC, firmware identity); `units` are
        those of the telemetry. Raises RecordError if the folder is taken or cannot be written.
        """
        require_free_folder(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordError(
                f"{folder}: no run folder can be made here: {error.strerror}. Choose another "
                f"folder with --out."
            ) from error
        lock = FolderLock(folder)
        try:
            stream = (folder / LOG_FILE).open("xb")
            (folder / LAYOUT_FILE).write_text(foxglove_layout(), encoding="utf-8")
        except OSError as error:
            lock.release()
            raise RecordError(f"{folder}: the log cannot be made: {error.strerror}.") from error
        writer = cls(folder, BulkWriter(stream), lock, stream)
        writer._units = units or {}
        writer.is_live = start.created is not None
        writer._log.start(LIBRARY)
        for name, data in attachments.items():
            suffix = PurePosixPath(name).suffix
            media_type = MEDIA_TYPES.get(suffix, "application/octet-stream")
            writer._log.attach(name, media_type, data)
        # Last of the set-up: a log that has it has every attachment, too.
        writer._log.add_metadata(START_METADATA, {"document": start.model_dump_json()})
        writer._log.sync()
        _sync_folder(folder)
        return writer

    @classmethod
    def resume(
        cls, folder: Path, keep_points: int | None = None, units: Units | None = None
    ) -> RunWriter:
        """Take up the run in `folder` after its last complete point, or after `keep_points`.

        The log is cut there; if that drops anything the old file stays beside it as
        `run.interrupted-1.mcap` (or the next free number). Raises RecordError if there is no
        run, if its set-up was not complete, if it has fewer points than asked for, or if
        another process is writing it.
        """
        path = folder / LOG_FILE
        if not path.is_file():
            raise RecordError(
                f"{folder}: there is no run to resume: {LOG_FILE} is missing. Give the folder that "
                f"`rig characterise` made."
            )
        lock = FolderLock(folder)
        try:
            return cls._resume_locked(folder, path, lock, keep_points, units)
        except BaseException:
            lock.release()
            raise

    @classmethod
    def _resume_locked(
        cls,
        folder: Path,
        path: Path,
        lock: FolderLock,
        keep_points: int | None,
        units: Units | None,
    ) -> RunWriter:
        try:
            content = path.read_bytes()
        except OSError as error:
            raise RecordError(f"{path}: the log cannot be read: {error.strerror}.") from error
        found = scan_log(path, memoryview(content))
        starts = [e.metadata for e in found.metadata if e.metadata.name == START_METADATA]
        if not starts:
            raise RecordError(
                f"{path}: the log ends before the set-up of the run was written, so there is "
                f"nothing to resume. Start a new run with `rig characterise`."
            )
        keep_chunks, end = _cut(path, found, keep_points)
        partial = path.with_suffix(".mcap.partial")
        try:
            stream = partial.open("wb")
            log = BulkWriter(stream)
            log.continue_from(found, keep_chunks, content[:end])
            log.sync()
            if _drops_data(found, end):
                os.link(path, _free_name(folder))
            partial.replace(path)
        except OSError as error:
            raise RecordError(
                f"{folder}: the log cannot be prepared for resuming: {error.strerror}. The old "
                f"log is untouched."
            ) from error
        _sync_folder(folder)
        writer = cls(folder, log, lock, stream)
        writer._units = units or {}
        writer.is_live = json.loads(starts[0].metadata["document"]).get("created") is not None
        return writer

    def __enter__(self) -> RunWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def telemetry(
        self,
        message: str,
        times_s: Sequence[float] | NDArray[np.float64],
        rows: Sequence[Mapping[str, float | int | str]],
    ) -> None:
        """Decoded CAN messages named `message` in the DBC; field names carry their units."""
        if not rows:
            return
        known = self._formatters.get(message)
        if known is None:
            schema = telemetry_schema(message, rows[0], self._units.get(message, {}))
            channel_id = self._log.register(telemetry_topic(message), "json", schema)
            known = self._formatters[message] = (channel_id, RowFormatter(rows[0]))
        channel_id, formatter = known
        self._log.add(message, channel_id, times_to_ns(times_s), formatter(rows))

    def can_frames(
        self,
        times_s: Sequence[float] | NDArray[np.float64],
        ids: Sequence[int],
        payloads: Sequence[bytes] | NDArray[np.uint8],
    ) -> None:
        """Raw CAN frames in the order of the link; `payloads` as bytes or as an (n, 8) array."""
        if not len(ids):
            return
        if self._can_channel is None:
            self._can_channel = self._log.register(CAN_TOPIC, "protobuf", can_frame_schema())
        times_ns = times_to_ns(times_s)
        if len(times_ns) != len(ids) or len(payloads) != len(ids):
            raise ValueError("times_s, ids and payloads must be equally long")
        joined = b"".join(map(bytes, payloads))
        lengths = {len(payload) for payload in payloads}
        if len(lengths) == 1 and (length := lengths.pop()):
            frames = np.empty(len(ids), dtype=_can_frame_layout(length))
            frames["id_tag"], frames["id"] = 0x0D, ids
            frames["data_tag"], frames["length"] = 0x12, length
            frames["data"] = np.frombuffer(joined, dtype=f"V{length}")
            self._log.add_equal("can", self._can_channel, times_ns, frames)
            return
        encoded = [
            b"\x0d" + int(number).to_bytes(4, "little") + b"\x12" + bytes((len(data),)) + data
            for number, data in zip(ids, map(bytes, payloads), strict=True)
        ]
        self._log.add("can", self._can_channel, times_ns, encoded)

    def image(self, time_s: float, jpeg: bytes, key: PointKey | None, frame: int) -> None:
        """A camera image and the point it belongs to, if any."""
        camera = self._log.register(CAMERA_TOPIC, "protobuf", protobuf_schema(CompressedImage))
        keys = self._log.register(CAMERA_KEY_TOPIC, "json", camera_key_schema())
        times_ns = times_to_ns((time_s,))
        note: dict[str, Any] = {"frame": frame}
        if key is not None:
            note |= key.model_dump()
        # The note goes first: an image that can be read always has its note.
        self._log.add("camera", keys, times_ns, [json.dumps(note).encode()])
        self._log.add("camera", camera, times_ns, [_image(time_s, jpeg)])

    def rest(self, time_s: float, jpeg: bytes) -> None:
        """The camera image of the actuator at rest, from which elongations count."""
        channel = self._log.register(REST_TOPIC, "protobuf", protobuf_schema(CompressedImage))
        self._log.add("camera", channel, times_to_ns((time_s,)), [_image(time_s, jpeg)])

    def deformation(self, reading: DeformationReading, time_s: float) -> None:
        """What vision made of one image."""
        self._document(DEFORMATION_TOPIC, reading, time_s)

    def event(
        self, time_s: float, name: str, data: Mapping[str, Any], level: Level = "info"
    ) -> None:
        """Something that happened; `data` must be JSON values. It shows in Foxglove's log."""
        channel_id = self._log.register(LOG_TOPIC, "protobuf", protobuf_schema(Log))
        times_ns = times_to_ns((time_s,))
        line = Log(
            timestamp=_timestamp(times_ns[0]),
            level=LEVELS[level],  # type: ignore[arg-type]
            name=name,
            message=json.dumps(data),
        )
        self._log.add("log", channel_id, times_ns, [line.SerializeToString()])

    def hand_on(self) -> None:
        """Let readers of the file see what was written; the disk is not waited for."""
        self._log.flush()

    def point(self, document: PointDocument, time_s: float) -> None:
        """A completed point; when this returns it and everything before it is on disk."""
        self._log.flush()
        self._document(POINTS_TOPIC, document, time_s)
        self._log.sync()

    def look(self, document: LookDocument, time_s: float) -> None:
        """The deformation in one frame of a trial."""
        self._document(LOOKS_TOPIC, document, time_s)

    def part(self, document: PartDocument, time_s: float) -> None:
        """A completed part of a trial; when this returns it is on disk, as a point is."""
        self._log.flush()
        self._document(PARTS_TOPIC, document, time_s)
        self._log.sync()

    def gas(self, document: GasDocument, time_s: float) -> None:
        """What the gas did while the valve was closed."""
        self._document(GAS_TOPIC, document, time_s)

    def resume_note(self, document: ResumeDocument, time_s: float) -> None:
        """The run was taken up again."""
        self.event(time_s, "resume", document.model_dump(), "warning")
        self._log.add_metadata(RESUME_METADATA, {"document": document.model_dump_json()})
        self._log.sync()

    def stop(self, document: StopDocument, time_s: float) -> None:
        """How the run ended; `close` still has to follow."""
        level: Level = "info" if document.exit_status == "success" else "error"
        self.event(time_s, "stop", document.model_dump(), level)
        self._log.flush()
        self._log.add_metadata(
            STOP_METADATA, {"document": document.model_dump_json(), "time_s": repr(float(time_s))}
        )
        self._log.sync()

    def close(self) -> None:
        """Write the summary and close the file; harmless when repeated."""
        if self._closed:
            return
        self._closed = True
        try:
            self._log.finish()
        finally:
            self._stream.close()
            self._lock.release()

    def _document(self, topic: str, document: Document, time_s: float) -> None:
        channel_id = self._log.register(topic, "json", document_schema(type(document)))
        data = document.model_dump_json(exclude_none=True).encode()
        self._log.add(topic, channel_id, times_to_ns((time_s,)), [data])


def _image(time_s: float, jpeg: bytes) -> bytes:
    image = CompressedImage(
        timestamp=_timestamp(times_to_ns((time_s,))[0]),
        frame_id="camera",
        data=jpeg,
        format="jpeg",
    )
    return bytes(image.SerializeToString())


def require_free_folder(folder: Path) -> None:
    """Raise RecordError unless a new run may be recorded in `folder`: it is absent or empty."""
    try:
        taken = next(folder.iterdir(), None) if folder.exists() else None
    except OSError as error:
        raise RecordError(
            f"{folder}: this is no folder for a run: {error.strerror}. Choose another with --out."
        ) from error
    if taken is not None:
        raise RecordError(
            f"{folder}: the folder is not empty ({taken.name} is in it) and a run never "
            f"overwrites anything. Choose another folder with --out, or continue the run "
            f"that is there with `rig resume {folder}`."
        )


def _cut(path: Path, found: Scan, keep_points: int | None) -> tuple[int, int]:
    """Number of chunks to keep and the offset where they end."""
    durable = [found.channel_id(topic) for topic in (POINTS_TOPIC, PARTS_TOPIC)]
    points = 0
    keep_chunks = 0
    for number, entry in enumerate(found.chunks, start=1):
        if keep_points is not None and points >= keep_points:
            break
        count = sum(entry.counts.get(channel, 0) for channel in durable if channel is not None)
        if count:
            points += count
            keep_chunks = number
    if keep_points is not None and points != keep_points:
        raise RecordError(
            f"{path}: {keep_points} points were to be kept but the log has {points} complete "
            f"ones. Resume without a number to keep them all."
        )
    if keep_chunks:
        return keep_chunks, found.chunks[keep_chunks - 1].end
    if found.chunks:
        return 0, found.chunks[0].index.chunk_start_offset
    return 0, found.data_end


def _drops_data(found: Scan, end: int) -> bool:
    """Whether cutting at `end` loses more than the summary of a closed file."""
    return found.problem is not None or found.data_end > end


def _can_frame_layout(length: int) -> np.dtype[np.void]:
    """Bytes of a `rig.CanFrame` message with a payload of `length` below 128."""
    return np.dtype(
        [
            ("id_tag", "u1"),
            ("id", "<u4"),
            ("data_tag", "u1"),
            ("length", "u1"),
            ("data", f"V{length}"),
        ]
    )


def _free_name(folder: Path) -> Path:
    number = 1
    while (name := folder / f"run.interrupted-{number}.mcap").exists():
        number += 1
    return name


def _timestamp(time_ns: int) -> Timestamp:
    return Timestamp(seconds=time_ns // 10**9, nanos=time_ns % 10**9)


def _sync_folder(folder: Path) -> None:
    """Make new names in the folder durable; not every system can."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(descriptor)
    except OSError:
        pass
    finally:
        os.close(descriptor)
