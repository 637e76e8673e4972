"""Formulas of requirements, and those that disturbances wait for, that cannot be meant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations, islice

from specc.analysis import Facts
from specc.analysis.facts import initial_state_of
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import in_ms, join_words
from specc.model.expr import BoundVariable, ConstantRef, Expr, MemoryRef, Truth, children, walk
from specc.model.requirement import (
    BoolOp,
    Requirement,
    Temporal,
    TemporalFormula,
    TickCondition,
    expressions,
    is_timeless,
    span_of,
)
from specc.model.types import Bool
from specc.proof import Ticks
from specc.source import Place

MOST_PARTS = 200
"""Most parts of one formula that are examined; a longer one is skipped."""
_MOST_PAIRS = 200
"""Pairs of requirements that are compared by proofs; those that are written alike are all found."""


def _formulas(facts: Facts) -> tuple[Requirement, ...]:
    return tuple(f for f in facts.system.formulas if _size(f.formula) <= MOST_PARTS)


def _size(formula: TemporalFormula) -> int:
    return 1 + sum(map(_size, getattr(formula, "operands", ())))


def _place(of: Requirement, part: TemporalFormula | Expr) -> Place:
    span = span_of(part) if isinstance(part, TickCondition | BoolOp | Temporal) else part.span
    return of.place.within(*span)


# Every part of a formula holds at some tick and fails at another.


def formulas_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0613 and W0617; what is about constants or literals alone is taken as intended."""
    for item in _formulas(facts):
        if not item.readings:
            parts = (node for part in expressions(item.formula) for node in walk(part))
            if not any(isinstance(node, ConstantRef) for node in parts):
                yield Diagnostic(
                    "W0613",
                    f"`{item.that}` says the same of every run",
                    item.place,
                    help="name a value of an agent or of the plant, or delete it",
                )
            continue
        found = _in_all_copies(item, list(_Constant(item, facts).parts(item.formula)))
        yield from found or _at_the_beginning(item, facts)


def _in_all_copies(item: Requirement, found: list[Diagnostic]) -> list[Diagnostic]:
    """Those that are there in all copies of what is written once, for the members of a group."""
    if not found:
        return []
    copies = Counter(_place(item, part) for part in _parts(item.formula))
    alike = Counter(each.primary for each in found)
    kept = (each for each in found if alike[each.primary] >= copies[each.primary])
    return [each for each in dict.fromkeys(kept) if not _is_elsewhere(item, each.primary)]


def _is_elsewhere(item: Requirement, place: Place) -> bool:
    """Whether what is found there is that of a name, which is told where it is defined."""
    return item.text[place.start : place.end] in item.names


def _parts(formula: TemporalFormula) -> Iterator[TemporalFormula | Expr]:
    """A formula and the formulas and conditions in it, as they are written."""
    if isinstance(formula, TickCondition):
        yield from (node for node in walk(formula.that) if isinstance(node.type, Bool))
        return
    yield formula
    operands = formula.operands
    if isinstance(formula, BoolOp) and formula.premise is not None:
        operands = formula.premise, operands[1]
    for operand in operands:
        yield from _parts(operand)


class _Constant:
    """Finds the innermost parts of one formula that always or never hold."""

    def __init__(self, item: Requirement, facts: Facts) -> None:
        self._item = item
        self._ticks = facts.ticks
        self._misfits = facts.suspicious

    def parts(self, formula: TemporalFormula) -> Iterator[Diagnostic]:
        """What is found in a formula, or else of it."""
        if isinstance(formula, TickCondition):
            yield from self._of_condition(formula.that)
            return
        found = [told for operand in formula.operands for told in self.parts(operand)]
        yield from found or self._whole(formula)

    def _of_condition(self, expr: Expr) -> Iterator[Diagnostic]:
        found = [told for child in children(expr) for told in self._of_condition(child)]
        if found or not isinstance(expr.type, Bool):
            yield from found
        elif not self._misfits.is_in(expr):
            yield from self._whole(TickCondition(expr))

    def _whole(self, formula: TemporalFormula) -> Iterator[Diagnostic]:
        nodes = [node for part in expressions(formula) for node in walk(part)]
        meant = any(isinstance(node, Truth) for node in nodes)
        spoilt = any(map(self._misfits.is_in, expressions(formula)))
        varies = any(isinstance(node, BoundVariable | MemoryRef) for node in nodes)
        if meant or spoilt or not varies:
            return
        asked = self._ticks.formula_at(formula)
        never = not self._ticks.is_possible(asked)
        if never or self._ticks.follows(asked):
            yield self._told(formula, "never" if never else "always")
        elif isinstance(formula, BoolOp) and formula.premise is not None:
            yield from self._conclusion(formula, formula.premise)
        elif isinstance(formula, BoolOp):
            yield from self._needless(formula)

    def _told(self, formula: TemporalFormula, word: str) -> Diagnostic:
        item, root = self._item, formula == self._item.formula
        never_asked = word == "never" and any(each == formula for each in _premises(item.formula))
        help = "correct it, or leave it out"
        if never_asked:
            help = "correct what is asked before `implies`, or delete the requirement"
        elif word == "never":
            help = "correct it, or leave out what it decides"
        label = "so nothing is ever asked of a run" if never_asked else ""
        text = item.part(formula)
        return Diagnostic(
            "W0613" if root else "W0617",
            f"`{text}` {word} holds",
            _place(item, formula),
            label,
            help=help,
        )

    def _conclusion(self, formula: BoolOp, premise: TemporalFormula) -> Iterator[Diagnostic]:
        """A conclusion that excludes its premise says only that this never holds."""
        conclusion, ticks = formula.operands[1], self._ticks
        if not ticks.is_possible(ticks.formula_at(premise), ticks.formula_at(conclusion)):
            before = self._item.part(premise)
            yield Diagnostic(
                "W0617",
                f"`{self._item.part(conclusion)}` never holds where `{before}` does",
                _place(self._item, conclusion),
                help=f"correct it, or require `not ({before})`",
            )

    def _needless(self, formula: BoolOp) -> Iterator[Diagnostic]:
        """An operand that follows from the others, or from which they follow."""
        operands, ticks = formula.operands, self._ticks
        asked = [ticks.formula_at(operand) for operand in operands]
        spans = {span_of(operand) for operand in operands}
        if len(operands) > 1 and len(spans) == 1:  # written out for the members of a group
            if len(set(asked)) == 1:
                yield Diagnostic(
                    "W0336",
                    f"`{self._item.part(operands[0])}` says the same of each of {len(operands)}",
                    _place(self._item, operands[0]),
                    help="name the variable in it, or leave the quantifier out",
                )
            return
        if not 2 <= len(operands) <= 8 or len(spans) < len(operands):
            return
        for index in reversed(range(len(operands))):
            others = [each for i, each in enumerate(asked) if i != index and each is not None]
            if formula.op == "and":
                needless = ticks.follows(asked[index], *others)
            else:
                needless = ticks.follows(ticks.make.disjunction(others), asked[index])
            if needless:
                yield Diagnostic(
                    "W0617",
                    f"`{self._item.part(operands[index])}` adds nothing to the rest of "
                    f"`{self._item.part(formula)}`",
                    _place(self._item, operands[index]),
                    help="correct it, or leave it out",
                )
                return


def _premises(formula: TemporalFormula) -> Iterator[TemporalFormula]:
    if isinstance(formula, BoolOp) and formula.premise is not None:
        yield formula.premise
        yield from _premises(formula.operands[1])
        return
    for operand in getattr(formula, "operands", ()):
        yield from _premises(operand)


# What is asked of the first tick alone is open there.


def _at_the_beginning(item: Requirement, facts: Facts) -> Iterator[Diagnostic]:
    """W0336, about formulas without `always`: what the first states say of them."""
    if item.lasts or item not in facts.system.requirements:
        return
    ticks = facts.ticks
    begun = [known for r in item.readings if (known := initial_state_of(r, facts.system))]
    first = [ticks.formula_at(known) for known in begun]
    asked, help = ticks.formula_at(item.formula), "write `always(...)` around it, or correct it"
    if ticks.follows(asked, *first):
        message = "this holds at the first tick already, so nothing is asked of a run"
    elif not ticks.is_possible(asked, *first):
        message = "this cannot hold at the first tick, and without `always` it is asked there"
    elif (early := _of_first_tick(item.formula)) is not None:
        said = f"`{item.part(early)}` is asked at the first tick alone"
        help = "write `always(...)` around the whole, or say within what time"
        yield Diagnostic("W0336", said, _place(item, early), help=help)
        return
    else:
        return
    yield Diagnostic("W0336", message, item.place, help=help)


def _of_first_tick(formula: TemporalFormula) -> TemporalFormula | None:
    """A part that is about the first tick only."""
    if isinstance(formula, TickCondition) or is_timeless(formula):
        return formula
    if isinstance(formula, Temporal):
        return formula if formula.op in ("once", "historically", "since") else None
    found = map(_of_first_tick, formula.operands)
    return next((part for part in found if part is not None), None)


# A name stands for more than another one.


def names_say_more(facts: Facts) -> Iterator[Diagnostic]:
    """W0336."""
    for let in facts.system.formula_lets:
        other = let.value.name if isinstance(let.value, ConstantRef) else ""
        if let.formula and let.formula.that in let.names:
            other = let.formula.that
        if other:
            message = f"`{let.name}` is only another name for `{other}`"
            yield Diagnostic("W0336", message, let.place, help="use that name, or say more")


# Windows reach over ticks at which something can change.


def windows_reach(facts: Facts) -> Iterator[Diagnostic]:
    """W0336."""
    periods = {s.qualified_name: 1 / s.rate_hz for s in facts.rates.timed}
    if not periods or facts.broken:
        return
    for item in _formulas(facts):
        owners = {r.name: r.subsystem for r in item.readings}
        for part in _parts(item.formula):
            if isinstance(part, Temporal) and not item.is_named(part):
                yield from _window(item, part, facts.rates.tick_s, periods, owners)


def _window(
    item: Requirement,
    part: Temporal,
    tick: Fraction,
    periods: dict[str, Fraction],
    owners: dict[str, str],
) -> Iterator[Diagnostic]:
    if part.op == "since" or part.span is None:
        return
    (operand,) = part.operands
    if part.span_s < tick:
        message = (
            f"`{part.op}` reaches over {_time(part.span_s)}, less than one tick of {in_ms(tick)}"
        )
        help = "write a longer time, or leave the operator out"
        yield Diagnostic("W0336", message, _place(item, part.span), help=help)
    elif isinstance(operand, Temporal) and operand.op == part.op:
        total = float(part.span_s + operand.span_s)
        inner = item.part(operand.operands[0])
        message = f"`{part.op}` of `{operand.op}` is one that reaches over both times"
        help = f"write `{part.op}({total:g}[s], {inner})`, or correct it"
        yield Diagnostic("W0336", message, _place(item, part), help=help)
    elif part.op == "within":
        nodes = (node for each in expressions(operand) for node in walk(each))
        named = dict.fromkeys(owners.get(n.name) for n in nodes if isinstance(n, MemoryRef))
        stepped = [periods.get(owner or "") for owner in named]
        known = [period for period in stepped if period is not None]
        if known and len(known) == len(stepped) and part.span_s < min(known):
            names = join_words([f"`{owner}`" for owner in named], "and")
            message = f"nothing of it may change within {_time(part.span_s)}"
            label = (
                f"{names} {'is' if len(named) == 1 else 'are'} stepped every {in_ms(min(known))}"
            )
            help = "allow one period at least"
            yield Diagnostic("W0336", message, _place(item, part.span), label, help=help)


def _time(span_s: Fraction) -> str:
    return in_ms(span_s) if span_s else "no time"


# No two requirements are the same, or exclude each other.


def requirements_differ(facts: Facts) -> Iterator[Diagnostic]:
    """W0337."""
    ticks = facts.ticks
    required = [r for r in facts.system.requirements if _size(r.formula) <= MOST_PARTS]
    varied = [r for r in required if r.readings and _varies(ticks, r)]
    same = {id(other): (one, other) for one, other in _the_same(ticks, varied)}
    rest = [item for item in varied if id(item) not in same]
    for one, other in (*same.values(), *islice(_alike(rest), _MOST_PAIRS)):
        first, second = ticks.formula_at(one.formula), ticks.formula_at(other.formula)
        related = (Related(one.place, "the other one"),)
        if ticks.follows(first, second) and ticks.follows(second, first):
            message = "this requirement says the same as another one"
            help = "delete one of the two, or correct it"
        elif not ticks.is_possible(first, second):
            message = "no run meets this requirement and another one"
            help = "correct one of the two"
        else:
            continue
        yield Diagnostic("W0337", message, other.place, related=related, help=help)


def _the_same(
    ticks: Ticks, required: Sequence[Requirement]
) -> Iterator[tuple[Requirement, Requirement]]:
    first: dict[object, Requirement] = {}
    for item in required:
        earlier = first.setdefault((item.lasts, ticks.formula_at(item.formula)), item)
        if earlier is not item:
            yield earlier, item


def _varies(ticks: Ticks, item: Requirement) -> bool:
    asked = ticks.formula_at(item.formula)
    return ticks.is_possible(asked) and not ticks.follows(asked)


def _alike(required: Sequence[Requirement]) -> Iterator[tuple[Requirement, Requirement]]:
    """Pairs that are asked at the same ticks, of the same values in part."""
    names = {id(each): {r.name for r in each.readings} for each in required}
    for one, other in combinations(required, 2):
        if one.lasts == other.lasts and not names[id(one)].isdisjoint(names[id(other)]):
            yield one, other
