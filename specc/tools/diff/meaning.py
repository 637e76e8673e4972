"""Whether two tables or types mean the same."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from specc.analysis.connections import Connections
from specc.frozen import frozen
from specc.lang.mismatch import substitute
from specc.model.expr import ConstantRef, Expr, LetRef, mapped
from specc.model.system import Subsystem, System
from specc.model.types import (
    Bool,
    Enum,
    ListOf,
    Opaque,
    OptionalOf,
    Record,
    Type,
    Vector,
    inner_types,
)
from specc.proof.formula import Formula, atoms_of
from specc.proof.numbering import Numbering
from specc.proof.relations import conjuncts, related
from specc.proof.table import Table
from specc.proof.translate import Translator
from specc.proof.verdict import Facts, TooLargeError
from specc.proof.witness import describe
from specc.reachable import reachable
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
            book.added("type", name, f"{key} {new[key]}".strip())
        elif key not in new:
            book.removed("type", name, f"{key} {old[key]}".strip())
        else:
            book.changed("type", name, key, old[key], new[key])


def _with_several_meanings(types: Mapping[tuple[str, str], Parts]) -> set[str]:
    first: dict[str, Parts] = {}
    return {name for (_, name), parts in types.items() if first.setdefault(name, parts) != parts}


def _by_user(system: System) -> dict[tuple[str, str], Parts]:
    """The parts of each named type, by what uses it and its name."""
    found: dict[tuple[str, str], Parts] = {}
    for user, types in _users(system):
        for type in sorted(reachable(types, inner_types), key=str):
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


@frozen
class Version:
    """A subsystem in its system."""

    system: System
    subsystem: Subsystem


class Constants:
    """Compares constants of two systems by their normal forms."""

    def __init__(self, old: System, new: System) -> None:
        self._numbering = Numbering(
            {},
            {
                mark + c.name: _marked(c.value, mark)
                for mark, system in zip(_MARKS, (old, new), strict=True)
                for c in system.constants
            },
        )

    def same(self, old: Expr, new: Expr) -> bool:
        """Whether a constant of the old system and one of the new have the same value."""
        numbers = (_marked(expr, mark) for mark, expr in zip(_MARKS, (old, new), strict=True))
        return len({self._numbering.number(expr) for expr in numbers}) == 1


class Meaning:
    """Compares expressions of two versions of one subsystem."""

    def __init__(self, old: Version, new: Version) -> None:
        lets: dict[str, Expr] = {}
        constants: dict[str, Expr] = {}
        for mark, version in zip(_MARKS, (old, new), strict=True):
            own = (*version.system.constants, *version.subsystem.constants)
            constants |= {mark + c.name: _marked(c.value, mark) for c in own}
            lets |= {mark + item.name: _marked(item.value, mark) for item in version.subsystem.lets}
        present = [Connections(v.system).always_present(v.subsystem) for v in (old, new)]
        self._translator = Translator(lets, constants, present[0] & present[1])
        self._numbering = Numbering(lets, constants)
        assumed = [[axiom.that for axiom in v.subsystem.axioms] for v in (old, new)]
        self._axioms = self.common(assumed[0], assumed[1])

    def same_value(self, old: Expr, new: Expr) -> bool:
        """Whether two expressions have the same value; conditions are decided by truth tables."""
        if isinstance(old.type, Bool) and isinstance(new.type, Bool):
            return self.compare([old], [new]).same
        return self._number(old, 0) == self._number(new, 1)

    def compare(
        self, old: Sequence[Expr], new: Sequence[Expr], given: Iterable[Formula] = ()
    ) -> Verdict:
        """How `any of old` and `any of new` relate where `given` and the common axioms hold."""
        before = self._any(old, 0)
        after = self._any(new, 1)
        if before is after:
            return Verdict(True)
        assumed = related(conjuncts([*self._axioms, *given]), (before, after))
        try:
            return _verdict(before, after, assumed)
        except TooLargeError as error:
            return Verdict(False, unknown=str(error))

    def common(self, old: Sequence[Expr], new: Sequence[Expr]) -> tuple[Formula, ...]:
        """The conditions of both versions that are the same formula."""
        before = {self._formula(expr, 0) for expr in old}
        found = {formula for expr in new if (formula := self._formula(expr, 1)) in before}
        return tuple(sorted(found, key=lambda formula: formula.index))

    def same_assumption(self, old: Expr, new: Expr) -> bool:
        """Whether two assumptions say the same, whatever else is assumed."""
        before, after = self._formula(old, 0), self._formula(new, 1)
        try:
            return before is after or _verdict(before, after, ()).same
        except TooLargeError:
            return False

    def excluded(self, condition: Formula) -> Formula:
        """`not condition`."""
        return self._translator.make.negation(condition)

    def _any(self, conditions: Sequence[Expr], version: int) -> Formula:
        return self._translator.make.disjunction(self._formula(c, version) for c in conditions)

    def _formula(self, expr: Expr, version: int) -> Formula:
        return self._translator.formula(_marked(expr, _MARKS[version]))

    def _number(self, expr: Expr, version: int) -> int:
        return self._numbering.number(_marked(expr, _MARKS[version]))


def _verdict(before: Formula, after: Formula, assumed: Sequence[Formula]) -> Verdict:
    table = Table([before, after, *assumed])
    allowed = table.full
    for formula in assumed:
        allowed &= table.bits(formula)
    asked = frozenset(atoms_of((before, after)))
    lost = table.bits(before) & ~table.bits(after) & allowed
    gained = table.bits(after) & ~table.bits(before) & allowed
    only_old = _facts(table, lost, allowed, asked)
    only_new = _facts(table, gained, allowed, asked)
    return Verdict(not (lost or gained), only_old, only_new)


def _facts(table: Table, faults: int, allowed: int, asked: frozenset[Any]) -> Facts:
    if not faults:
        return ()
    found, *_ = describe(table, faults, allowed, asked)
    if not found:
        return (("anything", "true"),)
    return tuple(_readable(fact, answer, found) for fact, answer in found)


def _readable(fact: str, answer: str, found: Facts) -> tuple[str, str]:
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
