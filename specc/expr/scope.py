"""What the names in an expression stand for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from specc.model.expr import Expr
from specc.model.system import Operator
from specc.model.types import Enum, Type
from specc.source import Place

CLOCK_NAMES = ("elapsed", "entered", "period")
BUILTIN_NAMES = (
    "abs", "all", "any", "argmax", "argmin", "fresh", "identity", "inverse", "len", "max", "min",
    "near", "norm", "pose", "position", "present", "sqrt", "translation",
)  # fmt: skip
RESERVED = frozenset({"True", "False", "x", "y", "_", *CLOCK_NAMES, *BUILTIN_NAMES})
"""Names of the language; a specification gives them to nothing of its own."""


@dataclass(frozen=True, slots=True)
class Declared:
    """Where a name is declared, and what it stands for if it is a `let` or a constant."""

    place: Place
    value: Expr | None = None


@dataclass(frozen=True)
class Scope:
    """The names that an expression may use. A name is looked up in the order of the fields."""

    bound: Mapping[str, Type] = field(default_factory=dict)
    """Variables of the quantifiers around the expression."""
    memory: Mapping[str, Type] = field(default_factory=dict)
    lets: Mapping[str, Type] = field(default_factory=dict)
    constants: Mapping[str, Type] = field(default_factory=dict)
    files: Collection[str] = ()
    enums: Mapping[str, tuple[Enum, ...]] = field(default_factory=dict)
    """Member -> the enums that have it; the expected type chooses among several."""
    operators: Mapping[str, Operator] = field(default_factory=dict)
    inputs: Mapping[tuple[str, str], Type] = field(default_factory=dict)
    """Peer and element -> type, for `x.peer.element`."""
    peers: Collection[str] = ()
    """Peers in x whose buffer has no elements; the others follow from `inputs`."""
    declared: Mapping[str, Declared] = field(default_factory=dict)
    """Declarations of memory, lets, constants and inputs, these as `x.peer.element`."""
    later: Collection[str] = ()
    """Memory and lets, which have no value yet where the expression is evaluated."""
    allow_inputs: bool = True
    allow_memory: bool = True
    """Memory and lets, which may depend on memory."""
    allow_clock: bool = False

    def binding(self, name: str, type: Type) -> Scope:
        """The scope inside a quantifier over `name`."""
        return replace(self, bound={**self.bound, name: type})

    def value(self, name: str) -> tuple[str, Type] | None:
        """Kind and type of a named value, or None: the name may still be a member or a file."""
        for kind in ("bound", "memory", "lets", "constants"):
            found: Type | None = getattr(self, kind).get(name)
            if found is not None:
                return kind, found
        return None

    def values(self) -> Iterator[tuple[str, Type]]:
        """Every named value with its type."""
        if self.allow_memory:
            yield from self.memory.items()
            yield from self.lets.items()
        yield from self.constants.items()

    def elements(self, peer: str) -> dict[str, Type]:
        """The elements of the input buffer that is connected to a peer."""
        return {element: type for (p, element), type in self.inputs.items() if p == peer}

    def known_peers(self) -> list[str]:
        """Peers with an input buffer, in order."""
        return list(dict.fromkeys([*(peer for peer, _ in self.inputs), *self.peers]))

    def names(self) -> list[str]:
        """Every plain name that stands for something here."""
        values = [*self.memory, *self.lets] if self.allow_memory else []
        clock = CLOCK_NAMES if self.allow_clock else ()
        return [*self.bound, *values, *self.constants, *self.files, *self.enums, *clock]


def members_of(enums: Iterable[Enum]) -> dict[str, tuple[Enum, ...]]:
    """Member -> the enums that have it, as `Scope.enums` wants it."""
    found: dict[str, tuple[Enum, ...]] = {}
    for enum in dict.fromkeys(enums):
        for member in enum.members:
            found[member] = (*found.get(member, ()), enum)
    return found
