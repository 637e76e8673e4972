"""Reading recordings that may end anywhere, be damaged or be of strangers; mending them."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from errno import EISDIR
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.exceptions import EndOfFile
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    Schema,
)
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import Writer

from specc_runtime.recording.container import MAGIC
from specc_runtime.recording.log import LIBRARY

__all__ = [
    "Attachment",
    "Channel",
    "Message",
    "Metadata",
    "Reading",
    "Recovered",
    "Schema",
    "Unusable",
]

LARGEST_BYTES = 1 << 28
"""Of one record, packed or unpacked."""


class Unusable(Exception):
    """The file is no recording, or cannot be read; the message says why."""


class Reading:
    """The records of a file in their order, as far as they can be read.

    `cut` says that the file has no proper end, `damaged` counts chunks that were passed over,
    `last_s` is the last simulated time. With `topics`, parts without messages of these are passed
    over as far as the file tells.
    """

    def __init__(self, path: Path, topics: Collection[str] = ()) -> None:
        self.cut = False
        self.damaged = 0
        self.last_s = 0.0
        self._path = path
        self._topics = topics
        self._unwanted: set[int] = set()

    def __iter__(self) -> Iterator[McapRecord]:
        """Schemas, channels, messages, metadata and attachments. Raises Unusable."""
        try:
            file = self._path.open("rb")
        except OSError as error:
            raise Unusable(f"cannot read {self._path}: {error.strerror}") from error
        with file:
            if file.read(len(MAGIC)) != MAGIC:
                raise Unusable(f"{self._path} is no MCAP file")
            file.seek(0)
            reader = StreamReader(file, emit_chunks=True, record_size_limit=LARGEST_BYTES)
            is_over = False
            for record in self._wanted(reader.records):
                is_over |= isinstance(record, DataEnd)
                if is_over:  # an index follows, made from the rest
                    continue
                for found in self._inside(record):
                    if isinstance(found, Channel) and found.topic not in self._topics:
                        self._unwanted.add(found.id)
                    yield found
            self.cut = not is_over

    def _wanted(self, records: Iterable[McapRecord]) -> Iterator[McapRecord]:
        """The records without chunks that have nothing wanted, as the indexes behind them say."""
        chunk: Chunk | None = None
        inside: set[int] = set()
        try:
            for record in records:
                if isinstance(record, MessageIndex):
                    inside.add(record.channel_id)
                    continue
                if chunk is not None and self._is_wanted(inside):
                    yield chunk
                chunk, inside = None, set()
                if isinstance(record, Chunk):
                    chunk = record
                    self.last_s = max(self.last_s, record.message_end_time / 1e9)
                else:
                    yield record
        except Exception:  # noqa: BLE001  # the library reads what is no record as it may
            pass
        if chunk is not None and self._is_wanted(inside):
            yield chunk

    def _is_wanted(self, channels: set[int]) -> bool:
        return not (self._topics and channels and channels <= self._unwanted)

    def _inside(self, record: McapRecord) -> Iterator[McapRecord]:
        if not isinstance(record, Chunk):
            if isinstance(record, Attachment | Channel | Message | Metadata | Schema):
                yield record
            return
        try:
            if record.compression == "zstd":
                size = zstandard.frame_content_size(record.data)
                if size != record.uncompressed_size or size > LARGEST_BYTES:
                    raise ValueError("the chunk is not as large as it says")
            elif record.compression:
                raise ValueError("another compression")
            stream, length = get_chunk_data_stream(record, validate_crc=True)
            reader = StreamReader(BytesIO(stream.read(length)), skip_magic=True, emit_chunks=True)
            for count, found in enumerate(reader.records):
                if count == len(record.data):  # a few bytes may stand for millions of messages
                    raise ValueError("more records than bytes")
                if not isinstance(found, Chunk):
                    yield found
        except EndOfFile:
            return
        except Exception:  # noqa: BLE001  # as above
            self.damaged += 1


class Recovered:
    """What was saved: messages, the last simulated time in s, and what could not be read."""

    def __init__(self, path: Path, out: Path) -> None:
        """Write what can be read of the file `path` to `out`, with an index.

        Whoever looks finds the old file or the whole new one. Raises Unusable, OSError.
        """
        self.messages = 0
        self.last_s = 0.0
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}
        reading = Reading(path)
        if out.is_dir():
            raise IsADirectoryError(EISDIR, os.strerror(EISDIR))
        aside = out.with_name(f".{out.name}.{os.getpid()}")
        try:
            with aside.open("wb") as file:
                writer = Writer(file)
                writer.start(library=LIBRARY)
                for record in reading:
                    self._copy(record, writer)
                writer.finish()
            aside.replace(out)
        finally:
            aside.unlink(missing_ok=True)
        self.cut, self.damaged = reading.cut, reading.damaged

    def _copy(self, record: McapRecord, writer: Writer) -> None:
        match record:
            case Schema(id=id, name=name, encoding=encoding, data=data):
                if id not in self._schemas:
                    self._schemas[id] = writer.register_schema(name, encoding, data)
            case Channel(id=id, topic=topic, message_encoding=encoding, schema_id=schema):
                if id not in self._channels:
                    number = self._schemas.get(schema, 0)
                    told = record.metadata
                    self._channels[id] = writer.register_channel(topic, encoding, number, told)
            case Message(channel_id=id, log_time=log, publish_time=publish, data=data):
                if id in self._channels:
                    number = self._channels[id]
                    writer.add_message(number, log, data, publish, record.sequence)
                    self.messages += 1
                    self.last_s = max(self.last_s, log / 1e9)
            case Metadata(name=name, metadata=told):
                writer.add_metadata(name, told)
            case Attachment(name=name, media_type=kind, data=data):
                times = record.create_time, record.log_time
                writer.add_attachment(*times, name, kind, data)
