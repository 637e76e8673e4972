"""Frozen classes are those of `dataclass(frozen=True, slots=True)`; mypy refuses changes."""

import pickle
from dataclasses import field, replace

from specc.frozen import frozen


@frozen
class Point:
    x: float
    y: float = 0.0
    note: str = field(default="", compare=False)
    tags: list[str] = field(default_factory=list, hash=False)


@frozen
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
