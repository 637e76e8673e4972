"""Equations of one subsystem: conditions and values in the forms in which they fit into a page."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from specc.analysis import Facts
from specc.analysis.reads import Dependence, Dependences
from specc.model import expr as m
from specc.model.fsm import Behaviour, Condition
from specc.model.system import Let, Port, Subsystem
from specc.source import Place
from specc.tools.doc.formulas import FormulaWriter
from specc.tools.doc.markup import EMPTY, Math, sign
from specc.tools.doc.pages import Pages
from specc.tools.doc.symbols import SubsystemNames, arguments_of
from specc.tools.graph.diagram import is_named

DEFINED, ASSIGNED = sign("eq.delta"), sign("colon.eq")
_MOST_INLINED = 40
"""Nodes of an expression with lets written out."""


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
class SubsystemEquations:
    """Writes the equations of one subsystem."""

    pages: Pages
    facts: Facts
    names: SubsystemNames
    level: int
    signs: dict[str, None]

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

    def _heading(self, text: str) -> None:
        self.pages.heading(self.level + 1, text)

    def _source(self, place: Place | None) -> str:
        return f"#{self.pages.source(place)}"

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
            about=f"{condition.kind} condition of {behaviour.name}" if behaviour else "",
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

    def _own_endings(self, behaviour: Behaviour) -> list[Condition]:
        """The conditions that stand in the place of their behaviour."""
        endings = (behaviour.terminal, *(error for _, error in behaviour.errors))
        own = (c for c in endings if not is_named(c) or c.name in ("always", "never"))
        return [c for c in own if c.trace or not isinstance(c.when, m.Truth)]
