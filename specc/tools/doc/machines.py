"""The section of a subsystem: buffers and memory, state machine, behaviours, assumptions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from specc.analysis import Facts
from specc.analysis.reads import Dependence, Dependences
from specc.model import expr as m
from specc.model.fsm import (
    Assignment,
    Behaviour,
    Condition,
    Function,
    Trace,
    Transition,
)
from specc.model.system import Let, Port, Subsystem
from specc.reachable import grouped
from specc.tools.doc.formulas import FormulaWriter
from specc.tools.doc.markup import EMPTY, Math, bracketed, listed, sign, string, word
from specc.tools.doc.pages import Pages, Part, mono, plain
from specc.tools.doc.symbols import NEXT_STAMP, SubsystemNames, arguments_of
from specc.tools.graph.diagram import is_named
from specc.tools.graph.machine import flow, states
from specc.tools.graph.structure import inside

DEFINED, ASSIGNED = sign("eq.delta"), sign("colon.eq")
_MOST_INLINED = 40
"""Nodes of an expression with lets written out."""
KINDS = {
    "control": "Control subsystem",
    "virtual_effector": "Virtual effector",
    "virtual_receptor": "Virtual receptor",
}
GROUNDS = {
    "": "nothing that the specification says; it is monitored in every run",
    "proved": "what is sent, from which it follows",
    "broken": "nothing: a sender breaks it",
}


def broken_forms(
    head: Math, body: Math, parts: tuple[str, list[Math]], middle: Math = EMPTY
) -> list[Math]:
    """An equation on one line, on two, and with each operand on a line of its own."""
    left = head + middle
    forms = [left + DEFINED + body]
    second = Math(f"{left.text} #br & eq.delta/**/{body.text}", max(left.width, body.width + 2))
    if middle.text:
        first = f"{head.text}/**/& {middle.text}"
        second = Math(f"{first} #br & eq.delta/**/{body.text}", second.width)
    forms.append(second)
    op, operands = parts
    if op:
        lines = f" #br & quad {op}/**/".join(each.text for each in operands)
        width = max(each.width for each in operands) + 4
        forms.append(Math(f"{left.text} #br & eq.delta/**/{lines}", width))
    return forms


@dataclass
class SubsystemSection:
    """Writes the section of one subsystem."""

    pages: Pages
    facts: Facts
    names: SubsystemNames
    level: int
    signs: dict[str, None]
    written: dict[str, list[tuple[str, ...]]] = field(default_factory=dict)
    """Functions that were shown -> peer and index of each symbol that they have there."""

    @property
    def subsystem(self) -> Subsystem:
        """The subsystem that stands for all its copies."""
        return self.names.subsystem

    @cached_property
    def formulas(self) -> FormulaWriter:
        """Writes its expressions."""
        inlined = {let.name: let.value for let in self._inlined}
        return FormulaWriter(self.names, self.names.outer, inlined, signs=self.signs)

    @cached_property
    def dependences(self) -> Dependences:
        """What its expressions read."""
        return Dependences({let.name: let.value for let in self.subsystem.lets})

    def write(self, copies: Sequence[Subsystem]) -> None:
        """Write all of it; `copies` are what else is described by it."""
        s, pages = self.subsystem, self.pages
        title = f"{KINDS[s.kind]}: {s.title}" if s.title else f"{KINDS[s.kind]} {s.name}"
        pages.heading(self.level, title, self.names.id(), self.names.symbol)
        self._facts(copies)
        self._buffers()
        self._parameters(copies)
        if s.states:
            self._machine()
        self._lets()
        self._behaviours()
        self._assumptions()

    def _heading(self, text: str) -> None:
        self.pages.heading(self.level + 1, text)

    def _facts(self, copies: Sequence[Subsystem]) -> None:
        s, pages = self.subsystem, self.pages
        found: list[Part] = [mono(s.qualified_name)]
        if s.has_rate:
            found.append(f", {plain(f'{float(s.rate_hz):.6g} Hz')}")
        if s.budget_s is not None:
            found.append(plain(f", at most {1000 * float(s.budget_s):.6g} ms for a step"))
        found.append(f", {self._source(s.place)}. ")
        if len(copies) > 1:
            others = ", ".join(mono(each.qualified_name) for each in copies[1:])
            found.append(f"#{string('It describes also')} {others}. ")
        pages.add("#lead_[", *found, "]\n")

    def _source(self, place: object) -> str:
        return f"#{self.pages.source(place)}"  # type: ignore[arg-type]  # a place

    # Buffers and memory.

    def _buffers(self) -> None:
        s, pages = self.subsystem, self.pages
        if not s.ports and not s.memory:
            return
        self._heading("Buffers and memory")
        diagram = inside(self.facts.system, s)
        caption = pages.caption(
            replace(s.trace, eq=()), f"Structure of {s.qualified_name}", s.place
        )
        if any(diagram.all_nodes):
            words = f"Inner structure of {s.qualified_name}"
            pages.picture(
                diagram, [*caption, "Inner structure of ", self.names.symbol.inline], words
            )
        pages.table(
            ("", "Name", "Type", "Meaning", "Source"),
            self._element_rows(),
            widths="(auto, auto, auto, 1fr, auto)",
        )

    def _element_rows(self) -> Iterator[list[str | list[Part]]]:
        names, pages = self.names, self.pages
        for port in self.subsystem.ports:
            for element in port.elements:
                shown = names.placeholder(port.direction, port.peer, element.name)
                id = names.id(port.direction, port.peer, element.name)
                meaning: list[Part] = [plain(element.title)]
                if element.init is not None:
                    meaning.append(
                        plain("; initially ") + f"{self.formulas.math(element.init).inline}"
                    )
                if element.max_age_s is not None:
                    meaning.append(plain(f"; at most {1000 * float(element.max_age_s):.6g} ms old"))
                if element.event:
                    meaning.append(plain("; none may be missed"))
                meaning += self._trace(element.trace, element.title or element.name, element.place)
                place = port.place_of(element)
                name = mono(f"{port.direction}.{port.peer}.{element.name}")
                first = f"#{pages.anchor(id)}{shown.inline}"
                yield [first, name, mono(str(element.type)), meaning, self._source(place)]
        for item in self.subsystem.memory:
            shown = names.placeholder("", "", item.name)
            meaning = [
                plain(item.title),
                plain("; initially ") + f"{self.formulas.math(item.init).inline}",
            ]
            meaning += self._trace(item.trace, item.title or item.name, item.place)
            first = f"#{pages.anchor(names.id('memory', item.name))}{shown.inline}"
            yield [first, mono(item.name), mono(str(item.type)), meaning, self._source(item.place)]

    def _trace(self, trace: Trace, words: str, place: object) -> list[Part]:
        if not trace:
            return []
        return [" (", *self.pages.mentions(trace, words, place), ")"]  # type: ignore[arg-type]  # a place

    def _parameters(self, copies: Sequence[Subsystem]) -> None:
        s, names = self.subsystem, self.names
        if not s.constants:
            return
        self._heading("Parameters")
        parts = copies or (s,)

        def rows() -> Iterator[list[str | list[Part]]]:
            for number, item in enumerate(s.constants):
                anchor = f"#{self.pages.anchor(names.id('constant', item.name))}"
                outer = FormulaWriter(None, names.outer, signs=self.signs)
                values = (outer.math(each.constants[number].value).inline for each in parts)
                yield [
                    f"{anchor}{names.value('constant', item.name).inline}",
                    mono(item.name),
                    ", ".join(dict.fromkeys(values)),
                    plain(item.title),
                    self._source(item.place),
                ]

        widths = "(auto, auto, auto, 1fr, auto)"
        self.pages.table(("", "Name", "Value", "Meaning", "Source"), rows(), widths=widths)

    # The state machine.

    def _machine(self) -> None:
        s, names, pages = self.subsystem, self.names, self.pages
        self._heading("State machine")
        words = f"State machine of {s.qualified_name}"
        caption: list[Part] = ["State machine of ", names.symbol.inline]
        diagram = replace(states(s), notes=())
        pages.picture(diagram, caption, words)
        traces = [state.trace for state in s.states]
        tables = Trace(
            table=tuple(sorted({n for trace in traces for n in trace.table})),
            fig=tuple(sorted({n for trace in traces for n in trace.fig})),
        )
        numbers = pages.caption(tables, f"States of {s.qualified_name}", s.place)
        first = f" It begins in {names.state(s.initial_state).inline}." if s.initial_state else ""
        pages.table(
            ("State", "Name", "Behaviour", "Description", "Source"),
            self._state_rows(),
            caption=[*numbers, f"States and behaviours of {names.symbol.inline}.{first}"],
            widths="(auto, auto, auto, 1fr, auto)",
        )
        self._modes()
        pages.table(
            ("State", "Ended by", "Initial condition", "Next state", "Source"),
            self._transition_rows(),
            caption=[f"State transition table of {names.symbol.inline} (T. denotes TRUE)."],
            widths="(1fr, auto, 1fr, auto, auto)",
        )
        own = [c for c in s.conditions if c.kind == "initial" and is_named(c)]
        own += [c for c in s.conditions if c.kind == "terminal" and is_named(c)]
        own += [c for c in s.conditions if c.kind == "error" and is_named(c)]
        if own or any(self._own_endings(each) for each in self._parts):
            self._heading("Conditions")
        for condition in own:
            self._condition(condition)
        for behaviour in self._parts:
            for condition in self._own_endings(behaviour):
                self._condition(condition, behaviour)

    def _state_rows(self) -> Iterator[list[str | list[Part]]]:
        names = self.names
        for state in self.subsystem.states:
            meaning: list[Part] = [plain(state.title or state.behaviour.title)]
            meaning += self._trace(Trace(eq=state.trace.eq), state.title or state.name, state.place)
            if state.holds:
                outputs = ", ".join(names.placeholder("y", *each).inline for each in state.holds)
                meaning.append(plain("; keeps ") + outputs)
            behaviour = names.behaviour(state.behaviour)
            if state.behaviour.arguments:
                behaviour += bracketed(listed(map(self.formulas.math, state.behaviour.arguments)))
            anchor = f"#{self.pages.anchor(names.id('state', state.name))}"
            yield [
                f"{anchor}{names.state(state.name).inline}",
                mono(state.name),
                behaviour.inline,
                meaning,
                self._source(state.place),
            ]

    def _modes(self) -> None:
        names = self.names

        def rows() -> Iterator[list[str | list[Part]]]:
            for mode in self.subsystem.modes:
                inside_ = ", ".join(names.state(name).inline for name in mode.states)
                errors = ", ".join(
                    f"{mono(cause)} {self.formulas.math(condition.when).inline}"
                    for cause, condition in mode.errors
                )
                meaning: list[Part] = [plain(mode.title)]
                meaning += self._trace(mode.trace, mode.title or mode.name, mode.place)
                yield [mono(mode.name), inside_, errors, meaning, self._source(mode.place)]

        columns = ("Mode", "States", "Error conditions", "Meaning", "Source")
        self.pages.table(columns, rows(), widths="(auto, 1fr, 1fr, auto, auto)")

    def _transition_rows(self) -> Iterator[list[str | list[Part]]]:
        for (_, cause, name, target, _), rows in grouped(
            ((row.place, row.cause, row.condition.name, _target(row), row.resumes), row)
            for row in self.subsystem.transitions
        ).items():
            first = rows[0]
            if first.is_otherwise:
                initial: list[Part] = ["otherwise"]
            elif name == "always":
                initial = [word("TRUE").inline]
            else:
                shown = self.names.condition(first.condition) + sign("=") + word("T.")
                initial = [shown.inline]
                if is_named(first.condition):
                    initial.append(f" #note[#{string(first.condition.name)}]")
            initial += self._trace(first.trace, f"row of {first.source}", first.place)
            sources = dict.fromkeys(
                mono(row.source_mode) if row.source_mode else self.names.state(row.source).inline
                for row in rows
            )
            cell = ", ".join(dict.fromkeys(self._ending(row, cause).inline for row in rows))
            after = self.names.state(target).inline if not first.target_mode else mono(target)
            if first.resumes:
                after = f"resume({mono(first.resumes)})"
            yield [", ".join(sources), cell, initial, after, self._source(first.place)]

    def _ending(self, row: Transition, cause: str) -> Math:
        state = self.subsystem.state(row.source) if row.source in self._state_names else None
        endings = dict(state.behaviour.endings) if state else {}
        if row.source_mode or cause not in endings or state is None:
            return word(cause)
        return self.names.condition(endings[cause], state.behaviour) + sign("=") + word("T.")

    @cached_property
    def _state_names(self) -> frozenset[str]:
        return frozenset(state.name for state in self.subsystem.states)

    # Conditions and named values.

    def _condition(self, condition: Condition, behaviour: Behaviour | None = None) -> None:
        names = self.names
        head = names.condition(condition, behaviour) + self._arguments(condition.when)
        name = condition.name
        if behaviour is not None and name in ("always", "never"):
            name = f"{behaviour.name.partition('(')[0]}.{condition.kind}"
        self.pages.equation(
            names.id("condition", condition.kind, name),
            self._forms(head, condition.when),
            condition.trace,
            title=condition.title,
            name=condition.name if is_named(condition) else "",
            place=condition.place,
        )

    def _forms(self, head: Math, value: m.Expr, middle: Math = EMPTY) -> list[Math]:
        return broken_forms(head, self.formulas.math(value), self.formulas.operands(value), middle)

    def _arguments(self, *values: m.Expr) -> Math:
        read = self.dependences.all(values)
        return arguments_of(self.names, self._ports(read), bool(read.memory))

    def _ports(self, read: Dependence) -> list[Port]:
        peers = {peer for peer, _ in read.inputs}
        ports = (port for port in self.subsystem.ports if port.direction == "x")
        return [port for port in ports if port.peer in peers]

    @cached_property
    def _inlined(self) -> list[Let]:
        """Lets that are written out: small ones that are used once, and records of operators."""
        s = self.subsystem
        exprs = [item.value for item in s.lets]
        exprs += [a.value for f in s.functions for a in f.assignments]
        exprs += [a.value for g in s.generics for a in g.part.assignments]
        exprs += [c.when for c in s.conditions] + [axiom.that for axiom in s.axioms]
        exprs += [c.when for g in s.generics for c in g.conditions]
        uses: dict[str, int] = {}
        in_fields: dict[str, int] = {}
        for node in (each for expr in exprs for each in m.walk(expr)):
            if isinstance(node, m.LetRef):
                uses[node.name] = uses.get(node.name, 0) + 1
            if isinstance(node, m.FieldOf) and isinstance(node.value, m.LetRef):
                name = node.value.name
                in_fields[name] = in_fields.get(name, 0) + 1
        sizes: dict[str, int] = {}
        found = []
        for let in s.lets:
            size = sum(
                sizes.get(each.name, 1) if isinstance(each, m.LetRef) else 1
                for each in m.walk(let.value)
            )
            count = uses.get(let.name, 0)
            is_record = isinstance(let.value, m.Call) and count == in_fields.get(let.name)
            is_free = not let.trace and let.name.isidentifier() and size <= _MOST_INLINED
            if is_free and count and (count == 1 or is_record):
                sizes[let.name] = size
                found.append(let)
        return found

    def _lets(self) -> None:
        written_out = {let.name for let in self._inlined}
        own = [let for let in self.subsystem.lets if let.name not in written_out]
        if not own:
            return
        self._heading("Named values")
        for let in own:
            self.pages.equation(
                self.names.id("let", let.name),
                self._forms(self.names.value("let", let.name), let.value),
                let.trace,
                title=let.title,
                name=let.name,
                place=let.place,
            )

    # Behaviours and their functions.

    @cached_property
    def _parts(self) -> list[Behaviour]:
        """The behaviours; those with parameters once, as they are declared."""
        parts: dict[str, Behaviour] = {}
        for behaviour in self.subsystem.behaviours:
            generic = behaviour.generic.part if behaviour.generic else behaviour
            assert isinstance(generic, Behaviour)
            parts.setdefault(generic.name, generic)
        for state in self.subsystem.states:
            if not state.behaviour.generic:
                parts.setdefault(state.behaviour.name, state.behaviour)
        return list(parts.values())

    def _behaviours(self) -> None:
        s = self.subsystem
        if self._parts:
            self._heading("Behaviours")
        for behaviour in self._parts:
            self._behaviour(behaviour)
        rest = [f for f in s.functions if f.name not in self.written and not f.generic]
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
        pages.equation(
            "", forms, Trace(eq=behaviour.trace.eq), name=short, place=behaviour.place,
        )  # fmt: skip
        self._flow(behaviour, own)
        for function in own:
            self._function(function, numbered)
        for function in shared:
            target = names.id("function", function.name)
            words = function.title or function.name
            pages.content(f"#{string('It shares')} #u({string(target)})[#{string(words)}].")

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

    def _own_endings(self, behaviour: Behaviour) -> list[Condition]:
        """The conditions that stand in the place of their behaviour."""
        endings = (behaviour.terminal, *(error for _, error in behaviour.errors))
        own = (c for c in endings if not is_named(c) or c.name in ("always", "never"))
        return [c for c in own if c.when != m.FALSE or c.trace]

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
        elif together or function.trace:
            self._group(function, id, numbered, together)
            together, id = [], ""
        for number, item in enumerate((*together, *apart)):
            left, middle = self._target(item, numbered, function)
            first = number == 0 and id
            pages.equation(
                id if first else "",
                self._forms(left, item.value, middle),
                item.trace,
                title=title if first else "",
                name=shown if first else "",
                place=item.place,
            )

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

    def _assumptions(self) -> None:
        s = self.subsystem
        if not s.axioms:
            return
        self._heading("Assumptions")
        machine = next((each for each in self.facts.machines if each.subsystem is s), None)
        for number, axiom in enumerate(s.axioms, 1):
            value = self.formulas.math(axiom.that)
            self.pages.equation(
                self.names.id("assumption", str(number)), [value], place=axiom.place
            )
            grounds = ""
            if machine is not None:
                verdict = self.facts.assumption_checker.check_assumption(machine, axiom)
                grounds = f" It rests on {GROUNDS[verdict.grounds]}."
            self.pages.text(f"Because {axiom.because.rstrip('.')}.{grounds}")


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


def _target(row: Transition) -> str:
    return row.target_mode or row.target
