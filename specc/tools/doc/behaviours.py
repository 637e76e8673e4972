"""Behaviours of a subsystem, and the transition functions that they execute."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from specc.model.fsm import Assignment, Behaviour, Function, Trace
from specc.reachable import grouped
from specc.tools.doc.equations import ASSIGNED, DEFINED, SubsystemEquations
from specc.tools.doc.markup import Math, bracketed, listed, string, word
from specc.tools.doc.pages import mono
from specc.tools.doc.symbols import NEXT_STAMP
from specc.tools.graph.diagram import is_named
from specc.tools.graph.machine import flow

_WIDEST_GROUP = 72
"""Of assignments that stand beside one brace."""


@dataclass
class BehaviourSection(SubsystemEquations):
    """Writes the behaviours of one subsystem."""

    written: dict[str, list[tuple[str, ...]]] = field(default_factory=dict)
    """Functions that were shown -> peer and index of each symbol that they have there."""

    def write(self) -> None:
        """Write all behaviours, and the functions that none executes."""
        s = self.subsystem
        if self._parts:
            self._heading("Behaviours")
        for behaviour in self._parts:
            self._behaviour(behaviour)
        calls = {f.name for b in s.behaviours if b.generic for f in b.functions}
        shown = self.written.keys() | calls
        rest = [f for f in s.functions if f.name not in shown and not f.generic]
        if rest:
            self._heading("Further transition functions")
        for function in rest:
            self._function(function, _Numbered("", {}))

    def _behaviour(self, behaviour: Behaviour) -> None:
        names, pages = self.names, self.pages
        short = behaviour.name.partition("(")[0]
        title = behaviour.title or short
        pages.heading(
            self.level + 2, title, names.id("behaviour", short), names.behaviour(behaviour)
        )
        numbered = _Numbered(names.behaviour_indices.get(behaviour.name, short), {})
        own = [f for f in behaviour.functions if f.name not in self.written]
        shared = [f for f in behaviour.functions if f.name in self.written]
        assigned = [a for f in own for a in f.assignments]
        for items in grouped((a.peer, a) for a in assigned).values():
            ordered = sorted(items, key=lambda a: not a.trace)
            for number, item in enumerate(ordered, 1):
                numbered.numbers[id(item)] = str(number) if len(items) > 1 else ""
        functions = [names.transition_function(p, numbered.index) for p in _peers(assigned)]
        endings = [names.condition(behaviour.terminal, behaviour)]
        endings += [names.condition(error, behaviour) for _, error in behaviour.errors] or [
            self._never(behaviour)
        ]
        head = names.behaviour(behaviour)
        inside_ = listed((*functions, *self._shared(shared), *endings))
        forms = [head + DEFINED + head + bracketed(inside_)]
        name, trace = short if behaviour.title else "", Trace(eq=behaviour.trace.eq)
        pages.equation(
            "", forms, trace, name=name, about=f"behaviour {short}", place=behaviour.place
        )
        self._flow(behaviour, own)
        for function in own:
            self._function(function, numbered)
        if shared:
            links = ", ".join(
                f"#u({string(names.id('function', f.name))})[{mono(f.name)}]" for f in shared
            )
            pages.content(f"It also executes {links}, as above.")

    def _never(self, behaviour: Behaviour) -> Math:
        """The error condition of a behaviour that has none."""
        return word("FALSE")

    def _shared(self, functions: Sequence[Function]) -> Iterator[Math]:
        """Functions that were shown with another behaviour, by the symbols that they have there."""
        for function in functions:
            for peer, *index in self.written[function.name]:
                yield self.names.transition_function(peer, *index)

    def _flow(self, behaviour: Behaviour, functions: Sequence[Function]) -> None:
        """The data flow of a behaviour that has a figure, or of which a function has one."""
        figures = dict.fromkeys(behaviour.trace.fig)
        figures |= dict.fromkeys(n for f in functions for n in f.trace.fig)
        tables = dict.fromkeys(behaviour.trace.table)
        if tables:
            words = behaviour.title or behaviour.name
            traces = self.pages.mentions(Trace(table=tuple(tables)), words, behaviour.place)
            self.pages.add("#par_[", *traces, "]\n")
        if not figures:
            return
        words = f"Data flow of {behaviour.name}"
        caption = self.pages.caption(Trace(fig=tuple(figures)), words, behaviour.place)
        diagram = flow(self.subsystem, behaviour.name, behaviour.functions)
        if any(diagram.all_nodes):
            shown = [*caption, "Data flow of ", self.names.behaviour(behaviour).inline]
            self.pages.picture(diagram, shown, words)

    def _function(self, function: Function, numbered: _Numbered) -> None:
        """Its equations: one group, or one for each assignment that has a number of its own."""
        names, pages = self.names, self.pages
        self.written[function.name] = [
            (item.peer, *numbered.index_of(item, function)) for item in function.assignments
        ]
        title = function.title
        shown = function.name if is_named(function) else ""
        id = names.id("function", function.name)
        apart = [a for a in function.assignments if a.trace]
        together = [a for a in function.assignments if not a.trace]
        if function.trace and apart:
            self._group(function, id, numbered, [])
            id = ""
        elif (together or function.trace) and self._is_narrow(together, numbered, function):
            self._group(function, id, numbered, together)
            together, id = [], ""
        for number, item in enumerate((*together, *apart)):
            left, middle = self._target(item, numbered, function)
            first = number == 0 and id
            pages.equation(
                id if first else "",
                self._forms(left, item.value, middle),
                item.trace or (Trace(eq=function.trace.eq) if first else item.trace),
                title=title if first else "",
                name=shown if first else "",
                about=f"{function.name}: {item.target}",
                place=item.place,
            )

    def _is_narrow(
        self, items: Sequence[Assignment], numbered: _Numbered, function: Function
    ) -> bool:
        """Whether assignments fit beside one brace."""
        targets = [self._target(item, numbered, function) for item in items]
        widths = [left.width + middle.width for left, middle in targets]
        values = [self.formulas.math(item.value).width for item in items]
        return max(map(sum, zip(widths, values, strict=True)), default=0) <= _WIDEST_GROUP

    def _group(
        self, function: Function, id: str, numbered: _Numbered, items: Sequence[Assignment]
    ) -> None:
        """All assignments beside one brace; without items the names of their functions."""
        lines: list[Math] = []
        if items:
            for item in items:
                left, middle = self._target(item, numbered, function)
                lines.append(left + middle + DEFINED + self.formulas.math(item.value))
        else:
            for item in function.assignments:
                left, middle = self._target(item, numbered, function)
                lines.append(left + middle)
        width = max((each.width for each in lines), default=0)
        forms = lines[:1]
        if len(lines) > 1:
            forms = [Math(f"cases({', '.join(each.text for each in lines)})", width)]
        title = function.title
        self.pages.equation(
            id,
            forms,
            replace(function.trace, fig=()),
            title=title,
            name=function.name if is_named(function) else "",
            place=function.place,
        )

    def _target(
        self, item: Assignment, numbered: _Numbered, function: Function
    ) -> tuple[Math, Math]:
        """`^E_y e^{ι+1}[c_d]`, and `:= ^{e,E}f(…)`."""
        names = self.names
        own = numbered.index_of(item, function)
        left = names.placeholder("y", item.peer, item.name, NEXT_STAMP)
        called = names.transition_function(item.peer, *own) + self._arguments(item.value)
        return left, ASSIGNED + called

    # Assumptions.


@dataclass(frozen=True, slots=True)
class _Numbered:
    """The index of functions of a behaviour, and the number of each assignment, by identity."""

    index: str
    numbers: dict[int, str]

    def index_of(self, item: Assignment, function: Function) -> tuple[str, ...]:
        """The index of the function of one assignment."""
        number = self.numbers.get(id(item), "")
        return tuple(filter(None, (self.index or function.name, number)))


def _peers(assigned: Sequence[Assignment]) -> list[str]:
    """Peers in the order of the paper: outputs, then memory."""
    found = dict.fromkeys(item.peer for item in assigned)
    return sorted(found, key=lambda peer: not peer)
