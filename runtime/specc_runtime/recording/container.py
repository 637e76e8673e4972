"""An MCAP file that grows: chunks of messages, each readable once it is written, and an index.

Every record that occurs once is stored twice: schemas and channels in the first two chunks with
messages of them, other records where they were written and at the end.

The records are the library's. Its own writer takes 7 us for a message, as much as all other work
for that message. Here the messages of a chunk and their index are packed together.
"""

from __future__ import annotations

import zlib
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain, repeat
from math import inf
from pathlib import Path
from struct import Struct, pack
from tempfile import SpooledTemporaryFile
from typing import IO

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from specc_runtime.recording.spans import COPIES, FRAME, MAGIC, headed

CHUNK_S = 0.5
"""Simulated time from the first to the last message of a chunk, at most."""
_CHUNK_NS = CHUNK_S * 1e9
CHUNK_BYTES = 1 << 20
"""Size at which a chunk is written, so that readers need not unpack more at once."""
_MESSAGE = Struct("<BQHIQQ")
_INDEX = Struct("<BQHI")
_OPCODE = int(Opcode.MESSAGE)
_MESSAGE_BYTES = _MESSAGE.size - 9
"""Bytes of a message record between its head and its data."""

_LEVEL = 1
"""Level of zstandard: digits become smaller than at higher levels, in 2/3 of the time."""

_INDEX_BYTES = 1 << 20
"""Of the index of chunks in memory; of more there is a file without a name until the end."""
_COPIES = 2
"""Copies in the file of each record that occurs once."""
NOTHING: Mapping[str, str] = {}

Message = tuple[int, int, int, bytes] | tuple[int, int, int, bytes, int]
"""Channel, times of log and publication in ns, data, and its sequence number, if any."""


class Container:
    """Writes to a file that is open for binary writing; errors of the file pass through.

    What is in memory does not grow with the file: its index is in another one, in a `folder`.
    """

    def __init__(
        self, file: IO[bytes], library: str, folder: Path | None = None, profile: str = ""
    ) -> None:
        self._file = file
        self._spans = 0
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._copies: Counter[int] = Counter()
        """Number of copies of each channel in the file."""
        self._once: list[bytes] = []
        self._chunks = SpooledTemporaryFile[bytes](
            _INDEX_BYTES, dir=None if folder is None else str(folder)
        )
        """The records of the index of chunks."""
        self._chunk_count = 0
        self._first_ns, self._last_ns = inf, 0
        self._others: list[records.MetadataIndex | records.AttachmentIndex] = []
        self._counts: Counter[int] = Counter()
        self._compressor = zstandard.ZstdCompressor(_LEVEL, write_checksum=True)
        file.write(MAGIC + _written(records.Header(profile, library)))

    def schema(self, name: str, text: bytes, encoding: str = "jsonschema") -> int:
        """The number of a new schema."""
        number = len(self._schemas) + 1
        self._schemas.append(records.Schema(number, text, encoding, name))
        return number

    def channel(
        self, topic: str, schema: int, encoding: str = "json", metadata: Mapping[str, str] = NOTHING
    ) -> int:
        """The number of a new channel; schema 0 is none."""
        number = len(self._channels) + 1
        self._channels.append(records.Channel(number, topic, encoding, dict(metadata), schema))
        return number

    def metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Write a metadata record: names and texts."""
        begin, length = self._write_once(records.Metadata(name, dict(data)))
        self._others.append(records.MetadataIndex(begin, length, name))

    def attachment(
        self, name: str, media_type: str, data: bytes, times: tuple[int, int] = (0, 0)
    ) -> None:
        """Attach a file, with its times of creation and log in ns."""
        begin, length = self._write_once(records.Attachment(*times, name, media_type, data))
        self._others.append(
            records.AttachmentIndex(begin, length, *times, len(data), name, media_type)
        )

    def chunk(self, messages: Sequence[Message]) -> None:
        """Write messages as one compressed chunk, and their index."""
        if not messages:
            return
        channels, times, dates, texts, *rest = zip(*messages, strict=True)
        sizes = list(map(len, texts))
        inside = [size + _MESSAGE_BYTES for size in sizes]
        numbers = rest[0] if rest else repeat(0)
        heads = map(_MESSAGE.pack, repeat(_OPCODE), inside, channels, numbers, times, dates)
        forms = self._forms(set(channels))
        plain = forms + b"".join(chain.from_iterable(zip(heads, texts, strict=False)))
        places: defaultdict[int, list[int]] = defaultdict(list)
        offset = len(forms)
        for channel, time_ns, size in zip(channels, times, sizes, strict=True):
            places[channel] += (time_ns, offset)
            offset += size + _MESSAGE.size
        packed = self._compressor.compress(plain)
        first, last = min(times), max(times)
        # No CRC: the compressor's own checksum takes a tenth of its time.
        chunk = _written(records.Chunk("zstd", packed, last, first, 0, len(plain)))
        span, starts = [chunk], list[int]()
        for channel, within in places.items():
            data = pack(f"<{len(within)}Q", *within)
            starts.append(sum(map(len, span)))
            span.append(
                _INDEX.pack(Opcode.MESSAGE_INDEX, len(data) + _INDEX.size - 9, channel, len(data))
                + data
            )
            self._counts[channel] += len(within) // 2
        begin = self._write_span(b"".join(span))
        offsets = {channel: begin + at for channel, at in zip(places, starts, strict=True)}
        index = records.ChunkIndex(
            chunk_length=len(chunk),
            chunk_start_offset=begin,
            compression="zstd",
            compressed_size=len(packed),
            message_end_time=last,
            message_index_length=sum(map(len, span[1:])),
            message_index_offsets=offsets,
            message_start_time=first,
            uncompressed_size=len(plain),
        )
        self._chunks.write(_written(index))
        self._chunk_count += 1
        self._first_ns, self._last_ns = min(self._first_ns, first), max(self._last_ns, last)

    def _forms(self, channels: Iterable[int]) -> bytes:
        """The channels that still need a copy in the file, with their schemas."""
        builder = RecordBuilder()
        for number in sorted(channels):
            if self._copies[number] == _COPIES:
                continue
            self._copies[number] += 1
            channel = self._channels[number - 1]
            if channel.schema_id:
                self._schemas[channel.schema_id - 1].write(builder)
            channel.write(builder)
        return bytes(builder.end())

    def finish(self) -> None:
        """End the file with the copies of records that occur once, and the index."""
        copies = b"".join(self._once)
        self._write_span(FRAME.pack(COPIES, len(copies)) + copies)
        self._file.write(_written(records.DataEnd(0)))
        begin = self._file.tell()
        crc = 0
        for part in self._summary():
            self._file.write(part)
            crc = zlib.crc32(part, crc)
        crc = zlib.crc32(_written(records.Footer(begin, 0, 0))[:-4], crc)
        self._file.write(_written(records.Footer(begin, 0, crc)) + MAGIC)

    def _summary(self) -> Iterator[bytes]:
        yield from map(_written, (*self._schemas, *self._channels, self._statistics()))
        with self._chunks as chunks:
            chunks.seek(0)
            while part := chunks.read(_INDEX_BYTES):
                yield part
        yield from map(_written, self._others)

    def _statistics(self) -> records.Statistics:
        kinds = Counter(type(other) for other in self._others)
        return records.Statistics(
            attachment_count=kinds[records.AttachmentIndex],
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=self._chunk_count,
            message_count=self._counts.total(),
            message_end_time=self._last_ns,
            message_start_time=int(self._first_ns) if self._chunk_count else 0,
            metadata_count=kinds[records.MetadataIndex],
            schema_count=len(self._schemas),
        )

    def _write_once(self, record: records.McapRecord) -> tuple[int, int]:
        """Write a record whose copy comes at the end; returns its place and length."""
        self._once.append(_written(record))
        return self._write_span(self._once[-1]), len(self._once[-1])

    def _write_span(self, span: bytes) -> int:
        """Write a span, which has its own checksum; returns its place."""
        self._file.write(headed(self._spans, self._file.tell(), span))
        self._spans += 1
        return self._file.tell() - len(span)


def write_chunks(
    container: Container, messages: Iterable[Message], apart: Collection[int] = ()
) -> None:
    """Write messages in chunks of bounded simulated time and size.

    Channels that are `apart` have chunks of their own, so that their messages are found without
    reading the others.
    """
    waiting: list[Message] = []
    size, first_ns, last_ns = 0, inf, -inf
    for message in messages:
        time_ns = message[1]
        if time_ns > last_ns:
            last_ns = time_ns
        if time_ns < first_ns:
            first_ns = time_ns
        if last_ns - first_ns > _CHUNK_NS or size > CHUNK_BYTES:
            _write_apart(container, waiting, apart)
            waiting, size, first_ns, last_ns = [], 0, time_ns, time_ns
        waiting.append(message)
        size += len(message[3]) + 1
    _write_apart(container, waiting, apart)


def _write_apart(container: Container, messages: Sequence[Message], apart: Collection[int]) -> None:
    aside = [message for message in messages if message[0] in apart]
    container.chunk([m for m in messages if m[0] not in apart] if aside else messages)
    container.chunk(aside)


def _written(record: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())
