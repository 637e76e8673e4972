"""Runs the generated code of one subsystem by itself, period by period, for a scenario.

The specification is compiled anew in every run, with nothing proved, so that its rows are checked;
operators give what the scenario says, otherwise the first value of their type.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property, partial
from os.path import relpath
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import SkipTest

from specc.example.situation import MakeArray, Value, alike, first_value, for_run, of_run
from specc.lower.annotations import TypeNames, named_types
from specc.lower.module import Module, elements
from specc.model.system import System
from specc.pipeline import read_spec
from specc.scenario.script import row_words
from specc.scenario.subject import OPERATORS, alone, unproved
from specc.source import Sources

Load = Callable[[Path, Any], Any]
"""What imports a generated package and gives the system in it."""

Values = Mapping[str, Value]
"""Values by the names that the specification has for them: `x.peer.element`, or of memory."""


class Trial:
    """A subsystem that is run step by step."""

    def __init__(
        self, spec: Path, subsystem: str, scratch: Path, load: Load, array: MakeArray
    ) -> None:
        """Compile `spec` and load the subsystem of a qualified name.

        Code is generated into `scratch`. `load` is the runtime's `load_system`, `array` makes
        arrays.

        Raises:
            ValueError: the subsystem has errors that leave no code for it.
        """
        result = read_spec(str(spec))
        names = {s.qualified_name for s in result.system.subsystems} if result.system else set()
        if result.system is None or subsystem not in names - result.broken:
            raise ValueError(f"{spec} has errors: see `specc validate {spec}`")
        self._array = array
        self._answers: list[tuple[str, tuple[Value, ...], Value]] = []
        self._system = alone(result.system, subsystem)
        (self._subsystem,) = self._system.subsystems
        types = TypeNames(named_types(self._system))
        self._module = Module(self._system, self._subsystem, types)
        self._elements = {
            f"x.{peer}.{element.name}": (self._module.inputs[peer, element.name], element.type)
            for peer, element in elements(self._subsystem, "x")
        }
        self._memory = {item.name: item.type for item in self._subsystem.memory}
        self._places = _places(self._system, result.sources)
        self._package = scratch / f"witness_of_{self._system.name}"
        self._load = load

    def operator(self, name: str, *args: Value, gives: Value) -> None:
        """Let an operator return a value for some arguments; to be called before the first step."""
        self._answers.append((name, args, gives))

    def step(
        self,
        into: str,
        arrives: Values | None = None,
        there: Values | None = None,
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
            self._feed(arrives or {}, there or {}, absent)
            self._run()
            if self._machine.state != into:
                raise SkipTest(
                    f"this leads to {self._machine.state}, no longer to {into}: "
                    "run `specc witness` again"
                )

    def place(
        self, state: str = "", memory: Values | None = None, periods: int | None = None
    ) -> None:
        """Put the subsystem into a state, give memory values, let it have run for some periods."""
        if state:
            self._machine.state = state
            method = self._module.state_methods.get(state)
            if method is None:
                raise SkipTest(f"there is no state {state} any more: run `specc witness` again")
            self._machine._work = getattr(self._machine, method)
        for name, value in (memory or {}).items():
            type_ = self._known(name, self._memory)
            given = for_run(value, type_, self._array)
            setattr(self._machine.memory, self._module.memory[name], given)
        if periods is not None and hasattr(self._machine, "_periods"):
            self._machine._periods = periods - 1

    def decide(
        self,
        arrives: Values | None = None,
        there: Values | None = None,
        absent: Collection[str] = (),
    ) -> None:
        """The period that matters: exactly one row applies, or the state goes on.

        An assumption that excludes this is accepted as well.
        """
        __tracebackhide__ = True
        self._feed(arrives or {}, there or {}, absent)
        self._run()

    def _run(self) -> None:
        __tracebackhide__ = True  # pytest then shows the scenario and the generated code only
        self._machine.violations = ()
        try:
            self._machine.step()
        except Exception as error:
            if not self._machine.violations:
                for line in self._notes(error):
                    error.add_note(line)
                raise

    def _notes(self, error: Exception) -> Iterator[str]:
        """Where in the specification to look."""
        state = self._machine.state
        if hasattr(error, "rows"):
            for words in (f"state {state}", *error.rows):
                yield f"{self._places.get(words, 'the specification')}: {words}"
        if isinstance(error, AttributeError):
            names = {attribute: name for name, (attribute, _) in self._elements.items()}
            if error.name in names:
                yield f"`{names[error.name]}` has no value"

    def _feed(self, arrives: Values, there: Values, absent: Collection[str]) -> None:
        x = self._machine.x
        for attribute, _ in self._elements.values():
            self._flag("fresh", attribute, False)
        for name, value in (*arrives.items(), *there.items()):
            attribute, type_ = self._known(name, self._elements)
            setattr(x, attribute, for_run(value, type_, self._array))
            self._flag("present", attribute, True)
        for name in arrives:
            self._flag("fresh", self._elements[name][0], True)
        for name in absent:
            attribute, _ = self._known(name, self._elements)
            if hasattr(x, attribute):
                delattr(x, attribute)
            self._flag("present", attribute, False)

    def _flag(self, kind: str, attribute: str, value: bool) -> None:
        """Set a flag of an element if the generated code asks for it."""
        if f"{kind}_{attribute}" in type(self._machine.x).__slots__:
            setattr(self._machine.x, f"{kind}_{attribute}", value)

    def _known(self, name: str, names: Mapping[str, Any]) -> Any:
        if name not in names:
            raise SkipTest(f"there is no {name} any more: run `specc witness` again")
        return names[name]

    @cached_property
    def _machine(self) -> Any:
        """The generated subsystem; operators may be called as soon as it is there."""
        self._package.mkdir(parents=True)
        for name, text in unproved(self._system).items():
            (self._package / name).write_text(text, encoding="utf-8")
        with _importable(self._modules()):
            system = self._load(self._package, "")
        return system.scheduled(self._subsystem.qualified_name).subsystem

    def _modules(self) -> Iterator[ModuleType]:
        """The module of the operators, and the modules of types that are not there."""
        operators = ModuleType(OPERATORS)
        for operator in self._system.operators:
            setattr(operators, operator.name, partial(self._call, operator.name, operator.result))
        yield operators
        classes: dict[str, ModuleType] = {}
        for _, type_ in named_types(self._system):
            module, _, name = getattr(type_, "python", "").partition(":")
            if name and not hasattr(sys.modules.get(module), name):
                stub = classes.setdefault(module, ModuleType(module))
                setattr(stub, name, type(name, (), {}))
        yield from classes.values()

    def _call(self, name: str, result: Any, *args: Any) -> Any:
        plain = of_run(args)
        for operator, known, gives in self._answers:
            if operator == name and alike(known, plain):
                return for_run(gives, result, self._array)
        return for_run(first_value(result), result, self._array)


@contextmanager
def _importable(modules: Iterator[ModuleType]) -> Iterator[None]:
    """While some modules can be imported that are not on disk."""
    before: dict[str, ModuleType | None] = {}
    for module in modules:
        before[module.__name__] = sys.modules.get(module.__name__)
        sys.modules[module.__name__] = module
    try:
        yield
    finally:
        for name, known in before.items():
            if known is None:
                del sys.modules[name]
            else:
                sys.modules[name] = known


def _places(system: System, sources: Sources) -> dict[str, str]:
    """File and line of every state and row, by the words that faults have for them."""
    (subsystem,) = system.subsystems
    found = {f"state {state.name}": state.place for state in subsystem.states}
    found |= {row_words(row): row.place for row in subsystem.transitions}
    spans = {words: sources.span(place) for words, place in found.items()}
    return {words: f"{relpath(span.file)}:{span.line}" for words, span in spans.items()}
