"""Faults in names: what is referred to does not exist, or only by way of itself."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from bench.seeding.fault import Seed, fault, seed
from bench.seeding.machine import KINDS, Machine, constants, machines
from bench.seeding.sheet import Edit, Sheet, misspelt
from specc.source import Route

_INPUT = re.compile(r"\bx\.(\w+)\.(\w+)")
_PART = re.compile(r"(?:\bx\.\w+\.\w+|(?<![\w.])(?!x\.)[A-Za-z]\w*)\.([A-Za-z]\w*)(?!\w*[.\w])")
_TYPE = re.compile(r"\b[A-Z]\w+")


def _undefined(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        names = machine.names()
        for kind, route in machine.expressions():
            known = constants(sheet) if kind in ("init", "memory") else names
            for word in sheet.words(route, known):
                yield seed(sheet.replaced(word, _unknown(word.scalar or "", names)))


def _operators(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for _, route in machine.expressions():
            for call in re.finditer(r"\b([A-Z]\w*)\(", sheet.raw(sheet.at(route))):
                start = sheet.at(route).start + call.start(1)
                yield seed(Edit(start, start + len(call[1]), call[1] + "N"))


def _elements(sheet: Sheet) -> Iterator[Seed]:
    yield from _inputs(sheet, 2)


def _peers(sheet: Sheet) -> Iterator[Seed]:
    yield from _inputs(sheet, 1)


def _inputs(sheet: Sheet, part: int) -> Iterator[Seed]:
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            for found in _INPUT.finditer(sheet.raw(node)):
                start, end = (node.start + offset for offset in found.span(part))
                yield seed(Edit(start, end, found[part] + "x"))


def _outputs(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        peers = machine.get("y")
        for kind, route in machine.expressions():
            node = sheet.at(route)
            for found in _INPUT.finditer(sheet.raw(node)):
                if kind in ("let", "condition", "function") and found[1] in peers:
                    element = next(iter(peers[found[1]]))
                    text = f"y.{found[1]}.{element}"
                    yield seed(Edit(node.start + found.start(), node.start + found.end(), text))


def _cyclic(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        lets = set(machine.get("let"))
        uses = {name: _lets_of(machine, name, lets) for name in lets}
        for name in machine.get("let"):
            for other in sorted(uses[name] | {name}):
                cycle = [machine.below("let", item) for item in {name, other}]
                place = sheet.scalar(machine.below("let", other), "is")
                edit = sheet.replaced(sheet.at(place), f'"{name}"')
                yield seed(edit, *(sheet.key(route).start for route in cycle))


def _lets_of(machine: Machine, name: str, lets: set[str]) -> set[str]:
    sheet = machine.sheet
    route = sheet.scalar(machine.below("let", name), "is")
    return {word.scalar or "" for word in sheet.words(route, lets)} - {name}


def _listed(sheet: Sheet, *steps: str) -> Iterator[Seed]:
    """Names that stand as values, or in lists, in parts of machines: `behaviours`, `functions`.

    What stands there itself has no name.
    """
    part, key = steps
    for machine in machines(sheet):
        for entry in machine.entries(part):
            route = sheet.scalar(entry, key) if part == "states" else (*entry, key)
            listed = isinstance(sheet.get(route), list)
            for value in sheet.entries(route) if listed else [route]:
                name = sheet.get(value)
                if isinstance(name, str):
                    yield seed(sheet.replaced(sheet.at(value), f"{name}_"))


def _functions(sheet: Sheet) -> Iterator[Seed]:
    yield from _listed(sheet, "behaviours", "functions")


def _behaviours(sheet: Sheet) -> Iterator[Seed]:
    yield from _listed(sheet, "states", "behaviour")


def _conditions(sheet: Sheet) -> Iterator[Seed]:
    for cause in KINDS[1:]:
        yield from _listed(sheet, "behaviours", cause)
    yield from _cells(sheet, 2)


def _other_kinds(sheet: Sheet) -> Iterator[Seed]:
    """A terminal condition in place of an error condition, and the other way round."""
    for machine in machines(sheet):
        for behaviour in machine.entries("behaviours"):
            for cause, other in (("terminal", "error"), ("error", "terminal")):
                names = machine.get("conditions", other)
                wrong = next((n for n in names if n not in machine.get("conditions", cause)), None)
                if sheet.has((*behaviour, cause)) and wrong is not None:
                    yield seed(sheet.replaced(sheet.at((*behaviour, cause)), str(wrong)))


def _parts(sheet: Sheet) -> Iterator[Seed]:
    """`held.cd` for `held.c_d`, `F_c.w` for `F_c.z`."""
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            text = sheet.raw(node)
            for found in _PART.finditer(text):
                if f" for {found[0].partition('.')[0]} in x." in text:
                    continue  # an element of a buffer of many
                start, end = (node.start + offset for offset in found.span(1))
                yield seed(Edit(start, end, found[1] + "w"))


def _targets(sheet: Sheet) -> Iterator[Seed]:
    yield from _cells(sheet, 3)


def _sources(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for row in machine.rows():
            yield seed(sheet.replaced(sheet.at(row.source), f"{row.state}_"))


def _cells(sheet: Sheet, column: int) -> Iterator[Seed]:
    for machine in machines(sheet):
        for route in machine.entries("transitions"):
            cell = (*route, column)
            yield seed(sheet.replaced(sheet.at(cell), f"{sheet.get(cell)}_"))


def _initial(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        route = machine.below("initial_state")
        yield seed(sheet.replaced(sheet.at(route), f"{sheet.get(route)}_"))


def _assigned(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for function in machine.functions():
            for name, route in machine.targets_of(function).items():
                yield seed(sheet.rewritten(sheet.key(route), f"{name}x"))


def _types(sheet: Sheet) -> Iterator[Seed]:
    own = set(sheet.get(("types",), {}))
    for route in type_texts(sheet):
        node = sheet.at(route)
        for found in _TYPE.finditer(sheet.raw(node)):
            if found[0] in own:
                start = node.start + found.start()
                yield seed(Edit(start, start + len(found[0]), misspelt(found[0])))


def _frames(sheet: Sheet) -> Iterator[Seed]:
    for route in type_texts(sheet):
        node = sheet.at(route)
        for found in re.finditer(r"(?:pose\[|wrench\[|twist\[|, )([A-Z])\b", sheet.raw(node)):
            start = node.start + found.start(1)
            yield seed(Edit(start, start + 1, "Z"))


def type_texts(sheet: Sheet) -> Iterable[Route]:
    """Routes of the types of memory and buffer elements, each once."""
    found = []
    for machine in machines(sheet):
        found += [(*route, "type") for route in machine.entries("memory")]
        for direction in "xy":
            found += [sheet.scalar(route, "type") for route in machine.elements(direction)]
    return dict.fromkeys(found)


def _members(sheet: Sheet) -> Iterator[Seed]:
    members = {
        member.strip()
        for entry in sheet.get(("types",), {}).values()
        for text in [entry.get("type", "") if isinstance(entry, dict) else entry]
        if text.startswith("enum[")
        for member in text[5:-1].split(",")
    }
    for machine in machines(sheet):
        for _, route in machine.expressions():
            for word in sheet.words(route, members - machine.names()):
                yield seed(sheet.replaced(word, f"{word.scalar}{word.scalar}"))


def _given(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        if len(route) > 1 and route[-2] == "with":
            yield seed(sheet.replaced(sheet.key(route), f"{route[-1]}x"), sheet.key(route).start)


def _not_given(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        if route and route[-1] == "with" and len(sheet.get(route)) == 1:
            user = route[:-1]
            places = (sheet.key(user).start, sheet.at((*user, "use")).start)
            yield seed(sheet.replaced(sheet.at(route), "{}"), *places, sheet.key(route).start)


def _unknown(name: str, taken: set[str]) -> str:
    wrong = misspelt(name)
    return f"{name}_" if wrong in taken else wrong


FAULTS = (
    fault("undefined variable", "E0201", _undefined),
    fault("unknown operator", "E0201", _operators),
    fault("unknown element of a buffer", "E0201", _elements),
    fault("unknown peer in an expression", "E0201", _peers),
    fault("output read", "E0201 E0230", _outputs),
    fault("unknown field or component", "E0234", _parts),
    fault("cyclic let", "E0206", _cyclic),
    fault("unknown function", "E0201", _functions),
    fault("unknown behaviour", "E0201", _behaviours),
    fault("unknown condition", "E0201", _conditions),
    fault("condition of another kind", "E0201", _other_kinds),
    fault("wrong target of a row", "E0201", _targets),
    fault("wrong source of a row", "E0201", _sources),
    fault("wrong initial state", "E0201", _initial),
    fault("unknown target of a function", "E0201", _assigned),
    fault("unknown type", "E0233", _types),
    fault("unknown frame", "E0201", _frames),
    fault("wrong member of an enum", "E0201", _members),
    fault("unknown parameter", "E0201", _given),
    fault("parameter not given", "E0211", _not_given),
)
