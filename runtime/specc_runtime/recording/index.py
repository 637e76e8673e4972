"""An index of a recording: where the messages of each topic are, and when machines changed state.

Made in one pass over the file, in which steps are skimmed and nothing is decoded. Then the last
messages until a time are found by unpacking the chunks that they are in.

Memory: 20 bytes for each change of a machine, 8 for each chunk, 12 for each topic in a chunk, each
name once, and the last few chunks unpacked. Time for a moment: unpacking at most two chunks for a
topic, mostly two or three in all, and decoding two messages for a machine.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections import defaultdict, deque
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from time import monotonic
from typing import IO, Any, NamedTuple

from specc_runtime.forms import Misshapen
from specc_runtime.recording.budget import Budget, Unusable
from specc_runtime.recording.cells import VALUE_SCHEMA
from specc_runtime.recording.messages import (
    Beginning,
    beginning_of,
    report_of,
    simulated_s,
    step_of,
)
from specc_runtime.recording.reading import (
    Channel,
    Chunk,
    McapRecord,
    Message,
    Metadata,
    RecordFile,
    Schema,
)
from specc_runtime.recording.steps import STEP_SCHEMA
from specc_runtime.recording.unpacking import Inside, content_at, plain_chunk, records_within

EARLIER_S = 1e-6
"""A time that is earlier than another by no more than this is the same one."""
_OF_TOPIC, _OF_NAME, _OF_CHANGE, _OF_PLACE = 2000, 200, 24, 12
"""Bytes that are kept for a topic, a name, a change of a machine, and a topic in a chunk."""
_LONGEST = 300
"""Characters that are kept of a name."""
_MOST_CHUNKS, _SMALL_BYTES = 6, 4 << 20
"""Chunks that are kept unpacked, the last ones, and their greatest size."""
_MOST_FAULTS = 100
_NO_ROW, _UNKNOWN = 0, 1
"""Numbers of rows: of a change without one, and of one that is not in the file."""
_FAULT = b',"fault":'


@dataclass(slots=True)
class Topic:
    """The messages of a topic: its schema, the chunks with some, and the time of their first."""

    name: str
    schema: str
    chunks: array[int] = field(default_factory=lambda: array("I"))
    firsts_s: array[float] = field(default_factory=lambda: array("d"))

    def place(self, time_s: float) -> int:
        """The index of the last of the chunks that begin until then; -1 if none does."""
        return bisect_right(self.firsts_s, time_s + EARLIER_S) - 1


class Last(NamedTuple):
    """The last message of a topic and the one before it, which is empty if there is none."""

    before: bytes
    time_s: float
    text: bytes


class Names:
    """Texts by number, each kept once."""

    def __init__(self, *first: str) -> None:
        self.texts = list(first)
        self._numbers = {text: number for number, text in enumerate(first)}

    def number(self, text: str, budget: Budget) -> int:
        """The number of a text. Raises Unusable where there are far too many."""
        text = text[:_LONGEST]
        if text not in self._numbers:
            budget.keep(_OF_NAME + len(text))
            self._numbers[text] = len(self.texts)
            self.texts.append(text)
        return self._numbers[text]


@dataclass(slots=True)
class Changes:
    """The changes of a machine: of state, or by a row into the state that it was in.

    Each has a time, the numbers of state and row, and the first change of the run of changes by the
    same row that it belongs to. `gaps` are steps before which others are missing, the first one
    among them, and the times of the last step before.
    """

    times_s: array[float] = field(default_factory=lambda: array("d"))
    states: array[int] = field(default_factory=lambda: array("I"))
    rows: array[int] = field(default_factory=lambda: array("I"))
    runs: array[int] = field(default_factory=lambda: array("I"))
    gaps_s: array[float] = field(default_factory=lambda: array("d"))
    gap_stamps: array[int] = field(default_factory=lambda: array("Q"))
    before_gaps_s: array[float] = field(default_factory=lambda: array("d"))
    last_s: float = -inf
    step_s: float = 0.0
    """Simulated time from the last step but one to the last one."""
    _stamp: int = -2

    def since_s(self, number: int) -> float | None:
        """The time of a change; None for one that is not in the file, or before all of them."""
        return self.times_s[number] if number >= 0 and self.rows[number] != _UNKNOWN else None

    def spans(self, end_s: float) -> Iterator[tuple[float, float, int]]:
        """Begin and end in s, and the state, of each span without another; the last until then."""
        gaps = dict(zip(self.gaps_s, self.before_gaps_s, strict=True))
        begin_s, state = 0.0, -1
        for time_s, number in zip(self.times_s, self.states, strict=True):
            if number != state or time_s in gaps:
                if state >= 0:
                    yield begin_s, gaps.get(time_s, time_s), state
                begin_s, state = time_s, number
        if state >= 0:
            yield begin_s, end_s, state

    def take(self, time_s: float, begun: Beginning, names: Names, budget: Budget) -> None:
        """Note the next step. Raises Misshapen, and Unusable."""
        if time_s < self.last_s:
            raise Misshapen(f"the step before was later, at {self.last_s:.12g} s")
        is_gap = begun.first != self._stamp + 1
        if is_gap:
            self.before_gaps_s.append(self.last_s)
            self.gaps_s.append(time_s)
            self.gap_stamps.append(begun.stamp)
            budget.keep(_OF_CHANGE)
        else:
            self.step_s = time_s - self.last_s
        self._stamp, self.last_s = begun.stamp, time_s
        state = names.number(begun.state, budget)
        if begun.row != -1 or not begun.before:
            row = names.number(begun.transition, budget) if begun.transition else _NO_ROW
        elif is_gap:
            row = _UNKNOWN
        elif self.states[-1] != state:  # it failed after its row
            row = _NO_ROW
        else:
            return
        budget.keep(_OF_CHANGE)
        number, last = len(self.times_s), self.rows[-1] if self.rows else _UNKNOWN
        self.runs.append(self.runs[-1] if row == last and row > _UNKNOWN else number)
        self.times_s.append(time_s)
        self.states.append(state)
        self.rows.append(row)


class Index:
    """The index of a file.

    `machines` are the changes of subsystems by name, `faults` the steps that failed, each a time
    in s and a text. `begin_s` and `end_s` are the first and the last time of a step.
    """

    def __init__(self, path: Path, for_s: float = inf) -> None:
        """Read the file once, for so long of wall time; see `read`. Raises Unusable."""
        self.path = path
        self.reading = RecordFile(path)
        self.names = Names("", "")
        self.topics: dict[str, Topic] = {}
        self.machines: dict[str, Changes] = {}
        self.faults: list[tuple[float, str]] = []
        self.report: Mapping[str, Any] = {}
        self.begin_s, self.end_s = inf, 0.0
        self._places = array("Q")
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[Topic, Changes | None] | None] = {}
        self._last_chunks: dict[int, Mapping[str, list[tuple[float, bytes]]]] = {}
        self.most_messages = 0
        """Of a chunk."""
        self._file: IO[bytes] | None = None
        self._records = self.reading.placed()
        self._reported_s: float | None = None
        self.is_whole = False
        """Whether all of the file is read."""
        self.read(for_s)

    def read(self, for_s: float) -> None:
        """Read on for so long of wall time, or to the end. Raises Unusable."""
        end_s = monotonic() + for_s
        for place, record in self._records:
            self._file = self._file or self.path.open("rb")
            self._take(place, record)
            if monotonic() > end_s:
                return
        self.is_whole = True
        self.end_s = self.reading.end_s(self.end_s, self._reported_s)

    def spans(self, changes: Changes) -> Iterator[tuple[float, float, int]]:
        """The spans of a machine until the end, or until its own last step if that is lost."""
        lost_from_s = changes.last_s + changes.step_s if self.has_losses else inf
        return changes.spans(max(changes.last_s, min(self.end_s, lost_from_s)))

    def lost_at(self, name: str, time_s: float) -> tuple[float, float | None] | None:
        """The last step before and the first one after steps of a machine that are lost then.

        None if the last step until then is that of the moment. There is no step after the end.
        """
        changes = self.machines[name]
        gap = bisect_right(changes.gaps_s, time_s + EARLIER_S)
        is_last = gap == len(changes.gaps_s)
        if gap == 0 or (is_last and not self.has_losses):
            return None
        before_s = changes.last_s if is_last else changes.before_gaps_s[gap]
        if time_s < before_s + changes.step_s + EARLIER_S:
            return None
        return before_s, None if is_last else changes.gaps_s[gap]

    @property
    def has_losses(self) -> bool:
        """Whether parts of the file are lost, among them perhaps its end."""
        return bool(self.reading.cut or self.reading.damaged)

    # The pass over the file.

    def _take(self, place: int, record: McapRecord) -> None:
        reading = self.reading
        if isinstance(record, Metadata) and record.name == "report":
            self._reported_s = simulated_s(record.metadata)
            self.report = report_of(record.metadata)
        elif isinstance(record, Schema | Channel):
            self._form(record)
        elif isinstance(record, Chunk | Message):
            try:
                if isinstance(record, Chunk):
                    plain = plain_chunk(record, reading.budget)
                else:
                    plain = self._content(place, reading.budget)
                self._skim(place, plain)
            except Unusable:
                raise
            except Exception:  # noqa: BLE001  # the library reads what is no record as it may
                reading.damaged += 1

    def _form(self, record: Schema | Channel) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record.name
            return
        name, schema = record.topic, self._schemas.get(record.schema_id, "")
        if schema == VALUE_SCHEMA:
            self._channels[record.id] = None
            return
        if name not in self.topics:
            self.reading.budget.keep(_OF_TOPIC + len(name))
            self.topics[name] = Topic(name, schema)
        is_step = schema.startswith(STEP_SCHEMA)
        changes = self.machines.setdefault(name[1:], Changes()) if is_step else None
        self._channels[record.id] = self.topics[name], changes

    def _skim(self, place: int, plain: bytes) -> None:
        """Note what is in a chunk, or in a record outside chunks. Raises Unusable."""
        budget, channels = self.reading.budget, self._channels
        number, seen, count = len(self._places), set[int](), 0
        self._places.append(place)
        for found in records_within(plain, budget):
            if not isinstance(found, Inside):
                self._form(found)
                continue
            channel, _, log_ns, _, begin, end = found
            budget.skim(end - begin)
            if (known := channels.get(channel)) is None:
                continue
            topic, changes = known
            count += 1
            time_s = log_ns / 1e9
            if channel not in seen:
                seen.add(channel)
                budget.keep(_OF_PLACE)
                topic.chunks.append(number)
                topic.firsts_s.append(max(time_s, topic.firsts_s[-1] if topic.firsts_s else -inf))
            if changes is not None:
                self._step(topic, changes, time_s, (plain, begin, end))
        self.most_messages = max(self.most_messages, count)

    def _step(
        self, topic: Topic, changes: Changes, time_s: float, text: tuple[bytes, int, int]
    ) -> None:
        plain, begin, end = text
        self.begin_s, self.end_s = min(self.begin_s, time_s), max(self.end_s, time_s)
        try:
            changes.take(time_s, beginning_of(*text), self.names, self.reading.budget)
            if plain.find(_FAULT, begin, end) >= 0 and len(self.faults) < _MOST_FAULTS:
                self.reading.budget.decode(message := plain[begin:end])
                if fault := step_of(message).get("fault"):
                    words = f"{topic.name[1:]}: {fault}"
                    self.faults.append((time_s, words[:_LONGEST]))
        except Misshapen as error:
            raise wrong(self.path, topic.name, time_s, error) from None

    # Messages, once the index is there.

    def last(self, topics: Collection[str], time_s: float, budget: Budget) -> dict[str, Last]:
        """The last messages of topics until then; those without one are left out.

        Raises Unusable.
        """
        wanted = defaultdict[int, set[str]](set)
        for topic in map(self.topics.get, topics):
            if topic is not None and (place := topic.place(time_s)) >= 0:
                for chunk in topic.chunks[max(0, place - 1) : place + 1]:
                    wanted[chunk].add(topic.name)
        found = defaultdict[str, deque[tuple[float, bytes]]](lambda: deque(maxlen=2))
        for chunk, names in sorted(wanted.items()):
            for name, at_s, text in self._within(chunk, names, budget):
                if at_s <= time_s + EARLIER_S:
                    found[name].append((at_s, text))
        return {name: Last(b"" if len(t) == 1 else t[0][1], *t[-1]) for name, t in found.items()}

    def latest(self, name: str, time_s: float, budget: Budget) -> Iterator[bytes]:
        """The messages of a topic until then, the last one first. Raises Unusable."""
        topic = self.topics.get(name)
        for place in range(topic.place(time_s) if topic else -1, -1, -1):
            assert topic is not None
            inside = [*self._within(topic.chunks[place], {name}, budget)]
            yield from (text for _, at_s, text in inside[::-1] if at_s <= time_s + EARLIER_S)

    def messages(
        self, name: str, begin_s: float = -inf, end_s: float = inf, budget: Budget | None = None
    ) -> Iterator[tuple[float, bytes]]:
        """The messages of a topic from a time to another, both included. Raises Unusable."""
        budget = budget or Budget(self.path)
        topic = self.topics.get(name)
        first = 0 if topic is None or begin_s == -inf else max(0, topic.place(begin_s))
        for place in range(first, len(topic.chunks) if topic else 0):
            assert topic is not None
            if topic.firsts_s[place] > end_s + EARLIER_S:
                return
            for _, at_s, text in self._within(topic.chunks[place], {name}, budget):
                if begin_s - EARLIER_S <= at_s <= end_s + EARLIER_S:
                    yield at_s, text

    def _within(
        self, chunk: int, names: Collection[str], budget: Budget
    ) -> Iterator[tuple[str, float, bytes]]:
        """The messages of topics in a chunk: topic, time in s, text; topic after topic."""
        inside = self._last_chunks.get(chunk)
        if inside is None:
            inside = self._by_topic(chunk, names, budget)
        for name, found in inside.items():
            if name in names:
                yield from ((name, at_s, text) for at_s, text in found)

    def _by_topic(
        self, chunk: int, names: Collection[str], budget: Budget
    ) -> Mapping[str, list[tuple[float, bytes]]]:
        """Times and texts in a chunk, at least of these topics.

        Of a small one all are kept: most moments that are asked for are near the one before.
        """
        try:
            plain = self._content(self._places[chunk], budget)
        except Unusable:
            raise
        except Exception as error:  # the file was another one when it was indexed
            raise Unusable(f"{self.path} has changed since it was opened") from error
        is_small = len(plain) <= _SMALL_BYTES
        wanted = {
            number: known[0].name
            for number, known in self._channels.items()
            if known is not None and (is_small or known[0].name in names)
        }
        inside = defaultdict[str, list[tuple[float, bytes]]](list)
        for found in records_within(plain, budget):
            if isinstance(found, Inside) and found.channel in wanted:
                text = plain[found.begin : found.end]
                inside[wanted[found.channel]].append((found.log_ns / 1e9, text))
        if is_small:
            while len(self._last_chunks) >= _MOST_CHUNKS:
                del self._last_chunks[next(iter(self._last_chunks))]
            self._last_chunks[chunk] = inside
        return inside

    def _content(self, place: int, budget: Budget) -> bytes:
        assert self._file is not None
        return content_at(self._file, place, budget)


def read_on(index: Index, for_s: float) -> None:
    """See `Index.read`."""
    index.read(for_s)


def wrong(path: Path, topic: str, time_s: float, error: Misshapen) -> Unusable:
    """Why a file with such a message is not used."""
    return Unusable(f"{path}: {topic} at {time_s:.12g} s: {error}")
