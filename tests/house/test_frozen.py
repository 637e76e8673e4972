"""Frozen classes are those of `dataclass(frozen=True, slots=True)`; mypy refuses changes.

Mutable ones are those of `dataclass(eq=False, repr=False, slots=True)`.
"""

import pickle
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from inspect import signature
from typing import Any

import pytest


@dataclass(frozen=True, slots=True)
class Point:
    x: float
    y: float = 0.0
    note: str = field(default="", compare=False)
    tags: list[str] = field(default_factory=list, hash=False)


@dataclass(frozen=True, slots=True)
class Named(Point):
    name: str = ""


def test_values_are_compared_by_their_fields() -> None:
    assert Point(1.0, note="a") == Point(1.0, note="b")
    assert Point(1.0) != Point(2.0)
    assert Point(1.0, tags=["a"]) != Point(1.0)
    assert Point(1.0) != Named(1.0)
    assert Named(1.0) != Point(1.0)
    nan = float("nan")
    assert Point(nan) == Point(nan)


def test_equal_values_have_equal_hashes() -> None:
    assert len({Point(1.0), Point(1.0, note="b"), Point(1.0, tags=["a"]), Named(1.0)}) == 3


def test_values_are_shown_copied_and_pickled() -> None:
    assert repr(Point(1.0)) == "Point(x=1.0, y=0.0, note='', tags=[])"
    assert replace(Named(1.0), name="a") == Named(1.0, name="a")
    assert pickle.loads(pickle.dumps(Point(1.0, 2.0))) == Point(1.0, 2.0)
    assert not hasattr(Point(1.0), "__dict__")
    match Point(1.0, 2.0):
        case Point(x, y):
            assert (x, y) == (1.0, 2.0)


@dataclass(frozen=True, slots=True)
class Node:
    _: KW_ONLY
    kind: str
    span: tuple[int, int] = (0, 0)


@dataclass(frozen=True, slots=True)
class Leaf(Node):
    value: float
    note: str = ""


@dataclass
class Usual:
    value: float
    note: str = ""
    _: KW_ONLY
    kind: str
    span: tuple[int, int] = (0, 0)


@dataclass(frozen=True, slots=True)
class Doubled:
    value: float
    twice: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "twice", 2.0 * self.value)


@dataclass(frozen=True)
class Far:
    values: tuple[float, ...]

    @cached_property
    def total(self) -> list[float]:
        return [sum(self.values)]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((1.0,), {"kind": "a"}),
        ((1.0, "b"), {"kind": "a", "span": (1, 2)}),
        ((), {"value": 1.0, "kind": "a", "note": "b"}),
        ((), {"kind": "a"}),
        ((1.0,), {}),
        ((1.0, "b", "a"), {}),
        ((1.0,), {"kind": "a", "other": 1}),
    ],
)
def test_values_are_made_as_those_of_any_dataclass(arguments: Any, named: Any) -> None:
    outcomes: list[Any] = []
    for kind in (Leaf, Usual):
        try:
            made = kind(*arguments, **named)
            outcomes.append((made.value, made.note, made.kind, made.span))
        except TypeError as error:
            outcomes.append(str(error).partition("__init__()")[2])
    assert outcomes[0] == outcomes[1]


def test_fields_that_are_computed_are() -> None:
    assert Doubled(2.0).twice == 4.0
    assert list(signature(Leaf).parameters) == list(signature(Usual).parameters)


def test_values_that_remember_keep_what_they_have_computed() -> None:
    far = Far((1.0, 2.0))
    assert far.total is far.total and far == Far((1.0, 2.0))
    assert len({far, Far((1.0, 2.0))}) == 1
    assert replace(far, values=()).total == [0]


@dataclass(frozen=True, eq=False, slots=True)
class Node:
    of: tuple["Node", ...] = ()


def test_interned_values_are_told_apart() -> None:
    leaf = Node()
    assert leaf != Node() and len({leaf, leaf, Node((leaf,))}) == 2
    assert replace(leaf, of=(leaf,)).of == (leaf,)


@dataclass(eq=False, slots=True)
class Counts:
    name: str
    found: list[int] = field(default_factory=list)
    _: KW_ONLY
    seen: dict[str, int] = field(default_factory=dict)
    most: int = 3


def test_things_that_change_have_their_own_defaults() -> None:
    one, other = Counts("a"), Counts("a", [1], seen={"b": 1}, most=4)
    one.found.append(2)
    one.seen["c"] = one.most
    assert (other.found, other.seen, other.most) == ([1], {"b": 1}, 4)
    assert (Counts("a").found, Counts("a").seen) == ([], {})
    assert replace(one, name="b").found is one.found
    assert one != Counts("a", [2], seen={"c": 3}) and len({one, other}) == 2
    assert not hasattr(one, "__dict__")
