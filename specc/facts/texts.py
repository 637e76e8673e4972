"""The expressions of a subsystem with the texts in which they stand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from specc.facts.places import text_place
from specc.model.expr import Expr
from specc.model.system import Constant, Let, Memory, Subsystem, System
from specc.source import Place


class Text(NamedTuple):
    """An expression that is the text at `key` of a part, or its short form."""

    expr: Expr
    part: Place
    key: str

    def place(self, node: Expr) -> Place:
        """Where a part of the expression stands."""
        return text_place(self.part, self.key, node)


def text_of(named: Constant | Let | Memory) -> Text:
    """The text of what has a name in expressions."""
    if isinstance(named, Memory):
        return Text(named.init, named.place, "init")
    return Text(named.value, named.place, "is")


def texts(owner: Subsystem | System) -> Iterator[Text]:
    """All expressions of a subsystem, or those of the constants of a system."""
    yield from map(text_of, owner.constants)
    if isinstance(owner, System):
        return
    for port in owner.ports:
        yield from (Text(e.init, e.place, "init") for e in port.elements if e.init is not None)
    yield from map(text_of, owner.memory)
    yield from map(text_of, owner.lets)
    yield from (Text(condition.when, condition.place, "when") for condition in owner.conditions)
    for function in owner.functions:
        yield from (Text(item.value, item.place, "is") for item in function.assignments)
    yield from (Text(axiom.that, axiom.place, "") for axiom in owner.axioms)
