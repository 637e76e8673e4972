"""Formulas of requirements as questions about one tick.

An operator over ticks becomes a truth value of its own, with what follows of it at the same tick
from what it is about: where `p` holds, so does `within(t, p)`; where `within(1[s], p)` does, so
does `within(2[s], p)`; and `throughout(t, p)` is `not within(t, not p)`. What contradicts so
contradicts in every run; the reverse does not hold.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from specc.lang import show
from specc.limits import spend
from specc.model.expr import Expr, MemoryRef
from specc.model.requirement import BoolOp, Stays, Temporal, TemporalFormula, TickCondition
from specc.model.types import Bool
from specc.proof.decide import is_satisfiable
from specc.proof.formula import Formula, Variable, atoms_of
from specc.proof.translate import Translator

_OF_A_QUESTION = 40
"""Steps that it takes to find out which operators over ticks a question is about."""
_MOST_RELATED = 12
"""Operators over ticks that are compared with each other in one question."""


@dataclass(frozen=True, slots=True)
class _TemporalFlag:
    """An operator over ticks, `within`, `once` or `since`, as the truth value `flag`."""

    op: str
    span_s: Fraction
    operands: tuple[Formula, ...]
    flag: Formula


class Ticks:
    """Which formulas can hold at one tick, and which follow from others."""

    def __init__(self, constants: Mapping[str, Expr], known: Iterable[Expr] = ()) -> None:
        """`constants` in order of dependence; what is `known` holds at every tick."""
        self._translator = Translator({}, constants)
        self.make = self._translator.make
        self._facts = tuple(map(self._translator.formula, known))
        self._temporal: dict[object, _TemporalFlag] = {}
        self._by_variable: dict[Variable, _TemporalFlag] = {}
        # By identity, with the formula itself so that no other one takes its identity.
        self._formulas: dict[int, tuple[TemporalFormula | Expr, Formula]] = {}
        self._possible: dict[frozenset[Formula], bool | None] = {}

    def formula_at(self, formula: TemporalFormula | Expr) -> Formula:
        """A formula, or a condition, at a tick; equal ones are one object."""
        known = self._formulas.get(id(formula))
        if known is None:
            known = self._formulas[id(formula)] = formula, self._translate(formula)
        return known[1]

    def _translate(self, formula: TemporalFormula | Expr) -> Formula:
        match formula:
            case TickCondition(that=that):
                return self._translator.formula(that)
            case BoolOp(op=op, operands=operands):
                parts = [self.formula_at(operand) for operand in operands]
                if op == "not":
                    return self.make.negation(parts[0])
                return self.make.conjunction(parts) if op == "and" else self.make.disjunction(parts)
            case Stays(value=value, span_s=span_s):
                # It changed within the span: what has not changed for longer has not for less.
                changes = MemoryRef(f"changes {show(value)}", type=Bool())
                return self.make.negation(
                    self._flag("stays", span_s, (self._translator.formula(changes),))
                )
            case Temporal(op=op, operands=operands, span_s=span_s):
                parts = [self.formula_at(operand) for operand in operands]
                if op in ("throughout", "historically"):
                    opposite = "within" if op == "throughout" else "once"
                    inner = self._flag(opposite, span_s, (self.make.negation(parts[0]),))
                    return self.make.negation(inner)
                return self._flag(op, span_s, tuple(parts))
        return self._translator.formula(formula)

    def is_possible(self, *formulas: Formula) -> bool:
        """Whether all can hold at one tick, as far as it is known."""
        key = frozenset(formulas)
        if key not in self._possible:
            if not spend("proof", _OF_A_QUESTION):
                return True
            self._possible[key] = True  # what follows from itself is not asked again
            self._possible[key] = is_satisfiable([*formulas, *self._related_facts(formulas)])
        return self._possible[key] is not False

    def follows(self, conclusion: Formula, *context: Formula) -> bool:
        """Whether it surely holds at every tick at which the context does."""
        return not self.is_possible(*context, self.make.negation(conclusion))

    def _flag(self, op: str, span_s: Fraction, operands: tuple[Formula, ...]) -> Formula:
        key = op, span_s, operands
        if key not in self._temporal:
            # No value has a name with a space in it.
            name = MemoryRef(f"{op} {len(self._temporal)}", type=Bool())
            flag = self._translator.formula(name)
            assert flag.atom is not None  # nothing is known of the name
            self._temporal[key] = self._by_variable[flag.atom.variable] = _TemporalFlag(
                op, span_s, operands, flag
            )
        return self._temporal[key].flag

    def _related_facts(self, formulas: Sequence[Formula]) -> Iterator[Formula]:
        """The facts and laws about the variables and operators in formulas."""
        operators = self._operators_in(formulas)
        with_operands = [*formulas, *(operand for each in operators for operand in each.operands)]
        variables = {atom.variable for atom in atoms_of(with_operands)}
        for fact in self._facts:
            if any(atom.variable in variables for atom in atoms_of([fact])):
                yield fact
        for each in operators:
            yield from self._laws_of(each)
        if len(operators) <= _MOST_RELATED:
            for one in operators:
                for other in operators:  # `one` reaches no further the same way
                    same = one is not other and one.op == other.op != "since"
                    if (
                        same
                        and one.span_s <= other.span_s
                        and self.follows(other.operands[0], one.operands[0])
                    ):
                        yield self.make.disjunction([self.make.negation(one.flag), other.flag])

    def _operators_in(self, formulas: Sequence[Formula]) -> list[_TemporalFlag]:
        """The temporal operators in formulas, nested ones included."""
        found: dict[_TemporalFlag, None] = {}
        open_ = list(formulas)
        while open_:
            for atom in atoms_of([open_.pop()]):
                each = self._by_variable.get(atom.variable)
                if each is not None and each not in found:
                    found[each] = None
                    open_ += each.operands
        return list(found)

    def _laws_of(self, each: _TemporalFlag) -> Iterator[Formula]:
        begun = each.operands[-1]
        yield self.make.disjunction([self.make.negation(begun), each.flag])
        if each.op == "since":
            yield self.make.disjunction([self.make.negation(each.flag), *each.operands])
        if not self.is_possible(begun):
            yield self.make.negation(each.flag)
