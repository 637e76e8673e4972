"""Words for conditions, situations and places in messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from specc.lang import show
from specc.model.expr import Call, Expr, walk
from specc.model.fsm import Behaviour, Cause
from specc.model.system import Constant, Let, Memory, Subsystem, System
from specc.proof import Witness
from specc.source import Place

# Phrases that several findings share.


def situation(witness: Witness) -> str:
    """`when a is true and b is false`, or whatever holds in all situations of a witness."""
    if witness.everywhere is not None:
        return f"when `{show(witness.everywhere)}`"
    if not witness.facts:
        return "whatever the conditions are"
    return f"when {facts_of(witness)}{', among other cases' if witness.some else ''}"


def facts_of(witness: Witness) -> str:
    """`a is true and b is false`: one situation of a witness."""
    return listed([f"`{question}` is {answer}" for question, answer in witness.facts], "and")


def operators_in(witness: Witness) -> str:
    """A last remark on the operators in a witness; empty if it involves none."""
    nodes = (node for asked, _ in witness.answers for node in walk(asked))
    calls = (node.operator for node in nodes if isinstance(node, Call))
    names = [f"`{name}`" for name in dict.fromkeys(calls)]
    if not names:
        return ""
    kind = "an operator, which" if len(names) == 1 else "operators, which"
    verb = "is" if len(names) == 1 else "are"
    return f"; {listed(names, 'and')} {verb} {kind} may have any result as far as proofs know"


def ms(seconds: Fraction) -> str:
    """A length of time in milliseconds."""
    return f"{float(1000 * seconds):.6g} ms"


def listed(names: Iterable[str], word: str) -> str:
    """`a`, `a and b`, `a, b and c`."""
    *most, last = names
    return f"{', '.join(most)} {word} {last}" if most else last


def ending(behaviour: Behaviour, cause: Cause) -> str:
    """How a behaviour ends by a cause: `by its terminal condition `idle_ended``."""
    condition = behaviour.terminal if cause == "terminal" else behaviour.error
    return f"by its {cause} condition `{condition.name}`"


# Places inside the texts of expressions.


def text_place(part: Place, key: str, expr: Expr) -> Place:
    """Where `expr` stands in the text at `key` of a part (its own text in the short form)."""
    start, end = expr.span
    return replace(part, route=(*part.route, key), part="value", start=start, end=end)


def below(part: Place, *keys: str | int) -> Place:
    """The value at `keys` of a part, or the nearest thing around it that the file has."""
    return replace(part, route=(*part.route, *keys), part="value")


# The expressions of a subsystem with the texts in which they stand.


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
