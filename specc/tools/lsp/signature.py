"""Signatures of operators and keys at the cursor."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from specc.frozen import frozen
from specc.pipeline import json_schema
from specc.schema import ROW_KEYS
from specc.source import Route
from specc.tools.lsp.cursor import cursors
from specc.tools.lsp.index import Index
from specc.tools.lsp.structure import role_of

# Keys and values that the schema allows at a place, with their descriptions.


Schema = dict[str, Any]
_ABOUT = frozenset(("title", "eq", "table", "fig"))
"""Keys that nearly everything takes."""


@cache
def _schema() -> Schema:
    return json_schema()


def keys_at(route: Route) -> dict[str, str]:
    """The keys of the mapping at a route, with their descriptions: those first that it needs."""
    found: dict[str, str] = {}
    needed: set[str] = set()
    for schema in _at(route):
        found |= {key: _description(value) for key, value in schema.get("properties", {}).items()}
        needed |= set(schema.get("required", ()))
    ranks = {key: (key not in needed, key in _ABOUT) for key in found}
    return {key: found[key] for key in sorted(found, key=ranks.__getitem__)}


def values_at(route: Route) -> list[str]:
    """The values that the one at a route is chosen from; empty if it is free."""
    found: list[str] = []
    for schema in _at(route):
        found += [str(value) for value in schema.get("enum", ()) if value != ""]
        if "const" in schema:
            found.append(_spelled(schema["const"]))
    return list(dict.fromkeys(found))


def describe_key(route: Route) -> str:
    """What the schema says of the key at the end of a route."""
    return keys_at(route[:-1]).get(str(route[-1]), "") if route else ""


def _spelled(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _at(route: Route) -> list[Schema]:
    """The schemas that the value at a route may follow."""
    present = list(_alternatives(_schema()))
    for step in route:
        below = [found for schema in present for found in _below(schema, step)]
        present = [found for schema in below for found in _alternatives(schema)]
    return present


def _below(schema: Schema, step: str | int) -> Iterator[Schema]:
    if isinstance(step, int):
        items = schema.get("prefixItems", ())
        if step < len(items):
            yield items[step]
        elif isinstance(schema.get("items"), dict):
            yield schema["items"]
        elif step < len(ROW_KEYS) and ROW_KEYS[step] in schema.get("properties", {}):
            yield schema["properties"][ROW_KEYS[step]]
    elif step in schema.get("properties", {}):
        yield schema["properties"][step]
    elif isinstance(schema.get("additionalProperties"), dict):
        yield schema["additionalProperties"]


def _alternatives(schema: Schema) -> Iterator[Schema]:
    """A schema with its reference followed, or all of which it may be one."""
    reference = schema.get("$ref")
    if reference:
        yield from _alternatives(_schema()["$defs"][reference.rpartition("/")[2]])
    for member in schema.get("anyOf", ()):
        yield from _alternatives(member)
    yield schema


def _description(schema: Schema) -> str:
    for found in (schema, *_alternatives(schema)):
        if found.get("description"):
            return str(found["description"])
    return ""


# The parameters of the operator or function whose arguments are being written.


_NAME = re.compile(r"[^\W\d]\w*$")
_TEXT = re.compile(r"\"[^\"]*\"|'[^']*'")
_OPENING = {")": "(", "]": "[", "}": "{"}
_BUILT_IN: dict[str, tuple[str, str, str]] = {
    "fresh": ("x.peer.element", "bool", "a value became visible since the previous period"),
    "present": ("x.peer.element", "bool", "the element has received a value at least once"),
    "near": (
        "a, b, tolerance, angle",
        "bool",
        "numbers or vectors within a tolerance; two poses within a distance and an angle",
    ),
    "all": ("test for v in list", "bool", "for every item of a list or component of a vector"),
    "any": ("test for v in list", "bool", "for some item of a list or component of a vector"),
    "argmax": ("number for v in list", "item", "the item for which the number is largest"),
    "argmin": ("number for v in list", "item", "the item for which the number is smallest"),
    "inverse": ("X", "pose", "pose[B, A] of a pose[A, B]"),
    "position": ("X", "vector[3, m]", ""),
    "identity": ("", "pose", "between the frames that the place requires"),
    "translation": ("x, y, z", "pose", "between the frames that the place requires"),
    "pose": ("p, q", "pose", "q is a quaternion (x, y, z, w)"),
    "len": ("list", "int", "number of items"),
    "norm": ("v", "real", "length of a vector, in its unit"),
    "abs": ("a", "number", ""),
    "min": ("a, b, ...", "number", "numbers of one unit"),
    "max": ("a, b, ...", "number", "numbers of one unit"),
    "sqrt": ("a", "real", "half the powers of the unit"),
}


@frozen
class Signature:
    """How a call is written; `active` counts the argument at the cursor from 0."""

    label: str
    parameters: tuple[str, ...]
    words: str
    active: int


def signature(index: Index | None, text: str, offset: int) -> Signature | None:
    """The innermost call around an offset of a text, however unfinished the call is."""
    for cursor in cursors(text, offset):
        role = role_of(cursor.route)
        if role is None or role.form not in ("constant", "initial", "full", "argument"):
            continue
        found = _call(_TEXT.sub(lambda match: "_" * len(match.group()), cursor.before))
        if found is not None:
            return _of(index, *found)
    return None


def _call(before: str) -> tuple[str, int] | None:
    """The name in front of the innermost open bracket, and the commas behind it."""
    closed: list[str] = []
    commas = 0
    for at in range(len(before) - 1, -1, -1):
        char = before[at]
        if char in _OPENING:
            closed.append(_OPENING[char])
        elif closed:
            if char == closed[-1]:
                closed.pop()
        elif char == ",":
            commas += 1
        elif char in "([{":
            name = _NAME.search(before, 0, at)
            if char == "(" and name:
                return name.group(), commas
            commas = 0
    return None


def _of(index: Index | None, name: str, active: int) -> Signature | None:
    operators = index.system.operators if index and index.system else ()
    operator = next((o for o in operators if o.name == name), None)
    if operator is not None:
        parameters = tuple(f"{n}: {type_}" for n, type_ in operator.parameters)
        words = " ".join(
            filter(None, [operator.title, f"({operator.trace})" if str(operator.trace) else ""])
        )
        return _signature(name, parameters, str(operator.result), words, active)
    if name in _BUILT_IN:
        listed, result, words = _BUILT_IN[name]
        parameters = tuple(filter(None, listed.split(", ")))
        return _signature(name, parameters, result, words, active)
    return None


def _signature(
    name: str, parameters: tuple[str, ...], result: str, words: str, active: int
) -> Signature:
    label = f"{name}({', '.join(parameters)}) -> {result}"
    return Signature(label, parameters, words, min(active, max(len(parameters) - 1, 0)))
