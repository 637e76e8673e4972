"""Faults in numbers and expressions that have the right type all the same."""

from __future__ import annotations

import re
from collections.abc import Iterator

from bench.seeding.fault import Follows, Seed, fault, seed
from bench.seeding.machine import Machine, machines
from bench.seeding.sheet import Edit, Sheet
from specc.source import Route, TextNode

_NEAR = re.compile(r"\bnear\(([^(),]+), ([^(),]+), ([^(),]+)(?:, ([^(),]+))?\)")
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?=\[|\b)")
_CLAMP = re.compile(r"(min\(max\(.*), ([^(),]+)\), ([^(),]+)\)")
_DIFFERENCE = re.compile(r"([\w.]+) (?:-|<|>|<=|>=) ([\w.]+)(?![\w.(\[])")


def _expressions(sheet: Sheet) -> Iterator[tuple[Machine, str, Route, TextNode]]:
    for machine in machines(sheet):
        for kind, route in machine.expressions():
            yield machine, kind, route, sheet.at(route)


def _tolerances(sheet: Sheet, group: int) -> Iterator[tuple[TextNode, list[int]]]:
    """Numbers of tolerances where they are written, and where else they are used."""
    known: dict[str, tuple[TextNode, list[int]]] = {}
    for _, _, _, node in _expressions(sheet):
        for found in _NEAR.finditer(sheet.raw(node)):
            start, text = node.start + found.start(group), found[group]
            if text and _NUMBER.match(text):
                yield TextNode(start, start + len(text), text), []
            elif text and sheet.has(("constants", text)):
                at = sheet.at(sheet.scalar(("constants", text), "is"))
                known.setdefault(text, (at, []))[1].append(start)
    yield from known.values()


def _not_positive(sheet: Sheet) -> Iterator[Seed]:
    """Zero, and the number with a sign."""
    for group in (3, 4):
        for node, uses in _tolerances(sheet, group):
            text = sheet.raw(node).strip("\"'")
            number = _NUMBER.match(text)
            if number is None:
                continue
            for wrong in ("0", f"-{number[0]}"):
                yield seed(sheet.rewritten(node, wrong + text[number.end() :]), elsewhere=uses)


def _no_values(sheet: Sheet) -> Iterator[Seed]:
    """A constant divided by zero, and one that is too large for a float."""
    for route in sheet.entries(("constants",)):
        node = sheet.at(sheet.scalar(route, "is"))
        text = sheet.raw(node).strip("\"'")
        if _NUMBER.match(text):
            for wrong in (f"{text} / 0", f"{text} * 1e200 * 1e200"):
                edit = sheet.replaced(node, f'"{wrong}"')
                yield seed(edit, node.start, sheet.key(route).start)


def _half_turns(sheet: Sheet) -> Iterator[Seed]:
    """A number of degrees that is called radians."""
    for node, uses in _tolerances(sheet, 4):
        for wrong in ("180[deg]", "5[rad]"):
            yield seed(sheet.rewritten(node, wrong), elsewhere=uses)


def _quaternions(sheet: Sheet) -> Iterator[Seed]:
    """A component that is missing, or ten times too large; no pose without a turn."""
    routes = [route for _, _, route, _ in _expressions(sheet)]
    routes += [sheet.scalar(route, "is") for route in sheet.entries(("constants",))]
    for route in routes:
        node, text = sheet.at(route), sheet.raw(sheet.at(route))
        for found in re.finditer(r"\bpose\(.*, \[([^\]]+)\]\)", text):
            for item in _NUMBER.finditer(found[1]):
                start = node.start + found.start(1) + item.start()
                for wrong in ("0.5", "1"):
                    yield seed(Edit(start, start + len(item[0]), wrong))
        if text.strip("\"'") == "identity()":
            whole = sheet.inside(route, node.start, node.end, "pose([0, 0, 0], [0, 0, 1, 1])")
            yield seed(whole)


def _clamps(sheet: Sheet) -> Iterator[Seed]:
    """The two bounds changed round, and `min` and `max`."""
    for _, _, _, node in _expressions(sheet):
        for found in _CLAMP.finditer(sheet.raw(node)):
            if "x." in found[2] + found[3]:
                continue  # nothing is known of the sign of an input
            start, end = node.start + found.start(), node.start + found.end()
            yield seed(Edit(start, end, f"{found[1]}, {found[3]}), {found[2]})"))
            other = found[1].replace("min(max(", "max(min(", 1)
            yield seed(Edit(start, end, f"{other}, {found[2]}), {found[3]})"))


def _itself(sheet: Sheet) -> Iterator[Seed]:
    """The other side once more, in `near`, a comparison or a difference."""
    for _, _, _, node in _expressions(sheet):
        text = sheet.raw(node)
        for pattern in (_NEAR, _DIFFERENCE):
            for found in pattern.finditer(text):
                names = [found[1].strip(), found[2].strip()]
                for group, other in ((1, names[1]), (2, names[0])):
                    if not _NUMBER.match(other) and not other.startswith("_"):
                        start = node.start + found.start(group)
                        yield seed(Edit(start, start + len(found[group]), other))


_LEFT = {Follows.ONLY_USE: "W0240 W0412 W0611 W0615"}

FAULTS = (
    fault("tolerance that is not positive", "E0330", _not_positive, _LEFT),
    fault("angle of a tolerance that is too large", "E0330", _half_turns, _LEFT),
    fault("constant without a value", "E0334", _no_values),
    fault("quaternion of another length", "E0331", _quaternions),
    fault("bounds the wrong way round", "W0332", _clamps),
    fault("thing beside itself", "W0333", _itself, _LEFT),
)
