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
class _Pair:
    """The commands of a topic: those of the bag, and those of now with their times."""

    had: deque[Any] = field(default_factory=deque)
    now: deque[tuple[float, Any]] = field(default_factory=deque)
    last: list[Any] = field(default_factory=lambda: [None, None])
    count: int = 0
    difference: str = ""


class Commands:
    """Compares the sequences of different commands of each topic, whatever their times."""

    def __init__(self, topics: Mapping[str, Ros2Topic], types: Types) -> None:
        """`topics` by their whole names."""
        self.topics = topics
        self._types = types
        self._pairs = {name: _Pair() for name in topics}
        self._of_element = {topic.name: name for name, topic in topics.items()}

    def begin(self) -> None:
        """The run begins: what the bag has before is not compared."""
        for pair in self._pairs.values():
            pair.had.clear()
            pair.last[0], pair.count = None, 0

    def had(self, topic: str, fields: Callable[[], dict[str, Any]]) -> None:
        """The bag has a command."""
        pair = self._pairs[topic]
        if not pair.difference and len(pair.had) < _MOST:
            try:
                bare = _bare(fields())
            except NoMessage:
                return
            if not _same(pair.last[0], bare):
                pair.last[0] = bare
                pair.had.append(bare)
                pair.count += 1
            self._compare(topic, pair)

    def now(self, name: str, fields: Mapping[str, Any], time_s: float) -> None:
        """An element is commanded; what is no topic, as an answer, is not compared."""
        if (topic := self._of_element.get(name)) is None:
            return
        pair, type_ = self._pairs[topic], whole_type(self.topics[topic].type)
        if pair.difference or len(pair.now) >= _MOST or type_ not in self._types:
            return
        try:
            bare = _bare(self._types.decoded(type_, self._types.encoded(type_, fields)))
        except NoMessage:
            return
        if not _same(pair.last[1], bare):
            pair.last[1] = bare
            pair.now.append((time_s, bare))
        self._compare(topic, pair)

    def _compare(self, topic: str, pair: _Pair) -> None:
        while pair.had and pair.now:
            then, (time_s, now) = pair.had.popleft(), pair.now.popleft()
            if not _same(then, now):
                texts = text_of(_values(then)), text_of(_values(now))
                pair.difference = (
                    f"{topic} differs first at {time_s:g} s: the bag has {texts[0]}, now {texts[1]}"
                )
                return

    def differences(self) -> Iterator[str]:
        """What differs, in words; nothing of topics that the bag does not have."""
        for topic, pair in self._pairs.items():
            if pair.count:
                yield pair.difference or f"{topic}: the same commands as in the bag"


def _bare(fields: dict[str, Any]) -> dict[str, Any]:
    """A message without its stamp."""
    header = {k: v for k, v in fields.get("header", {}).items() if k != "stamp"}
    return fields | ({"header": header} if header else {})


def _values(fields: Any) -> Any:
    """The parts of a message that are not 0 or empty, which are what is worth to be seen."""
    if isinstance(fields, dict):
        parts = {name: _values(value) for name, value in fields.items()}
        return {name: value for name, value in parts.items() if value not in ({}, [], "", 0, None)}
    return fields


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
