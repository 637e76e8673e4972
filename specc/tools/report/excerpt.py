"""What a report has of a run: the answers of the page at chosen moments, within so many bytes.

Nothing is computed here. What the report shows of a moment is what the page's source of the
recording says of it, so that both have the same states, values, verdicts and reasons.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import inf
from typing import Any

from specc.diagnostics.visible import visible
from specc.refusal import Refused
from specc.tools.page.messages import Message, Picture, json_text
from specc.tools.page.moments import decimated
from specc.tools.page.recorded import RecordedRun

AROUND_S = 10.0
"""What is shown around a fault or a violation."""
_BAD = ("fault", "violation")
_SAME_S = 1e-6
_LONGEST_SERIES_S = 600.0
"""What the page gives at once."""
_MOST_MACHINES = 3
"""Of which a fault or a violation says why."""
_MOST_STRETCHES = 20
"""Of `_LONGEST_SERIES_S`; what is later has no lines."""
_MOST_LOOKED_THROUGH = 40_000_000
"""Messages, when each moment is looked up in a chunk of its own."""
_LONGEST_MARK = 300
"""Characters of a requirement that a mark has."""
_LARGEST_PICTURE = 400_000
_KINDS = {b"\xff\xd8\xff": "jpeg", b"\x89PNG": "png"}


class NoRoom(Refused):
    """Nothing of a run fits into the report."""


@dataclass(frozen=True, slots=True)
class Plenty:
    """How much of a run a report has at most."""

    moments: int = 800
    transitions: int = 300
    marks: int = 200
    incidents: int = 20
    pictures: int = 24
    signals: int = 16
    machines: int = 16
    """Whose reasons are there at each fault and violation, and at the end."""

    def half(self) -> Plenty:
        """Half as much of everything that there are several of."""
        return replace(
            self,
            moments=self.moments // 2,
            transitions=self.transitions // 2,
            marks=self.marks // 2,
            incidents=(self.incidents + 1) // 2,
            pictures=self.pictures // 2,
            signals=(self.signals + 1) // 2,
            machines=(self.machines + 1) // 2,
        )

    @property
    def is_least(self) -> bool:
        """Whether half of it would show nothing."""
        return self.moments < 20


def excerpt(run: RecordedRun, wanted: Sequence[str], most_bytes: int) -> str:
    """JSON about a run, of at most so many bytes; `wanted` are signals, empty for the usual ones.

    Raises NoRoom.
    """
    plenty = Plenty()
    while not plenty.is_least and plenty.moments * run.most_messages > _MOST_LOOKED_THROUGH:
        plenty = plenty.half()
    while True:
        text = json_text(_Excerpt(run, wanted, plenty).message())
        if len(text.encode(errors="replace")) <= most_bytes:
            return text
        if plenty.is_least:
            raise NoRoom("it is too large for a report; `specc view` shows it")
        plenty = plenty.half()


@dataclass(frozen=True, slots=True)
class _Transition:
    """A machine changed its state."""

    time_s: float
    machine: str
    before: str
    after: str


@dataclass(slots=True)
class _Lines:
    """The lines of a signal, one stretch of time after another."""

    times: list[float] = field(default_factory=list)
    columns: list[list[float]] = field(default_factory=list)
    words: Sequence[str] = ()

    def add(self, series: Message, begin_s: float) -> None:
        """Add what is not before a time: there it is known already."""
        first = sum(1 for time_s in series["t"] if time_s < begin_s - _SAME_S)
        self.times += series["t"][first:]
        self.columns = self.columns or [[] for _ in series["lines"]]
        for column, line in zip(self.columns, series["lines"], strict=False):
            column += line[first:]
        self.words = self.words or series["words"]

    def message(self) -> Message:
        """All of them, thinned out."""
        times, lines = decimated(self.times, self.columns)
        return {"t": times, "lines": lines, "words": self.words}


class _Excerpt:
    """A run, as far as a report has it."""

    def __init__(self, run: RecordedRun, wanted: Sequence[str], plenty: Plenty) -> None:
        self._run, self._plenty = run, plenty
        self._hello = run.hello()
        self._begin_s, self._end_s = self._hello["begin_s"], self._hello["end_s"]
        self._spans, self._marks = run.spans(), run.marks()
        self._machines = [machine["name"] for machine in self._hello["machines"]]
        known = {signal["name"]: signal for signal in self._hello["signals"]}
        self._shown = [name for name in wanted if name in known] or list(self._hello["usual"])
        self._shown = self._shown[: plenty.signals]
        others = (n for n, s in known.items() if s["components"] and s["kind"] != "state")
        more = () if wanted else others
        self._signals = list(dict.fromkeys((*self._shown, *more)))[: plenty.signals]
        bad = [mark for mark in self._marks if mark["kind"] in _BAD]
        self._incidents, self._left_out = bad[: plenty.incidents], len(bad[plenty.incidents :])

    def message(self) -> Message:
        """All of it."""
        return {
            "hello": self._hello_message(),
            "spans": self._spans,
            "marks": self._marks,
            "moments": list(self._moments()),
            "whys": self._whys(),
            "series": self._whole_series(),
            "incidents": [self._incident(mark) for mark in self._incidents],
            "more_incidents": self._left_out,
            "pictures": list(self._pictures()),
        }

    def _hello_message(self) -> Message:
        """What `hello` says, without what a report does not show."""
        hello, names = self._hello, {*self._signals, *self._machines}
        empty = dict.fromkeys(("constants", "poses", "bodies", "live", "panel"), ())
        file = visible(str(hello["file"]))
        return {
            **hello,
            **empty,
            "structure": None,
            "parts": {},
            "scene": None,
            "carriers": {},
            "machines": [{**machine, "svg": None, "rows": []} for machine in hello["machines"]],
            "signals": [signal for signal in hello["signals"] if signal["name"] in names],
            "usual": self._shown,
            "can": {},
            "file": file,
            "report": f"{file} {' '.join(self._shown)}",
            "window_s": 0,
        }

    # Moments.

    @cached_property
    def _transitions(self) -> list[_Transition]:
        """All changes of states that are known one by one, in the order of time."""
        found = [
            _Transition(after[0], name, before[2], after[2])
            for name, spans in self._spans.items()
            for before, after in pairwise(spans)
        ]
        return sorted(found, key=lambda one: one.time_s)

    @cached_property
    def _chosen_transitions(self) -> list[_Transition]:
        return _evenly(self._transitions, self._plenty.transitions)

    def _times(self) -> list[float]:
        """The moments of the report: where something happens, and evenly in between."""
        plenty, begin_s, end_s = self._plenty, self._begin_s, self._end_s
        bad = [mark["time_s"] for mark in self._incidents]
        times = [begin_s, end_s, *bad]
        times += [mark["time_s"] for mark in self._marks[: plenty.marks]]
        times += [one.time_s for one in self._chosen_transitions]
        rest = max(2, plenty.moments - len(times))
        near = rest // 2 // len(bad) if bad else 0
        for at_s in bad:
            times += spread(at_s - AROUND_S / 2, at_s + AROUND_S / 2, near)
        times += spread(begin_s, end_s, rest - near * len(bad))
        return without_near(time_s for time_s in times if begin_s <= time_s <= end_s)

    def _moments(self) -> Iterator[Message]:
        """What the page says of each moment, without what is as in the one before."""
        before: dict[str, dict[str, Any]] = {"states": {}, "values": {}, "requirements": {}}
        names = [*self._machines, *self._signals]
        for time_s in self._times():
            found = self._run.moment(time_s, names, has_scene=False)
            verdicts = enumerate(found["requirements"])
            now = {
                "states": dict(found["states"]),
                "values": dict(found["values"]),
                "requirements": {str(number): verdict for number, verdict in verdicts},
            }
            news = {name: changes(before[name], data) for name, data in now.items()}
            yield {"t": time_s, **{name: data for name, data in news.items() if data}}
            before = now

    def _whys(self) -> dict[str, list[Message]]:
        """Reasons by machine: at its transitions, at what went wrong, and at the end."""
        bad = [mark["time_s"] for mark in self._incidents]
        concerned = [name for mark in self._incidents for name in self._concerned(mark)]
        names = list(dict.fromkeys((*concerned, *self._machines)))[: self._plenty.machines]
        found: dict[str, list[Message]] = {}
        for name in self._machines:
            own = [one.time_s for one in self._chosen_transitions if one.machine == name]
            times = without_near((*own, *((*bad, self._end_s) if name in names else ())))
            found[name] = [
                {"t": time_s, "lines": self._run.why(name, time_s)["lines"]} for time_s in times
            ]
        return found

    # What went wrong.

    def _incident(self, mark: Message) -> Message:
        """A fault or a violation, with the lines of the shown signals around it."""
        at_s = mark["time_s"]
        drawn = self._run.several_series(self._shown, at_s, AROUND_S)
        is_violation, text = mark["kind"] == "violation", mark["text"]
        every = self._hello["requirements"] if is_violation else ()
        own = (each for each in every if each["that"][:_LONGEST_MARK] == text)
        return {
            **mark,
            "machines": list(self._concerned(mark)),
            "series": {name: drawn[name] for name in self._shown},
            "requirement": next(own, None),
        }

    def _concerned(self, mark: Message) -> Iterable[str]:
        """The machines that a text names, or the one that changed its state last."""
        words = set(re.findall(r"[^\W\d]\w*(?:\.\w+)*", mark["text"]))
        if named := [name for name in self._machines if name in words]:
            return named[:_MOST_MACHINES]
        before = [one for one in self._transitions if one.time_s <= mark["time_s"] + _SAME_S]
        return [before[-1].machine] if before else self._machines[:1]

    # Signals and pictures.

    def _whole_series(self) -> dict[str, Message]:
        """The lines of the signals over all of the run."""
        found = {name: _Lines() for name in self._signals}
        begin_s, number = self._begin_s, 0
        while number < _MOST_STRETCHES and (begin_s < self._end_s or not number):
            end_s = min(self._end_s, begin_s + _LONGEST_SERIES_S)
            length_s = end_s - begin_s
            part = self._run.several_series(self._signals, begin_s + length_s / 2, length_s)
            for name, lines in found.items():
                lines.add(part[name], begin_s if number else -inf)
            begin_s, number = end_s, number + 1
        return {name: lines.message() for name, lines in found.items()}

    def _pictures(self) -> Iterator[Message]:
        """What cameras saw at transitions and when something went wrong, each picture once."""
        moments = [(m["time_s"], f"{m['kind']}: {m['text']}") for m in self._incidents]
        cameras = self._hello["cameras"][: self._plenty.pictures]
        most = self._plenty.pictures // max(1, len(cameras))
        changed = _evenly(self._transitions, max(0, most - len(moments)))
        moments += [(t.time_s, f"{t.machine}: {t.before} → {t.after}") for t in changed]
        for camera in cameras:
            seen: dict[float, tuple[Picture, list[Message]]] = {}
            for time_s, text in sorted(moments):
                picture = self._run.picture(camera, time_s)
                if picture is not None:
                    _, own = seen.setdefault(picture.time_s, (picture, []))
                    own.append({"time_s": time_s, "text": text})
            for picture, own in seen.values():
                if address := address_of(picture.data):
                    yield {"camera": camera, "time_s": picture.time_s, "at": own, "src": address}


def address_of(picture: bytes) -> str:
    """A picture as an address; empty if it is none, or too large."""
    for begin, kind in _KINDS.items():
        if picture.startswith(begin) and len(picture) <= _LARGEST_PICTURE:
            return f"data:image/{kind};base64,{b64encode(picture).decode()}"
    return ""


def _evenly(items: Sequence[_Transition], most: int) -> list[_Transition]:
    """At most so many of the items, evenly spread over all of them."""
    if len(items) <= most:
        return list(items)
    return [items[number * len(items) // most] for number in range(most)]


def spread(begin_s: float, end_s: float, count: int) -> list[float]:
    """So many times from one to another, both included."""
    if count < 2:
        return []
    step_s = (end_s - begin_s) / (count - 1)
    return [round(begin_s + number * step_s, 6) for number in range(count)]


def without_near(times: Iterable[float]) -> list[float]:
    """The times in ascending order, without those that are the same as one before."""
    found: list[float] = []
    for time_s in sorted(times):
        if not found or time_s - found[-1] > _SAME_S:
            found.append(time_s)
    return found


def changes(before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """What is another than before; None for what is not there any more."""
    gone: Collection[str] = before.keys() - now.keys()
    return {**dict.fromkeys(sorted(gone)), **{n: d for n, d in now.items() if before.get(n) != d}}
