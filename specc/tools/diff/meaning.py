"""Whether two tables or types mean the same."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from typing import Any, Literal

from specc.analysis.arrivals import always_present
from specc.lang.mismatch import substitute
from specc.model.expr import (
    Choice,
    Clock,
    ConstantRef,
    Expr,
    LetRef,
    Number,
    Truth,
    mapped,
)
from specc.model.requirement import Junction, Requirement, Temporal, TickCondition
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
    within,
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
from specc.tools.diff.record import Book, Verdict

# Changes of named types, each reported once and not wherever the type is used.


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


Parts = dict[str, str]
"""What a type consists of, by what it is there: a member, a field, the class."""


def compare_types(old: System, new: System, book: Book) -> None:
    """Members of enums, fields of records and Python classes of the types that both systems use.

    A change is reported once, whoever uses the type. Descriptions may have different types of one
    name; whose type has changed is said of these.
    """
    before, after = _by_user(old), _by_user(new)
    several = _with_several_meanings(before) | _with_several_meanings(after)
    told: dict[str, list[tuple[Parts, Parts]]] = {}
    for user, name in sorted(before.keys() & after.keys(), key=lambda key: key[::-1]):
        both = before[user, name], after[user, name]
        if both not in told.setdefault(name, []):
            told[name].append(both)
            _compare_parts(f"{name} of {user}" if name in several else name, *both, book)


def _compare_parts(name: str, old: Parts, new: Parts, book: Book) -> None:
    for key in sorted(old.keys() | new.keys()):
        if key not in old:
            book.alone("added", "type", name, f"{key} {new[key]}".strip())
        elif key not in new:
            book.alone("removed", "type", name, f"{key} {old[key]}".strip())
        else:
            book.both("type", name).changed(key, old[key], new[key])


def _with_several_meanings(types: Mapping[tuple[str, str], Parts]) -> set[str]:
    first: dict[str, Parts] = {}
    return {name for (_, name), parts in types.items() if first.setdefault(name, parts) != parts}


def _by_user(system: System) -> dict[tuple[str, str], Parts]:
    """The parts of each named type, by what uses it and its name."""
    found: dict[tuple[str, str], Parts] = {}
    for user, types in _users(system):
        for type in sorted(within(types), key=str):
            if isinstance(type, _NAMED) and type.name:
                found.setdefault((user, type.name), _parts(type))
    return found


_NAMED = (Enum, Record, Opaque)


def _parts(type: Type) -> Parts:
    """What a named type consists of, by whatever frames it is used with."""
    if isinstance(type, Record):
        type = substitute(type, {frame: f"F{n}" for n, frame in enumerate(type.frames, 1)})
    match type:
        case Enum(members=members):
            return {f"member {member}": "-" for member in members}
        case Record(fields=fields, python=python):
            parts = {f"field {field}": type_text(t) for field, t in fields}
            return parts | {"class": python or "generated"}
        case Opaque(python=python):
            return {"class": python or "not said"}
    return {}


def _users(system: System) -> Iterator[tuple[str, list[Type]]]:
    """Devices, subsystems and operators, each with its types."""
    for device in system.devices:
        yield device.qualified_name, [element.type for element in (*device.x, *device.y)]
    for part in system.subsystems:
        elements = [element.type for port in part.ports for element in port.elements]
        yield part.qualified_name, elements + [memory.type for memory in part.memory]
    for operator in system.operators:
        yield operator.name, [*(type for _, type in operator.parameters), operator.result]


# Whether two expressions of two versions of a subsystem mean the same.
#
# Both versions are translated together: inputs and memory are the same unknowns, lets and constants
# are each version's own and looked through. Conditions are compared by truth tables, everything
# else by its normal form.


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
                mark + c.name: _marked(c.value, mark)
                for mark, constants in zip(_MARKS, known, strict=True)
                for c in constants
            },
        )

    def same(self, old: Expr, new: Expr) -> bool:
        """Whether a value of the old version and one of the new are the same."""
        numbers = (_marked(expr, mark) for mark, expr in zip(_MARKS, (old, new), strict=True))
        return len({self._numbering.number(expr) for expr in numbers}) == 1

    def canonical_form(self, requirement: Requirement, version: Literal[0, 1]) -> object:
        """What a requirement of the old or the new version says, whatever it calls constants."""
        return requirement.lasts, self._form(requirement.formula, _MARKS[version])

    def _form(self, formula: Temporal | Junction | TickCondition, mark: str) -> object:
        if isinstance(formula, TickCondition):
            return self._numbering.number(_marked(formula.that, mark))
        parts = [self._form(operand, mark) for operand in formula.operands]
        if isinstance(formula, Temporal):
            return formula.op, formula.span_s, *parts
        if formula.op == "not":
            return "not", *parts
        # Order, repetition and brackets of operands say nothing.
        inside = (p[1] if isinstance(p, tuple) and p[0] == formula.op else (p,) for p in parts)
        found = frozenset(chain.from_iterable(inside))
        return (formula.op, found) if len(found) > 1 else next(iter(found))


class Equivalence:
    """Compares expressions of two versions of one subsystem.

    Conditions are `asked` whole periods after a state began, other values in its first period too.
    """

    def __init__(self, old: Version, new: Version) -> None:
        versions = old, new
        rates = {v.subsystem.rate_hz if v.subsystem.rated else None for v in versions}
        rate_hz = rates.pop()
        period_s = 1 / rate_hz if rate_hz and not rates else None
        self.asked = _Moment(versions, period_s, lambda expr: expr)
        self._first = _Moment(versions, period_s, _at_first)

    def same_value(self, old: Expr, new: Expr) -> bool:
        """Whether two expressions have the same value in every period."""
        if isinstance(old.type, Bool) and isinstance(new.type, Bool):
            return self.compare_values(old, new).same
        return self.asked.same(old, new) and self._first.same(old, new)

    def compare_values(self, old: Expr, new: Expr) -> Verdict:
        """How two truth values relate in every period."""
        found = self.asked.compare([old], [new])
        return self._first.compare([old], [new]) if found.same else found

    def same_assumption(self, old: Expr, new: Expr) -> bool:
        """Whether two assumptions say the same, whatever else is assumed."""
        moments = self.asked, self._first
        return all(moment.compare([old], [new], None).same for moment in moments)


def _at_first(expr: Expr) -> Expr:
    """An expression as it is in the first period of a state."""
    if isinstance(expr, Clock) and expr.name == "elapsed":
        return Number(0.0, type=expr.type)
    if isinstance(expr, Clock) and expr.name == "entered":
        return Truth(True, type=Bool())
    return mapped(expr, _at_first)


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
        self._axioms = self.common(assumed[0], assumed[1])

    def same(self, old: Expr, new: Expr) -> bool:
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
        self, old: Sequence[Expr], new: Sequence[Expr], given: Iterable[Formula] | None = ()
    ) -> Verdict:
        """How `any of old` and `any of new` relate; without axioms if nothing may be given."""
        before, after = self._any(old, 0), self._any(new, 1)
        if before is after:
            return Verdict(True)
        known = [] if given is None else conjuncts([*self._axioms, *given])
        try:
            try:
                things = self._dependencies.of
                return self._verdict(before, after, connected(known, (before, after), things))
            except TooLargeError:
                return self._verdict(before, after, connected(known, (before, after)))
        except (TooLargeError, SolverError) as error:
            return Verdict(False, unknown=str(error))

    def common(self, old: Sequence[Expr], new: Sequence[Expr]) -> tuple[Formula, ...]:
        """The conditions of both versions that are the same formula."""
        before = {self._formula(expr, 0) for expr in old}
        found = {formula for expr in new if (formula := self._formula(expr, 1)) in before}
        return tuple(sorted(found, key=lambda formula: formula.index))

    def _any(self, conditions: Sequence[Expr], side: int) -> Formula:
        return self.make.disjunction(self._formula(c, side) for c in conditions)

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
                table.where_answered(model or ()) if model is not None else 0 for model in models
            )
        unsure = next((atom.text for atom in atoms if atom.is_uncertain), "")
        if unsure and (only_old or only_new):
            raise SolverError(f"proofs do not follow how `{unsure}` changes with the time")
        asked = frozenset(atoms_of((before, after)))
        return Verdict(
            not (only_old or only_new),
            _facts(table, only_old, allowed, asked),
            _facts(table, only_new, allowed, asked),
        )


def _facts(table: Table, faults: int, allowed: int, asked: frozenset[Any]) -> FactTexts:
    if not faults:
        return ()
    found, *_ = describe(table, faults, allowed, asked)
    if not found:
        return (("anything", "true"),)
    return tuple(_readable(fact, answer, found) for fact, answer in found)


def _readable(fact: str, answer: str, found: FactTexts) -> tuple[str, str]:
    """A fact without marks; where both versions ask it with values of their own, it says whose."""
    plain = _plain(fact)
    if sum(_plain(other) == plain for other, _ in found) > 1:
        whose = next((mark.rstrip("'") for mark in _MARKS if mark in fact), "")
        plain += f" ({whose})" if whose else ""
    return plain, answer


def _plain(text: str) -> str:
    for mark in _MARKS:
        text = text.replace(mark, "")
    return text


def _marked(expr: Expr, mark: str) -> Expr:
    """`expr` with the names of lets and constants marked."""
    if isinstance(expr, (LetRef, ConstantRef)):
        return replace(expr, name=mark + expr.name)
    return mapped(expr, lambda part: _marked(part, mark))
