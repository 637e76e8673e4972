"""Monitors of temporal formulas over base ticks, with three truth values and margins.

A judgement is an interval of truth and margin. The bounds coincide where the formula is decided;
the interval is the widest where it is unknown. The margin is the robustness of signal temporal
logic (Donze and Maler, 2010): the change of the compared numbers that would change the verdict. On
the bounds `and` is a minimum and `or` a maximum, over two formulas and over ticks; for truth this
is Kleene's logic. Memory is bounded by the windows of the operators, in ticks.
"""

from __future__ import annotations

import math
import traceback
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import chain, groupby, repeat
from typing import Any, ClassVar, NamedTuple

import numpy as np

from specc_runtime.examination import same

Known = tuple[bool, float]
"""Truth and margin: the margin is >= 0 where true and <= 0 where false."""
Judgement = tuple[Known, Known]

_OPERATORS = "specc_runtime.usual"
"""The module through which generated code calls operators."""
_LOWEST, _HIGHEST = (False, -math.inf), (True, math.inf)
UNKNOWN: Judgement = (_LOWEST, _HIGHEST)
TRUE: Judgement = (_HIGHEST, _HIGHEST)
FALSE: Judgement = (_LOWEST, _LOWEST)


def judged(holds: bool, margin: float | Callable[[], float] = math.inf) -> Judgement:
    """The judgement of a condition from its truth and its distance to the opposite truth.

    The margin of integers is a float as well, infinite where it is beyond all floats. There is no
    margin if it needs an operand that short-circuit evaluation skipped, of `or` or of `all`.
    """
    try:
        size = abs(float(margin() if callable(margin) else margin))
    except Exception as error:
        if not isinstance(error, AttributeError) and not _may_be_raised(error):
            raise
        size = math.inf
    known = (True, size) if holds else (False, -size)
    return known, known


class _Data(NamedTuple):
    """A conversion to plain data and back; reading raises TypeError, ValueError."""

    of: Callable[[Any], Any]
    read: Callable[[Any], Any]


def _of_known(known: Known) -> list[Any]:
    holds, margin = known
    return [holds] if math.isinf(margin) else [holds, margin]


def _known(data: Any) -> Known:
    holds, *margin = data
    size = margin[0] if margin else math.inf if holds else -math.inf
    if type(holds) is not bool or type(size) is not float:
        raise TypeError("neither truth nor margin")
    return holds, size


def of_judgement(judgement: Judgement) -> list[Any]:
    """A judgement as plain data; one bound if both are equal."""
    low, high = judgement
    return [_of_known(low)] if low == high else [_of_known(low), _of_known(high)]


def read_judgement(data: Any) -> Judgement:
    """A judgement from plain data; raises TypeError, ValueError for other data."""
    low, *high = map(_known, data)
    return low, high[0] if high else low


def _of_waiting(waiting: deque[Judgement | None]) -> list[Any]:
    runs = [(len(list(same)), item) for item, same in groupby(waiting)]
    return [[count, None if item is None else of_judgement(item)] for count, item in runs]


def _waiting(data: Any) -> deque[Judgement | None]:
    runs = [(int(count), None if item is None else read_judgement(item)) for count, item in data]
    return deque(chain.from_iterable(repeat(item, count) for count, item in runs))


def check_runs(data: Any, most: int) -> None:
    """Raise ValueError for runs (length, repeated value) of more than `most` items."""
    lengths = [int(length) for length, _ in data]
    if sum(lengths) > most or min(lengths, default=1) < 1:
        raise ValueError("more than is ever remembered")


_NUMBER = _Data(int, int)
_NOTHING_SEEN = -1
_SEEN = _Data(
    lambda seen: seen and min(seen, 0), lambda seen: None if seen is None else min(int(seen), 0)
)
"""Changes that were seen: restored values count them from 0."""
_LAST = _Data(of_judgement, read_judgement)
_WAITING = _Data(_of_waiting, _waiting)
_BEST = _Data(
    lambda values: [[tick, _of_known(known)] for tick, known in values],
    lambda data: deque([(int(tick), _known(known)) for tick, known in data]),
)


class _History:
    """An object with state from past ticks: its attributes in `keeps`, and its `parts`.

    `keeps` has the conversion to plain data of each attribute.
    """

    keeps: ClassVar[Mapping[str, _Data]] = {}
    parts: Sequence[_History] = ()

    @property
    def shape(self) -> list[Any]:
        """Its operators and windows in ticks, as plain data.

        A saved state can be restored only into the same shape.
        """
        return [type(self).__name__, self._reach, *[part.shape for part in self.parts]]

    _reach: int = 0

    def saved(self) -> list[Any]:
        """Its state, as plain data."""
        own = [data.of(getattr(self, name)) for name, data in self.keeps.items()]
        return [*own, *[part.saved() for part in self.parts]]

    def restore(self, saved: Any) -> None:
        """Restore a saved state; raises TypeError, ValueError for other data."""
        readers = [
            *[data.read for data in self.keeps.values()],
            *[part.restore for part in self.parts],
        ]
        found = [read(item) for read, item in zip(readers, saved, strict=True)]
        for name, value in zip(self.keeps, found, strict=False):
            setattr(self, name, value)


class Formula(_History, ABC):
    """A formula that follows a run. Its judgement of a tick is known `delay` ticks later.

    Its state is determined by the last `depth` ticks.
    """

    delay: int = 0
    depth: float = 0
    operands: Sequence[Formula] = ()

    def atoms(self) -> Iterator[Atom]:
        """The conditions in it."""
        for operand in self.operands:
            yield from operand.atoms()

    @abstractmethod
    def step(self) -> Judgement | None:
        """Advance by a tick; returns the judgement `delay` ticks earlier, None before the first."""


class Atom(Formula):
    """A condition on the values of one tick, unknown where it cannot be computed.

    `reads` are the attributes of the values that it reads.
    """

    def __init__(self, judge: Callable[[], Judgement], *reads: str) -> None:
        self.now = UNKNOWN
        self.reads = frozenset(reads)
        self._judge = judge

    def atoms(self) -> Iterator[Atom]:
        """Itself."""
        yield self

    def update(self) -> None:
        """Evaluate the condition again after a value changed."""
        try:
            self.now = self._judge()
        except Exception as error:
            if not _may_be_raised(error, self.reads):
                raise
            self.now = UNKNOWN

    def step(self) -> Judgement:
        """See `Formula`."""
        return self.now


class Watched(Atom):
    """A value of which each change is counted; `reads` are the attributes that it reads."""

    def __init__(self, value: Callable[[], Any], *reads: str) -> None:
        super().__init__(lambda: UNKNOWN, *reads)
        self._value = value
        self.changes = 0
        self.last: Any = _NEVER
        """Its value, or `_ABSENT`."""

    def update(self) -> None:
        """Compute it again; the first value is no change."""
        try:
            found = self._value()
        except Exception as error:
            if not _may_be_raised(error, self.reads):
                raise
            found = _ABSENT
        self.changes += self.last is not _NEVER and not _is_equal(found, self.last)
        self.last, self.now = found, UNKNOWN if found is _ABSENT else TRUE

    def forget(self) -> None:
        """Begin anew: the next value is that of the last tick."""
        self.changes, self.last = 0, _NEVER


_NEVER, _ABSENT = object(), object()


def _is_equal(a: Any, b: Any) -> bool:
    """Whether two values are equal; a component that is missing equals itself."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        is_missing = (a != a) & (b != b)  # NaN
        return a.shape == b.shape and bool(np.all((a == b) | is_missing))
    if isinstance(a, tuple | list) and type(a) is type(b):
        return len(a) == len(b) and all(map(_is_equal, a, b))
    return bool(a == b) if isinstance(a, int | float | str) else same(a, b)


def _may_be_raised(error: Exception, reads: Collection[str] = ()) -> bool:
    """Whether an error means an unknown condition: absence, arithmetic, an operator."""
    if isinstance(error, ArithmeticError | LookupError | ValueError):
        return True
    absent = isinstance(error, AttributeError) and error.name in reads
    frames = (frame for frame, _ in traceback.walk_tb(error.__traceback__))
    return absent or any(f.f_globals.get("__name__") == _OPERATORS for f in frames)


class Not(Formula):
    """The negation of a formula."""

    def __init__(self, operand: Formula) -> None:
        self.delay, self.depth = operand.delay, operand.depth
        self.operands = (operand,)
        self.parts = (operand,)

    def step(self) -> Judgement | None:
        """See `Formula`."""
        found = self.operands[0].step()
        return found and (_opposite(found[1]), _opposite(found[0]))


def _opposite(known: Known) -> Known:
    return not known[0], -known[1]


class _Delayed(_History):
    """A formula whose judgements come `delay` ticks after what they judge."""

    keeps: ClassVar[Mapping[str, _Data]] = {"_waiting": _WAITING}

    def __init__(self, formula: Formula, delay: int) -> None:
        self._formula = formula
        self.parts = (formula,)
        self._reach = self._by = delay - formula.delay
        self.depth = formula.depth + self._by
        self._waiting: deque[Judgement | None] = deque()

    def step(self) -> Judgement | None:
        if not self._by:
            return self._formula.step()
        self._waiting.append(self._formula.step())
        return self._waiting.popleft() if len(self._waiting) > self._by else None

    def restore(self, saved: Any) -> None:
        """See `_History`; refuses more judgements than can ever wait."""
        check_runs(saved[0], self._by)
        super().restore(saved)


class _Junction(Formula):
    def __init__(self, pick: Callable[[list[Known]], Known], operands: Sequence[Formula]) -> None:
        self._pick = pick
        self.delay = max(operand.delay for operand in operands)
        self.operands = operands
        self._delayed = [_Delayed(operand, self.delay) for operand in operands]
        self.depth = max(operand.depth for operand in self._delayed)
        self.parts = self._delayed

    def step(self) -> Judgement | None:
        """See `Formula`."""
        found = [operand.step() for operand in self._delayed]
        known = [judgement for judgement in found if judgement is not None]
        if not known:
            return None
        return self._pick([low for low, _ in known]), self._pick([high for _, high in known])


class And(_Junction):
    """The conjunction of formulas."""

    def __init__(self, *operands: Formula) -> None:
        super().__init__(min, operands)


class Or(_Junction):
    """The disjunction of formulas."""

    def __init__(self, *operands: Formula) -> None:
        super().__init__(max, operands)


class _Window(Formula):
    """The maximum or minimum of a formula over `ticks + 1` ticks, ahead or past."""

    best: ClassVar[bool]
    ahead: ClassVar[bool]
    keeps: ClassVar[Mapping[str, _Data]] = {"_count": _NUMBER, "_lows": _BEST, "_highs": _BEST}

    def __init__(self, ticks: int, operand: Formula) -> None:
        self._reach = self._ticks = ticks
        self.operands = (operand,)
        self.parts = (operand,)
        self._count = 0
        # For each bound the ticks that may still become the best, in falling order.
        self._lows: deque[tuple[int, Known]] = deque()
        self._highs: deque[tuple[int, Known]] = deque()
        self.delay = operand.delay + (ticks if self.ahead else 0)
        self.depth = operand.depth + ticks

    def step(self) -> Judgement | None:
        """See `Formula`."""
        found = self.operands[0].step()
        if found is None:
            return None
        low, high = self._append(self._lows, found[0]), self._append(self._highs, found[1])
        self._count += 1
        return None if self.ahead and self._count <= self._ticks else (low, high)

    def _append(self, values: deque[tuple[int, Known]], new: Known) -> Known:
        while values and (values[-1][1] <= new if self.best else values[-1][1] >= new):
            values.pop()
        values.append((self._count, new))
        if values[0][0] < self._count - self._ticks:
            values.popleft()
        return values[0][1]


class Within(_Window):
    """The formula holds at some tick of the window ahead."""

    best, ahead = True, True


class Throughout(_Window):
    """The formula holds at all ticks of the window ahead."""

    best, ahead = False, True


class Once(_Window):
    """The formula held at some tick of the past window."""

    best, ahead = True, False


class Historically(_Window):
    """The formula held at all ticks of the past window."""

    best, ahead = False, False


class _Unchanged(Formula):
    """Whether a value is what it was at the tick before; at the first tick it is not."""

    keeps: ClassVar[Mapping[str, _Data]] = {"_seen": _SEEN}
    depth = 1

    def __init__(self, value: Watched) -> None:
        self._value = value
        self._seen: int | None = _NOTHING_SEEN
        """Changes until the last tick; None if that tick is unknown."""

    def atoms(self) -> Iterator[Atom]:
        """See `Formula`."""
        yield self._value

    def step(self) -> Judgement:
        """See `Formula`."""
        if self._value.now is UNKNOWN and self._value.last is not _ABSENT:
            self._seen = None
            return UNKNOWN
        seen, self._seen = self._seen, self._value.changes
        if seen is None:
            return UNKNOWN
        return self._value.now if seen == self._seen else FALSE

    def restore(self, saved: Any) -> None:
        """See `_History`."""
        super().restore(saved)
        self._value.forget()


class Stays(Historically):
    """A value has been equal at this tick and the `ticks` before; false until there are as many.

    To become absent, or present, is a change. It is unknown of a value that stays absent.
    """

    def __init__(self, ticks: int, value: Watched) -> None:
        super().__init__(max(0, ticks - 1), _Unchanged(value))
        self._is_trivial = not ticks

    def step(self) -> Judgement | None:
        """See `Formula`."""
        found = super().step()
        return TRUE if self._is_trivial else found


class Since(Formula):
    """The second held at some tick until now, and the first at all ticks after that one."""

    keeps: ClassVar[Mapping[str, _Data]] = {"_last": _LAST}

    def __init__(self, first: Formula, second: Formula) -> None:
        self.delay, self.depth = max(first.delay, second.delay), math.inf
        self.operands = (first, second)
        self._first = _Delayed(first, self.delay)
        self._second = _Delayed(second, self.delay)
        self.parts = self._first, self._second
        self._last = FALSE

    def step(self) -> Judgement | None:
        """See `Formula`."""
        first, second = self._first.step(), self._second.step()
        if first is None or second is None:
            return None
        low = max(second[0], min(first[0], self._last[0]))
        high = max(second[1], min(first[1], self._last[1]))
        self._last = low, high
        return self._last
