"""Reads, and repairs, recordings that may be cut, damaged or from strangers."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import IO

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
from mcap.stream_reader import StreamReader

from specc_runtime.atomic_files import replacing
from specc_runtime.recording.budget import Budget, Unusable
from specc_runtime.recording.container import Container, write_chunks
from specc_runtime.recording.container import Message as Written
from specc_runtime.recording.log import LIBRARY, check_unowned
from specc_runtime.recording.spans import FRAME, LARGEST_BYTES, MAGIC, Spans, is_copies
from specc_runtime.recording.unpacking import unpacked_chunk
from specc_runtime.report import RECORDING, check_writable

__all__ = [
    "Attachment",
    "Channel",
    "Chunk",
    "McapRecord",
    "Message",
    "Metadata",
    "RecordFile",
    "Recovered",
    "Schema",
    "Unusable",
]

_ROS2 = b"\4\0\0\0ros2"
_OWN_KINDS = 0x80
"""First opcode of the records that MCAP reserves for applications."""


class RecordFile:
    """The records of a file in their order, as far as they can be read.

    `cut`: the file has no proper end. `damaged` counts parts that were skipped. `last_s` is the
    last simulated time. With `topics`, chunks without messages of these are skipped where their
    index says so. Copies are not removed. `budget` is shared by several passes over the file.
    Raises Unusable if there is no such file.
    """

    def __init__(
        self, path: Path, topics: Collection[str] = (), budget: Budget | None = None
    ) -> None:
        self.cut = False
        self.damaged = 0
        self.last_s = 0.0
        self.path = path
        self._topics = topics
        self.budget = budget or Budget(path)
        self._unwanted: set[int] = set()

    def end_s(self, last_s: float, reported_s: float | None) -> float:
        """The end of a file that is read: of its run, or of its last step if parts of it are lost.

        The report of a run may be there although its last steps are lost.
        """
        return last_s if self.cut or self.damaged else max(last_s, reported_s or 0.0)

    def __iter__(self) -> Iterator[McapRecord]:
        """Schemas, channels, messages, metadata and attachments. Raises Unusable."""
        for _, record in self.placed():
            for found in self._inside(record):
                if isinstance(found, Channel) and found.topic not in self._topics:
                    self._unwanted.add(found.id)
                yield found

    def placed(self) -> Iterator[tuple[int, McapRecord]]:
        """The records as they lie in the file, chunks as a whole, each with its place there.

        Raises Unusable.
        """
        try:
            file = self.path.open("rb")
        except OSError as error:
            raise Unusable(f"cannot read {self.path}: {error.strerror}") from error
        with file:
            if not _is_magic(file.read(len(MAGIC))):
                raise Unusable(f"{self.path} is no MCAP file")
            yield from self._wanted(self._records(file))

    def _records(self, file: IO[bytes]) -> Iterator[tuple[int, McapRecord]]:
        """The records before the index of the file, which only repeats them."""
        spans = Spans(file)
        for span in spans:
            within = FRAME.size if is_copies(span) else 0
            while within + FRAME.size <= len(span):
                end = within + FRAME.size + FRAME.unpack_from(span, within)[1]
                for record in self._record(span[within:end]):
                    yield spans.place + within, record
                within = end
            self.damaged, spans.damaged = self.damaged + spans.damaged, 0
        self.damaged, self.cut = self.damaged + spans.damaged, spans.cut
        if not spans.found:
            yield from self._each(file)

    def _record(self, text: bytes) -> Iterator[McapRecord]:
        """The record, or None if it is none or of a kind that applications add."""
        self.budget.record(text[0], len(text))
        if text[0] >= _OWN_KINDS:
            return
        packed = BytesIO(text)
        try:
            found = next(StreamReader(packed, skip_magic=True, emit_chunks=True).records)
        except Exception:  # noqa: BLE001  # the library reads what is no record as it may
            self.damaged += 1
        else:
            yield found

    def _each(self, file: IO[bytes]) -> Iterator[tuple[int, McapRecord]]:
        """The records of a file without spans, read one by one."""
        end, begin = os.fstat(file.fileno()).st_size, len(MAGIC)
        while begin + FRAME.size <= end:
            file.seek(begin)
            kind, length = FRAME.unpack(head := file.read(FRAME.size))
            if length > LARGEST_BYTES or not any(head):  # zeros are no record
                self.damaged += 1  # the start of the next record is unknown
                return
            if kind == Opcode.DATA_END:
                return
            place, begin = begin, begin + FRAME.size + length
            if begin > end:
                break
            for record in self._record(head + file.read(length)):
                yield place, record
        # A file with a proper end was not cut: one of its lengths is wrong.
        file.seek(-len(MAGIC), os.SEEK_END)
        self.cut = file.read() != MAGIC
        self.damaged += not self.cut

    def _wanted(
        self, records: Iterable[tuple[int, McapRecord]]
    ) -> Iterator[tuple[int, McapRecord]]:
        """The records without chunks whose index lists no wanted topic."""
        chunk: tuple[int, Chunk] | None = None
        inside: set[int] = set()
        for place, record in records:
            if isinstance(record, MessageIndex):
                inside.add(record.channel_id)
                continue
            if chunk is not None and self._is_wanted(inside):
                yield chunk
            chunk, inside = None, set()
            if isinstance(record, Chunk):
                chunk = place, record
                self.last_s = max(self.last_s, record.message_end_time / 1e9)
            else:
                yield place, record
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
            yield from unpacked_chunk(record, self.budget)
        except Unusable:
            raise
        except Exception:  # noqa: BLE001  # unpacking fails as it may
            self.damaged += 1


def profile_of(path: Path) -> str:
    """The profile of a file, such as that of bags; empty if it has none that is known."""
    with path.open("rb") as file:
        head = file.read(len(MAGIC) + FRAME.size + len(_ROS2))
    return "ros2" if head.endswith(_ROS2) and head[len(MAGIC)] == Opcode.HEADER else ""


def _is_magic(found: bytes) -> bool:
    """Whether these are the magic bytes of a file, up to one damaged byte."""
    return sum(map(int.__eq__, found, MAGIC)) >= len(MAGIC) - 1


class Recovered:
    """The result of a repair: messages, the last simulated time in s, and unreadable parts."""

    def __init__(self, path: Path, out: Path) -> None:
        """Write the readable part of the file `path` to `out`, with an index.

        The file is replaced at once, by renaming. In place nothing may be lost: a file with damaged
        parts stays as it is. Raises Unusable, UsageError, OSError.
        """
        self.messages = 0
        self.last_s = 0.0
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}
        self._once: set[bytes] = set()
        reading = RecordFile(path)
        if out != path:
            check_writable(out, RECORDING)
        if out.exists():
            with out.open("rb") as file:
                check_unowned(file, out)
        with replacing(out) as aside:
            with aside.open("wb") as file:
                container = Container(file, LIBRARY, out.parent, profile_of(path))
                write_chunks(container, self._copied(reading, container))
                container.finish()
            if not self.messages and (reading.cut or reading.damaged):
                raise Unusable(f"{path}: nothing is left in it that can be read")
            if reading.damaged and out.exists() and out.samefile(path):
                raise Unusable(f"{path} stays as it is, for parts of it are damaged; name --out")
        self.cut, self.damaged = reading.cut, reading.damaged

    def _copied(self, reading: RecordFile, to: Container) -> Iterator[Written]:
        """The messages; all other records are written to the container."""
        for record in reading:
            if not isinstance(record, Message):
                self._copy(record, to)
            elif record.channel_id in self._channels:
                self.messages += 1
                self.last_s = max(self.last_s, record.log_time / 1e9)
                number = self._channels[record.channel_id]
                times = record.log_time, record.publish_time
                yield number, *times, record.data, record.sequence

    def _copy(self, record: McapRecord, to: Container) -> None:
        match record:
            case Schema(id=id, name=name, encoding=encoding, data=data):
                if id not in self._schemas:
                    self._schemas[id] = to.schema(name, data, encoding)
            case Channel(id=id, topic=topic, message_encoding=encoding, schema_id=schema):
                if id not in self._channels:
                    number = self._schemas.get(schema, 0)
                    self._channels[id] = to.channel(topic, number, encoding, record.metadata)
            case Metadata(name=name, metadata=told):
                if self._is_new(f"{name} {sorted(told.items())}".encode()):
                    to.metadata(name, told)
            case Attachment(name=name, media_type=kind, data=data):
                if self._is_new(f"{name} ".encode() + data):
                    to.attachment(name, kind, data, (record.create_time, record.log_time))

    def _is_new(self, content: bytes) -> bool:
        """Whether it is not a copy of an earlier record."""
        digest = sha256(content).digest()
        is_new = digest not in self._once
        self._once.add(digest)
        return is_new
