"""Keys and values that the schema allows at a place, with their descriptions."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

from specc.pipeline import json_schema
from specc.schema import ROW_KEYS
from specc.source import Route

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
