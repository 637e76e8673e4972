"""Faults in machines: rows, conditions, states, assumptions, and what has no value yet."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import CAUSES, OTHERWISE, Machine, Row, lost_without, machines, reached
from bench.seeding.presence_seeds import entered_unprepared, no_initial_values
from bench.seeding.sheet import Edit, Sheet
from specc.source import Route

_FRESH = re.compile(r"(?<!not )fresh\(x\.(\w+)\.(\w+)\)")
_MEMBERS = re.compile(r"in \{(\w+), (\w+)")


def _ends(machine: Machine) -> Iterator[tuple[str, str, list[Row]]]:
    """Each state and cause that can occur, with its rows."""
    for state in machine.get("states"):
        for cause in CAUSES:
            if machine.ends(machine.behaviour_of(state), cause) != "False":
                yield state, cause, machine.rows_of(state, cause)


def _missing_rows(sheet: Sheet) -> Iterator[Seed]:
    """One of several rows is gone: nothing applies where it did."""
    for machine in machines(sheet):
        for state, _, rows in _ends(machine):
            for row in rows if len(rows) > 1 else ():
                others = {other.condition for other in rows if other != row}
                if OTHERWISE not in others:
                    yield seed(machine.without(row), machine.place_of(state))
                elif not lost_without(machine, row):
                    yield seed(machine.without(row), absorbable=True)


def _missing_ways(sheet: Sheet) -> Iterator[Seed]:
    """The only row that leads to a state is gone, and `otherwise` applies where it did."""
    for machine in machines(sheet):
        for row in machine.rows():
            lost = lost_without(machine, row)
            if lost and row.condition != OTHERWISE and machine.has_otherwise(*row[:2]):
                yield seed(machine.without(row), *map(machine.place_of, sorted(lost)))


def _missing_last_rows(sheet: Sheet, cause: str) -> Iterator[Seed]:
    for machine in machines(sheet):
        for state, its_cause, rows in _ends(machine):
            if its_cause == cause and rows:
                edits = [machine.without(row) for row in rows]
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
        for route in machine.conditions("error"):
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
            for row in rows:
                others = {other.condition for other in rows if other != row}
                if others - {OTHERWISE}:
                    places = [sheet.at(other.route).start for other in rows]
                    yield seed(sheet.replaced(sheet.at((*row.route, 2)), "always"), *places)
                elsewhere = [state for state in states if state != row.target]
                for target in elsewhere[:1] if row.condition != OTHERWISE else ():
                    text = f"[{', '.join([*row.cells[:3], target])}]"
                    yield seed(sheet.beside(row.route, text), sheet.at(row.route).start)


def _narrowed(sheet: Sheet) -> Iterator[Seed]:
    """A case is left out of a condition: its rows no longer cover everything."""
    for machine in machines(sheet):
        for route in machine.entries("conditions", "initial"):
            text = sheet.scalar(route, "when")
            places = _states_with(machine, str(route[-1]))
            absorbed = _is_absorbed(machine, str(route[-1]))
            node = sheet.at(text)
            if machine.text_of("initial", str(route[-1])) == "True":
                edit = sheet.replaced(node, '"elapsed > 1[s]"')
                yield seed(edit, elsewhere=places, absorbable=absorbed)
                continue
            for found in _MEMBERS.finditer(sheet.raw(node)):
                start, end = (node.start + found.start(group) for group in (1, 2))
                yield seed(Edit(start, end, ""), elsewhere=places, absorbable=absorbed)
            inner = sheet.raw(node).strip("\"'")
            if "\n" not in inner:
                more = f'"({inner}) and elapsed > 1[s]"'
                yield seed(sheet.replaced(node, more), elsewhere=places, absorbable=absorbed)


def _states_with(machine: Machine, condition: str) -> list[int]:
    """Places of the states that have a row with this initial condition, and of their rows."""
    states = {row.state for row in machine.rows() if row.condition == condition}
    rows = [machine.sheet.at(row.route).start for row in machine.rows() if row.state in states]
    return [*(machine.place_of(state) for state in sorted(states)), *rows]


def _is_absorbed(machine: Machine, condition: str) -> bool:
    """Whether, where a row with this condition does not apply, one with `otherwise` does."""
    rows = [row for row in machine.rows() if row.condition == condition]
    return all(machine.has_otherwise(row.state, row.cause) for row in rows)


def _negated(sheet: Sheet) -> Iterator[Seed]:
    """`fresh` where `not fresh` is meant: some cases have two rows, others none."""
    for machine in machines(sheet):
        for route in machine.entries("conditions", "initial"):
            node = sheet.at(sheet.scalar(route, "when"))
            places = _states_with(machine, str(route[-1]))
            absorbed = _is_absorbed(machine, str(route[-1]))
            for found in re.finditer(r"\bnot ", sheet.raw(node)):
                start = node.start + found.start()
                edit = Edit(start, start + 4, "")
                yield seed(edit, elsewhere=places, absorbable=absorbed)


def _never_initial(sheet: Sheet) -> Iterator[Seed]:
    yield from _contradicted(sheet, "initial")


def _never_ending(sheet: Sheet) -> Iterator[Seed]:
    yield from _contradicted(sheet, "terminal")


def _contradicted(sheet: Sheet, kind: str) -> Iterator[Seed]:
    for machine in machines(sheet):
        for route in machine.conditions(kind):
            node = sheet.at(sheet.scalar(route, "when"))
            fresh = _FRESH.search(sheet.raw(node))
            part = fresh[0] if fresh else "elapsed > 1[s]"
            places = [node.start, sheet.key(route).start]
            yield seed(sheet.replaced(node, f'"{part} and not {part}"'), *places)


def _constant_parts(sheet: Sheet) -> Iterator[Seed]:
    """A part beside the rest that is always or never so: a contradiction, a time, the clock."""
    for machine in machines(sheet):
        for kind in ("initial", "terminal"):
            for route in machine.conditions(kind):
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
        for route in machine.conditions("error"):
            node = sheet.at(sheet.scalar(route, "when"))
            found = re.search(r"elapsed (>) (?!x\.)", sheet.raw(node))
            if found:
                start = node.start + found.start(1)
                yield seed(Edit(start, start + 1, "<"), node.start, sheet.key(route).start)


def _too_late(sheet: Sheet) -> Iterator[Seed]:
    """A behaviour that ends at once, beside an error that takes its time."""
    for machine in machines(sheet):
        for name in machine.get("behaviours"):
            terminal, error = (machine.end(name, cause) for cause in CAUSES)
            if terminal and error and re.search(r"elapsed > (?!x\.)", machine.ends(name, "error")):
                node = sheet.at(machine.below("behaviours", name, "terminal"))
                yield seed(sheet.replaced(node, "always"), elsewhere=[sheet.key(error).start])


def _unreachable(sheet: Sheet) -> Iterator[Seed]:
    """Another state, from which rows lead away but to which none leads."""
    for machine in machines(sheet):
        behaviours = list(machine.get("behaviours"))
        rows = machine.entries("transitions")
        first = next(iter(machine.get("states")))
        for name in behaviours:
            ends = [machine.ends(name, cause) for cause in CAUSES]
            if not rows or ends[0] == "False" or ends[1] != "False":
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
        targets = {row.route: row.target for row in machine.rows()}
        before = _reached(machine, targets)
        for one, other in itertools.combinations(targets, 2):
            swapped = {one: targets[other], other: targets[one]}
            if lost := before - _reached(machine, {**targets, **swapped}):
                edits = [sheet.replaced(sheet.at((*at, 3)), to) for at, to in swapped.items()]
                places = [machine.place_of(state) for state in sorted(lost)]
                yield seed(edits, *(edit.start for edit in edits), elsewhere=places)


def _reached(machine: Machine, targets: Mapping[Route, str]) -> set[str]:
    """The states that can be reached, with the next states of the lines of the table."""
    return reached(machine, [(row.state, targets[row.route]) for row in machine.rows()])


def _returning(sheet: Sheet) -> Iterator[Seed]:
    """All rows of a state lead back to it."""
    for machine in machines(sheet):
        for state in machine.get("states"):
            leaving = [row for row in machine.rows() if row.state == state != row.target]
            targets = {row.route: row.target for row in machine.rows()}
            targets |= {row.route: state for row in leaving}
            if leaving and _reached(machine, targets) == set(machine.get("states")):
                edits = [sheet.replaced(sheet.at((*row.route, 3)), state) for row in leaving]
                places = [edit.start for edit in edits]
                yield seed(edits, *places, elsewhere=[machine.place_of(state)])


def _idle_rows(sheet: Sheet) -> Iterator[Seed]:
    """A row for a cause that cannot occur."""
    for machine in machines(sheet):
        for state in machine.get("states"):
            for cause in CAUSES:
                never = machine.ends(machine.behaviour_of(state), cause) == "False"
                for row in machine.entries("transitions")[:1] if never else ():
                    text = f"[{state}, {cause}, always, {state}]"
                    yield seed(sheet.beside(row, text))


def _other_causes(sheet: Sheet) -> Iterator[Seed]:
    """`error` for `terminal`, or the other way round."""
    for machine in machines(sheet):
        for route in machine.entries("transitions"):
            states = [row.state for row in machine.rows() if row.route == route]
            other = "error" if sheet.get((*route, 1)) == "terminal" else "terminal"
            edit = sheet.replaced(sheet.at((*route, 1)), other)
            yield seed(edit, edit.start, *(machine.place_of(state) for state in states))


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
            for other in machine.entries("functions"):
                both = sorted(written & set(machine.targets_of(other)))
                if other in own or not both:
                    continue
                listed = machine.below("behaviours", name, "functions")
                end = sheet.at(listed).end - 1
                yield seed(Edit(end, end, f", {other[-1]}"), sheet.at(listed).start)


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
    fault(
        "missing case (one of several rows)", "E0601", _missing_rows, {Follows.ONLY_USE: "W0611"}
    ),
    fault("missing row that alone leads to a state", "W0607", _missing_ways),
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
    fault(
        "trap state (no rows)",
        "E0603 O0605",
        _traps,
        {Follows.WAY: "E0514", Follows.ONLY_USE: "W0611"},
    ),
    fault(
        "trap state (all rows lead back)",
        "W0612",
        _returning,
        {Follows.WAY: f"{_LEADS} W0420"},
    ),
    fault("missing row for the error cause", "E0603", _no_error_rows),
    fault("new error without a row", "E0603 W0618", _new_errors, several=Follows.EVERY_STATE),
    fault("row for a cause that never occurs", "W0604", _idle_rows),
    fault(
        "row for the other cause",
        "W0604 E0601 E0602 E0603 O0605",
        _other_causes,
        {Follows.WAY: "W0607 W0605"},
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
    fault(
        "read before present",
        "E0701 E0702",
        entered_unprepared,
        {Follows.WAY: "W0612"},
        several=Follows.EVERY_USE,
    ),
)
