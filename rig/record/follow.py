"""Reads a log while it is being written: what is complete so far, and then what comes.

Nothing but the file is shared with whoever writes it, so that a watcher can never disturb a run.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema

from rig.record.channels import LOG_FILE, SchemaRecord
from rig.record.errors import RecordError
from rig.record.mcap_format import MAGIC, MALFORMED, RECORD_HEAD, chunk_data, decode, iter_messages


@dataclass(frozen=True)
class LoggedChannel:
    """A channel as the log defines it."""

    topic: str
    encoding: str
    """Of its messages: json or protobuf."""
    schema: SchemaRecord


class LogFollower:
    """Follows the log of a run: give its folder or its MCAP file.

    Raises RecordError if there is no such file or it is not an MCAP.
    """

    def __init__(self, run: Path) -> None:
        self.path = run / LOG_FILE if run.is_dir() else run
        self.channels: dict[int, LoggedChannel] = {}
        self.finished = False
        """Whether the writer has closed the log."""
        self._schemas: dict[int, SchemaRecord] = {}
        self._inode: int | None = None
        self._offset = 0
        with self._open() as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise RecordError(
                    f"{self.path}: this is not an MCAP file. Give the folder of a run."
                )

    def poll(self) -> list[tuple[int, int]]:
        """Offset and length of every chunk that was completed since the last call.

        Channels that were defined meanwhile are in `channels` when this returns. A log that was
        replaced, as `rig resume` does, is read again from its beginning.
        """
        chunks: list[tuple[int, int]] = []
        with self._open() as stream:
            end = stream.seek(0, 2)
            while not self.finished and self._offset + RECORD_HEAD.size <= end:
                stream.seek(self._offset)
                opcode, length = RECORD_HEAD.unpack(stream.read(RECORD_HEAD.size))
                size = RECORD_HEAD.size + length
                if self._offset + size > end:
                    break
                if opcode == Opcode.CHUNK:
                    chunks.append((self._offset, size))
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._define(opcode, stream.read(length))
                self.finished = opcode == Opcode.DATA_END
                self._offset += size
        return chunks

    def ended(self) -> bool:
        """Whether the log is closed already; what `poll` says next does not change by asking."""
        other = LogFollower(self.path)
        other.poll()
        return other.finished

    def messages(self, chunk: tuple[int, int]) -> Iterator[tuple[LoggedChannel, int, bytes]]:
        """Channel, log time in ns and payload of every message of a chunk, as they were written."""
        start, length = chunk
        with self._open() as stream:
            stream.seek(start)
            data = memoryview(stream.read(length))
        try:
            records = chunk_data(data, ChunkIndex(length, 0, "", 0, 0, 0, {}, 0, 0))
            for channel_id, time_ns, _, begin, end in iter_messages(records):
                yield self.channels[channel_id], time_ns, records[begin:end]
        except (*MALFORMED, KeyError) as error:
            raise self._damaged(start, error) from error

    def _define(self, opcode: int, body: bytes) -> None:
        try:
            if opcode == Opcode.SCHEMA:
                schema = decode(Schema, body)
                self._schemas[schema.id] = (schema.name, schema.encoding, schema.data)
            else:
                channel = decode(Channel, body)
                self.channels[channel.id] = LoggedChannel(
                    channel.topic, channel.message_encoding, self._schemas[channel.schema_id]
                )
        except (*MALFORMED, KeyError) as error:
            raise self._damaged(self._offset, error) from error

    def _open(self) -> BinaryIO:
        try:
            stream = self.path.open("rb")
            inode = self.path.stat().st_ino
        except OSError as error:
            raise RecordError(
                f"{self.path}: there is no readable log here: {error.strerror}. Give the folder "
                f"that `rig characterise` made, or its {LOG_FILE}."
            ) from error
        if inode != self._inode:
            self._inode, self._offset, self.finished = inode, len(MAGIC), False
        return stream

    def _damaged(self, offset: int, error: Exception) -> RecordError:
        return RecordError(
            f"{self.path}: the record at byte {offset} is damaged ({error}). `rig report` and "
            f"`rig replay` read what comes before it."
        )
