"""The account of a run: who follows its records, and what is known of it until now."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from specc_runtime.plant import Plant
from specc_runtime.records import Observer, RecordDigest
from specc_runtime.report import Statistics
from specc_runtime.requirements import Requirement, Requirements
from specc_runtime.sampling import Onlooker
from specc_runtime.savable import restored, saved_by
from specc_runtime.snapshot import Values
from specc_runtime.system import System
from specc_runtime.task import Cycles, Judge

_ROUNDING_S = 1e-6  # times are multiples of a rounded tick


class Account:
    """Digest of the records, tallies, cycles and requirements of one run.

    `unobserved` says why something of the plant could not be observed.
    """

    def __init__(self, system: System, judge: Judge | None, now_s: Callable[[], float]) -> None:
        """`now_s` gives simulated time."""
        self.digest = RecordDigest()
        self.statistics = Statistics(system)
        self.cycles = Cycles(system, judge, now_s)
        self.requirements = system.requirements
        self.unobserved: dict[str, str] = {}
        named = ("requirements", system.requirements), ("triggers", system.triggers)
        self._judge = judge
        self._tick_s = system.tick_s
        self._stop_when = system.stop_when
        self._judged = {of: each for of, each in named if each is not None}
        periods = {s.subsystem.name: (s.subsystem, s.ticks) for s in system.subsystems}
        for each in self._judged.values():
            each.follow(periods, system.tick_s)

    @property
    def observers(self) -> tuple[Observer, ...]:
        """Who is told of every step, in turn."""
        return self.digest, self.statistics, self.cycles, *self._judged.values()

    def onlooker(
        self, system: System, plant: Plant | None, recorder: Observer | None
    ) -> Onlooker | None:
        """What samples the plant for requirements; a recorder gets all that there is."""
        if system.plant is None or plant is None:
            return None
        watchers: list[Requirements] = [*self._judged.values()]
        read = frozenset[str]().union(*(each.observed for each in watchers))
        seen = [one for one in system.plant.observed if recorder is not None or one.name in read]
        if not seen:
            return None
        onlooker = Onlooker(
            seen, plant.sample, [*([] if recorder is None else [recorder]), *watchers]
        )
        self.unobserved = onlooker.failed
        return onlooker

    def advance(self, tick: int) -> None:
        """A tick is over, the plant has moved."""
        self.cycles.observe()
        for each in self._judged.values():
            each.advance(tick)

    def finish(self, tick: int) -> None:
        """The run is over after so many ticks."""
        for each in self._judged.values():
            each.finish(tick)

    @property
    def stop(self) -> Requirement | None:
        """The formula that ends the run once it holds, if there is one."""
        if self._stop_when is None or (triggers := self._judged.get("triggers")) is None:
            return None
        return triggers.requirements[self._stop_when]

    @property
    def violated(self) -> bool:
        """Whether a requirement is."""
        return self.requirements is not None and self.requirements.violated

    def saved(self, values: Values) -> dict[str, Any]:
        """All of it, plain data; raises NotRecorded."""
        judge = saved_by("the judge", self._judge, is_lenient=values.is_lenient)
        return {
            "records": self.digest.saved(),
            "tallies": self.statistics.saved(),
            "task": self.cycles.saved() | {"judge": judge},
            **{of: each.saved(partial(values.read, of)) for of, each in self._judged.items()},
            "unobserved": self.unobserved,
        }

    def restore(
        self, saved: Mapping[str, Any], values: Values, tick: int, *, is_other: bool
    ) -> list[str]:
        """Go on from there at a tick; says what of the past is not known.

        Raises LookupError, TypeError, ValueError for other data.
        """
        self.digest.restore(saved["records"])
        self.statistics.restore(saved["tallies"])
        self.cycles.restore(saved["task"])
        self.unobserved |= saved["unobserved"]
        judge = saved["task"]["judge"]
        restored("the judge", self._judge, judge)
        lost = []
        if self._judge is not None and judge is None:
            lost.append("the judge begins anew: it could not be kept")
        is_alike = abs(saved["tick"] * self._tick_s - saved["time"]) < _ROUNDING_S
        for of, each in self._judged.items():
            known = saved.get(of, ()) if is_alike else ()  # it is in ticks of one length
            lost += each.restore(known, tick, partial(values.found, of), is_other=is_other)
        return lost
