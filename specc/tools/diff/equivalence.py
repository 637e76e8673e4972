"""Whether expressions and types of two versions mean the same.

Both versions are translated together: inputs and memory are the same unknowns, lets and constants
are each version's own and looked through. Conditions are compared by truth tables, everything
else by its normal form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from typing import Any, Literal

from specc.analysis.definite_assignment import always_present
from specc.lang import show
from specc.lang.context import substitute
from specc.model.expr import (
    Choice,
    Clock,
    Compare,
    ConstantRef,
    Expr,
    LetRef,
    Live,
    Number,
    Truth,
    map_children,
)
from specc.model.requirement import (
    Requirement,
    Stays,
    Temporal,
    TemporalFormula,
    TickCondition,
)
from specc.model.system import Constant, Subsystem, System
from specc.model.types import (
    Bool,
    Enum,
    ListOf,
    Opaque,
    OptionalOf,
    Record,
    Type,
    Vector,
    nested_types,
)
from specc.model.wires import Wires
from specc.proof.decide import FormulaQuestion, is_satisfiable
from specc.proof.dependencies import Dependencies, conjuncts, connected
from specc.proof.formula import Formula, atoms_of
from specc.proof.numbering import Numbering
from specc.proof.table import Table
from specc.proof.translate import Translator
from specc.proof.verdict import FactTexts, SolverError, TooLargeError
from specc.proof.witness import describe
from specc.reachable import grouped
from specc.tools.diff.changes import ChangeLog, PartLog, Verdict

_MARKS = ("old'", "new'")
"""Before the names of lets and constants, so that both versions fit into one translation."""


@dataclass(frozen=True, slots=True)
class Version:
    """A subsystem in its system."""

    system: System
    subsystem: Subsystem


class Constants:
    """Compares values that are computed from constants alone, by their normal forms."""

    def __init__(self, *known: Iterable[Constant]) -> None:
        """`known` are the constants of the old version and those of the new one."""
        self._numbering = Numbering(
            {},
            {
                mark + constant.name: _marked(constant.value, mark)
                for mark, constants in zip(_MARKS, known, strict=True)
                for constant in constants
            },
        )

    def compare(self, old: Expr, new: Expr) -> Verdict:
        """Whether a value of the old version and one of the new are the same."""
        numbers = (_marked(expr, mark) for mark, expr in zip(_MARKS, (old, new), strict=True))
        return Verdict(len({self._numbering.number(expr) for expr in numbers}) == 1)

    def canonical_form(self, requirement: Requirement, version: Literal[0, 1]) -> object:
        """What a requirement of the old or the new version says, whatever it calls constants."""
        return requirement.holds_always, self._form(requirement.formula, _MARKS[version])

    def is_same_formula(self, old: Requirement, new: Requirement) -> bool:
        return self.canonical_form(old, 0) == self.canonical_form(new, 1)

    def _form(self, formula: TemporalFormula, mark: str) -> object:
        if isinstance(formula, TickCondition):
            return self._numbering.number(_marked(formula.that, mark))
        if isinstance(formula, Stays):
            value = self._numbering.number(_marked(formula.value, mark))
            return "stays", formula.span_s, value
        parts = [self._form(operand, mark) for operand in formula.operands]
        if isinstance(formula, Temporal):
            return formula.op, formula.span_s, *parts
        if formula.op == "not":
            return "not", *parts
        # Order, repetition and brackets of operands say nothing.
        inside = (p[1] if isinstance(p, tuple) and p[0] == formula.op else (p,) for p in parts)
        found = frozenset(chain.from_iterable(inside))
        return (formula.op, found) if len(found) > 1 else next(iter(found))


def compare_constants(
    old: Constant, new: Constant, part: PartLog, values: Constants | Equivalence
) -> None:
    """Compare values at the start, ranges, and whether the constants may change."""
    one, other = (constant.initial or constant.value for constant in (old, new))
    part.compare_expressions("value", one, other, values.compare)
    ends = (
        [show(Number(end, type=each.value.type)) for end in each.bounds or ()]
        for each in (old, new)
    )
    part.changed("range", *(" to ".join(each) or "none" for each in ends))
    live = (constant.initial is not None for constant in (old, new))
    part.changed("live", *("true" if each else "false" for each in live))


class Equivalence:
    """Compares expressions of two versions of one subsystem.

    Conditions are evaluated whole periods after a state began; other values in its first, too.
    """

    def __init__(self, old: Version, new: Version) -> None:
        versions = old, new
        self.subsystems = old.subsystem, new.subsystem
        rates = {v.subsystem.rate_hz if v.subsystem.has_rate else None for v in versions}
        rate_hz = rates.pop()
        period_s = 1 / rate_hz if rate_hz and not rates else None
        self.conditions = _Moment(versions, period_s, lambda expr: expr)
        self._first = _Moment(versions, period_s, _at_first)

    def compare(self, old: Expr, new: Expr) -> Verdict:
        """How two values relate in every period."""
        if isinstance(old.type, Bool) and isinstance(new.type, Bool):
            found = self.compare_conditions(old, new)
            return self._first.compare([old], [new]) if found.same else found
        return Verdict(self.conditions.is_same(old, new) and self._first.is_same(old, new))

    def compare_conditions(self, old: Expr, new: Expr) -> Verdict:
        """How two conditions relate whole periods after a state began."""
        return self.conditions.compare([old], [new])

    def is_same_assumption(self, old: Expr, new: Expr) -> bool:
        """Whether two assumptions mean the same, whatever else is assumed."""
        moments = self.conditions, self._first
        return all(moment.compare([old], [new], None).same for moment in moments)


def _at_first(expr: Expr) -> Expr:
    """An expression as it is in the first period of a state."""
    if isinstance(expr, Clock) and expr.name == "elapsed":
        return Number(0.0, type=expr.type)
    if isinstance(expr, Clock) and expr.name == "entered":
        return Truth(True, type=Bool())
    return map_children(expr, _at_first)


_MOST_CHOICES = 16
"""Values that an expression chooses from, beyond which it is compared as a whole."""


class _Moment:
    """Expressions of both versions at one moment: inputs and memory are the same unknowns.

    Lets and constants are each version's own, and looked through.
    """

    def __init__(
        self,
        versions: tuple[Version, Version],
        period_s: Fraction | None,
        then: Callable[[Expr], Expr],
    ) -> None:
        """`then` is what an expression is at the moment."""
        self._then = then
        lets: dict[str, Expr] = {}
        constants: dict[str, Expr] = {}
        for side, version in enumerate(versions):
            own = (*version.system.constants, *version.subsystem.constants)
            constants |= {_MARKS[side] + c.name: self._at(c.value, side) for c in own}
            lets |= {_MARKS[side] + x.name: self._at(x.value, side) for x in version.subsystem.lets}
        present = [always_present(v.subsystem, Wires(v.system.agents)) for v in versions]
        self._translator = Translator(lets, constants, present[0] & present[1], period_s)
        self.make = self._translator.make
        self._dependencies = Dependencies(self._translator.numbering)
        assumed = [[axiom.that for axiom in v.subsystem.axioms] for v in versions]
        within = (self._formula(each, 0) for each in _within_ranges(versions))
        self._axioms = *self.common(assumed[0], assumed[1]), *within

    def is_same(self, old: Expr, new: Expr) -> bool:
        """Whether two values are the same, whatever the tests say that choose them."""
        number = self._translator.numbering.number
        choices = [list(self._choices(self._at(e, n), ())) for n, e in enumerate((old, new))]
        if number(self._at(old, 0)) == number(self._at(new, 1)):
            return True
        if max(map(len, choices)) > _MOST_CHOICES:
            return False
        return all(
            number(one) == number(other) or is_satisfiable([*tests, *more, *self._axioms]) is False
            for tests, one in choices[0]
            for more, other in choices[1]
        )

    def _choices(
        self, expr: Expr, tests: tuple[Formula, ...]
    ) -> Iterator[tuple[tuple[Formula, ...], Expr]]:
        """The values that an expression chooses from, each with the tests that lead to it."""
        value = self._translator.numbering.resolve(expr)
        if not isinstance(value, Choice) or len(tests) == _MOST_CHOICES:
            yield tests, expr
            return
        test = self._translator.formula(value.test)
        yield from self._choices(value.then, (*tests, test))
        yield from self._choices(value.otherwise, (*tests, self.make.negation(test)))

    def compare(
        self, old: Sequence[Expr], new: Sequence[Expr], premises: Iterable[Formula] | None = ()
    ) -> Verdict:
        """How `any of old` and `any of new` relate; without axioms if nothing may be given."""
        before, after = (
            self.make.disjunction(self._formula(expr, side) for expr in exprs)
            for side, exprs in enumerate((old, new))
        )
        if before is after:
            return Verdict(True, is_proved=True)
        assumptions = [] if premises is None else conjuncts([*self._axioms, *premises])
        try:
            try:
                of = self._dependencies.of
                return self._verdict(before, after, connected(assumptions, (before, after), of))
            except TooLargeError:
                return self._verdict(before, after, connected(assumptions, (before, after)))
        except (TooLargeError, SolverError) as error:
            return Verdict(False, unknown=str(error))

    def common(self, old: Sequence[Expr], new: Sequence[Expr]) -> tuple[Formula, ...]:
        """The conditions of both versions that are the same formula."""
        before = {self._formula(expr, 0) for expr in old}
        found = {formula for expr in new if (formula := self._formula(expr, 1)) in before}
        return tuple(sorted(found, key=lambda formula: formula.index))

    def _formula(self, expr: Expr, side: int) -> Formula:
        return self._translator.formula(self._at(expr, side))

    def _at(self, expr: Expr, side: int) -> Expr:
        return _marked(self._then(expr), _MARKS[side])

    def _verdict(self, before: Formula, after: Formula, assumed: Sequence[Formula]) -> Verdict:
        """Raises TooLargeError, and SolverError where the solver does not say."""
        formulas = [before, after, *assumed]
        table, atoms = Table(formulas), list(atoms_of(formulas))
        lost = table.bits(before) & ~table.bits(after)
        gained = table.bits(after) & ~table.bits(before)
        allowed = table.all_of(assumed)
        only_old, only_new = lost & allowed, gained & allowed
        if (only_old or only_new) and self._dependencies.are_related(atoms):
            # What refutes has to be possible.
            make = self.make
            question = FormulaQuestion((before, after), tuple(assumed), make, self._dependencies)
            sides = (before, make.negation(after)), (after, make.negation(before))
            models = question.models([make.conjunction(side) for side in sides])
            only_old, only_new = (
                0 if model is None else table.where_answered(model) for model in models
            )
        unsure = next((atom.text for atom in atoms if atom.is_uncertain), "")
        if unsure and (only_old or only_new):
            raise SolverError(f"proofs do not follow how `{unsure}` changes with the time")
        compared_atoms = frozenset(atoms_of((before, after)))
        return Verdict(
            not (only_old or only_new),
            _facts(table, only_old, allowed, compared_atoms),
            _facts(table, only_new, allowed, compared_atoms),
            is_proved=True,
        )


def _facts(table: Table, faults: int, allowed: int, atoms: frozenset[Any]) -> FactTexts:
    """Facts without marks; one that both versions have with values of their own says whose."""
    if not faults:
        return ()
    found, *_ = describe(table, faults, allowed, atoms)
    names = [_unmarked(fact) for fact, _ in found]
    facts = []
    for (fact, answer), name in zip(found, names, strict=True):
        whose = next((mark.rstrip("'") for mark in _MARKS if mark in fact), "")
        is_ambiguous = whose and names.count(name) > 1
        facts.append((f"{name} ({whose})" if is_ambiguous else name, answer))
    return tuple(facts) or (("anything", "true"),)


def _unmarked(text: str) -> str:
    for mark in _MARKS:
        text = text.replace(mark, "")
    return text


def _within_ranges(versions: Iterable[Version]) -> Iterator[Expr]:
    """The conditions that constants that may change are within a range of one version, or between
    those of both.
    """
    every = (constant.value for version in versions for constant in version.system.constants)
    live = [value for value in every if isinstance(value, Live)]
    for alike in grouped((value.name, value) for value in live).values():
        low = Number(min(value.low for value in alike), type=alike[0].type)
        high = Number(max(value.high for value in alike), type=alike[0].type)
        yield Compare(">=", alike[0], low, type=Bool())
        yield Compare("<=", alike[0], high, type=Bool())


def _marked(expr: Expr, mark: str) -> Expr:
    """`expr` with the names of lets and constants marked.

    A constant that may change is the same unknown in both versions, whatever its ranges are.
    """
    if isinstance(expr, (LetRef, ConstantRef)):
        return replace(expr, name=mark + expr.name)
    if isinstance(expr, Live):
        return replace(expr, low=-math.inf, high=math.inf)
    return map_children(expr, lambda part: _marked(part, mark))


# Named types.


def type_text(type: Type) -> str:
    """A type as it is written; the members of an enum without a name are in alphabetical order."""
    match type:
        case Enum(name=""):
            return str(replace(type, members=tuple(sorted(type.members))))
        case Vector(element=Enum(name="") as enum):
            return str(replace(type, element=replace(enum, members=tuple(sorted(enum.members)))))
        case ListOf(element=element, nonempty=nonempty):
            return f"{'nonempty' if nonempty else 'list'}[{type_text(element)}]"
        case OptionalOf(value=value):
            return f"optional[{type_text(value)}]"
    return str(type)


_TypeParts = dict[str, str]
"""What a type consists of, by what it is there: a member, a field, the class."""


def compare_types(old: System, new: System, log: ChangeLog) -> None:
    """The types that both systems use.

    Descriptions may have different types of one name; then the user of the changed type is named.
    """
    users = before, after = _types_by_user(old), _types_by_user(new)
    forms = [grouped((name, parts) for (_, name), parts in types.items()) for types in users]
    reported: list[tuple[str, _TypeParts, _TypeParts]] = []
    for user, name in sorted(before.keys() & after.keys(), key=lambda key: key[::-1]):
        one, other = before[user, name], after[user, name]
        if (name, one, other) in reported:
            continue
        reported.append((name, one, other))
        is_ambiguous = any(form != of[name][0] for of in forms for form in of[name])
        part = log.part("type", f"{name} of {user}" if is_ambiguous else name)
        for key in sorted(one.keys() | other.keys()):
            if key not in one:
                part.added(f"{key} {other[key]}".strip())
            elif key not in other:
                part.removed(f"{key} {one[key]}".strip())
            else:
                part.changed(key, one[key], other[key])


def _types_by_user(system: System) -> dict[tuple[str, str], _TypeParts]:
    """The parts of each named type, by the device, subsystem or operator that uses it."""
    users = {d.qualified_name: [e.type for e in (*d.x, *d.y)] for d in system.devices}
    for each in system.subsystems:
        types = [element.type for port in each.ports for element in port.elements]
        users[each.qualified_name] = types + [memory.type for memory in each.memory]
    for operator in system.operators:
        users[operator.name] = [*(type for _, type in operator.parameters), operator.result]
    found: dict[tuple[str, str], _TypeParts] = {}
    for user, types in users.items():
        for type in sorted(nested_types(types), key=str):
            if (parts := _type_parts(type)) is not None:
                found.setdefault((user, getattr(type, "name", "")), parts)
    return found


def _type_parts(type: Type) -> _TypeParts | None:
    """What a named type consists of, whatever frames it is used with."""
    match type:
        case Enum(name=name, members=members) if name:
            return {f"member {member}": "-" for member in members}
        case Record(name=name) as record if name:
            frames = {frame: f"F{n}" for n, frame in enumerate(record.frames, 1)}
            inside = substitute(record, frames)
            assert isinstance(inside, Record)
            parts = {f"field {field}": type_text(part) for field, part in inside.fields}
            return parts | {"class": record.python or "generated"}
        case Opaque(name=name, python=python) if name:
            return {"class": python or "not said"}
    return None
