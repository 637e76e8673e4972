"""Formulas of requirements, and those that disturbances wait for, that cannot be meant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import combinations, islice

from specc.analysis import Facts
from specc.analysis.facts import initial_state_of
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import in_ms, join_words
from specc.model.expr import BoundVariable, ConstantRef, Expr, MemoryRef, Truth, children, walk
from specc.model.requirement import (
    BoolOp,
    Requirement,
    Stays,
    Temporal,
    TemporalFormula,
    TickCondition,
    expressions_in,
    is_timeless,
    span_of,
)
from specc.model.types import Bool
from specc.source import Place

MOST_PARTS = 200
"""Most parts of one formula that are examined; a longer one is skipped."""
_MOST_PAIRS = 200
"""Pairs of requirements that are compared by proofs; those that are written alike are all found."""


def _formulas(facts: Facts) -> tuple[Requirement, ...]:
    """Those that are examined: not those of scenarios in which constants have other values."""
    others = {id(f) for each in facts.system.scenarios if each.settings for f in each.formulas}
    formulas = (f for f in facts.system.formulas if id(f) not in others)
    return tuple(f for f in formulas if _size(f.formula) <= MOST_PARTS)


def _size(formula: TemporalFormula) -> int:
    return 1 + sum(map(_size, getattr(formula, "operands", ())))


def _place(of: Requirement, part: TemporalFormula | Expr) -> Place:
    span = span_of(part) if isinstance(part, TemporalFormula) else part.span
    return of.place.within(*span)


# Every part of a formula holds at some tick and fails at another.


def formulas_vary(facts: Facts) -> Iterator[Diagnostic]:
    """W0613 and W0617; what is about constants or literals alone is taken as intended."""
    for item in _formulas(facts):
        if not item.readings:
            parts = (node for part in expressions_in(item.formula) for node in walk(part))
            if not any(isinstance(node, ConstantRef) for node in parts):
                yield Diagnostic(
                    "W0613",
                    f"`{item.that}` says the same of every run",
                    item.place,
                    help="name a value of an agent or of the plant, or delete it",
                )
            continue
        found = _in_all_copies(item, list(_ConstantParts(item, facts).find(item.formula)))
        yield from found or _first_tick_findings(item, facts)


def _in_all_copies(item: Requirement, found: list[Diagnostic]) -> list[Diagnostic]:
    """Those that occur in all copies of a text that is instantiated for the members of a group."""
    if not found:
        return []
    copies = Counter(_place(item, part) for part in _parts(item.formula))
    alike = Counter(each.primary for each in found)
    in_all = (each for each in found if alike[each.primary] >= copies[each.primary])
    return [
        each
        for each in dict.fromkeys(in_all)
        if item.text[each.primary.start : each.primary.end] not in item.names
    ]


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


class _ConstantParts:
    """Finds the innermost parts of one formula that always or never hold."""

    def __init__(self, item: Requirement, facts: Facts) -> None:
        self._item = item
        self._ticks = facts.ticks
        self._suspicious = facts.suspicious

    def find(self, formula: TemporalFormula) -> Iterator[Diagnostic]:
        """Constant parts inside a formula, or else the formula itself."""
        if isinstance(formula, TickCondition):
            yield from self._of_condition(formula.that)
            return
        found = [each for operand in formula.operands for each in self.find(operand)]
        yield from found or self._of_formula(formula)

    def _of_condition(self, expr: Expr) -> Iterator[Diagnostic]:
        found = [each for child in children(expr) for each in self._of_condition(child)]
        if found or not isinstance(expr.type, Bool):
            yield from found
        elif not self._suspicious.is_in(expr):
            yield from self._of_formula(TickCondition(expr))

    def _of_formula(self, formula: TemporalFormula) -> Iterator[Diagnostic]:
        nodes = [node for part in expressions_in(formula) for node in walk(part)]
        is_intended = any(isinstance(node, Truth) for node in nodes)
        is_suspicious = any(map(self._suspicious.is_in, expressions_in(formula)))
        varies = any(isinstance(node, BoundVariable | MemoryRef) for node in nodes)
        if is_intended or is_suspicious or not varies:
            return
        item, ticks, place = self._item, self._ticks, _place(self._item, formula)
        at_tick, text = ticks.formula_at(formula), item.part(formula)
        if not ticks.is_possible(at_tick):
            label, help = "", "correct it, or leave out what it decides"
            if any(each == formula for each in _premises(item.formula)):
                label = "so nothing is ever asked of a run"
                help = "correct what is asked before `implies`, or delete the requirement"
            code = "W0613" if formula == item.formula else "W0617"
            yield Diagnostic(code, f"`{text}` never holds", place, label, help=help)
        elif ticks.follows(at_tick):
            code = "W0613" if formula == item.formula else "W0617"
            help = "correct it, or leave it out"
            yield Diagnostic(code, f"`{text}` always holds", place, help=help)
        elif isinstance(formula, BoolOp) and (premise := formula.premise) is not None:
            conclusion, before = formula.operands[1], item.part(premise)
            if not ticks.is_possible(ticks.formula_at(premise), ticks.formula_at(conclusion)):
                message = f"`{item.part(conclusion)}` never holds where `{before}` does"
                help = f"correct it, or require `not ({before})`"
                yield Diagnostic("W0617", message, _place(item, conclusion), help=help)
        elif isinstance(formula, BoolOp):
            yield from self._redundant(formula)

    def _redundant(self, formula: BoolOp) -> Iterator[Diagnostic]:
        """A redundant operand: it is implied by the rest, or implies it."""
        operands, ticks = formula.operands, self._ticks
        at_tick = [ticks.formula_at(operand) for operand in operands]
        spans = {span_of(operand) for operand in operands}
        if len(operands) > 1 and len(spans) == 1:  # written out for the members of a group
            if len(set(at_tick)) == 1:
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
            others = [each for i, each in enumerate(at_tick) if i != index and each is not None]
            if formula.op == "and":
                is_redundant = ticks.follows(at_tick[index], *others)
            else:
                is_redundant = ticks.follows(ticks.make.disjunction(others), at_tick[index])
            if is_redundant:
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


def _first_tick_findings(item: Requirement, facts: Facts) -> Iterator[Diagnostic]:
    """Yield W0336 for a requirement without `always` that the initial states decide.

    Also for one of which a part concerns the first tick only.
    """
    if item.holds_always or item not in facts.system.requirements:
        return
    ticks = facts.ticks
    initial_conditions = [
        known for r in item.readings if (known := initial_state_of(r, facts.system))
    ]
    initial_formulas = [ticks.formula_at(known) for known in initial_conditions]
    at_tick, help = ticks.formula_at(item.formula), "write `always(...)` around it, or correct it"
    if ticks.follows(at_tick, *initial_formulas):
        message = "this holds at the first tick already, so nothing is asked of a run"
    elif not ticks.is_possible(at_tick, *initial_formulas):
        message = "this cannot hold at the first tick, and without `always` it is asked there"
    elif (early := _part_about_first_tick(item.formula)) is not None:
        words = f"`{item.part(early)}` is asked at the first tick alone"
        help = "write `always(...)` around the whole, or say within what time"
        yield Diagnostic("W0336", words, _place(item, early), help=help)
        return
    else:
        return
    yield Diagnostic("W0336", message, item.place, help=help)


def _part_about_first_tick(formula: TemporalFormula) -> TemporalFormula | None:
    """A part that is about the first tick only."""
    if isinstance(formula, TickCondition) or is_timeless(formula):
        return formula
    if isinstance(formula, Temporal):
        return formula if formula.op in ("once", "historically", "since") else None
    found = map(_part_about_first_tick, formula.operands)
    return next((part for part in found if part is not None), None)


# A name stands for more than another one.


def lets_are_not_aliases(facts: Facts) -> Iterator[Diagnostic]:
    """W0336, for a let of formulas that only renames a constant or another let."""
    for let in facts.system.formula_lets:
        other = let.value.name if isinstance(let.value, ConstantRef) else ""
        if let.formula and let.formula.that in let.names:
            other = let.formula.that
        if other:
            message = f"`{let.name}` is only another name for `{other}`"
            yield Diagnostic("W0336", message, let.place, help="use that name, or say more")


# Windows reach over ticks at which something can change.


def windows_reach(facts: Facts) -> Iterator[Diagnostic]:
    """W0336, for temporal operators whose span is shorter than a tick, or that could be one."""
    periods = {s.qualified_name: 1 / s.rate_hz for s in facts.rates.timed}
    if not periods or facts.broken:
        return
    for item in _formulas(facts):
        owners = {r.name: r.subsystem for r in item.readings}
        for part in _parts(item.formula):
            if not isinstance(part, Temporal | Stays) or item.is_named(part):
                continue
            op = "stays" if isinstance(part, Stays) else part.op
            if op == "since" or part.span is None:
                continue
            tick, span = facts.rates.tick_s, in_ms(part.span_s) if part.span_s else "no time"
            if part.span_s < tick:
                message = f"`{op}` reaches over {span}, less than one tick of {in_ms(tick)}"
                help = "write a longer time, or leave the operator out"
                yield Diagnostic("W0336", message, _place(item, part.span), help=help)
            if part.span_s < tick or isinstance(part, Stays):
                continue
            (operand,) = part.operands
            if isinstance(operand, Temporal) and operand.op == part.op:
                total = float(part.span_s + operand.span_s)
                inner = item.part(operand.operands[0])
                message = f"`{part.op}` of `{operand.op}` is one that reaches over both times"
                help = f"write `{part.op}({total:g}[s], {inner})`, or correct it"
                yield Diagnostic("W0336", message, _place(item, part), help=help)
            elif part.op == "within":
                nodes = (node for each in expressions_in(operand) for node in walk(each))
                named = dict.fromkeys(owners.get(n.name) for n in nodes if isinstance(n, MemoryRef))
                known = [periods[owner] for owner in named if owner in periods]
                if known and len(known) == len(named) and part.span_s < min(known):
                    names = join_words([f"`{owner}`" for owner in named], "and")
                    verb = "is" if len(named) == 1 else "are"
                    message = f"nothing of it may change within {span}"
                    label = f"{names} {verb} stepped every {in_ms(min(known))}"
                    help = "allow one period at least"
                    yield Diagnostic("W0336", message, _place(item, part.span), label, help=help)


# No two requirements are the same, or exclude each other.


def requirements_differ(facts: Facts) -> Iterator[Diagnostic]:
    """W0337, of requirements that are not constant."""
    ticks, rest = facts.ticks, list[Requirement]()
    pairs, first = list[tuple[Requirement, Requirement]](), dict[object, Requirement]()
    for item in facts.system.requirements:
        if not item.readings or _size(item.formula) > MOST_PARTS:
            continue
        at_tick = ticks.formula_at(item.formula)
        if ticks.is_possible(at_tick) and not ticks.follows(at_tick):
            earlier = first.setdefault((item.holds_always, at_tick), item)
            if earlier is item:
                rest.append(item)
            else:
                pairs.append((earlier, item))
    # Those that are asked at the same ticks, of the same values in part.
    names = {id(each): {r.name for r in each.readings} for each in rest}
    alike = (
        (one, other)
        for one, other in combinations(rest, 2)
        if one.holds_always == other.holds_always
        and not names[id(one)].isdisjoint(names[id(other)])
    )
    for one, other in (*pairs, *islice(alike, _MOST_PAIRS)):
        mine, theirs = ticks.formula_at(one.formula), ticks.formula_at(other.formula)
        related = (Related(one.place, "the other one"),)
        if ticks.follows(mine, theirs) and ticks.follows(theirs, mine):
            message = "this requirement says the same as another one"
            help = "delete one of the two, or correct it"
        elif not ticks.is_possible(mine, theirs):
            message = "no run meets this requirement and another one"
            help = "correct one of the two"
        else:
            continue
        yield Diagnostic("W0337", message, other.place, related=related, help=help)
