"""Snapshots in a recording: all that a run goes on from, about once in a simulated second.

Each is a message of JSON. What is large of opaque values stands aside, each array once in a file;
camera images are in none.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from specc_runtime.forms import Aside, Layout, Misshapen, NotRecorded, object_schema
from specc_runtime.loading import load_layouts
from specc_runtime.options import Options, UsageError
from specc_runtime.plants.errors import PlantError
from specc_runtime.recording.cells import VALUE, VALUE_SCHEMA, Shelf, digest_of
from specc_runtime.recording.log import Log
from specc_runtime.recording.messages import Shelved, recorded, unpacked
from specc_runtime.recording.reading import Channel, Message, Reading, Unusable
from specc_runtime.recording.text import dumped, loaded
from specc_runtime.session import Session
from specc_runtime.snapshot import Values
from specc_runtime.system import System

SNAPSHOTS, PIECES = "/snapshot", "/snapshot/values"
_SCHEMA = object_schema(
    {
        "tick": {"type": "integer"},
        "time": {"type": "number"},
        "missing": {"type": "string", "description": "why there is no snapshot at this time"},
        **{
            name: {"type": "object"}
            for name in ("subsystems", "commands", "sensors", "task", "plant", "requirements")
        },
    }
)
_LATEST = 1000
"""Snapshots that are looked through for the last one that is whole."""
_MOST_BYTES, _MOST_ASIDE = 2**28, 2**31
"""Of these snapshots, and of what is aside: a file may unpack to far more than it is."""
_EARLIER_S = 1e-6
_MOST_DIGITS = 4000
"""Of a seed; Python reads no more."""
WRONG = (AttributeError, LookupError, TypeError, ValueError, OverflowError, Misshapen, NotRecorded)


class Snapshots(Shelf):
    """Writes snapshots, and what of them stands aside."""

    def __init__(self, log: Log, system: System, layouts: Mapping[str, Layout]) -> None:
        super().__init__(log, exact=True)
        self._known: set[str] = set()
        self._values = Values(system, layouts, self)
        self._messages = log.channel(SNAPSHOTS, "specc.Snapshot", _SCHEMA, is_apart=True)
        self._pieces = log.channel(PIECES, VALUE_SCHEMA, VALUE, is_apart=True)

    def keep(self, time_s: float, saved: Callable[[Values], dict[str, Any]]) -> None:
        """Write a snapshot, or why there is none."""
        self._time_s = time_s
        try:
            told = saved(self._values)
        except NotRecorded as missing:
            told = {"missing": str(missing)}
        self._messages.add(time_s, dumped({"time": time_s, **told}))

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        raise NotRecorded("an image")

    def left_out(self, kind: str) -> Any:
        """See `Aside`."""
        raise NotRecorded(f"a value of {kind}, which has no `codec`")

    def _is_new(self, digest: str) -> bool:
        """Whether it is not yet in the file."""
        is_new = digest not in self._known
        self._known.add(digest)
        return is_new

    def _put(self, log: Log, make: Callable[[], bytes], size: int) -> None:
        self._pieces.add(self._time_s, make())


@dataclass(slots=True)
class Kept:
    """What a recording has to go on from: the last snapshot until a moment, and what is aside.

    Without one, `missing` says why. `seed`, `set` and `texts` are those of the recorded run.
    """

    saved: Any = None
    shelf: Shelved = field(default_factory=lambda: Shelved(inf, _MOST_ASIDE))
    missing: str = "it has no snapshots"
    until_s: float = 0.0
    seed: int = 0
    set: Mapping[str, Any] | None = None
    """None where that is not known."""
    texts: dict[str, str] = field(default_factory=dict)

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

    @property
    def settings(self) -> str:
        """The constants that were set, to be read."""
        if self.set is None:
            return "not known"
        return ", ".join(f"{name}={text}" for name, text in self.set.items()) or "none"

    def take(self, session: Session, system: System) -> None:
        """Keep what a run is now, which is at rest, instead."""
        if not session.time_s:
            self.saved = None
            return
        taken = _Taken()
        values = Values(system, load_layouts(system), taken, is_lenient=True)
        self.saved, self.shelf = loaded(dumped(session.saved(values))), taken.shelf

    def go_on(self, session: Session, system: System) -> list[str]:
        """Let a run go on from there; what has no place in it. Raises UsageError."""
        if self.saved is None:
            return []
        if not 0.0 < self.time_s <= self.until_s + _EARLIER_S:
            raise UsageError("the run cannot go on from its snapshot: it has no time")
        values = Values(system, load_layouts(system), self.shelf)
        try:
            return session.restore(self.saved, values)
        except (*WRONG, PlantError) as error:
            why = str(error) if isinstance(error, Misshapen | PlantError) else "it is damaged"
            raise UsageError(f"the run cannot go on from its snapshot: {why}") from error


class _Taken(Aside):
    """Values that stay in this process; see `Aside`."""

    exact, is_brief = True, False

    def __init__(self) -> None:
        self.shelf = Shelved(inf)
        self._count = 0

    def _put(self, value: Any) -> str:
        self._count += 1
        self.shelf.put(str(self._count), value)
        return str(self._count)

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        return {"image": self._put(value)}

    def packed(self, kind: str, data: bytes | np.ndarray[Any, Any]) -> Any:
        """See `Aside`."""
        return {"type": kind, "digest": self._put(data)}

    def left_out(self, kind: str) -> Any:
        """See `Aside`."""
        raise NotRecorded(f"a value of {kind}, which has no `codec`")


def last_before(file: Path, until_s: float) -> Kept:
    """Raises UsageError for a file that cannot be used, or does not reach that far."""
    try:
        return _last_before(file, until_s)
    except (Unusable, Misshapen) as error:
        raise UsageError(str(error)) from error


def _last_before(file: Path, until_s: float) -> Kept:
    about, texts = recorded(file)
    seed = about.get("seed", "")
    if not seed.isdecimal() or len(seed) > _MOST_DIGITS:
        raise UsageError(f"{file} does not say with which seed it was recorded")
    kept = Kept(until_s=until_s, seed=int(seed), set=_set(about), texts=texts)
    reading = Reading(file, {SNAPSHOTS, PIECES})
    latest = _last(_texts(reading, kept.shelf, until_s))
    if until_s > reading.last_s + _EARLIER_S:
        raise UsageError(f"{file} ends at {reading.last_s:g} s, before {until_s:g} s")
    for text in reversed(latest):
        told = _told(text)
        if "tick" in told and type(told.get("time")) is float:
            kept.saved = told
            break
        kept.missing = str(told.get("missing"))
    return kept


def _set(about: Mapping[str, str]) -> Mapping[str, Any] | None:
    """The constants that were set for a run."""
    try:
        told = loaded(about.get("set", "").encode())
    except Misshapen:
        return None
    return told if type(told) is dict else None


def _last(texts: Iterable[bytes]) -> deque[bytes]:
    """The last of them, at least one."""
    latest: deque[bytes] = deque()
    size = 0
    for text in texts:
        latest.append(text)
        size += len(text)
        while len(latest) > _LATEST or (size > _MOST_BYTES and len(latest) > 1):
            size -= len(latest.popleft())
    return latest


def snapshot_of(file: Path, tick: str) -> tuple[Any, Shelved]:
    """The snapshot of this tick, None if there is none that is whole, and what is aside.

    Raises Unusable, Misshapen.
    """
    shelf = Shelved(inf, _MOST_ASIDE)
    every = map(_told, _texts(Reading(file, {SNAPSHOTS, PIECES}), shelf, inf))
    return next((told for told in every if str(told.get("tick")) == tick), None), shelf


def _texts(reading: Reading, shelf: Shelved, until_s: float) -> Iterator[bytes]:
    """The texts of the snapshots until then; `shelf` gets what is aside."""
    topics: dict[int, str] = {}
    for record in reading:
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message) and record.log_time <= (until_s + _EARLIER_S) * 1e9:
            topic = topics.get(record.channel_id)
            if topic == SNAPSHOTS:
                yield record.data
            elif topic == PIECES:
                data = unpacked(loaded(record.data))
                shelf.put(digest_of(data), data)


def _told(text: bytes) -> dict[str, Any]:
    told = loaded(text)
    if type(told) is not dict:
        raise Misshapen("a snapshot that is none")
    return told
