"""Reading recordings that may end anywhere, be damaged or be of strangers; mending them."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from io import BytesIO
from pathlib import Path
from struct import Struct
from typing import IO

import zstandard
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
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
from specc_runtime.report import RECORDING, check_writable

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
_FRAME = Struct("<BQ")
"""What every record begins with: what it is, and how long the rest is."""


class Unusable(Exception):
    """The file is no recording, or cannot be read; the message says why."""


class Reading:
    """The records of a file in their order, as far as they can be read.

    `cut` says that the file has no proper end, `damaged` counts records that were passed over,
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
            for record in self._wanted(self._records(file)):
                for found in self._inside(record):
                    if isinstance(found, Channel) and found.topic not in self._topics:
                        self._unwanted.add(found.id)
                    yield found

    def _records(self, file: IO[bytes]) -> Iterator[McapRecord]:
        """The records before the index, which is made from them, each read by itself."""
        end, begin = os.fstat(file.fileno()).st_size, len(MAGIC)
        while begin + _FRAME.size <= end:
            file.seek(begin)
            kind, length = _FRAME.unpack(head := file.read(_FRAME.size))
            if length > LARGEST_BYTES:
                self.damaged += 1  # where the next one begins is not known
                return
            if kind == Opcode.DATA_END:
                return
            begin += _FRAME.size + length
            if begin > end:
                break
            packed = BytesIO(head + file.read(length))
            try:
                found = next(StreamReader(packed, skip_magic=True, emit_chunks=True).records)
            except Exception:  # noqa: BLE001  # the library reads what is no record as it may
                self.damaged += 1
            else:
                yield found
        # A file with a proper end was not cut: one of its lengths is wrong.
        file.seek(-len(MAGIC), os.SEEK_END)
        self.cut = file.read() != MAGIC
        self.damaged += not self.cut

    def _wanted(self, records: Iterable[McapRecord]) -> Iterator[McapRecord]:
        """The records without chunks that have nothing wanted, as the indexes behind them say."""
        chunk: Chunk | None = None
        inside: set[int] = set()
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

        Whoever looks finds the old file or the whole new one. In place nothing is lost: a file
        with damaged parts stays as it is. Raises Unusable, UsageError, OSError.
        """
        self.messages = 0
        self.last_s = 0.0
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}
        reading = Reading(path)
        if out != path:
            check_writable(out, RECORDING)
        aside = out.with_name(f".{out.name}.{os.getpid()}")
        try:
            with aside.open("wb") as file:
                writer = Writer(file)
                writer.start(library=LIBRARY)
                for record in reading:
                    self._copy(record, writer)
                writer.finish()
            if not self.messages and (reading.cut or reading.damaged):
                raise Unusable(f"{path}: nothing is left in it that can be read")
            if reading.damaged and out.exists() and out.samefile(path):
                raise Unusable(f"{path} stays as it is, for parts of it are damaged; name --out")
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
