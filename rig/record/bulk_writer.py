"""Writes MCAP fast: messages are framed in bulk and each group of channels has its own chunks.

A group keeps one kind of message together, so that a chunk holds one channel: it compresses
better, and a reader that wants one channel decompresses nothing else.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Sequence
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

from rig.record.errors import RecordError
from rig.record.mcap_format import (
    MAGIC,
    MESSAGE_FIXED,
    MESSAGE_HEAD,
    Scan,
    encode,
    encode_message_index,
)

CHUNK_SIZE = 1 << 20
"""A chunk is closed when its records exceed this many bytes."""
BATCH = 4096
"""Messages framed at a time, so that no chunk grows far beyond CHUNK_SIZE."""


class _OpenChunk:
    """Message records that wait to become a chunk."""

    def __init__(self) -> None:
        self.records = bytearray()
        self.times: dict[int, list[int]] = {}
        self.offsets: dict[int, list[int]] = {}


class BulkWriter:
    """An MCAP file in the making on `stream`, a new binary file."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._position = 0
        self._data_crc = 0
        self._compressor = zstandard.ZstdCompressor(level=3)
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._open: dict[str, _OpenChunk] = {}
        self._uncompressed_groups: set[str] = set()
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}

    def start(self, library: str) -> None:
        """Write magic and header of a new file."""
        self._write(MAGIC + encode(Header("", library)))

    def continue_from(self, found: Scan, keep_chunks: int, kept_bytes: bytes) -> None:
        """Take over an existing file of which the first chunks, `kept_bytes`, are kept.

        Message indexes that were cut off are added.
        """
        self._write(kept_bytes)
        kept = found.chunks[:keep_chunks]
        end = self._position
        self._channels = {
            number: channel
            for number, channel in found.channels.items()
            if found.definition_ends[number] <= end
        }
        used = {channel.schema_id for channel in self._channels.values()}
        self._schemas = {n: schema for n, schema in found.schemas.items() if n in used}
        self._chunks = [entry.index for entry in kept]
        self._attachments = [a.index for a in found.attachments if a.index.offset < end]
        self._metadata = [m.index for m in found.metadata if m.index.offset < end]
        for entry in kept:
            for channel_id, count in entry.counts.items():
                self._counts[channel_id] = self._counts.get(channel_id, 0) + count
        if kept:
            self._write(kept[-1].missing_indexes)

    def keep_uncompressed(self, group: str) -> None:
        """Write the chunks of `group` as they are: it holds data that is compressed already."""
        self._uncompressed_groups.add(group)

    def channel_id(self, topic: str) -> int | None:
        """Id of the channel `topic` if it is registered."""
        for channel in self._channels.values():
            if channel.topic == topic:
                return channel.id
        return None

    def register(self, topic: str, encoding: str, schema: tuple[str, str, bytes]) -> int:
        """Register a channel with its schema (name, encoding, data); returns the channel's id."""
        known = self.channel_id(topic)
        if known is not None:
            return known
        name, schema_encoding, data = schema
        new_schema = Schema(
            id=max(self._schemas, default=0) + 1, data=data, encoding=schema_encoding, name=name
        )
        self._schemas[new_schema.id] = new_schema
        channel = Channel(
            id=max(self._channels, default=0) + 1,
            topic=topic,
            message_encoding=encoding,
            metadata={},
            schema_id=new_schema.id,
        )
        self._channels[channel.id] = channel
        self._write(encode(new_schema) + encode(channel))
        return channel.id

    def add(self, group: str, channel_id: int, times_ns: Sequence[int], data: list[bytes]) -> None:
        """Append messages of one channel; `data` are their payloads."""
        pack = MESSAGE_HEAD.pack
        opcode = int(Opcode.MESSAGE)
        for first in range(0, len(data), BATCH):
            chunk = self._open.setdefault(group, _OpenChunk())
            times = chunk.times.setdefault(channel_id, [])
            offsets = chunk.offsets.setdefault(channel_id, [])
            sequence = self._counts.get(channel_id, 0)
            offset = len(chunk.records)
            parts: list[bytes] = []
            for payload, time_ns in zip(
                data[first : first + BATCH], times_ns[first : first + BATCH], strict=True
            ):
                size = len(payload)
                parts.append(
                    pack(opcode, MESSAGE_FIXED + size, channel_id, sequence, time_ns, time_ns)
                )
                parts.append(payload)
                times.append(time_ns)
                offsets.append(offset)
                offset += MESSAGE_HEAD.size + size
                sequence += 1
            chunk.records += b"".join(parts)
            self._counts[channel_id] = sequence
            if len(chunk.records) > CHUNK_SIZE:
                self._close_chunk(group)

    def add_equal(
        self, group: str, channel_id: int, times_ns: Sequence[int], payloads: NDArray[np.void]
    ) -> None:
        """Append messages whose payloads are equally long: a structured array, one row each."""
        layout = np.dtype(
            [
                ("opcode", "u1"),
                ("length", "<u8"),
                ("channel_id", "<u2"),
                ("sequence", "<u4"),
                ("log_time", "<u8"),
                ("publish_time", "<u8"),
                ("payload", payloads.dtype),
            ]
        )
        for first in range(0, len(payloads), BATCH):
            some = payloads[first : first + BATCH]
            some_times = times_ns[first : first + BATCH]
            chunk = self._open.setdefault(group, _OpenChunk())
            sequence = self._counts.get(channel_id, 0)
            messages = np.empty(len(some), dtype=layout)
            messages["opcode"] = Opcode.MESSAGE
            messages["length"] = MESSAGE_FIXED + payloads.dtype.itemsize
            messages["channel_id"] = channel_id
            messages["sequence"] = np.arange(sequence, sequence + len(some))
            messages["log_time"] = some_times
            messages["publish_time"] = messages["log_time"]
            messages["payload"] = some
            offset, size = len(chunk.records), layout.itemsize
            chunk.times.setdefault(channel_id, []).extend(some_times)
            chunk.offsets.setdefault(channel_id, []).extend(
                range(offset, offset + size * len(some), size)
            )
            chunk.records += messages.tobytes()
            self._counts[channel_id] = sequence + len(some)
            if len(chunk.records) > CHUNK_SIZE:
                self._close_chunk(group)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add a file."""
        record = encode(Attachment(0, 0, name, media_type, data))
        self._attachments.append(
            AttachmentIndex(self._position, len(record), 0, 0, len(data), name, media_type)
        )
        self._write(record)

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Add a named set of texts."""
        record = encode(Metadata(name, values))
        self._metadata.append(MetadataIndex(self._position, len(record), name))
        self._write(record)

    def flush(self) -> None:
        """Close the open chunks and hand everything to the operating system."""
        for group in tuple(self._open):
            self._close_chunk(group)
        try:
            self._stream.flush()
        except OSError as error:
            raise _unwritable(self._stream, error) from error

    def sync(self) -> None:
        """Flush and wait until the disk has it."""
        self.flush()
        try:
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise _unwritable(self._stream, error) from error

    def finish(self) -> None:
        """Write summary and end of the file; the stream stays open."""
        self.flush()
        self._write(encode(DataEnd(self._data_crc)))
        start = self._position
        groups: list[tuple[int, list[bytes]]] = [
            (Opcode.SCHEMA, [encode(schema) for schema in self._schemas.values()]),
            (Opcode.CHANNEL, [encode(channel) for channel in self._channels.values()]),
            (Opcode.STATISTICS, [encode(self._statistics())]),
            (Opcode.CHUNK_INDEX, [encode(index) for index in self._chunks]),
            (Opcode.ATTACHMENT_INDEX, [encode(index) for index in self._attachments]),
            (Opcode.METADATA_INDEX, [encode(index) for index in self._metadata]),
        ]
        summary = b""
        offsets = b""
        for opcode, records in groups:
            block = b"".join(records)
            if block:
                offsets += encode(SummaryOffset(opcode, start + len(summary), len(block)))
                summary += block
        footer = Footer(start, start + len(summary), 0)
        # The checksum covers the summary and the footer up to the checksum itself.
        footer.summary_crc = zlib.crc32(summary + offsets + encode(footer)[:-4])
        self._write(summary + offsets + encode(footer) + MAGIC)
        self.sync()

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(sorted(self._counts.items())),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _close_chunk(self, group: str) -> None:
        chunk = self._open.pop(group)
        if not chunk.records:
            return
        plain = group in self._uncompressed_groups
        records = bytes(chunk.records)
        data = records if plain else self._compressor.compress(records)
        first = min(min(times) for times in chunk.times.values())
        last = max(max(times) for times in chunk.times.values())
        record = encode(
            Chunk(
                compression="" if plain else "zstd",
                data=data,
                message_start_time=first,
                message_end_time=last,
                uncompressed_crc=zlib.crc32(records),
                uncompressed_size=len(records),
            )
        )
        index = ChunkIndex(
            message_start_time=first,
            message_end_time=last,
            chunk_start_offset=self._position,
            chunk_length=len(record),
            message_index_offsets={},
            message_index_length=0,
            compression="" if plain else "zstd",
            compressed_size=len(data),
            uncompressed_size=len(records),
        )
        after = self._position + len(record)
        indexes = b""
        for channel_id, times in chunk.times.items():
            index.message_index_offsets[channel_id] = after + len(indexes)
            indexes += encode_message_index(channel_id, times, chunk.offsets[channel_id])
        index.message_index_length = len(indexes)
        self._write(record + indexes)
        self._chunks.append(index)

    def _write(self, data: bytes) -> None:
        try:
            self._stream.write(data)
        except OSError as error:
            raise _unwritable(self._stream, error) from error
        self._position += len(data)
        self._data_crc = zlib.crc32(data, self._data_crc)


def _unwritable(stream: BinaryIO, error: OSError) -> RecordError:
    return RecordError(
        f"{stream.name}: the log cannot be written: {error.strerror or error}. Everything up to "
        f"the last completed point is on disk; make room or mend the disk, then `rig resume`."
    )


def times_to_ns(times_s: Sequence[float] | NDArray[np.float64]) -> list[int]:
    """Bench seconds to the nanoseconds of log times."""
    if isinstance(times_s, np.ndarray):
        nanoseconds: list[int] = np.rint(times_s * 1e9).astype(np.int64).tolist()
        return nanoseconds
    return [round(time_s * 1e9) for time_s in times_s]
