"""Whether a specification commands what a bag has of the commanded topics."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from specc_runtime.faults import text_of
from specc_runtime.ros2.bags.types import NoMessage, Types, whole_type
from specc_runtime.ros2.binding import Ros2Topic

_MOST = 10_000
"""Commands that wait for their counterpart."""
_SAME = 1e-6


@dataclass(slots=True)
class _Commands:
    """Commands in a row, of which each differs from the one before."""

    waiting: deque[tuple[float, Any]] = field(default_factory=deque)
    """Those without a counterpart: when each was given first, and its fields."""
    last: Any = None
    last_s: float = 0.0
    """When the last one was repeated last."""
    more: int = 0
    """Those left out, so that no others behind them can be compared."""

    def add(self, time_s: float, fields: Any) -> None:
        self.last_s = time_s
        if not _same(self.last, fields):
            self.last = fields
            if len(self.waiting) < _MOST and not self.more:
                self.waiting.append((time_s, fields))
            else:
                self.more += 1

    def drop(self, before_s: float) -> None:
        """Forget what was not given any more at a time."""
        if self.last_s < before_s:
            self.waiting.clear()
            self.last = None
        while len(self.waiting) > 1 and self.waiting[1][0] <= before_s:
            self.waiting.popleft()


@dataclass(slots=True)
class _Pair:
    """The commands of a topic: those of the bag, and those of now."""

    had: _Commands = field(default_factory=_Commands)
    now: _Commands = field(default_factory=_Commands)
    same: int = 0
    difference: str = ""


class Commands:
    """Compares the sequences of different commands of each topic, whatever their times."""

    def __init__(self, topics: Mapping[str, Ros2Topic], types: Types) -> None:
        """`topics` by their whole names."""
        self.topics = topics
        self._types = types
        self.restart()
        self._of_element = {topic.name: name for name, topic in topics.items()}

    def restart(self) -> None:
        """Know nothing of the bag, and be before the begin of the run."""
        self._pairs = {name: _Pair() for name in self.topics}
        self._has_begun = False

    def begin(self, time_s: float) -> None:
        """The run begins: what the bag has before that time is not compared."""
        self._has_begun = True
        for pair in self._pairs.values():
            pair.had.drop(time_s)

    def had(self, topic: str, fields: Callable[[], dict[str, Any]], time_s: float) -> None:
        """The bag has a command, at that time of its own."""
        pair = self._pairs[topic]
        if not pair.difference:
            try:
                pair.had.add(time_s, _bare(fields()))
            except NoMessage:
                return
            if not self._has_begun:
                pair.had.drop(time_s)
            self._compare(topic, pair)

    def now(self, name: str, fields: Mapping[str, Any], time_s: float) -> None:
        """An element is commanded; what is no topic, as an answer, is not compared."""
        if (topic := self._of_element.get(name)) is None:
            return
        pair, type_ = self._pairs[topic], whole_type(self.topics[topic].type)
        if pair.difference or type_ not in self._types:
            return
        try:
            bare = _bare(self._types.decoded(type_, self._types.encoded(type_, fields)))
        except NoMessage:
            return
        pair.now.add(time_s, bare)
        self._compare(topic, pair)

    def _compare(self, topic: str, pair: _Pair) -> None:
        had, now = pair.had.waiting, pair.now.waiting
        while had and now:
            (_, then), (time_s, command) = had.popleft(), now.popleft()
            if not _same(then, command):
                texts = map(text_of, _differing(then, command))
                pair.difference = (
                    f"{topic} differs first at {time_s:g} s: the bag has {next(texts)}, "
                    f"now {next(texts)}"
                )
                return
            pair.same += 1

    def differences(self, types: Mapping[str, str]) -> Iterator[str]:
        """What differs, in words; `types` are those of the topics that the bag has."""
        for name, pair in self._pairs.items():
            declared = whole_type(self.topics[name].type)
            if name not in types:
                yield f"{name}: the bag has no commands"
            elif types[name] != declared:
                yield f"{name}: not compared, it is {types[name]} in the bag, and {declared} here"
            elif declared not in self._types:
                yield f"{name}: not compared, {declared} is not known"
            else:
                yield pair.difference or f"{name}: {_summary(pair)}"


def _summary(pair: _Pair) -> str:
    """How many commands are the same, and who has more of them."""
    pairs = ("the bag", pair.had), ("the replay", pair.now)
    more = [f"{who} has {n} more" for who, each in pairs if (n := len(each.waiting) + each.more)]
    cap = (
        f" (no more than {_MOST} wait to be compared)"
        if any(each.more for _, each in pairs)
        else ""
    )
    if not more:
        return f"the same commands as in the bag ({pair.same})"
    return f"the same until command {pair.same}; {', '.join(more)}{cap}"


def _bare(fields: dict[str, Any]) -> dict[str, Any]:
    """A message without its stamp."""
    header = {k: v for k, v in fields.get("header", {}).items() if k != "stamp"}
    return fields | ({"header": header} if header else {})


def _differing(one: Any, other: Any) -> tuple[Any, Any]:
    """The fields of two messages that are not the same."""
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return one, other
    parts = {
        name: _differing(one[name], other[name])
        for name in one.keys() & other.keys()
        if not _same(one[name], other[name])
    }
    return {n: parts[n][0] for n in one if n in parts}, {n: parts[n][1] for n in one if n in parts}


def _same(one: Any, other: Any) -> bool:
    """Whether plain data is the same, up to rounding."""
    if isinstance(one, float) and isinstance(other, float):
        are_nan = one != one and other != other
        return are_nan or math.isclose(one, other, rel_tol=_SAME, abs_tol=_SAME)
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[k], other[k]) for k in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    return type(one) is type(other) and bool(one == other)
