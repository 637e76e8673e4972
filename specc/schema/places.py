"""What stands where in a file: by routes alone, so it holds for files with errors too."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate

from specc.schema.files import DeviceDef, SpecFile
from specc.schema.keys import (
    OTHERS,
    Key,
    ListKind,
    LiteralKind,
    MappingKind,
    Role,
    SymbolKind,
    Text,
    Traced,
    ValueKind,
    is_model,
)
from specc.schema.subsystem import SubsystemDef
from specc.source import Route


@dataclass(frozen=True, slots=True)
class SchemaNode:
    """A value on the way down a file: its kind, None if the schema has none for it, the key that
    it stands below, and what its own name defines. That may be a name which somebody has chosen.
    """

    kind: ValueKind | None
    key: Key | None = None
    defines: SymbolKind | None = None
    is_chosen: bool = False

    def below(self, step: str | int, value: object = None) -> SchemaNode:
        """The node one step below, where some value stands if that is known."""
        kind = self.kind
        if is_model(kind):
            name = str(step)
            if isinstance(step, int) and step < len(kind.row):
                name = kind.row[step]
            if (key := kind.keys.get(name)) and (key.name == OTHERS or kind.is_key(name, value)):
                return SchemaNode(key.kind, key, key.defines if is_model(key.kind) else None)
            others = kind.keys.get(OTHERS)
            return SchemaNode(others.kind, others).below(name) if others else UNKNOWN
        if isinstance(kind, ListKind):
            return SchemaNode(kind.item, self.key)
        if isinstance(kind, MappingKind):
            inner = kind.value
            named = None if self.key is None or isinstance(inner, MappingKind) else self.key.defines
            return SchemaNode(inner, self.key, named, is_chosen=True)
        return UNKNOWN

    @property
    def scalar_form(self) -> SchemaNode:
        """What a single value is that stands in place of the mapping or the list."""
        if is_model(self.kind) and self.kind.short:
            return self.below(self.kind.short)
        is_alone = isinstance(self.kind, ListKind) and bool(self.kind.form.single)
        return self.below(0) if is_alone else self

    def has_key(self, key: str) -> bool:
        """Whether it is a mapping that has the key."""
        return is_model(self.kind) and key in self.kind.keys

    @property
    def is_table(self) -> bool:
        """Whether it is a list of rows."""
        item = self.kind.item if isinstance(self.kind, ListKind) else None
        return is_model(item) and bool(item.row)


FILE, UNKNOWN = SchemaNode(SpecFile), SchemaNode(None)
TRACED = tuple(Traced.keys)
"""Keys that nearly every mapping takes."""


def walk(route: Route) -> Iterator[SchemaNode]:
    """Yield the schema node at each step of a route."""
    return accumulate(route, SchemaNode.below, initial=FILE)


def node_at(route: Route) -> SchemaNode:
    """The schema node at a route."""
    return reduce(SchemaNode.below, route, FILE)


def split_at_part(route: Route) -> tuple[Route, Route]:
    """Split a route into its subsystem or device, empty for none, and the rest."""
    for size, here in enumerate(walk(route)):
        if here.kind in (SubsystemDef, DeviceDef):
            return route[:size], route[size:]
    return (), route


def is_device(owner: Route) -> bool:
    """Whether the part at a route is a real effector or receptor."""
    return node_at(owner).kind is DeviceDef


def defined_by(route: Route) -> SymbolKind | None:
    """The kind of symbol that the key at the end of a route defines."""
    return node_at(route).defines


def role_of(route: Route) -> Role | None:
    """What the value at a route is; rows of a table may be lists or mappings."""
    kind = node_at(route).scalar_form.kind
    return kind.role if isinstance(kind, Text) else None


def names_used_file(route: Route) -> bool:
    """Whether a value names a file whose definitions or description are used."""
    return route[:1] == ("use",) or (route[-1:] == ("use",) and route[0] != "files")


def keys_at(route: Route) -> dict[str, str]:
    """The keys of the mapping at a route, with their descriptions: those first that it needs."""
    kind = node_at(route).kind
    found = [key for key in kind.keys.values() if key.name != OTHERS] if is_model(kind) else []
    found.sort(key=lambda key: (not key.needed, key.name in TRACED))
    return {key.name: key.about for key in found}


def values_at(route: Route) -> list[str]:
    """The values that the one at a route is chosen from, beside names; empty if it is free."""
    kind = node_at(route).scalar_form.kind
    if isinstance(kind, Text) and kind.role and kind.role.form == "name":
        return list(kind.examples)
    values = kind.values if isinstance(kind, LiteralKind) else ()
    return [str(v).lower() if isinstance(v, bool) else str(v) for v in values if v != ""]
