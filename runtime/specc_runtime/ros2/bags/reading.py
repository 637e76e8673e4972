"""The messages of a bag in the order of their times: of a folder of ROS 2, or of one file.

Bags come from strangers: what is held of a file is bounded by its size, and whatever is wrong with
it is `Unusable`.
"""

from __future__ import annotations

import heapq
import re
import sqlite3
from collections.abc import Collection, Iterable, Iterator
from contextlib import closing
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from specc_runtime.faults import error_text
from specc_runtime.recording.budget import Unusable
from specc_runtime.recording.reading import Channel, Message, RecordFile, Schema, profile_of
from specc_runtime.recording.spans import MAGIC
from specc_runtime.report import RECORDING, is_of

_FILES = (".mcap", ".db3")
_PACKED = (".zstd", ".lz4")
_NUMBER = re.compile(r"(\d+)")
_PLAIN = re.compile(r"[^?#%]+\Z")
_COMPUTED = re.compile(r"\bvirtual\b|\bgenerated\b|\bas\s*\(", re.IGNORECASE)
"""In the definition of a table: what other than its content decides what is read of it."""
_BEHIND_NS, _MOST_WAITING, _MOST_BYTES = 1_000_000_000, 2000, 1 << 27
"""Messages wait so long, and so many, for earlier ones that come later in a file."""


class BagTopic(NamedTuple):
    """A topic of a bag: the type of its messages, and the text that defines it, if it is there."""

    name: str
    type: str
    definition: str


class BagMessage(NamedTuple):
    """A message, and when it was received, in ns."""

    topic: BagTopic
    time_ns: int
    data: bytes


class Bag:
    """The messages of a bag; `topics` has what was seen of it, by names. `cut` and `damaged` tell
    that something is lost.
    """

    def __init__(self, path: Path) -> None:
        """Raises Unusable for what is no bag."""
        self.topics: dict[str, BagTopic] = {}
        self.cut = False
        self.damaged = 0
        self.end_ns = 0
        """When the last message of all that were seen was received."""
        self.path = path
        self._files = _files(path)
        self.is_own = path.is_file() and is_of(RECORDING, _head(path))
        """Whether specc wrote it: its times are those of the run."""
        if self.is_own and not profile_of(path):
            raise Unusable(f"{path} is a recording of specc: `specc replay {path} --spec SPEC`")

    def messages(self, wanted: Collection[str] | None) -> Iterator[BagMessage]:
        """The messages of these topics, or of all. Raises Unusable."""
        files = (
            (self._of_database if file.suffix == ".db3" else self._of_mcap)(file, wanted)
            for file in self._files
        )
        return in_order(chain.from_iterable(files))

    def _of_mcap(self, file: Path, wanted: Collection[str] | None) -> Iterator[BagMessage]:
        schemas: dict[int, Schema] = {}
        topics: dict[int, BagTopic] = {}
        reading = RecordFile(file, topics=wanted or ())
        for record in reading:
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel) and record.id not in topics:
                schema = schemas.get(record.schema_id)
                if schema is None or record.message_encoding != "cdr":
                    topics[record.id] = self._seen(record.topic, "another encoding", "")
                    continue
                is_text = schema.encoding == "ros2msg"
                text = schema.data.decode(errors="replace") if is_text else ""
                topics[record.id] = self._seen(record.topic, schema.name, text)
            elif isinstance(record, Message) and record.channel_id in topics:
                topic = topics[record.channel_id]
                self.end_ns = max(self.end_ns, record.log_time)
                if wanted is None or topic.name in wanted:
                    yield BagMessage(topic, record.log_time, record.data)
        self.end_ns = max(self.end_ns, round(reading.last_s * 1e9))
        self.cut |= reading.cut
        self.damaged += reading.damaged

    def _of_database(self, file: Path, wanted: Collection[str] | None) -> Iterator[BagMessage]:
        from rosbags.interfaces import MessageDefinitionFormat
        from rosbags.rosbag2 import Reader

        try:
            _check_tables(file)
            with Reader(file) as reader:
                topics: dict[int, BagTopic] = {}
                for each in reader.connections:
                    is_text = each.msgdef.format == MessageDefinitionFormat.MSG
                    text = str(each.msgdef.data) if is_text else ""
                    topics[each.id] = self._seen(str(each.topic), str(each.msgtype), text)
                chosen = [c for c in reader.connections if wanted is None or c.topic in wanted]
                for connection, time_ns, data in reader.messages(chosen) if chosen else ():
                    if type(time_ns) is not int or type(data) is not bytes:
                        raise ValueError("a message without its bytes or its time")
                    yield BagMessage(topics[connection.id], time_ns, data)
                self.end_ns = max(self.end_ns, int(reader.end_time))
        except Exception as error:  # the library raises what it may on a file that is none
            raise Unusable(f"{file} is no bag that can be read: {error_text(error)}") from error

    def _seen(self, name: str, type_: str, text: str) -> BagTopic:
        topic = BagTopic(name, type_, text)
        self.topics.setdefault(name, topic)
        return topic


def _check_tables(file: Path) -> None:
    """Raises ValueError unless a database has nothing but tables, so that reading it ends."""
    if not _PLAIN.match(str(file)):
        raise ValueError("a name that stands for another file")
    with closing(sqlite3.connect(f"{file.absolute().as_uri()}?immutable=1", uri=True)) as database:
        for kind, sql in database.execute("SELECT type, sql FROM sqlite_master"):
            if kind not in ("table", "index") or (sql and _COMPUTED.search(sql)):
                raise ValueError("it computes what it has")


def in_order(messages: Iterable[BagMessage]) -> Iterator[BagMessage]:
    """Messages by their times, as far as those that are late are not much so."""
    waiting: list[tuple[int, int, BagMessage]] = []
    size = 0
    for number, message in enumerate(messages):
        heapq.heappush(waiting, (message.time_ns, number, message))
        size += len(message.data)
        while waiting and (
            len(waiting) > _MOST_WAITING
            or size > _MOST_BYTES
            or message.time_ns - waiting[0][0] > _BEHIND_NS
        ):
            first = heapq.heappop(waiting)[2]
            size -= len(first.data)
            yield first
    while waiting:
        yield heapq.heappop(waiting)[2]


def _files(path: Path) -> list[Path]:
    """The files of a bag, in the order in which they were recorded."""
    try:
        inside = sorted(path.iterdir(), key=_counted) if path.is_dir() else [path]
        found = [file for file in inside if file.suffix in _FILES and file.is_file()]
        if not found and path.is_file() and _head(path).startswith(MAGIC):
            found = [path]
        packed = [file for file in inside if file.suffix in _PACKED]
    except (OSError, ValueError) as error:  # ValueError: not a file name, such as one with a NUL
        raise Unusable(f"cannot read {path}: {error_text(error)}") from error
    if packed and not found:
        raise Unusable(f"{packed[0]} is compressed as a whole: `ros2 bag convert` unpacks it")
    if not found:
        what = "has no .mcap and no .db3 file" if path.is_dir() else "is no .mcap or .db3 file"
        raise Unusable(f"{path} {what}: it is no bag" if path.exists() else f"there is no {path}")
    return found


def _head(file: Path) -> bytes:
    try:
        with file.open("rb") as stream:
            return stream.read(100)
    except OSError as error:
        raise Unusable(f"cannot read {file}: {error.strerror}") from error


def _counted(file: Path) -> list[str | int]:
    """A key by which `bag_9` comes before `bag_10`."""
    parts = _NUMBER.split(file.name)
    return [int(part) if part.isdigit() else part for part in parts]
