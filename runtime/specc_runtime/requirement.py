"""One requirement on a run: its monitor, its verdict, and its part of a snapshot."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from itertools import groupby, repeat
from typing import Any, Literal

from specc_runtime.faults import text_of
from specc_runtime.forms import is_short
from specc_runtime.temporal import (
    TRUE,
    UNKNOWN,
    Formula,
    Judgement,
    of_judgement,
    read_judgement,
)

Verdict = Literal["met", "violated", "unknown"]
Encode = Callable[[Any], Any]
"""Converts values, by attribute, to plain data or back."""
Show = Callable[[Mapping[str, Any]], None]
"""Evaluates conditions on values, by attribute."""
_LONGEST = 100_000
"""Judged ticks whose values are kept at most, for judging anew."""
_NOTHING: Mapping[str, Any] = {}


class Requirement:
    """A requirement at every tick if it `lasts`, else at the first one, with its verdict.

    `reads` has the attribute of each value that it names, by that name. `asked` is a formula over
    the same atoms: it holds where the requirement does not hold vacuously. Without `asked`, it is
    asked at every tick. `contract` is its name if it is the contract of a device.
    """

    def __init__(
        self,
        that: str,
        because: str,
        formula: Formula,
        reads: Mapping[str, str],
        *,
        asked: Formula | None = None,
        name: str = "",
        contract: str = "",
        lasts: bool = True,
    ) -> None:
        self.name = name
        self.contract = contract
        self.that = that
        self.because = because
        self.reads = reads
        self.formula = formula
        self._antecedent = None if asked is None else _Antecedent(asked, lasts=lasts)
        self._lasts = lasts
        self.holds = False
        """Whether it is met at the last tick that is judged."""
        self.asked_from = 0
        """The first tick that `held_first` may be."""
        self.held_first: int | None = None
        """The first tick judged in this run at which it is met."""
        self._worst = TRUE
        self._count = 0
        self._history = 0
        """Ticks that another version of it judged."""
        self._over = False
        depth = formula.depth if formula.depth < _LONGEST else formula.delay
        self._earlier: deque[Mapping[str, Any]] = deque(maxlen=int(depth) + 1)
        """The values of the last ticks, from which another formula can be judged."""
        self._first: dict[str, tuple[int, dict[str, Any]]] = {}
        """For each verdict the first tick that makes it, and the values reported for that tick."""

    def step(self, values: Mapping[str, Any]) -> None:
        """Judge a tick on its values."""
        self._earlier.append(values)
        if self._antecedent is not None:
            self._antecedent.step()
        found = self.formula.step()
        if found is None:
            return
        self.holds = found[0][0]
        if self.holds and self.held_first is None and self._count >= self.asked_from:
            self.held_first = self._count
        if (self._lasts or not self._count) and self._count >= self._history:
            self._judge(found, self._earlier[max(-1 - self.formula.delay, -len(self._earlier))])
        self._count += 1

    def _judge(self, found: Judgement, then: Mapping[str, Any]) -> None:
        (low, high), worst = found, self._worst
        self._worst = min(low, worst[0]), min(high, worst[1])
        if not low[0]:
            verdict = "unknown" if high[0] else "violated"
            if verdict not in self._first:
                self._first[verdict] = self._count, self._shown(then)

    def pass_over(self, ticks: int) -> None:
        """Judge some ticks on which all atoms are unknown."""
        for _ in range(ticks):
            self.step(_NOTHING)

    def finish(self, missed: int) -> None:
        """End the run, `missed` ticks ago: ticks that are not judged yet are unknown."""
        self.pass_over(0 if self._over else missed + self.formula.delay)
        self._over = True

    @property
    def verdict(self) -> Verdict:
        """The verdict so far; a requirement is met only once the run is over."""
        if not self._worst[1][0]:
            return "violated"
        return "met" if self._over and self._count and self._worst[0][0] else "unknown"

    def as_data(self, tick_s: float) -> dict[str, Any]:
        """The entry of the report; `time_s` is the first tick that makes the verdict.

        `asked`: whether it was ever asked in the run, None where it always is.
        """
        verdict = self.verdict
        margin = {"met": self._worst[0][1], "violated": self._worst[1][1], "unknown": None}[verdict]
        first = self._first.get(verdict)
        return {
            **({"name": self.name} if self.name else {}),
            **({"contract": self.contract} if self.contract else {}),
            "that": self.that,
            "because": self.because,
            "verdict": verdict,
            "asked": None if self._antecedent is None else self._antecedent.ever,
            "margin": None if margin is None or math.isinf(margin) else margin,
            "time_s": first[0] * tick_s if first else None,
            "values": first[1] if first else {},
        }

    def so_far(self, tick_s: float) -> dict[str, Any]:
        """Verdict and margin of the ticks that are judged, while the run goes on.

        The verdict is `open` as long as there are none.
        """
        low, high = self._worst
        judged = {"violated": not high[0], "open": not self._count, "unknown": not low[0]}
        verdict = next((name for name, is_so in judged.items() if is_so), "holds")
        first = self._first.get(verdict)
        is_known = low == high and math.isfinite(low[1])
        return {
            "verdict": verdict,
            "margin": high[1]
            if is_known or (verdict == "violated" and math.isfinite(high[1]))
            else None,
            "time_s": first[0] * tick_s if first else None,
        }

    def saved(self, encode: Encode) -> dict[str, Any]:
        """The state of the monitor, as plain data."""
        earlier = () if self._decided else self._earlier
        runs = [list(same) for _, same in groupby(earlier, id)]
        return {
            "that": self.that,
            "shape": self._shape,
            "formula": self.formula.saved(),
            "asked": None if self._antecedent is None else self._antecedent.saved(),
            "holds": self.holds,
            "worst": of_judgement(self._worst),
            "count": self._count,
            "history": self._history,
            "earlier": [[len(same), encode(same[0])] for same in runs],
            "first": self._first,
        }

    @property
    def _decided(self) -> bool:
        """Whether no tick is left to be judged."""
        return not self._lasts and max(self._count, self._history) > 0

    def is_of(self, saved: Any) -> bool:
        """Whether it can restore that state: its formula reaches over the same ticks."""
        return bool(saved.get("shape") == self._shape)

    @property
    def _shape(self) -> list[Any]:
        antecedent = self._antecedent
        return [self.formula.shape, None if antecedent is None else antecedent.formula.shape]

    def restore(self, saved: Any, values_of: Encode) -> None:
        """Restore a saved state; raises KeyError, TypeError, ValueError for other data."""
        self._remember(saved)
        self.formula.restore(saved["formula"])
        if self._antecedent is not None:
            self._antecedent.restore(saved["asked"])
        self._earlier.clear()
        self._earlier.extend(_values(saved, values_of, self._earlier.maxlen))

    def judge_anew(self, tick: int, saved: Any, values_of: Encode, show: Show) -> float:
        """Go on at a tick from the state `saved` of another version of this requirement.

        Its verdicts stay. Open ticks are judged by this version on the values of the last ticks,
        which `show` provides. Returns the number of earlier ticks whose values are missing.
        """
        earlier: deque[Mapping[str, Any]] = deque()
        if saved is not None:
            self._remember(saved)
            self._history, self._count = max(self._count, self._history), 0
            if self._antecedent is not None:
                self._antecedent.begin_anew(saved.get("asked"), self._history)
            # More values than this version keeps: the other version may have left more ticks open.
            earlier = _values(saved, values_of, tick)
        for atom in self.formula.atoms():
            atom.now = UNKNOWN
        self.pass_over(tick - len(earlier))
        last = None
        for values in earlier:
            if values is not last:
                show(values)
                last = values
            self.step(values)
        self.held_first = None
        needed = tick - self._history + self.formula.depth - self.formula.delay
        return 0 if self._decided else max(0, min(tick, needed) - len(earlier))

    def _remember(self, saved: Any) -> None:
        self.holds = bool(saved["holds"])
        self._count, self._history = int(saved["count"]), int(saved["history"])
        self._worst = read_judgement(saved["worst"])
        self._first = {str(v): (int(at), dict(shown)) for v, (at, shown) in saved["first"].items()}

    def _shown(self, values: Mapping[str, Any]) -> dict[str, Any]:
        return {
            name: _plain(values[attribute]) if attribute in values else None
            for name, attribute in self.reads.items()
        }


class _Antecedent:
    """Whether a requirement was ever asked: `formula` held at some judged tick."""

    def __init__(self, formula: Formula, *, lasts: bool) -> None:
        self.formula = formula
        self.ever = False
        self._lasts = lasts
        self._count = 0
        self._history = 0

    def step(self) -> None:
        """Judge a tick."""
        found = self.formula.step()
        if found is not None:
            judged = self._count >= self._history and (self._lasts or not self._count)
            self.ever |= judged and found[0][0]
            self._count += 1

    def saved(self) -> list[Any]:
        """The state of the monitor, as plain data."""
        return [self.ever, self._count, self._history, self.formula.saved()]

    def restore(self, saved: Any) -> None:
        """Restore a saved state; raises TypeError, ValueError for other data."""
        ever, count, history, formula = saved
        self.ever, self._count, self._history = bool(ever), int(count), int(history)
        self.formula.restore(formula)

    def begin_anew(self, saved: Any, history: int) -> None:
        """Go on from the state `saved` of another version, which judged `history` ticks."""
        self.ever = bool(saved and saved[0])
        self._history = history


def _values(saved: Any, values_of: Encode, most: int | None) -> deque[Mapping[str, Any]]:
    """The values of the last ticks, no more than `most`."""
    found: deque[Mapping[str, Any]] = deque(maxlen=most)
    for count, values in reversed(saved["earlier"]):
        room = (most or 0) - len(found)
        found.extendleft(repeat(values_of(values), min(int(count), room)))
    return found


def _plain(value: Any) -> Any:
    """A value for JSON: numbers and texts as they are, others and infinite numbers as text."""
    has_json = isinstance(value, bool | float | str)
    return value if has_json or (type(value) is int and is_short(value)) else text_of(value)
