"""What happens to the plant while a run goes on: what it is, when it begins and when it is over.

All numbers are drawn from the seed before the first tick, so a run can be repeated. Agents learn
nothing of a disturbance but what their devices report.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from specc_runtime.examination import shortcomings
from specc_runtime.options import UsageError
from specc_runtime.requirements import Requirements
from specc_runtime.system import Disturbance
from specc_runtime.task import drawn

_ROUNDING_S = 1e-9  # times are multiples of a rounded tick


class Disturbable(Protocol):
    """What a plant has in addition that can be disturbed otherwise than by silent devices."""

    def put(self, positions: Mapping[str, float]) -> None:
        """Put joints somewhere, at rest: rad or m; `box.x` is a coordinate of a free one."""

    def shift(self, distances: Mapping[str, float]) -> None:
        """Move joints from where they are, likewise."""

    def push(self, body: str, force: Sequence[float]) -> None:
        """Let a force (3,) act on a body from now on, N in the axes of the world."""

    def block(self, joint: str, blocked: bool) -> None:
        """Let a joint be stuck from now on, or not any more."""


class Disturbances:
    """Those of one run; `advance` before every tick."""

    def __init__(
        self,
        found: Sequence[Disturbance],
        triggers: Requirements | None,
        plant: Any,
        silence: Callable[[str, bool], None],
        seed: int,
    ) -> None:
        """`silence` makes an element silent, or not any more.

        Raises UsageError for a plant to which these things cannot happen.
        """
        if any(each.move or each.shift or each.push or each.block for each in found) and (
            lacking := shortcomings(plant, Disturbable)
        ):
            raise UsageError(f"the plant cannot be disturbed: it {'; '.join(lacking)}")
        count: Counter[str] = Counter()
        self._all = []
        for each in found:
            count[each.subject] += 1
            self._all.append(_Drawn(each, seed, count[each.subject]))
        self._triggers = triggers
        self._plant = plant
        self._silence = silence

    def advance(self, time_s: float) -> None:
        """Begin and end what is due at this time."""
        due_s = time_s + _ROUNDING_S
        for each in self._all:
            if each.began_s is None:
                if due_s >= each.at_s and self._holds(each.what.when):
                    each.began_s = time_s
                    self._begin(each)
            elif not each.over and due_s >= each.began_s + each.lasts_s:
                each.over = True
                self._act(each)

    def saved(self) -> list[dict[str, Any]]:
        """What is under way and over."""
        return [{"does": o.name, "began_s": o.began_s, "over": o.over} for o in self._all]

    def restore(self, saved: Any) -> list[str]:
        """Go on from there; what of it is not known here, and what is new, and begins in its time.

        Forces of now are given to the plant by `push_again`, once it is restored.

        Raises KeyError, TypeError, ValueError for other data.
        """
        known = {str(each["does"]): each for each in saved}
        for one in self._all:
            each = known.get(one.name)
            if each is not None and each["began_s"] is not None:
                one.began_s, one.over = float(each["began_s"]), bool(each["over"])
        for one in self._all:
            if one.began_s is not None:
                self._act(one)
        mine = {one.name for one in self._all}
        began = [name for name, each in known.items() if each["began_s"] is not None]
        gone = [name for name in began if name not in mine]
        return [
            *(f"nothing is known of the disturbance: {name}" for name in sorted(mine - {*known})),
            *(f"there is no such disturbance, which began in the past: {name}" for name in gone),
        ]

    def push_again(self) -> None:
        """Let the forces of now act, whatever the plant remembers of forces."""
        for one in self._all:
            if one.began_s is not None:
                self._push(one)

    def as_data(self) -> list[dict[str, Any]]:
        """What the report says of each; `began_s` is null if it never began."""
        return [{"because": each.what.because, "began_s": each.began_s} for each in self._all]

    def _holds(self, trigger: int | None) -> bool:
        if trigger is None or self._triggers is None:
            return True
        return self._triggers.requirements[trigger].holds

    def _begin(self, each: _Drawn) -> None:
        if each.move:
            self._plant.put(each.move)
        if each.shift:
            self._plant.shift(each.shift)
        self._act(each)

    def _act(self, each: _Drawn) -> None:
        """Bring what begins or ends about, with what others do to the same things."""
        going = self._going
        self._push(each)
        for joint in each.what.block:
            self._plant.block(joint, any(joint in one.what.block for one in going))
        for element in each.what.silent:
            self._silence(element, any(element in one.what.silent for one in going))

    @property
    def _going(self) -> list[_Drawn]:
        return [one for one in self._all if one.began_s is not None and not one.over]

    def _push(self, each: _Drawn) -> None:
        for body in each.push:
            forces = [one.push[body] for one in self._going if body in one.push]
            self._plant.push(body, tuple(map(sum, zip((0.0, 0.0, 0.0), *forces, strict=True))))


class _Drawn:
    """A disturbance with its numbers, which no other one changes, unless it does the same."""

    def __init__(self, what: Disturbance, seed: int, number: int) -> None:
        """`number` counts those that do the same."""
        self.what = what
        self.name = what.subject if number == 1 else f"{what.subject} ({number})"
        name = f"disturb {what.subject} {number}"
        times = drawn([time for time in (what.at, what.lasts) if time], seed, name)
        self.at_s = times.get("at", 0.0)
        self.lasts_s = times.get("lasts", math.inf)
        self.move = drawn(what.move, seed, f"{name} move")
        self.shift = drawn(what.shift, seed, f"{name} shift")
        self.push = {
            body: tuple(drawn(force, seed, f"{name} push").values()) for body, force in what.push
        }
        self.began_s: float | None = None
        self.over = False
