"""The section of a subsystem: buffers and memory, state machine, behaviours, assumptions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

from specc.model import expr as m
from specc.model.fsm import Mode, State, Trace, Transition
from specc.model.system import Element, Memory, Subsystem
from specc.reachable import grouped
from specc.tools.doc.behaviours import BehaviourSection
from specc.tools.doc.equations import SubsystemEquations
from specc.tools.doc.formulas import FormulaWriter
from specc.tools.doc.markup import Math, bracketed, listed, sign, string, unlinked, word
from specc.tools.doc.pages import Part, mono, plain
from specc.tools.graph.diagram import is_named
from specc.tools.graph.machine import states
from specc.tools.graph.structure import inside

_WIDE_CELL = 24
"""Of a formula that may need a line of its own in a cell of a table."""
Numbered = Element | Memory | Mode | State | Transition
"""Parts with numbers that stand in tables."""
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


class SubsystemSection(SubsystemEquations):
    """Writes the section of one subsystem."""

    def write(self, copies: Sequence[Subsystem]) -> None:
        """Write all of it; `copies` are what else is described by it."""
        s, pages = self.subsystem, self.pages
        name = "" if s.kind == "control" else f" {s.name}"
        title = f"{KINDS[s.kind]}: {s.title}" if s.title else f"{KINDS[s.kind]}{name}"
        pages.heading(self.level, title, self.names.id(), self.names.symbol)
        self._facts(copies)
        self._buffers()
        self._parameters(copies)
        if s.states:
            self._machine()
        self._lets()
        parts = self.pages, self.facts, self.names, self.level, self.signs
        BehaviourSection(*parts).write()
        self._assumptions()

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

    def _buffers(self) -> None:
        s, pages = self.subsystem, self.pages
        if not s.ports and not s.memory:
            return
        self._heading("Buffers and memory")
        diagram = inside(self.facts.system, s)
        caption = pages.caption(Trace(fig=s.trace.fig), f"Structure of {s.qualified_name}", s.place)
        if any(diagram.all_nodes):
            words = f"Inner structure of {s.qualified_name}"
            pages.picture(
                diagram, [*caption, "Inner structure of ", self.names.symbol.inline], words
            )
        pages.table(
            ("", "Name", "Type", "Meaning", "Source"),
            self._element_rows(),
            widths="(auto, auto, 1fr, 1.3fr, auto)",
        )

    def _element_rows(self) -> Iterator[list[str | list[Part]]]:
        names, pages = self.names, self.pages
        for port in self.subsystem.ports:
            for element in port.elements:
                shown = names.placeholder(port.direction, port.peer, element.name)
                words = [element.title]
                if element.max_age_s is not None:
                    words.append(f"at most {1000 * float(element.max_age_s):.6g} ms old")
                words += ["none may be missed"] * element.event
                name = f"{port.direction}.{port.peer}.{element.name}"
                id = names.id(port.direction, port.peer, element.name)
                yield [
                    f"#{pages.anchor(id)}{unlinked(shown, id).inline}",
                    mono(name),
                    mono(str(element.type)),
                    [*self._meaning(words, element.init), *self._trace(element)],
                    self._source(port.place_of(element)),
                ]
        for item in self.subsystem.memory:
            shown = names.placeholder("", "", item.name)
            id = names.id("memory", item.name)
            yield [
                f"#{pages.anchor(id)}{unlinked(shown, id).inline}",
                mono(item.name),
                mono(str(item.type)),
                [*self._meaning([item.title], item.init), *self._trace(item)],
                self._source(item.place),
            ]

    def _meaning(self, words: Sequence[str], init: m.Expr | None) -> Iterator[Part]:
        text = "; ".join(filter(None, words))
        yield plain(text)
        if init is not None:
            first = "; initially" if text else "Initially"
            value = self.formulas.math(init)
            is_wide = value.width > _WIDE_CELL
            yield f"{plain(first)} {f'#fit[{value.inline}]' if is_wide else value.inline}"

    def _trace(self, part: Numbered, trace: Trace | None = None) -> list[Part]:
        """The numbers of a part in brackets, or some of them."""
        trace = part.trace if trace is None else trace
        if not trace:
            return []
        words = getattr(part, "title", "") or getattr(part, "name", "")
        return [" (", *self.pages.mentions(trace, words, part.place), ")"]

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
        if len(s.states) == 1 and not s.transitions:
            anchor = f"#{pages.anchor(names.id('state', s.states[0].name))}"
            state, shown = names.state(s.states[0].name), names.behaviour(s.states[0].behaviour)
            has = f"{anchor}{state.inline}, with the behaviour {shown.inline}"
            trace = s.states[0].trace
            every = replace(trace, table=tuple(dict.fromkeys((*s.trace.table, *trace.table))))
            shown_numbers = self._trace(s.states[0], every)
            pages.add(f"#par_[It has one state, {has}", *shown_numbers, ".]\n")
            return
        traces = [state.trace for state in s.states]
        figures = Trace(fig=tuple(sorted({n for trace in traces for n in trace.fig})))
        words = f"State machine of {s.qualified_name}"
        caption = pages.caption(figures, words, s.place)
        caption += ["State machine of ", names.symbol.inline]
        diagram = replace(states(s), notes=())
        pages.picture(diagram, caption, words)
        tables = Trace(table=tuple(sorted({n for trace in traces for n in trace.table})))
        numbers = pages.caption(tables, f"States of {s.qualified_name}", s.place)
        first = f" It begins in {names.state(s.initial_state).inline}." if s.initial_state else ""
        pages.table(
            ("State", "Name", "Behaviour", "Description", "Source"),
            self._state_rows(),
            caption=[*numbers, f"States and behaviours of {names.symbol.inline}.{first}"],
            widths="(auto, auto, auto, 1fr, auto)",
        )
        self._modes()
        words = f"State transition table of {s.qualified_name}"
        rows = pages.caption(Trace(table=s.trace.table), words, s.place)
        pages.table(
            ("State", "Ended by", "Initial condition", "Next state", "Source"),
            self._transition_rows(),
            caption=[*rows, f"State transition table of {names.symbol.inline} (T. denotes TRUE)."],
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
            meaning += self._trace(state, Trace(eq=state.trace.eq))
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
                meaning += self._trace(mode)
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
            initial += self._trace(first)
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
        shown, ending = self.names.condition(endings[cause], state.behaviour), endings[cause]
        is_plain = isinstance(ending.when, m.Truth) and not ending.trace
        return shown if is_plain else shown + sign("=") + word("T.")

    @cached_property
    def _state_names(self) -> frozenset[str]:
        return frozenset(state.name for state in self.subsystem.states)

    # Named values.

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


def _target(row: Transition) -> str:
    return row.target_mode or row.target
