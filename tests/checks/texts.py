"""Verdicts about conditions that are given as text, over inputs of most types."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

from specc.lang import (
    Scope,
    TypeNames,
    declarations,
    enums_by_member,
    expression,
    parse_signature,
    parse_type,
)
from specc.model.expr import Expr
from specc.model.fsm import Trace
from specc.model.system import Operator
from specc.model.types import Bool, Enum, Int
from specc.proof import Decision, Prover, RowVerdict
from specc.proof.decide import FormulaQuestion
from specc.source import Place
from tests.checks.conditions import machine

MODE = Enum("Mode", ("u", "c", "s"))
NAMES = TypeNames(frames={"A": "A", "B": "B"}, types={"Mode": lambda _: MODE})
TYPES = {
    "d": "real", "e": "real", "f": "real", "n": "int", "k": "int", "m": "Mode", "o": "Mode",
    "p": "bool", "t": "text", "w": "text", "b": "vector[3, Mode]", "q": "vector[3]",
    "r": "vector[3]", "X": "pose[A, B]", "Y": "pose[A, B]", "l": "list[real]",
    "i": "list[int]",
}  # fmt: skip
SIGNATURES = {
    "P": "(n: int) -> bool",
    "Q": "(m: Mode) -> bool",
    "R": "(d: real) -> bool",
    "size": "(d: real) -> real",
    "along": "(d: real) -> vector[3]",
}


def _operator(name: str, signature: str) -> Operator:
    parameters, result = parse_signature(signature, NAMES)
    return Operator(name, parameters, result, "tool:f", "", Trace(), Place(""))


SCOPE = Scope(
    memory=declarations({name: parse_type(text, NAMES) for name, text in TYPES.items()}),
    enums=enums_by_member([MODE]),
    operators={name: _operator(name, text) for name, text in SIGNATURES.items()},
    inputs=declarations({("s", name): Int() for name in "ij"}),
    allow_clock=True,
)


def condition(text: str) -> Expr:
    """The condition that a text says."""
    return expression(text, SCOPE, Bool())


def prover(*rows: str, axioms: tuple[str, ...] = (), terminal: str = "True") -> Prover:
    """What answers about a machine with these rows, whose period is 1 s."""
    subsystem = machine(
        [condition(row) for row in rows],
        axioms=tuple(condition(axiom) for axiom in axioms),
        terminal=condition(terminal),
    )
    assert subsystem.rate_hz == Fraction(1)
    return Prover(subsystem, {})


def prove(*rows: str, **context: object) -> RowVerdict:
    """The verdict about the rows, of the solver where tables leave them open."""
    return solved(prover(*rows, **context).prove_rows("S", "terminal"))  # type: ignore[arg-type]  # passed on


def solved(verdict: RowVerdict) -> RowVerdict:
    """A verdict with the solver's answer in the place of an open question."""
    if verdict.decision.open is None:
        return verdict
    answer = verdict.decision.open.solve()
    decision = replace(
        verdict.decision,
        gap=answer.gap,
        overlap=answer.overlap,
        unknown=answer.unknown,
        way_out=answer.way_out,
        open=None,
    )
    return replace(verdict, decision=decision)


def agree(known: Prover, decision: Decision, conditions: Sequence[Expr]) -> bool:
    """Whether the solver alone decides of the conditions what tables and solver do."""
    formulas = tuple(known._formula(each) for each in conditions)
    answer = FormulaQuestion(formulas, (), known._translator.make, known._dependencies).solve()
    refuted = answer.gap is None, answer.overlap is None, answer.unknown == ""
    return refuted == (decision.gap is None, decision.overlap is None, decision.unknown == "")
