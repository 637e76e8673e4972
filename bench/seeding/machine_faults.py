"""Faults in machines: rows, conditions, states, assumptions, and what has no value yet."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import Machine, machines
from bench.seeding.presence_seeds import entered_unprepared, no_initial_values
from bench.seeding.sheet import Edit, Sheet
from specc.source import Route

_FRESH = re.compile(r"(?<!not )fresh\(x\.(\w+)\.(\w+)\)")
_MEMBERS = re.compile(r"in \{(\w+), (\w+)")


def _ends(machine: Machine) -> Iterator[tuple[str, str, list[tuple[Route, list[str]]]]]:
    """Each state and cause that can occur, with its rows."""
    for state in machine.get("states"):
        for cause in ("terminal", "error"):
            if machine.ends(state, cause) != "False":
                yield state, cause, machine.rows_of(state, cause)


def _missing_rows(sheet: Sheet) -> Iterator[Seed]:
    """One of several rows is gone: nothing applies where it did."""
    for machine in machines(sheet):
        for state, _, rows in _ends(machine):
            for route, _row in rows if len(rows) > 1 else ():
                yield seed(sheet.removed(route), machine.place_of(state))


def _missing_last_rows(sheet: Sheet, cause: str) -> Iterator[Seed]:
    for machine in machines(sheet):
        for state, its_cause, rows in _ends(machine):
            if its_cause == cause and rows:
                edits = [sheet.removed(route) for route, _row in rows]
                yield seed(edits, machine.place_of(state))


def _traps(sheet: Sheet) -> Iterator[Seed]:
    yield from _missing_last_rows(sheet, "terminal")


def _no_error_rows(sheet: Sheet) -> Iterator[Seed]:
    yield from _missing_last_rows(sheet, "error")


def _new_errors(sheet: Sheet) -> Iterator[Seed]:
    """An error condition that could not hold now can, and no row is there for it.

    Where the state is over by then, that is what is wrong with it.
    """
    for machine in machines(sheet):
        for route in machine.entries("conditions", "error"):
            node = sheet.at(sheet.scalar(route, "when"))
            states = [s for s in machine.get("states") if not machine.rows_of(s, "error")]
            places = [machine.place_of(state) for state in states]
            if sheet.raw(node) == "False":
                yield seed(sheet.replaced(node, '"elapsed > 60[s]"'), elsewhere=places)


def _overlaps(sheet: Sheet) -> Iterator[Seed]:
    """A row for every case beside others, or the same case with two next states."""
    for machine in machines(sheet):
        states = list(machine.get("states"))
        for _, _, rows in _ends(machine):
            for route, row in rows:
                if len(rows) > 1:
                    places = [sheet.at(other).start for other, _row in rows]
                    yield seed(sheet.replaced(sheet.at((*route, 2)), "always"), *places)
                elsewhere = [state for state in states if state != row[3]]
                for target in elsewhere[:1]:
                    text = f"[{', '.join([*row[:3], target])}]"
                    yield seed(sheet.beside(route, text), sheet.at(route).start)


def _narrowed(sheet: Sheet) -> Iterator[Seed]:
    """A case is left out of a condition: its rows no longer cover everything."""
    for machine in machines(sheet):
        for route in machine.entries("conditions", "initial"):
            text = sheet.scalar(route, "when")
            places = _states_with(machine, str(route[-1]))
            node = sheet.at(text)
            if machine.text_of("initial", str(route[-1])) == "True":
                yield seed(sheet.replaced(node, '"elapsed > 1[s]"'), elsewhere=places)
                continue
            for found in _MEMBERS.finditer(sheet.raw(node)):
                start, end = (node.start + found.start(group) for group in (1, 2))
                yield seed(Edit(start, end, ""), elsewhere=places)
            inner = sheet.raw(node).strip("\"'")
            if "\n" not in inner:
                more = f'"({inner}) and elapsed > 1[s]"'
                yield seed(sheet.replaced(node, more), elsewhere=places)


def _states_with(machine: Machine, condition: str) -> list[int]:
    """Places of the states that have a row with this initial condition, and of their rows."""
    states = {row[0] for _, row in machine.rows() if row[2] == condition}
    rows = [machine.sheet.at(route).start for route, row in machine.rows() if row[0] in states]
    return [*(machine.place_of(state) for state in sorted(states)), *rows]


def _negated(sheet: Sheet) -> Iterator[Seed]:
    """`fresh` where `not fresh` is meant: some cases have two rows, others none."""
    for machine in machines(sheet):
        for route in machine.entries("conditions", "initial"):
            node = sheet.at(sheet.scalar(route, "when"))
            places = _states_with(machine, str(route[-1]))
            for found in re.finditer(r"\bnot ", sheet.raw(node)):
                start = node.start + found.start()
                yield seed(Edit(start, start + 4, ""), elsewhere=places)


def _never_initial(sheet: Sheet) -> Iterator[Seed]:
    yield from _contradicted(sheet, "initial")


def _never_ending(sheet: Sheet) -> Iterator[Seed]:
    yield from _contradicted(sheet, "terminal")


def _contradicted(sheet: Sheet, kind: str) -> Iterator[Seed]:
    for machine in machines(sheet):
        for route in machine.entries("conditions", kind):
            node = sheet.at(sheet.scalar(route, "when"))
            fresh = _FRESH.search(sheet.raw(node))
            part = fresh[0] if fresh else "elapsed > 1[s]"
            places = [node.start, sheet.key(route).start]
            yield seed(sheet.replaced(node, f'"{part} and not {part}"'), *places)


def _constant_parts(sheet: Sheet) -> Iterator[Seed]:
    """A part beside the rest that is always or never so: a contradiction, a time, the clock."""
    for machine in machines(sheet):
        for kind in ("initial", "terminal"):
            for route in machine.entries("conditions", kind):
                node = sheet.at(sheet.scalar(route, "when"))
                inner = sheet.raw(node).strip().strip("\"'")
                if "\n" in inner or inner in ("True", "False"):
                    continue
                for wrong in (
                    "(elapsed > 2[s] and elapsed < 1[s])",
                    "elapsed < 0.1[ms]",
                    "entered",
                ):
                    yield seed(sheet.replaced(node, f'"({inner}) or {wrong}"'))


def _turned_round(sheet: Sheet) -> Iterator[Seed]:
    """An error that holds at once: `elapsed < 3[s]` for `elapsed > 3[s]`."""
    for machine in machines(sheet):
        for route in machine.entries("conditions", "error"):
            node = sheet.at(sheet.scalar(route, "when"))
            found = re.search(r"elapsed (>) (?!x\.)", sheet.raw(node))
            if found:
                start = node.start + found.start(1)
                yield seed(Edit(start, start + 1, "<"), node.start, sheet.key(route).start)


def _too_late(sheet: Sheet) -> Iterator[Seed]:
    """A behaviour that ends at once, beside an error that takes its time."""
    for machine in machines(sheet):
        for name in machine.get("behaviours"):
            behaviour = machine.get("behaviours", name)
            kind = machine.text_of("error", behaviour.get("error", "never"))
            if re.search(r"elapsed > (?!x\.)", kind) and "terminal" in behaviour:
                node = sheet.at(machine.below("behaviours", name, "terminal"))
                error = machine.below("conditions", "error", behaviour["error"])
                yield seed(sheet.replaced(node, "always"), elsewhere=[sheet.key(error).start])


def _unreachable(sheet: Sheet) -> Iterator[Seed]:
    """Another state, from which rows lead away but to which none leads."""
    for machine in machines(sheet):
        behaviours = list(machine.get("behaviours"))
        rows = machine.entries("transitions")
        first = next(iter(machine.get("states")))
        for name in behaviours:
            behaviour = machine.get("behaviours", name)
            if not rows or machine.text_of("error", behaviour.get("error", "never")) != "False":
                continue
            state = machine.entries("states")[0]
            edits = [
                sheet.beside(state, f"aside: {name}"),
                sheet.beside(rows[0], f"[aside, terminal, always, {first}]"),
            ]
            yield seed(edits, sheet.key(state).start)


def _swapped(sheet: Sheet) -> Iterator[Seed]:
    """The targets of two rows changed round, where a state can no longer be reached then."""
    for machine in machines(sheet):
        rows = machine.rows()
        arcs = [(row[0], row[3]) for _, row in rows]
        for i in range(len(rows)):
            for j in range(i + 1, len(rows)):
                changed = list(arcs)
                changed[i], changed[j] = (arcs[i][0], arcs[j][1]), (arcs[j][0], arcs[i][1])
                lost = _reached(machine, arcs) - _reached(machine, changed)
                if lost:
                    edits = [
                        sheet.replaced(sheet.at((*rows[i][0], 3)), arcs[j][1]),
                        sheet.replaced(sheet.at((*rows[j][0], 3)), arcs[i][1]),
                    ]
                    places = [machine.place_of(state) for state in sorted(lost)]
                    yield seed(edits, *(edit.start for edit in edits), elsewhere=places)


def _reached(machine: Machine, arcs: Iterable[tuple[str, str]]) -> set[str]:
    reached, added = set(), {str(machine.get("initial_state"))}
    while added:
        reached |= added
        added = {target for source, target in arcs if source in reached} - reached
    return reached


def _returning(sheet: Sheet) -> Iterator[Seed]:
    """All rows of a state lead back to it."""
    for machine in machines(sheet):
        for state in machine.get("states"):
            leaving = [(route, row) for route, row in machine.rows() if row[0] == state != row[3]]
            arcs = [(row[0], state if row[0] == state else row[3]) for _, row in machine.rows()]
            if leaving and _reached(machine, arcs) == set(machine.get("states")):
                edits = [sheet.replaced(sheet.at((*route, 3)), state) for route, _ in leaving]
                places = [edit.start for edit in edits]
                yield seed(edits, *places, elsewhere=[machine.place_of(state)])


def _idle_rows(sheet: Sheet) -> Iterator[Seed]:
    """A row for a cause that cannot occur."""
    for machine in machines(sheet):
        for state in machine.get("states"):
            for cause in ("terminal", "error"):
                if machine.ends(state, cause) == "False" and machine.rows():
                    row = machine.rows()[0][0]
                    text = f"[{state}, {cause}, always, {state}]"
                    yield seed(sheet.beside(row, text))


def _other_causes(sheet: Sheet) -> Iterator[Seed]:
    """`error` for `terminal`, or the other way round."""
    for machine in machines(sheet):
        for route, row in machine.rows():
            other = "error" if row[1] == "terminal" else "terminal"
            edit = sheet.replaced(sheet.at((*route, 1)), other)
            yield seed(edit, edit.start, machine.place_of(row[0]))


def _named_twice(sheet: Sheet) -> Iterator[Seed]:
    """A function that stands twice in a behaviour."""
    for machine in machines(sheet):
        for name in machine.get("behaviours"):
            for route in machine.entries("behaviours", name, "functions"):
                yield seed(sheet.beside(route, sheet.entry(route)))


def _two_writers(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for name in machine.get("behaviours"):
            own = machine.functions_of(name)
            written = {target for function in own for target in machine.targets_of(function)}
            for other in machine.get("functions"):
                both = sorted(written & set(machine.targets_of(other)))
                if other in own or not both:
                    continue
                listed = machine.below("behaviours", name, "functions")
                end = sheet.at(listed).end - 1
                yield seed(Edit(end, end, f", {other}"), sheet.at(listed).start)


def _unused(sheet: Sheet) -> Iterator[Seed]:
    """A second entry of another name, which nothing refers to."""
    for machine in machines(sheet):
        parts: list[tuple[str, ...]] = [("memory",), ("let",), ("functions",), ("behaviours",)]
        parts += [("conditions", kind) for kind in machine.get("conditions")]
        for part in parts:
            for route in machine.entries(*part):
                entry = sheet.entry(route)
                if "\n" not in entry:
                    text = f"spare_{entry}"
                    yield seed(sheet.beside(route, text), sheet.key(route).start)


def _assumption(sheet: Sheet, that: str, first: bool = False) -> Iterator[Seed]:
    """An assumption about every input that is asked for, `{}` in the text."""
    for machine in machines(sheet):
        text = "".join(sheet.raw(sheet.at(route)) for _, route in machine.expressions())
        asked = sorted({found[0] for found in _FRESH.finditer(text)})
        for item in asked:
            said = f'{{that: "{that.format(item)}", because: "the test says so"}}'
            if existing := machine.entries("assume"):
                place = sheet.at(existing[0]).start
                yield seed(sheet.beside(existing[0], said), sheet.text.rindex("-", 0, place), place)
            else:
                anchor = machine.below("initial_state")
                edit = sheet.beside(anchor, f"assume: [{said}]")
                yield seed(edit, sheet.key(anchor).start)


def _contradictory(sheet: Sheet) -> Iterator[Seed]:
    yield from _assumption(sheet, "{0} and not {0}")


def _superfluous(sheet: Sheet) -> Iterator[Seed]:
    yield from _assumption(sheet, "{0} or not {0}")


_READS = "E0701 E0702 E0705 W0415 W0416"
_LEADS = f"{_READS} E0514"

FAULTS = (
    fault("missing case (one of several rows)", "E0601", _missing_rows),
    fault(
        "case left out of a condition",
        "E0601",
        _narrowed,
        {Follows.BOTH: "W0618"},
        several=Follows.EVERY_STATE,
    ),
    fault(
        "condition without its `not`",
        "E0601 E0602",
        _negated,
        {Follows.WAY: _READS},
        several=Follows.EVERY_STATE,
    ),
    fault("overlapping conditions", "E0602", _overlaps, {Follows.WAY: _READS}),
    fault(
        "condition of a row that can never hold",
        "W0605 W0613",
        _never_initial,
        {Follows.CASE: "E0601"},
    ),
    fault(
        "terminal condition that can never hold",
        "W0604 W0613",
        _never_ending,
        {Follows.ONLY_USE: "W0240 W0412 W0611 W0615"},
    ),
    fault("part of a condition that is constant", "W0617", _constant_parts, {Follows.WAY: _READS}),
    fault(
        "error that holds at once",
        "W0618",
        _turned_round,
        {Follows.ONLY_USE: "W0240 W0412 W0611 W0615"},
        several=Follows.EACH,
    ),
    fault(
        "condition that comes too late",
        "W0618",
        _too_late,
        {Follows.ONLY_USE: "W0240 W0412 W0611 W0615"},
    ),
    fault("trap state (no rows)", "E0603 O0605", _traps, {Follows.WAY: "E0514"}),
    fault("trap state (all rows lead back)", "W0612", _returning, {Follows.WAY: _LEADS}),
    fault("missing row for the error cause", "E0603", _no_error_rows),
    fault("new error without a row", "E0603 W0618", _new_errors, several=Follows.EVERY_STATE),
    fault("row for a cause that never occurs", "W0604", _idle_rows),
    fault(
        "row for the other cause",
        "W0604 E0601 E0602 E0603 O0605",
        _other_causes,
        several=Follows.EACH,
    ),
    fault("unreachable state", "W0607", _unreachable),
    fault("targets of two rows swapped", "W0607", _swapped, {Follows.WAY: _LEADS}),
    fault("two writers", "E0608", _two_writers, {Follows.WAY: _READS}, several=Follows.EACH),
    fault("function named twice", "E0608", _named_twice, several=Follows.EACH),
    fault("part that nothing uses", "W0611", _unused),
    fault("assumption that contradicts itself", "E0609", _contradictory),
    fault("assumption that nothing needs", "W0610", _superfluous),
    fault(
        "input without its initial value",
        "E0701 E0702 E0703",
        no_initial_values,
        several=Follows.EVERY_USE,
    ),
    fault("read before present", "E0701 E0702", entered_unprepared, several=Follows.EVERY_USE),
)
