"""What the tests call that `specc witness` writes: a subsystem that is stepped by hand."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property
from os import curdir
from pathlib import Path
from unittest import SkipTest

from specc_runtime.faults import UndecidedTransition

from specc.lang.values import Value
from specc.model.system import System
from specc.pipeline import read_spec
from specc.search import OperatorAnswer
from specc.source import Sources, relative_path
from specc.tools.witness.code import (
    Periods,
    Placed,
    Run,
    ScriptValues,
    SubsystemCode,
    input_text,
)


class Trial:
    """A subsystem that is run step by step; the specification is compiled anew in every test."""

    def __init__(self, spec: Path, subsystem: str, scratch: Path) -> None:
        """Compile the subsystem of a qualified name in the file `spec`, into `scratch`.

        Raises:
            ValueError: the subsystem has errors that leave no code for it.
        """
        result = read_spec(str(spec))
        names = {s.qualified_name for s in result.system.subsystems} if result.system else set()
        if result.system is None or subsystem not in names - result.broken:
            raise ValueError(f"{spec} has errors: see `specc validate {spec}`")
        self._code = SubsystemCode(result.system, subsystem, scratch)
        self._places = _places(self._code.system, result.sources)
        self._answers: list[OperatorAnswer] = []

    def operator(self, name: str, *args: Value, gives: Value) -> None:
        """Let an operator return a value for some arguments; to be called before the first step."""
        self._answers.append((name, args, gives))

    def step(
        self,
        into: str,
        arrives: ScriptValues | None = None,
        there: ScriptValues | None = None,
        absent: Collection[str] = (),
        periods: int = 1,
    ) -> None:
        """One period, or several equal ones, after which the subsystem is in the state `into`.

        What `arrives` is fresh, what is `there` has a value without being fresh, what is `absent`
        has none.

        Raises:
            SkipTest: the specification has changed, and another state is reached.
        """
        __tracebackhide__ = True
        for _ in range(periods):
            self.decide(arrives, there, absent)
            if self._run.state != into:
                raise SkipTest(
                    f"this leads to {self._run.state}, no longer to {into}: "
                    "run `specc witness` again"
                )

    def place(
        self, state: str = "", memory: ScriptValues | None = None, periods: int | None = None
    ) -> None:
        """Put the subsystem into a state, give memory values, let it have run for some periods."""
        self._run.place(Placed(state, memory or {}, periods))

    def decide(
        self,
        arrives: ScriptValues | None = None,
        there: ScriptValues | None = None,
        absent: Collection[str] = (),
    ) -> None:
        """The period that matters: exactly one row applies, or the state goes on.

        An assumption that excludes this is accepted as well.
        """
        __tracebackhide__ = True  # pytest then shows the test and the generated code only
        try:
            self._run.step(Periods(arrives or {}, there or {}, tuple(absent)))
        except Exception as error:
            if self._run.is_assumed or isinstance(error, SkipTest):
                if isinstance(error, UndecidedTransition):
                    for words in (f"state {error.state}", *error.rows):
                        place = self._places.get(words, "the specification")
                        error.add_note(f"{place}: {words}")
                if name := self._run.absent(error):
                    error.add_note(f"`{input_text(name)}` has no value")
                raise

    @cached_property
    def _run(self) -> Run:
        return self._code.begin(self._answers)


def _places(system: System, sources: Sources) -> dict[str, str]:
    """File and line of every state and row, by the words that faults have for them."""
    (subsystem,) = system.subsystems
    found = {f"state {state.name}": state.place for state in subsystem.states}
    found |= {row.label: row.place for row in subsystem.transitions}
    spans = {words: sources.span(place) for words, place in found.items()}
    return {words: f"{relative_path(s.file, curdir)}:{s.line}" for words, s in spans.items()}
