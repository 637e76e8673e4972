"""A task: what it provides, a scene to begin with and a judge, and the cycles that are judged.

Scene and judge see the plant as it really is. Nothing of them reaches an agent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from specc_runtime.contracts import as_bool
from specc_runtime.faults import JudgeFailed
from specc_runtime.random_streams import stream
from specc_runtime.records import StepRecord
from specc_runtime.savable import from_plain, plain
from specc_runtime.system import Draw, System
from specc_runtime.wrong import Blamed, Unfit


class Scene(Protocol):
    """Sets the plant up. Made without arguments."""

    def place(self, plant: Any, rng: np.random.Generator) -> None:
        """Called once, after the plant's reset; `rng` comes from the seed of the run."""


def drawn(draws: Sequence[Draw], seed: int, what: str = "scene") -> dict[str, float]:
    """The numbers by their names. Each follows from the seed, its name and `what`."""
    return {draw.name: _one(draw, stream(seed, f"{what} {draw.name}")) for draw in draws}


def _one(draw: Draw, rng: np.random.Generator) -> float:
    values = draw.values
    if draw.between:
        return float(rng.uniform(values[0], values[1]))
    return values[rng.integers(len(values))]


class Judge(Protocol):
    """Watches a run and says what each cycle was worth. Made with the plant, once the scene is set.

    It has `watch` if the task watches memory. `criterion` names the entry of a cycle's report that
    says whether the cycle was fulfilled.
    """

    criterion: str

    def observe(self) -> None:
        """Called after every base tick."""

    def watch(self, name: str, value: Any) -> None:
        """Called with the memory that the task names when it became visible; never with None."""

    def end_cycle(self) -> dict[str, Any]:
        """Called at the end of a cycle: what the report says of it. The next one begins."""


class Cycles:
    """Counts and judges cycles; call it with each record.

    `results` has what the judge said of each cycle, with `simulated_s` and `ended`, which is
    "completed" or why it ended without; `fulfilled` goes with them.
    """

    def __init__(self, system: System, judge: Judge | None, now_s: Callable[[], float]) -> None:
        """`now_s` gives simulated time; no cycle ever ends in a system without a task."""
        self.results: list[dict[str, Any]] = []
        self.fulfilled: list[bool] = []
        self.begun_s = 0.0
        self._judge = judge
        self._now_s = now_s
        self._name = system.task.judge if system.task is not None else ""
        self._subsystem = ""
        self._last: frozenset[int] = frozenset()
        if system.task is not None:
            task = system.task
            table = system.scheduled(task.subsystem).subsystem.transitions
            ends = [
                i for i, t in enumerate(table) if (t.source, t.target) == (task.source, task.target)
            ]
            self._subsystem = task.subsystem
            self._last = frozenset(ends)

    def __call__(self, record: StepRecord) -> None:
        """Let the judge see the record; end the cycle if this was its last transition.

        Raises `JudgeFailed`.
        """
        if record.watched and self._judge is not None:
            try:
                for name, value in record.watched:
                    if value is not None:
                        self._judge.watch(name, value)
            except BaseException as error:  # whatever the user's class raises
                raise self._failed(error) from error
        if record.transition in self._last and record.subsystem == self._subsystem:
            self.end("completed")

    def observe(self) -> None:
        """Let the judge see the plant. Raises `JudgeFailed`."""
        if self._judge is not None:
            try:
                self._judge.observe()
            except BaseException as error:  # as above
                raise self._failed(error) from error

    def end(self, why: str) -> None:
        """End the cycle now. Only a completed one can be fulfilled. Raises `JudgeFailed`."""
        now_s = self._now_s()
        own = {"simulated_s": now_s - self.begun_s, "ended": why}
        self.begun_s = now_s
        self.results.append(own)
        self.fulfilled.append(False)
        good = True
        if self._judge is not None:
            try:
                found = dict(self._judge.end_cycle())
                good = as_bool(found[self._judge.criterion])
            except Unfit as unfit:
                what = f"gave {unfit.came} as {self._judge.criterion}: give {unfit.wanted}"
                raise self._failed(Blamed(f"judge {self._name}", what)) from None
            except BaseException as error:  # as above
                raise self._failed(error) from error
            self.results[-1] = {**found, **own}
        self.fulfilled[-1] = good and why == "completed"

    def saved(self) -> dict[str, Any]:
        """What is known of the cycles so far, without the judge; raises NotRecorded."""
        own = {"fulfilled": self.fulfilled, "begun_s": self.begun_s}
        return own | {"results": plain(self.results)}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on from there; raises KeyError, TypeError, ValueError for other data."""
        self.results = [dict(result) for result in from_plain(saved["results"])]
        self.fulfilled = [bool(good) for good in saved["fulfilled"]]
        self.begun_s = float(saved["begun_s"])

    def _failed(self, error: BaseException) -> BaseException:
        """The fault of a judge, which is not asked again; Ctrl-C stays what it is."""
        if isinstance(error, KeyboardInterrupt):
            return error
        self._judge = None
        return JudgeFailed(self._name, error)
