"""MCAP records in bytes: encoding for the bulk writer and a scan that survives truncation.

The record layouts are those of the MCAP specification (https://mcap.dev/spec) and come from the
`mcap` package; only messages are framed here, in bulk, because that package spends about 8 us on
each and a run has a million.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
)
from numpy.typing import NDArray

from rig.record.errors import RecordError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length of what follows."""
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""Opcode, length, channel, sequence, log time, publish time; the payload follows."""
MESSAGE_FIXED = MESSAGE_HEAD.size - RECORD_HEAD.size

MALFORMED = (
    struct.error,
    McapError,
    ValueError,
    OverflowError,
    MemoryError,
    zstandard.ZstdError,
)
"""What decoding a damaged record can raise (a bad UTF-8 string is a ValueError)."""

Record = TypeVar("Record", bound=McapRecord)


def encode(record: McapRecord) -> bytes:
    """Bytes of one record with its opcode and length."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def decode(kind: type[Record], body: bytes) -> Record:
    """A record of `kind` from the bytes after its opcode and length; raises one of MALFORMED."""
    stream = _ExactStream(io.BytesIO(body))
    record = kind.read(stream)  # type: ignore[attr-defined]
    assert isinstance(record, kind)
    return record


class _ExactStream(ReadDataStream):
    """Refuses to return less than was asked for; the library's own stream returns a stump."""

    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) != length:
            raise struct.error("record is shorter than it says")
        return data


def encode_message_index(channel_id: int, times_ns: list[int], offsets: list[int]) -> bytes:
    """MessageIndex record of one channel of one chunk."""
    entries = np.empty((len(times_ns), 2), dtype="<u8")
    entries[:, 0] = times_ns
    entries[:, 1] = offsets
    body = entries.tobytes()
    head = RECORD_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + len(body))
    return head + struct.pack("<HI", channel_id, len(body)) + body


@dataclass(frozen=True)
class ChunkEntry:
    """A complete chunk in a file."""

    index: ChunkIndex
    counts: dict[int, int]
    """Messages in it, by channel."""
    end: int
    """Offset of the first byte after it and its message indexes."""
    missing_indexes: bytes
    """The message indexes that should follow it and do not, because the file ends there."""


@dataclass(frozen=True)
class AttachmentEntry:
    """A complete attachment in a file."""

    index: AttachmentIndex
    data: bytes


@dataclass(frozen=True)
class MetadataEntry:
    """A complete metadata record in a file."""

    index: MetadataIndex
    metadata: Metadata


@dataclass
class Scan:
    """All that can be read of a log, finished or not: a prefix without a gap."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    definition_ends: dict[int, int] = field(default_factory=dict)
    """Offset after the definition of each channel."""
    chunks: list[ChunkEntry] = field(default_factory=list)
    attachments: list[AttachmentEntry] = field(default_factory=list)
    metadata: list[MetadataEntry] = field(default_factory=list)
    data_end: int = 0
    """Offset after the last complete record of the data section."""
    finished: bool = False
    """The writer closed the file: it has its summary and its end."""
    problem: str | None = None
    """Why reading stopped early; None for a finished file."""

    def channel_id(self, topic: str) -> int | None:
        """Id of the channel `topic`; None if the log has none."""
        for channel in self.channels.values():
            if channel.topic == topic:
                return channel.id
        return None


def chunk_data(log: memoryview, entry: ChunkIndex) -> bytes:
    """Uncompressed records of the chunk described by `entry`; raises one of MALFORMED."""
    start, length = entry.chunk_start_offset, entry.chunk_length
    chunk = decode(Chunk, bytes(log[start + RECORD_HEAD.size : start + length]))
    return _uncompressed(chunk)


def _uncompressed(chunk: Chunk) -> bytes:
    if chunk.compression == "zstd":
        data = zstandard.ZstdDecompressor().decompress(
            chunk.data, max_output_size=chunk.uncompressed_size
        )
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise ValueError(f"compression '{chunk.compression}' is not one that rig writes")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("checksum of a chunk does not match")
    return data


def iter_messages(records: bytes) -> Iterator[tuple[int, int, int, int, int]]:
    """Channel id, log time in ns, record offset, payload start and end of each message."""
    unpack = MESSAGE_HEAD.unpack_from
    head_size = RECORD_HEAD.size
    position, end = 0, len(records)
    while position < end:
        opcode, length = RECORD_HEAD.unpack_from(records, position)
        following = position + head_size + length
        if following > end:
            raise struct.error("record reaches beyond its chunk")
        if opcode == Opcode.MESSAGE:
            _, _, channel_id, _, log_time, _ = unpack(records, position)
            yield channel_id, log_time, position, position + MESSAGE_HEAD.size, following
        position = following


def read_channel(
    log: memoryview, entry: ChunkEntry, channel_id: int
) -> tuple[NDArray[np.int64], list[bytes]]:
    """Log times in ns and payloads of one channel's messages in a chunk, by its message index.

    Raises one of MALFORMED.
    """
    records = chunk_data(log, entry.index)
    if entry.missing_indexes:
        found = [m for m in iter_messages(records) if m[0] == channel_id]
        return np.array([m[1] for m in found], np.int64), [records[m[3] : m[4]] for m in found]
    place = entry.index.message_index_offsets[channel_id] + RECORD_HEAD.size + 6
    index = np.frombuffer(log, "<i8", 2 * entry.counts[channel_id], place).reshape(-1, 2)
    offsets = index[:, 1]
    content = np.frombuffer(records, np.uint8)
    if offsets.size and (offsets.min() < 0 or offsets.max() + MESSAGE_HEAD.size > content.size):
        raise ValueError("a message index points outside its chunk")
    lengths = content[offsets[:, None] + np.arange(1, RECORD_HEAD.size)].view("<i8")[:, 0]
    starts = (offsets + MESSAGE_HEAD.size).tolist()
    ends = (offsets + RECORD_HEAD.size + lengths).tolist()
    return index[:, 0], [records[a:b] for a, b in zip(starts, ends, strict=True)]


def scan(log: memoryview) -> Scan:
    """Read the structure of a log up to its end or up to the first damage.

    Every chunk is decompressed and checked, so what the result lists is readable. Raises
    ValueError if `log` does not begin as an MCAP file does.
    """
    if bytes(log[: len(MAGIC)]) != MAGIC:
        raise ValueError("no MCAP magic")
    found = Scan(data_end=len(MAGIC))
    position = len(MAGIC)
    while not found.finished and found.problem is None:
        if position + RECORD_HEAD.size > len(log):
            found.problem = f"the file ends without being closed, at byte {len(log)}"
            break
        opcode, length = RECORD_HEAD.unpack_from(log, position)
        following = position + RECORD_HEAD.size + length
        if following > len(log):
            found.problem = f"the file ends inside a record, at byte {len(log)}"
            break
        try:
            _take(found, log, opcode, position, following)
        except MALFORMED as error:
            found.problem = f"the record at byte {position} is damaged ({error})"
            break
        position = following
    try:
        _complete_last_chunk(found, log)
    except MALFORMED as error:
        damaged = found.chunks.pop()
        found.data_end = damaged.index.chunk_start_offset
        found.problem = f"the chunk at byte {found.data_end} is damaged ({error})"
    return found


def scan_log(path: Path, log: memoryview) -> Scan:
    """Scan the log at `path`; raises RecordError if it is no MCAP file."""
    try:
        return scan(log)
    except ValueError:
        raise RecordError(
            f"{path}: this is not an MCAP file, or nothing of it was written. Give the folder of "
            f"a run, or its log."
        ) from None


def _take(found: Scan, log: memoryview, opcode: int, position: int, following: int) -> None:
    body = bytes(log[position + RECORD_HEAD.size : following])
    if opcode == Opcode.SCHEMA:
        schema = decode(Schema, body)
        found.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL:
        channel = decode(Channel, body)
        found.channels[channel.id] = channel
        # The summary repeats definitions; the first one is the one that counts.
        found.definition_ends.setdefault(channel.id, following)
    elif opcode == Opcode.CHUNK:
        _take_chunk(found, body, position, following)
    elif opcode == Opcode.MESSAGE_INDEX:
        _take_message_index(found, body, position, following)
    elif opcode == Opcode.ATTACHMENT:
        _take_attachment(found, body, position, following)
    elif opcode == Opcode.METADATA:
        metadata = decode(Metadata, body)
        index = MetadataIndex(position, following - position, metadata.name)
        found.metadata.append(MetadataEntry(index, metadata))
    elif opcode == Opcode.DATA_END:
        stated = decode(DataEnd, body).data_section_crc
        if stated and zlib.crc32(log[:position]) != stated:
            raise ValueError("the checksum of the whole log does not match: something is damaged")
    elif opcode == Opcode.FOOTER:
        if bytes(log[following : following + len(MAGIC)]) != MAGIC:
            raise ValueError("the closing magic is missing")
        found.finished = True
    elif opcode not in _KNOWN:
        raise ValueError(f"unknown opcode {opcode}")
    if opcode in _DATA_SECTION and found.data_end == position:
        found.data_end = following


_DATA_SECTION = {
    Opcode.HEADER,
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.CHUNK,
    Opcode.MESSAGE_INDEX,
    Opcode.ATTACHMENT,
    Opcode.METADATA,
}
_KNOWN = set(Opcode)


def _take_chunk(found: Scan, body: bytes, position: int, following: int) -> None:
    chunk = decode(Chunk, body)
    records = _uncompressed(chunk)
    index = ChunkIndex(
        message_start_time=chunk.message_start_time,
        message_end_time=chunk.message_end_time,
        chunk_start_offset=position,
        chunk_length=following - position,
        message_index_offsets={},
        message_index_length=0,
        compression=chunk.compression,
        compressed_size=len(chunk.data),
        uncompressed_size=len(records),
    )
    found.chunks.append(ChunkEntry(index, {}, following, b""))


def _take_message_index(found: Scan, body: bytes, position: int, following: int) -> None:
    channel_id, size = struct.unpack_from("<HI", body)
    if size != len(body) - 6 or not found.chunks:
        raise ValueError("a message index of the wrong length or without a chunk")
    last = found.chunks[-1]
    last.index.message_index_offsets[channel_id] = position
    last.index.message_index_length += following - position
    last.counts[channel_id] = size // 16
    found.chunks[-1] = ChunkEntry(last.index, last.counts, following, b"")


def _take_attachment(found: Scan, body: bytes, position: int, following: int) -> None:
    attachment = decode(Attachment, body)
    if zlib.crc32(body[:-4]) != struct.unpack("<I", body[-4:])[0]:
        raise ValueError(f"checksum of attachment {attachment.name} does not match")
    index = AttachmentIndex(
        offset=position,
        length=following - position,
        log_time=attachment.log_time,
        create_time=attachment.create_time,
        data_size=len(attachment.data),
        name=attachment.name,
        media_type=attachment.media_type,
    )
    found.attachments.append(AttachmentEntry(index, attachment.data))


def _complete_last_chunk(found: Scan, log: memoryview) -> None:
    """Make up for message indexes that the end of the file cut off."""
    if found.finished or not found.chunks or found.chunks[-1].end != found.data_end:
        return
    last = found.chunks[-1]
    times: dict[int, list[int]] = {}
    offsets: dict[int, list[int]] = {}
    for channel_id, time_ns, offset, _, _ in iter_messages(chunk_data(log, last.index)):
        times.setdefault(channel_id, []).append(time_ns)
        offsets.setdefault(channel_id, []).append(offset)
    missing = b""
    for channel_id, channel_times in times.items():
        if channel_id in last.counts:
            continue
        last.index.message_index_offsets[channel_id] = last.end + len(missing)
        missing += encode_message_index(channel_id, channel_times, offsets[channel_id])
        last.counts[channel_id] = len(channel_times)
    last.index.message_index_length += len(missing)
    found.chunks[-1] = ChunkEntry(last.index, last.counts, last.end, missing)
