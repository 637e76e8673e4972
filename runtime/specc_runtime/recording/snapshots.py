"""Snapshots in a recording: the state from which a run can go on, about once a simulated second.

A snapshot is a message of JSON. Large opaque values are stored aside; camera images are left out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from math import inf
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from specc_runtime.changes import TASK, Event
from specc_runtime.companion import View
from specc_runtime.forms import Aside, Layout, Misshapen, NotRecorded, object_schema
from specc_runtime.live import Change, change_of
from specc_runtime.loading import load_layouts
from specc_runtime.options import Options, UsageError
from specc_runtime.panel import Operation, operation_of
from specc_runtime.plants.errors import PlantError
from specc_runtime.recording.budget import Budget
from specc_runtime.recording.cells import VALUE, VALUE_SCHEMA, Shelf, digest_of
from specc_runtime.recording.log import Channel as LogChannel
from specc_runtime.recording.log import Log
from specc_runtime.recording.messages import (
    Shelved,
    followed_the_clock,
    recorded,
    simulated_s,
    unpacked,
)
from specc_runtime.recording.reading import Channel, Message, Metadata, RecordFile, Unusable
from specc_runtime.recording.text import dumped, loaded
from specc_runtime.session import Session
from specc_runtime.snapshot import Values
from specc_runtime.system import System

SNAPSHOTS, PIECES, CHANGES, PANEL = "/snapshot", "/snapshot/values", "/constants", "/panel"
_MAPPINGS = (
    *("subsystems", "stamps", "late", "ages", "sensors", "commands", "tallies", "task"),
    *("unobserved", "scene", "live", "panel"),
)
_SCHEMA = object_schema(
    {
        "tick": {"type": "integer"},
        "time": {"type": "number"},
        "missing": {"type": "string", "description": "why there is no snapshot at this time"},
        "records": {"type": "string"},
        **{name: {"type": "object"} for name in _MAPPINGS},
        **{name: {"type": "array"} for name in ("requirements", "triggers", "disturbances")},
        "plant": {"description": "what it remembers, which is its own affair"},
    }
)
_CHANGE_SCHEMA = object_schema(
    {
        "tick": {"type": "integer"},
        "constant": {"type": "string"},
        "value": {"type": "number"},
        "by": {"type": "string", "description": "the program, or a disturbance of the task"},
    }
)
_OPERATION_SCHEMA = object_schema(
    {
        "tick": {"type": "integer"},
        "element": {"type": "string"},
        "value": {"description": "a number, true or false, or the name of a member"},
        "by": {"type": "string", "description": "the page, keys, a program, or the task"},
    }
)
_LATEST = 1000
"""Snapshots that are searched for the last complete one."""
_MOST_TRIES = 10
"""Snapshots that are tried for one whose values stored aside are all there."""
_MOST_LOST = 200
"""Elements that a continued run cannot take over and that are named at most."""
_BYTES_A_SECOND = 10_000
"""Average bytes of snapshots in a simulated second; a snapshot waits until they are due."""
_EARLIER_S = 1e-6
_Event = TypeVar("_Event", Change, Operation)
_MOST_DIGITS = 4000
"""Digits of a seed; Python reads no more."""
WRONG = (
    AttributeError, LookupError, TypeError, ValueError, OverflowError, RecursionError, Misshapen,
    NotRecorded,
)  # fmt: skip


@dataclass(slots=True)
class Reach:
    """From which moments on another run can go on from a recording that is being written."""

    begin_s: float
    first_s: float = inf
    """The time of its first snapshot."""
    missing: str = ""
    """Why there is none."""

    def lacks(self, from_s: float) -> str:
        """What it would need for a moment; "" if it has that, or can be repeated from its start."""
        if not self.begin_s or self.first_s <= from_s + _EARLIER_S:
            return ""
        why = f" ({self.missing})" if self.missing else ""
        return f"it has no snapshots until then{why}"


class Snapshots(Shelf):
    """Writes snapshots, and their values stored aside: again unless among the last so many."""

    _window = 2048

    def __init__(
        self, log: Log, system: System, layouts: Mapping[str, Layout], begin_s: float = 0.0
    ) -> None:
        super().__init__(log, exact=True)
        self.reach = Reach(begin_s)
        self._next_s = 0.0
        self._values = Values(system, layouts, self)
        self._messages = log.channel(SNAPSHOTS, "specc.Snapshot", _SCHEMA, is_apart=True)
        self._changes: dict[type[Event], LogChannel] = {}
        if system.live:
            self._changes[Change] = log.channel(CHANGES, "specc.Change", _CHANGE_SCHEMA)
        if system.panel:
            self._changes[Operation] = log.channel(PANEL, "specc.Operation", _OPERATION_SCHEMA)
        self._pieces = log.channel(PIECES, VALUE_SCHEMA, VALUE, is_apart=True)

    def changed(self, change: Event, time_s: float) -> None:
        """Write that a constant has changed, or that the panel is operated."""
        self._changes[type(change)].add(time_s, dumped(asdict(change)))

    def keep(self, time_s: float, saved: Callable[[Values], dict[str, Any]]) -> None:
        """Write a snapshot, or the reason why there is none, unless it is too early."""
        if time_s < self._next_s:
            return
        self._time_s = time_s
        try:
            values = saved(self._values)
            self.reach.first_s = min(self.reach.first_s, time_s)
        except NotRecorded as missing:
            values = {"missing": str(missing)}
            self.reach.missing = str(missing)
        data = dumped({"time": time_s, **values})
        self._messages.add(time_s, data)
        self._next_s = time_s + len(data) / _BYTES_A_SECOND

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        raise NotRecorded("an image")

    def left_out(self, kind: str, value: Any) -> Any:
        """See `Aside`."""
        raise NotRecorded(f"a value of {kind}, which has no `codec`")

    def _put(self, log: Log, make: Callable[[], bytes], size: int) -> None:
        self._pieces.add(self._time_s, make())


@dataclass(slots=True)
class Snapshot:
    """The start of a continued run: the last snapshot until a moment, and its values stored aside.

    Without a snapshot, `missing` has the reason. `seed`, `set` and `texts` are of the recorded run.
    """

    saved: Any = None
    shelf: Shelved = field(default_factory=Shelved)
    missing: str = "it has no snapshots"
    until_s: float = 0.0
    seed: int = 0
    set: Mapping[str, Any] | None = None
    """None if unknown."""
    texts: dict[str, str] = field(default_factory=dict)
    changes: Sequence[Change] = ()
    """Those that the program of the recorded run made between the snapshot and the moment."""
    operations: Sequence[Operation] = ()
    """Those of the panel that were made then, but for those of the task."""
    is_other: bool = False
    """Whether the run that goes on has another specification, or other constants."""

    @property
    def time_s(self) -> float:
        """Simulated time of the snapshot, 0 without one."""
        return float(self.saved["time"]) if self.saved else 0.0

    def is_of(self, options: Options) -> bool:
        """Whether the recorded run had that specification, as far as its text is known."""
        same = not options.texts or [*self.texts.values()] == [*options.texts.values()]
        return same and not self.is_set_otherwise(options)

    def is_set_otherwise(self, options: Options) -> bool:
        """Whether the recorded run had other constants set."""
        return self.set != dict(options.built_with)

    def take(self, session: Session, system: System) -> None:
        """Replace the snapshot by the present state of a run with no step under way."""
        self.changes, self.operations = (), ()
        if not session.time_s:
            self.saved = None
            return
        aside = _SnapshotAside()
        values = Values(system, load_layouts(system), aside, is_lenient=True)
        self.saved, self.shelf = loaded(dumped(session.saved(values))), aside.shelf
        self.until_s = session.time_s

    def go_on(self, session: Session, system: System) -> list[str]:
        """Let a run go on from the snapshot; returns the elements that have no place in it.

        Raises UsageError, also if the run would end before the requested moment.
        """
        lost = self._restored(session, system) if self.saved else []
        session.schedule(self.changes, self.operations, self.until_s)
        if over := _over(session.view(), self.until_s):
            more = (
                "--cycles and --duration count from the beginning of the recorded run, ask for more"
            )
            raise UsageError(f"the run is over before {self.until_s:g} s, {over}: {more}")
        others = [f"and {len(lost) - _MOST_LOST} others"] if len(lost) > _MOST_LOST else []
        return lost[:_MOST_LOST] + others

    def _restored(self, session: Session, system: System) -> list[str]:
        if not 0.0 < self.time_s <= self.until_s + _EARLIER_S:
            raise UsageError("the run cannot go on from its snapshot: it has no time")
        values = Values(system, load_layouts(system), self.shelf)
        try:
            return session.restore(self.saved, values, is_other=self.is_other)
        except (*WRONG, PlantError) as error:
            why = str(error) if isinstance(error, Misshapen | PlantError) else "it is damaged"
            raise UsageError(f"the run cannot go on from its snapshot: {why}") from error


def _over(view: View, time_s: float) -> str:
    """Words for the end of a run that ends before that time; else empty."""
    if view.duration_s is not None and view.duration_s < time_s - _EARLIER_S:
        return f"at {view.duration_s:g} s"
    enough = view.cycles is not None and len(view.fulfilled) >= view.cycles
    return f"after cycle {view.cycles}" if enough else ""


class _SnapshotAside(Aside):
    """Keeps images and opaque values in this process, unconverted; see `Aside`."""

    exact, is_brief = False, False

    def __init__(self) -> None:
        self.shelf = _SnapshotShelf()

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        return {"image": self.shelf.hold(value)}

    def packed(self, kind: str, data: bytes | np.ndarray[Any, Any]) -> Any:
        """See `Aside`; never called, since this is not exact."""
        raise NotImplementedError

    def left_out(self, kind: str, value: Any) -> Any:
        """See `Aside`."""
        return {"kept": self.shelf.hold((kind, value))}


class _SnapshotShelf(Shelved):
    """The values kept by `_SnapshotAside`; see `Fetch`."""

    def __init__(self) -> None:
        super().__init__()
        self._numbered: list[Any] = []

    def hold(self, value: Any) -> int:
        """Keep a value; returns its number."""
        self._numbered.append(value)
        return len(self._numbered) - 1

    def image(self, data: Any) -> Any:
        """See `Fetch`."""
        return self._numbered[data["image"]]

    def opaque(self, kind: str, data: Any) -> Any:
        """See `Fetch`."""
        own, value = self._numbered[data["kept"]]
        if own != kind:
            raise Misshapen(f"a value of {own} is none of {kind}")
        return value


def settings_text(settings: Mapping[str, Any] | None) -> str:
    """The constants that were set, for people; None if unknown."""
    if settings is None:
        return "not known"
    return ", ".join(f"{name}={text}" for name, text in settings.items()) or "no constants"


def last_before(file: Path, until_s: float) -> Snapshot:
    """The last snapshot until a time; raises UsageError if the file is unusable or too short."""
    try:
        return _last_before(file, until_s)
    except (Unusable, Misshapen) as error:
        raise UsageError(str(error)) from error


def _last_before(file: Path, until_s: float) -> Snapshot:
    budget = Budget(file)
    about, texts = recorded(file, budget)
    seed = about.get("seed", "")
    if not seed.isdecimal() or len(seed) > _MOST_DIGITS:
        raise UsageError(f"{file} does not say with which seed it was recorded")
    if followed_the_clock(about):
        raise UsageError(f"{file} is of a run in real time, which cannot be gone on with")
    snapshot = Snapshot(until_s=until_s, seed=int(seed), set=_set(about), texts=texts)
    reading = RecordFile(file, {SNAPSHOTS}, budget)
    report: dict[str, str] = {}
    latest = _last(_texts(reading, until_s, report), budget.most_bytes)
    end_s = reading.end_s(reading.last_s, simulated_s(report))
    if until_s > end_s + _EARLIER_S:
        raise UsageError(f"{file} ends at {end_s:g} s, before {until_s:g} s")
    tries = _MOST_TRIES
    for text in reversed(latest):
        data = _snapshot_data(text)
        if "tick" in data and type(data.get("time")) is float:
            snapshot.saved, snapshot.shelf = data, _aside_of(file, data, budget)
            tries -= 1
            if snapshot.shelf.is_whole or not tries:
                break
        snapshot.missing = str(data.get("missing"))
    if snapshot.saved is None and about.get("from"):
        why = f"it begins later than at 0 s and has no snapshot until then ({snapshot.missing})"
        raise UsageError(f"{file}: the run cannot go on from {until_s:g} s: {why}")
    snapshot.changes = _made_since(snapshot, file, CHANGES, change_of, budget)
    snapshot.operations = _made_since(snapshot, file, PANEL, operation_of, budget)
    return snapshot


def _made_since(
    snapshot: Snapshot,
    file: Path,
    topic: str,
    of_data: Callable[[Any], _Event],
    budget: Budget,
) -> list[_Event]:
    """What was changed from outside since a snapshot, which nothing does again. Raises Unusable."""
    begin, found = snapshot.saved["tick"] if snapshot.saved else 0, list[_Event]()
    for record in _of_topic(RecordFile(file, {topic}, budget), topic):
        if isinstance(record, Message) and record.log_time < (snapshot.until_s - _EARLIER_S) * 1e9:
            try:
                event = of_data(loaded(record.data))
            except (KeyError, TypeError, ValueError) as error:
                raise Unusable(f"{file}: a message of {topic} is damaged") from error
            if event.tick >= begin and event.by != TASK:
                found.append(event)
    return found


def _set(about: Mapping[str, str]) -> Mapping[str, Any] | None:
    """The constants that were set for a run."""
    try:
        texts = loaded(about.get("set", "").encode())
    except Misshapen:
        return None
    return texts if type(texts) is dict else None


def _last(texts: Iterable[bytes], most_bytes: int) -> deque[bytes]:
    """The last texts within a number of bytes, at least one."""
    latest: deque[bytes] = deque()
    size = 0
    for text in texts:
        latest.append(text)
        size += len(text)
        while len(latest) > _LATEST or (size > most_bytes and len(latest) > 1):
            size -= len(latest.popleft())
    return latest


def snapshot_of(file: Path, tick: str, budget: Budget | None = None) -> tuple[Any, Shelved]:
    """The complete snapshot of this tick, else None, and its values stored aside.

    Raises Unusable, Misshapen.
    """
    budget = budget or Budget(file)
    every = every_snapshot(file, budget)
    found = next((data for data in every if str(data["tick"]) == tick), None)
    return found, _aside_of(file, found, budget)


def every_snapshot(file: Path, budget: Budget | None = None) -> Iterator[dict[str, Any]]:
    """All snapshots in a file. Raises Unusable, Misshapen."""
    for text in _texts(RecordFile(file, {SNAPSHOTS}, budget), inf, {}):
        data = _snapshot_data(text)
        if "tick" in data and type(data.get("stamps")) is dict:
            yield data


def _texts(reading: RecordFile, until_s: float, report: dict[str, str]) -> Iterator[bytes]:
    """The texts of the snapshots until then; `report` receives the report in the file."""
    for record in _of_topic(reading, SNAPSHOTS):
        if isinstance(record, Metadata):
            report.update(record.metadata if record.name == "report" else {})
        elif record.log_time <= (until_s + _EARLIER_S) * 1e9:
            yield record.data


def _aside_of(file: Path, saved: Any, budget: Budget) -> Shelved:
    """The values of a snapshot that are stored aside, perhaps long before it in the file.

    Raises Unusable, Misshapen.
    """
    shelf, wanted, found = Shelved(inf, budget.most_bytes), set(_digests(saved)), set[str]()
    for record in _of_topic(RecordFile(file, {PIECES}, budget), PIECES) if wanted else ():
        if isinstance(record, Message):
            budget.aside(len(record.data))
            data = unpacked(loaded(record.data))
            if (digest := digest_of(data)) in wanted:
                shelf.put(digest, data)
                found.add(digest)
    shelf.is_whole = found == wanted
    return shelf


def _digests(data: Any) -> Iterator[str]:
    """The digests in data that refer to values stored aside."""
    inside = [data]
    while inside:
        item = inside.pop()
        if isinstance(item, list):
            inside += item
        elif isinstance(item, dict):
            inside += item.values()
            if type(digest := item.get("digest")) is str:
                yield digest


def _of_topic(reading: RecordFile, topic: str) -> Iterator[Message | Metadata]:
    """The messages of a topic, and the metadata of the run."""
    numbers: set[int] = set()
    for record in reading:
        if isinstance(record, Channel) and record.topic == topic:
            numbers.add(record.id)
        elif isinstance(record, Metadata) or (
            isinstance(record, Message) and record.channel_id in numbers
        ):
            yield record


def _snapshot_data(text: bytes) -> dict[str, Any]:
    data = loaded(text)
    if type(data) is not dict:
        raise Misshapen("a snapshot that is none")
    return data
