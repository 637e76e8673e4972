"""Faults in types, units, frames and arguments."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import Machine, given_agents, machines
from bench.seeding.sheet import Edit, Sheet
from specc.source import Route

_LITERAL = re.compile(r"(?<![\w.])\d+(?:\.\d+)?\[([^\]]+)\]")
_CALL = re.compile(r"\b([A-Z]\w*)\(([^()]*(?:\([^()]*\)[^()]*)*)\)")
_SIX = re.compile(r"\[((?:[^\[\],]+,){5}[^\[\],]+)\]")
_POSE = re.compile(r"pose\[(\w+), (\w+)\]")
_PARTIAL = re.compile(r"\bpartial\[((?:[^\[\]]|\[[^\]]*\])+)\]")
_COMPARED = re.compile(r"(?<= )(?:<|>|>=|<=)(?= )")

_TYPE_CODES = "E0310 E0311 E0312 E0313 E0315 E0316 E0317 E0318"


def _conditions(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for kind, route in machine.expressions():
            if kind == "condition":
                node = sheet.at(route)
                for wrong in ("period", "abs(period)"):
                    yield seed(sheet.replaced(node, wrong))
                if sheet.raw(node)[0] not in "\"'>":
                    yield seed(Edit(node.start, node.end, f"({sheet.raw(node)}) + 1"))


def _literals(sheet: Sheet) -> Iterator[Seed]:
    """Units of literals where their place asks for a unit."""
    for machine in machines(sheet):
        for kind, route in machine.expressions():
            for found in _LITERAL.finditer(sheet.raw(sheet.at(route))):
                if kind != "let":
                    start = sheet.at(route).start + found.start(1)
                    yield seed(Edit(start, start + len(found[1]), _other_unit(found[1])))


def _no_units(sheet: Sheet) -> Iterator[Seed]:
    """`0.5` for `0.5[s]`."""
    for machine in machines(sheet):
        for kind, route in machine.expressions():
            for found in _LITERAL.finditer(sheet.raw(sheet.at(route))):
                if kind != "let" and not found[0].startswith("0["):
                    start = sheet.at(route).start
                    yield seed(Edit(start + found.start(1) - 1, start + found.end(), ""))


def _wrong_given(sheet: Sheet) -> Iterator[Seed]:
    """Parameters of parts that are given a truth value, or a number of another unit."""
    for route in sheet.walk():
        if len(route) > 1 and route[-2] == "with" and route not in given_agents(sheet):
            for wrong in ("True", '"5[kg]"', '"[1, 2]"'):
                yield seed(sheet.replaced(sheet.at(route), wrong))


def _constants(sheet: Sheet) -> Iterator[Seed]:
    """Units of constants, whose type is what their literal has: found where they are used."""
    for route in sheet.entries(("constants",)):
        node = sheet.at(sheet.scalar(route, "is"))
        found = _LITERAL.search(sheet.raw(node))
        uses = [use for machine in machines(sheet) for use in _effects(machine, str(route[-1]))]
        uses += [sheet.at(item).start for item in sheet.walk() if item[-2:-1] == ("with",)]
        if found is not None:
            start = node.start + found.start(1)
            other = _other_unit(found[1])
            yield seed(Edit(start, start + len(found[1]), other), elsewhere=uses)


def _effects(machine: Machine, name: str) -> list[int]:
    """Where a constant is used, and the lets that are computed from it."""
    uses = [use.start for use in machine.uses(name)]
    lets = [route for kind, route in machine.expressions() if kind == "let"]
    lets = [route for route in lets if machine.sheet.words(route, {name})]
    named = [str(route[-2] if route[-1] == "is" else route[-1]) for route in lets]
    return uses + [use.start for let in named for use in machine.uses(let)]


def _other_unit(unit: str) -> str:
    return "kg" if unit != "kg" else "m"


def _frames_of_memory(sheet: Sheet) -> Iterator[Seed]:
    """Poses of memory the other way round: found where they are filled or used."""
    for machine in machines(sheet):
        for route in machine.entries("memory"):
            node = sheet.at((*route, "type"))
            found = _POSE.search(sheet.raw(node))
            if found is not None and found[1] != found[2]:
                uses = [use.start for use in _all_uses(machine, str(route[-1]))]
                start = node.start + found.start()
                text = f"pose[{found[2]}, {found[1]}]"
                edit = Edit(start, node.start + found.end(), text)
                yield seed(edit, elsewhere=[sheet.at((*route, "init")).start, *uses])


def _all_uses(machine: Machine, name: str) -> Iterator[Edit]:
    """Where a memory element is read, and where it is assigned."""
    for use in machine.uses(name):
        yield Edit(use.start, use.end, "")
    for function in machine.functions():
        for target, route in machine.targets_of(function).items():
            if target == name:
                yield Edit(machine.sheet.key(route).start, 0, "")


def _frames_in_expressions(sheet: Sheet) -> Iterator[Seed]:
    """A pose inverted: `near(T_c, x.c.T_d, ...)` -> `near(T_c, inverse(x.c.T_d), ...)`."""
    for machine in machines(sheet):
        poses = {
            str(route[-1])
            for route in machine.entries("memory")
            if (found := _POSE.match(sheet.get((*route, "type")))) and found[1] != found[2]
        }
        for kind, route in machine.expressions():
            if kind in ("condition", "function"):
                for word in sheet.words(route, poses):
                    yield seed(sheet.replaced(word, f"inverse({word.scalar})"))


def _lengths(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            for found in _SIX.finditer(sheet.raw(node)):
                start = node.start + found.start(1)
                shorter = found[1].rsplit(",", 1)[0]
                yield seed(Edit(start, start + len(found[1]), shorter))
                yield seed(Edit(start, start, "0, " if found[1][0] in "0_" else f"{found[1][0]}, "))


def _calls(sheet: Sheet, route: Route) -> Iterator[tuple[int, list[str]]]:
    """Where the arguments of a call of an operator begin, and what they are."""
    node = sheet.at(route)
    for found in _CALL.finditer(sheet.raw(node)):
        arguments = re.findall(r"[^,()]+(?:\([^()]*\))?[^,()]*", found[2])
        if ",".join(arguments) == found[2] and arguments:
            yield node.start + found.start(2), arguments


def _numbers_of_arguments(sheet: Sheet) -> Iterator[Seed]:
    for machine in machines(sheet):
        for _, route in machine.expressions():
            for start, arguments in _calls(sheet, route):
                end = start + len(",".join(arguments))
                yield seed(Edit(end - len(arguments[-1]) - (len(arguments) > 1), end, ""))
                more = f", {arguments[-1].strip()}"
                yield seed(sheet.inside(route, end, end, more))


def _swapped_arguments(sheet: Sheet) -> Iterator[Seed]:
    types = {
        name: re.findall(r"\w+: ([^,\[\]]+(?:\[[^\]]*\])?)", entry["signature"].split("->")[0])
        for name, entry in sheet.get(("operators",), {}).items()
    }
    for machine in machines(sheet):
        for _, route in machine.expressions():
            for start, arguments in _calls(sheet, route):
                name = re.findall(r"\w+(?=\($)", sheet.text[:start])[-1]
                kinds = types.get(name, [])
                if len(arguments) > 1 and len(kinds) > 1 and kinds[0] != kinds[1]:
                    end = start + len(",".join(arguments[:2]))
                    text = f"{arguments[1].strip()}, {arguments[0].strip()}"
                    yield seed(Edit(start, end, text))


def _exact(sheet: Sheet) -> Iterator[Seed]:
    """Two measurements compared by `==`; numbers of items may well be."""
    for machine in machines(sheet):
        for _, route in machine.expressions():
            node = sheet.at(route)
            text = sheet.raw(node)
            for found in _COMPARED.finditer(text):
                if "len(" not in text:
                    yield seed(Edit(node.start + found.start(), node.start + found.end(), "=="))


def _memory_types(sheet: Sheet) -> Iterator[Seed]:
    """Memory of another type than what it is filled with."""
    for machine in machines(sheet):
        for route in machine.entries("memory"):
            if sheet.get((*route, "init")) not in ("[]", 0, "0"):
                uses = [use.start for use in _all_uses(machine, str(route[-1]))]
                node, init = sheet.at((*route, "type")), sheet.at((*route, "init"))
                yield seed(sheet.replaced(node, "bool"), elsewhere=[init.start, *uses])


def _units_of_types(sheet: Sheet) -> Iterator[Seed]:
    for route in sheet.walk():
        text = sheet.get(route)
        if isinstance(text, str) and (
            found := re.fullmatch(r"(real|vector\[\d)\W+([\w/*]+)\]", text)
        ):
            node = sheet.at(route)
            start = node.start + sheet.raw(node).rindex(found[2])
            yield seed(Edit(start, start + len(found[2]), "mm"))


def _no_dash(sheet: Sheet) -> Iterator[Seed]:
    """`wrench[E]` for `partial[wrench[E]]`: an operator that needs every component."""
    for route in sheet.entries(("operators",)):
        node = sheet.at((*route, "signature"))
        uses = [use.start for machine in machines(sheet) for use in machine.uses(str(route[-1]))]
        for found in _PARTIAL.finditer(sheet.raw(node)):
            start, end = (node.start + offset for offset in found.span())
            yield seed(Edit(start, end, found[1]), elsewhere=uses)


FAULTS = (
    fault("type error in a condition", _TYPE_CODES, _conditions),
    fault("unit error in an expression", _TYPE_CODES, _literals),
    fault("unit left out", _TYPE_CODES, _no_units),
    fault("unit error in a constant", _TYPE_CODES, _constants, several=Follows.EVERY_USE),
    fault("frame error in an expression", _TYPE_CODES, _frames_in_expressions),
    fault(
        "frame error in the type of memory",
        _TYPE_CODES,
        _frames_of_memory,
        several=Follows.EVERY_USE,
    ),
    fault(
        "wrong type of memory",
        _TYPE_CODES,
        _memory_types,
        {Follows.EVERY_USE: "E0234 E0319"},
        several=Follows.EVERY_USE,
    ),
    fault("unit of a type that is not SI", "E0305", _units_of_types),
    fault("wrong number of items", "E0316", _lengths),
    fault("wrong number of arguments", "E0315", _numbers_of_arguments),
    fault("arguments swapped", "E0315", _swapped_arguments, several=Follows.EACH),
    fault("argument of a part of the wrong type", _TYPE_CODES, _wrong_given),
    fault("component that may be missing", "E0321 E0315", _no_dash, several=Follows.EVERY_USE),
    fault("reals compared exactly", "E0319", _exact),
)
