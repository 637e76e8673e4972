"""Differences between two state machines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from specc.lang import show
from specc.model.fsm import Assignment, Behaviour, Condition, Transition
from specc.model.system import Subsystem
from specc.proof.formula import Formula
from specc.reachable import grouped
from specc.tools.diff.meaning import Equivalence
from specc.tools.diff.record import Book, Compared, Pairs, paired
from specc.tools.diff.values import unassigned

# Changes of a transition table, and of what is assumed of a subsystem.


Named = TypeVar("Named", Condition, Behaviour)


def compare_rows(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """Rows of one state, cause and target are one arc: any of their conditions leads there."""
    both = book.matched("row", _arcs(old), _arcs(new), lambda rows: _arc_name(rows[0]), _names)
    for arc, before, after in both:
        arc.remark("trace", _traces(before), _traces(after))
        if {r.condition.name for r in before} == {r.condition.name for r in after}:
            # A condition of one name in both is compared where it is declared.
            if len(before) != len(after):
                arc.changed("number", len(before), len(after))
            continue
        given = _given(old, new, before[0], meaning)
        verdict = meaning.asked.compare(
            [r.condition.when for r in before], [r.condition.when for r in after], given
        )
        arc.verdict(verdict, (_names(before), _names(after)), "condition")


def _given(old: Subsystem, new: Subsystem, row: Transition, meaning: Equivalence) -> list[Formula]:
    """When the cause occurs, as far as both versions agree on it; the error has priority (2.4)."""
    before, after = (s.state(row.source).behaviour for s in (old, new))
    error = meaning.asked.common([before.error.when], [after.error.when])
    if row.cause == "error":
        return list(error)
    terminal = meaning.asked.common([before.terminal.when], [after.terminal.when])
    return [*terminal, *(meaning.asked.make.negation(formula) for formula in error)]


def _arcs(subsystem: Subsystem) -> Iterable[Sequence[Transition]]:
    rows = subsystem.transitions
    return grouped(((row.source, row.cause, row.target), row) for row in rows).values()


def _arc_name(row: Transition) -> str:
    return f"{row.source} --{row.cause}--> {row.target}"


def _traces(rows: Sequence[Transition]) -> str:
    return ", ".join(sorted(str(row.trace) for row in rows if row.trace))


def _names(rows: Sequence[Transition]) -> str:
    return " or ".join(sorted({row.condition.name for row in rows}))


def compare_axioms(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """Assumptions have no names; those that say the same are the same."""
    left = list(new.axioms)
    for before in old.axioms:
        again = next((a for a in left if meaning.same_assumption(before.that, a.that)), None)
        if again is None:
            text, note = show(before.that), "runs are no longer checked for it"
            book.alone("removed", "assumption", "", text, guarantee="weaker", note=note)
            continue
        left.remove(again)
        assumption = book.both("assumption", show(again.that))
        assumption.remark("text", show(before.that), show(again.that))
        assumption.remark("reason", before.because, again.because)
    for after in left:
        note = "proofs rest on it from now on"
        book.alone("added", "assumption", "", show(after.that), guarantee="weaker", note=note)


# Changes of a subsystem's conditions, behaviours and states.


def compare_conditions(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """A condition matters where it is used; only adding or removing it changes nothing."""
    pairs = paired(old.conditions, new.conditions, lambda c: f"{c.kind} condition {c.name}")
    for before, after in pairs.both.values():
        verdict = meaning.asked.compare([before.when], [after.when])
        texts = show(before.when), show(after.when)
        condition = book.both(f"{before.kind} condition", before.name)
        condition.verdict(verdict, texts, "meaning")
        condition.rest(before, after)

    def same(old: Condition, new: Condition) -> bool:
        return old.kind == new.kind and meaning.asked.compare([old.when], [new.when]).same

    _renamed(pairs, same, lambda c: f"{c.kind} condition", lambda c: show(c.when), book, False)


def _renamed(
    pairs: Pairs[Named],
    same: Callable[[Named, Named], bool],
    part: Callable[[Named], str],
    text: Callable[[Named], str],
    book: Book,
    semantic: bool,
) -> None:
    """What only one version has; if it is the same as a thing of the other, only its name is new.

    Anything else is a change of meaning if it is `semantic`.
    """
    left = dict(pairs.added)
    for before in pairs.removed.values():
        again = next((key for key, after in left.items() if same(before, after)), None)
        if again is None:
            book.alone("removed", part(before), before.name, text(before), semantic=semantic)
        else:
            renamed = book.both(part(before), before.name)
            renamed.remark("name", before.name, left.pop(again).name)
    for after in left.values():
        book.alone("added", part(after), after.name, text(after), semantic=semantic)


def compare_behaviours(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """A behaviour that has only another name is the same."""
    pairs = paired(old.behaviours, new.behaviours, lambda b: b.name)
    for name, (before, after) in pairs.both.items():
        behaviour = book.both("behaviour", name)
        _ends(behaviour, before, after, meaning)
        _effects(behaviour, before, after, meaning)
        behaviour.rest(before, after, "is_complete")

    def same(old: Behaviour, new: Behaviour) -> bool:
        return same_behaviour(old, new, meaning)

    _renamed(pairs, same, lambda _: "behaviour", _text, book, True)


def _ends(behaviour: Compared, old: Behaviour, new: Behaviour, meaning: Equivalence) -> None:
    """A condition of one name in both is compared where it is declared."""
    for cause, before, after in (
        ("terminal", old.terminal, new.terminal),
        ("error", old.error, new.error),
    ):
        if before.name != after.name:
            verdict = meaning.asked.compare([before.when], [after.when])
            texts = before.name, after.name
            behaviour.verdict(verdict, texts, f"{cause} condition")


def _effects(behaviour: Compared, old: Behaviour, new: Behaviour, meaning: Equivalence) -> None:
    """What a behaviour assigns, whichever functions do it."""
    pairs = paired(_effects_of(old), _effects_of(new), lambda effect: effect[1].target)
    declared = {f.name for f in old.functions} & {f.name for f in new.functions}
    removed, added = (
        [assignment for function, assignment in alone.values() if function not in declared]
        for alone in (pairs.removed, pairs.added)
    )
    unassigned(behaviour, removed, added)
    for target, (before, after) in pairs.both.items():
        in_one_function = before[0] == after[0]
        if not in_one_function and not meaning.same_value(before[1].value, after[1].value):
            behaviour.changed(target, show(before[1].value), show(after[1].value))


def _effects_of(behaviour: Behaviour) -> list[tuple[str, Assignment]]:
    return [(f.name, a) for f in behaviour.functions for a in f.assignments]


def same_behaviour(old: Behaviour, new: Behaviour, meaning: Equivalence) -> bool:
    """Whether two behaviours do the same and end alike, whatever they are called."""
    before = {a.target: a.value for a in old.assignments}
    after = {a.target: a.value for a in new.assignments}
    return (
        before.keys() == after.keys()
        and meaning.asked.compare([old.terminal.when], [new.terminal.when]).same
        and meaning.asked.compare([old.error.when], [new.error.when]).same
        and all(meaning.same_value(before[t], after[t]) for t in before)
    )


def _text(behaviour: Behaviour) -> str:
    functions = ", ".join(sorted(f.name for f in behaviour.functions)) or "no functions"
    ends = f"terminal {behaviour.terminal.name}, error {behaviour.error.name}"
    return f"{functions}; {ends}"


def _named(side: str, elements: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{side}.{peer}.{name}" for peer, name in sorted(elements)) or "none"


def compare_states(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """States are known by their names, which step records carry."""
    both = book.matched(
        "state", old.states, new.states, lambda s: s.name, lambda s: s.behaviour.name
    )
    for state, before, after in both:
        names = before.behaviour.name, after.behaviour.name
        same = names[0] != names[1] and same_behaviour(before.behaviour, after.behaviour, meaning)
        state.changed("behaviour", *names, semantic=not same)
        for aspect, side, earlier, later in (
            ("ignored events", "x", before.ignores, after.ignores),
            ("held outputs", "y", before.holds, after.holds),
        ):
            texts = _named(side, earlier), _named(side, later)
            less, more = set(later) - set(earlier), set(earlier) - set(later)
            state.guarded(aspect, texts, bool(less), bool(more))
        state.rest(before, after, "ignores", "holds")
    book.both("initial state", "").changed("", old.initial_state, new.initial_state)
