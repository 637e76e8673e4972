"""Traces: the steps of all machines to a configuration, with their times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from specc.diagnostics import Related
from specc.diagnostics.phrases import join_words
from specc.lang.show import show
from specc.model import fsm
from specc.proof import InputName
from specc.source import Place
from specc.tools.explore.composition import Edge
from specc.tools.explore.graph import Graph
from specc.tools.explore.partial import is_known
from specc.tools.explore.symmetry import composed
from specc.tools.explore.transitions import Transition
from specc.tools.explore.walker import Walker

MAX_SHOWN = 16


@dataclass(frozen=True, slots=True)
class Step:
    """The move of one machine at a time stamp."""

    time_s: Fraction
    index: int
    walker: Walker
    transition: Transition

    @property
    def row(self) -> fsm.Transition | None:
        """The row that was taken."""
        return (
            self.walker.subsystem.transitions[self.transition.row]
            if self.transition.row >= 0
            else None
        )

    @property
    def place(self) -> Place:
        """The row, or the state that was entered first."""
        return (
            self.row.place
            if self.row
            else self.walker.subsystem.state(self.transition.target).place
        )

    def description(self) -> str:
        """The step in words."""
        source, target = self.transition.source, self.transition.target
        path = f"from `{source}` to `{target}`" if source and source != target else f"in `{target}`"
        if self.row and self.row.resumes:
            path += f" by `resume({self.row.resumes})`"
        sent = [f"`y.{peer}.{name}`{self._value(n)}" for (peer, name), n in self.transition.sent]
        parts = [f"{float(self.time_s):g} s: `{self.walker.name}` {path}"]
        if sent:
            parts.append(f"sends {join_words(sent, 'and')}")
        if self.transition.lost:
            lost = [
                f"`x.{peer}.{name}`" + (f" = {member}" if member else "")
                for (peer, name), member in self.transition.lost
            ]
            parts.append(f"does not look at {join_words(lost, 'and')}, which came")
        return ", ".join(parts)

    def _value(self, number: int) -> str:
        value = self.walker.values.value(number)
        return f" = {show(value)}" if is_known(value) else ""


@dataclass(frozen=True, slots=True)
class ExploredTrace:
    """The steps to a configuration; `choices` are the conditions that could have been false."""

    steps: tuple[Step, ...]
    overwritten: tuple[tuple[int, InputName], ...]
    choices: tuple[str, ...]
    time_s: Fraction

    @property
    def rests_on_measurements(self) -> bool:
        """Whether some of the conditions are decided by measurements."""
        return any(
            name in s.walker.measured_choices for s in self.steps for name in s.transition.choices
        )

    @property
    def is_decided(self) -> bool:
        """Whether every run takes it."""
        return not self.choices

    def last_missed(self, index: int, key: InputName) -> Step | None:
        """The step at which the last arrival of an input was not read."""
        found = (
            s for s in reversed(self.steps) if s.index == index and key in dict(s.transition.lost)
        )
        return next(found, None)

    def with_stamps(self) -> Iterator[tuple[Step, int]]:
        """The steps, each with its first time stamp."""
        stamps: Counter[int] = Counter()
        for step in self.steps:
            yield step, stamps[step.index]
            stamps[step.index] += 1

    def shown_steps(self) -> tuple[Related, ...]:
        """The steps to show: those that change a state or miss an input; of many the last ones."""
        missed = {
            (s.index, s.transition.target, key): s
            for s in self.steps
            for key, _ in s.transition.lost
        }
        last = {id(step) for step in missed.values()}
        steps = [
            s
            for s in self.steps
            if s.transition.source not in ("", s.transition.target) or id(s) in last
        ]
        shown = [Related(s.place, s.description()) for s in steps[-MAX_SHOWN:]]
        if len(steps) > MAX_SHOWN:
            words = f"after {len(steps) - MAX_SHOWN} earlier steps, {shown[0].message}"
            shown[0] = Related(shown[0].place, words)
        return tuple(shown)


def easiest_trace(graph: Graph, number: int, *last: Edge) -> ExploredTrace:
    """The easiest trace to a configuration and over further edges."""
    composition = graph.composition
    walkers = composition.walkers
    ticks, tick_s = 0, composition.tick_s
    steps = [Step(Fraction(0), i, walkers[i], move) for i, move in graph.initial_transitions]
    overwritten: list[tuple[int, InputName]] = []
    frame = graph.frame(0)
    for edge in (*(edge for _, edge in graph.easiest_path(number)), *last):
        ticks += composition.elapsed_ticks(ticks % composition.hyperperiod)
        moves = (composition.real_transition(frame, *move) for move in edge.transitions)
        steps += (Step(ticks * tick_s, i, walkers[i], move) for i, move in moves)
        overwritten += composition.real_overwritten(frame, edge)
        frame = composed(frame, edge.permutation)
    free = [f"{f} in `{s.walker.name}`" for s in steps for f in s.transition.choices]
    return ExploredTrace(
        tuple(steps), tuple(overwritten), tuple(dict.fromkeys(free)), ticks * tick_s
    )
