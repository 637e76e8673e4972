"""Edits of a specification that know its structure: entries, keys, scalars, anchors, depth."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from bench.fuzzing.texts import ODD_VALUES
from bench.seeding.sheet import Edit, Sheet
from specc.source import Route, TextNode

Change = Callable[[Sheet, list[Route], Random], list[Edit]]

_ODD_CHARACTERS = "\x00\x07\x85\u2028\u202e\ufeff\ud83dé∞😀\t\r\n\"'{}[],:&*#|>%@`\\"


def edited(sheet: Sheet, random: Random) -> str:
    """The text after one change; the text itself where the change does not apply."""
    routes = [route for route in sheet.walk() if route]
    change = random.choice(_CHANGES)
    text = sheet.text
    for start, end, new in sorted(change(sheet, routes, random), reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _remove(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    return [sheet.removed(random.choice(routes))]


def _double(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    route = random.choice(routes)
    return [sheet.beside(route, sheet.entry(route))]


def _double_renamed(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    route = random.choice(routes)
    mark = "" if isinstance(route[-1], int) else random.choice("aZ_")
    return [sheet.beside(route, mark + sheet.entry(route))]


def _swap(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    first, second = sorted((sheet.at(random.choice(routes)) for _ in "ab"), key=_start)
    if first.end > second.start:
        return []
    return [sheet.replaced(first, sheet.raw(second)), sheet.replaced(second, sheet.raw(first))]


def _start(node: TextNode) -> int:
    return node.start


def _copy(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    source, target = (sheet.at(route) for route in random.choices(_scalars(sheet, routes), k=2))
    return [sheet.replaced(target, sheet.raw(source).rstrip())]


def _rename(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    named = [route for route in routes if isinstance(route[-1], str)]
    key = sheet.key(random.choice(named))
    other = sheet.key(random.choice(named))
    new = random.choice((sheet.raw(other), f"{sheet.raw(key)}x", "c", "E", "y.c.n", "é", '""', "1"))
    return [sheet.replaced(key, new)]


def _odd(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    return [sheet.replaced(sheet.at(random.choice(routes)), random.choice(ODD_VALUES))]


def _odd_scalar(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    route = random.choice(_scalars(sheet, routes))
    return [sheet.replaced(sheet.at(route), random.choice(ODD_VALUES))]


def _scalars(sheet: Sheet, routes: list[Route]) -> list[Route]:
    return [route for route in routes if sheet.at(route).scalar is not None]


def _inside(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    """Other characters within a scalar, most often an expression or a type."""
    node = sheet.at(random.choice(_scalars(sheet, routes)))
    start, end = sorted(random.randint(node.start, node.end) for _ in "ab")
    new = random.choice(
        (*"()[]{}.,+-*/@<>=_ 0", " and ", " not ", " if ", " in ", "x.c.", "", "**")
    )
    return [Edit(start, random.choice((start, min(start + 1, end), end)), new)]


def _character(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    at = random.randrange(len(sheet.text))
    return [Edit(at, at + random.randrange(2), random.choice(_ODD_CHARACTERS))]


def _deepen(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    node = sheet.at(random.choice(_scalars(sheet, routes)))
    depth = random.choice((1, 5, 63, 500, 20_000))
    left, right = random.choice((("[", "]"), ("{a: ", "}")))
    return [sheet.replaced(node, left * depth + "1" + right * random.choice((depth, 0)))]


def _alias(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    """An anchor at one value and an alias in place of another, which may be within the first."""
    first, second = sheet.at(random.choice(routes)), sheet.at(random.choice(routes))
    if first.start == second.start:
        return [sheet.replaced(first, "&loop [*loop]")]
    return [Edit(first.start, first.start, "&one "), sheet.replaced(second, "*one")]


def _bomb(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    width, height = random.choice(((2, 40), (10, 8), (300, 2)))
    layers = [f"&b{n} [{', '.join([f'*b{n - 1}'] * width)}]" for n in range(1, height)]
    bomb = f"[&b0 [{', '.join(['x'] * width)}], {', '.join(layers)}]"
    return [sheet.replaced(sheet.at(random.choice(_scalars(sheet, routes))), bomb)]


def _many(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    """The same entry very often, under other names."""
    route = random.choice(routes)
    mark = "" if isinstance(route[-1], int) else "n{}_"
    entry, count = sheet.entry(route), random.choice((20, 100))
    if len(entry) > 300 or "\n" in entry:
        return []
    return [sheet.beside(route, mark.format(n) + entry) for n in range(count)]


def _cut(sheet: Sheet, routes: list[Route], random: Random) -> list[Edit]:
    start, end = sorted(random.randrange(len(sheet.text)) for _ in "ab")
    return [Edit(start, random.choice((end, len(sheet.text))), "")]


_CHANGES: tuple[Change, ...] = (
    *(_remove, _double, _double_renamed, _swap, _copy, _rename, _odd, _odd_scalar, _inside),
    *(_inside, _inside, _odd_scalar, _copy, _character, _deepen, _alias, _bomb, _many, _cut),
)
