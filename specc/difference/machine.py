"""Changes of a subsystem's conditions, behaviours and states."""

from __future__ import annotations

from specc.difference.meaning import Meaning
from specc.difference.record import Book, paired
from specc.expr import show
from specc.model.fsm import Assignment, Behaviour
from specc.model.system import Subsystem


def compare_conditions(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """A condition matters where it is used, so one that comes or goes alone changes nothing."""
    pairs = paired(old.conditions, new.conditions, lambda c: f"{c.kind} condition {c.name}")
    for before, after in pairs.both.values():
        verdict = meaning.compare([before.when], [after.when])
        texts = show(before.when), show(after.when)
        book.verdict(f"{before.kind} condition", before.name, verdict, texts, "meaning")
        book.words(f"{before.kind} condition", before.name, before, after)
    left = dict(pairs.added)
    for before in pairs.removed.values():
        part = f"{before.kind} condition"
        again = [
            (key, c)
            for key, c in left.items()
            if c.kind == before.kind and meaning.compare([before.when], [c.when]).same
        ]
        if again:
            book.remark(part, before.name, "name", before.name, again[0][1].name)
            del left[again[0][0]]
        else:
            book.removed(part, before.name, show(before.when), semantic=False)
    for after in left.values():
        book.added(f"{after.kind} condition", after.name, show(after.when), semantic=False)


def compare_behaviours(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """A behaviour that has only another name is the same."""
    pairs = paired(old.behaviours, new.behaviours, lambda b: b.name)
    for name, (before, after) in pairs.both.items():
        _ends(name, before, after, meaning, book)
        _effects(name, before, after, meaning, book)
        book.words("behaviour", name, before, after)
    left = dict(pairs.added)
    for before in pairs.removed.values():
        again = next((b for b in left.values() if same_behaviour(before, b, meaning)), None)
        if again is None:
            book.removed("behaviour", before.name, _text(before))
        else:
            book.remark("behaviour", before.name, "name", before.name, again.name)
            del left[again.name]
    for after in left.values():
        book.added("behaviour", after.name, _text(after))


def _ends(name: str, old: Behaviour, new: Behaviour, meaning: Meaning, book: Book) -> None:
    """A condition of one name in both is compared where it is declared."""
    for cause, before, after in (
        ("terminal", old.terminal, new.terminal),
        ("error", old.error, new.error),
    ):
        if before.name != after.name:
            verdict = meaning.compare([before.when], [after.when])
            texts = before.name, after.name
            book.verdict("behaviour", name, verdict, texts, f"{cause} condition")


def _effects(name: str, old: Behaviour, new: Behaviour, meaning: Meaning, book: Book) -> None:
    """What a behaviour assigns, whichever functions do it."""
    pairs = paired(_effects_of(old), _effects_of(new), lambda effect: effect[1].target)
    declared = {f.name for f in old.functions} & {f.name for f in new.functions}
    for target, (function, assignment) in pairs.removed.items():
        if function not in declared:
            book.changed("behaviour", name, target, show(assignment.value), "not assigned")
    for target, (function, assignment) in pairs.added.items():
        if function not in declared:
            book.changed("behaviour", name, target, "not assigned", show(assignment.value))
    for target, (before, after) in pairs.both.items():
        in_one_function = before[0] == after[0]
        if not in_one_function and not meaning.same_value(before[1].value, after[1].value):
            book.changed("behaviour", name, target, show(before[1].value), show(after[1].value))


def _effects_of(behaviour: Behaviour) -> list[tuple[str, Assignment]]:
    return [(f.name, a) for f in behaviour.functions for a in f.assignments]


def same_behaviour(old: Behaviour, new: Behaviour, meaning: Meaning) -> bool:
    """Whether two behaviours do the same and end alike, whatever they are called."""
    before = {a.target: a.value for a in old.assignments}
    after = {a.target: a.value for a in new.assignments}
    return (
        before.keys() == after.keys()
        and meaning.compare([old.terminal.when], [new.terminal.when]).same
        and meaning.compare([old.error.when], [new.error.when]).same
        and all(meaning.same_value(before[t], after[t]) for t in before)
    )


def _text(behaviour: Behaviour) -> str:
    functions = ", ".join(sorted(f.name for f in behaviour.functions)) or "no functions"
    ends = f"terminal {behaviour.terminal.name}, error {behaviour.error.name}"
    return f"{functions}; {ends}"


def compare_states(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """States are known by their names, which step records carry."""
    pairs = paired(old.states, new.states, lambda s: s.name)
    for name, state in pairs.removed.items():
        book.removed("state", name, state.behaviour.name)
    for name, state in pairs.added.items():
        book.added("state", name, state.behaviour.name)
    for name, (before, after) in pairs.both.items():
        names = before.behaviour.name, after.behaviour.name
        same = names[0] != names[1] and same_behaviour(before.behaviour, after.behaviour, meaning)
        book.changed("state", name, "behaviour", *names, semantic=not same)
        book.words("state", name, before, after)
    book.changed("initial state", "", "", old.initial_state, new.initial_state)
