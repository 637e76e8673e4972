"""An MCAP file that grows: chunks of messages, each readable once it is written, and an index.

The records are the library's. Its own writer takes 7 us for a message, as much as all else that is
done for one; here messages and their places are packed at once.
"""

from __future__ import annotations

import zlib
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from itertools import chain, repeat
from struct import Struct, pack
from typing import IO

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
_MESSAGE = Struct("<BQHIQQ")
_INDEX = Struct("<BQHI")
_OPCODE = int(Opcode.MESSAGE)
_MESSAGE_BYTES = _MESSAGE.size - 9
"""Of the content of a message record before its data."""

_LEVEL = 1
"""Digits of numbers become smaller than at higher levels, in two thirds of the time."""

Message = tuple[int, int, int, bytes]
"""Channel, times of log and publication in ns, data."""


class Container:
    """Writes to a file that is open for binary writing; raises what that raises."""

    def __init__(self, file: IO[bytes], library: str) -> None:
        self._file = file
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._indexes: list[records.ChunkIndex] = []
        self._others: list[records.MetadataIndex | records.AttachmentIndex] = []
        self._counts: Counter[int] = Counter()
        self._compressor = zstandard.ZstdCompressor(_LEVEL, write_checksum=True)
        file.write(MAGIC)
        self._write(records.Header("", library))

    def schema(self, name: str, text: bytes) -> int:
        """The number of a new schema, in JSON Schema."""
        number = len(self._schemas) + 1
        self._schemas.append(records.Schema(number, text, "jsonschema", name))
        self._write(self._schemas[-1])
        return number

    def channel(self, topic: str, schema: int) -> int:
        """The number of a new channel, of messages in JSON."""
        number = len(self._channels) + 1
        self._channels.append(records.Channel(number, topic, "json", {}, schema))
        self._write(self._channels[-1])
        return number

    def metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Names and texts."""
        begin = self._file.tell()
        length = self._write(records.Metadata(name, dict(data)))
        self._others.append(records.MetadataIndex(begin, length, name))

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        """A file."""
        begin = self._file.tell()
        length = self._write(records.Attachment(0, 0, name, media_type, data))
        self._others.append(
            records.AttachmentIndex(begin, length, 0, 0, len(data), name, media_type)
        )

    def chunk(self, messages: Sequence[Message]) -> None:
        """Messages, compressed together, and where they are."""
        if not messages:
            return
        channels, times, dates, texts = zip(*messages, strict=True)
        sizes = list(map(len, texts))
        inside = [size + _MESSAGE_BYTES for size in sizes]
        heads = map(_MESSAGE.pack, repeat(_OPCODE), inside, channels, repeat(0), times, dates)
        plain = b"".join(chain.from_iterable(zip(heads, texts, strict=False)))
        places: defaultdict[int, list[int]] = defaultdict(list)
        offset = 0
        for channel, time_ns, size in zip(channels, times, sizes, strict=True):
            places[channel] += (time_ns, offset)
            offset += size + _MESSAGE.size
        packed = self._compressor.compress(plain)
        first, last = min(times), max(times)
        begin = self._file.tell()
        # No CRC: the compressor's own checksum takes a tenth of its time.
        length = self._write(records.Chunk("zstd", packed, last, first, 0, len(plain)))
        offsets = {}
        for channel, within in places.items():
            offsets[channel] = self._file.tell()
            data = pack(f"<{len(within)}Q", *within)
            size = len(data) + _INDEX.size - 9
            self._file.write(_INDEX.pack(Opcode.MESSAGE_INDEX, size, channel, len(data)) + data)
            self._counts[channel] += len(within) // 2
        self._indexes.append(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=begin,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=last,
                message_index_length=self._file.tell() - begin - length,
                message_index_offsets=offsets,
                message_start_time=first,
                uncompressed_size=len(plain),
            )
        )

    def finish(self) -> None:
        """End the file with its index."""
        self._write(records.DataEnd(0))
        begin = self._file.tell()
        builder = RecordBuilder()
        for record in (*self._schemas, *self._channels, self._statistics(), *self._indexes):
            record.write(builder)
        for other in self._others:
            other.write(builder)
        summary = builder.end()
        self._file.write(summary)
        records.Footer(begin, 0, 0).write(builder)
        footer = builder.end()
        crc = zlib.crc32(footer[:-4], zlib.crc32(summary))
        self._write(records.Footer(begin, 0, crc))
        self._file.write(MAGIC)

    def _statistics(self) -> records.Statistics:
        kinds = Counter(type(other) for other in self._others)
        return records.Statistics(
            attachment_count=kinds[records.AttachmentIndex],
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._indexes),
            message_count=self._counts.total(),
            message_end_time=max((i.message_end_time for i in self._indexes), default=0),
            message_start_time=min((i.message_start_time for i in self._indexes), default=0),
            metadata_count=kinds[records.MetadataIndex],
            schema_count=len(self._schemas),
        )

    def _write(self, record: records.McapRecord) -> int:
        """Write a record; its length."""
        builder = RecordBuilder()
        record.write(builder)
        data = builder.end()
        self._file.write(data)
        return len(data)
