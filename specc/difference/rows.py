"""Changes of a transition table, and of what is assumed of a subsystem."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from specc.difference.meaning import Meaning
from specc.difference.record import Book, paired
from specc.expr import show
from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.proof.formula import Formula

Arc = tuple[str, Cause, str]


def compare_rows(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """Rows of one state, cause and target are one arc: any of their conditions leads there."""
    pairs = paired(_arcs(old), _arcs(new), lambda rows: _arc_name(rows[0]))
    for name, rows in pairs.removed.items():
        book.removed("row", name, _names(rows))
    for name, rows in pairs.added.items():
        book.added("row", name, _names(rows))
    for name, (before, after) in pairs.both.items():
        book.remark("row", name, "trace", _traces(before), _traces(after))
        if {r.condition.name for r in before} == {r.condition.name for r in after}:
            # A condition of one name in both is compared where it is declared.
            if len(before) != len(after):
                book.changed("row", name, "number", len(before), len(after))
            continue
        given = _given(old, new, before[0], meaning)
        verdict = meaning.compare(
            [r.condition.when for r in before], [r.condition.when for r in after], given
        )
        book.verdict("row", name, verdict, (_names(before), _names(after)), "condition")


def _given(old: Subsystem, new: Subsystem, row: Transition, meaning: Meaning) -> list[Formula]:
    """When the cause occurs, as far as both versions agree on it; the error has priority (2.4)."""
    before, after = (s.state(row.source).behaviour for s in (old, new))
    error = meaning.common([before.error.when], [after.error.when])
    if row.cause == "error":
        return list(error)
    terminal = meaning.common([before.terminal.when], [after.terminal.when])
    return [*terminal, *(meaning.excluded(formula) for formula in error)]


def _arcs(subsystem: Subsystem) -> Iterable[tuple[Transition, ...]]:
    found: dict[Arc, tuple[Transition, ...]] = {}
    for row in subsystem.transitions:
        key = row.source, row.cause, row.target
        found[key] = (*found.get(key, ()), row)
    return found.values()


def _arc_name(row: Transition) -> str:
    return f"{row.source} --{row.cause}--> {row.target}"


def _traces(rows: Sequence[Transition]) -> str:
    return ", ".join(sorted(str(row.trace) for row in rows if row.trace))


def _names(rows: Sequence[Transition]) -> str:
    return " or ".join(sorted({row.condition.name for row in rows}))


def compare_axioms(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """Assumptions have no names; those that say the same are the same."""
    left = list(new.axioms)
    for before in old.axioms:
        again = next((a for a in left if meaning.same_assumption(before.that, a.that)), None)
        if again is None:
            book.removed("assumption", "", show(before.that))
            continue
        left.remove(again)
        name = show(again.that)
        book.remark("assumption", name, "text", show(before.that), name)
        book.remark("assumption", name, "reason", before.because, again.because)
    for after in left:
        book.added("assumption", "", show(after.that))
