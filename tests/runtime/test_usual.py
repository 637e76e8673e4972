"""The lines that know a usual value take nothing that their contract refuses."""

from __future__ import annotations

import math
from dataclasses import make_dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime import contracts as c
from specc_runtime.contracts import Unfit, WrongValue, operator
from specc_runtime.usual import usual_of

from tests.seeds import how_many

FLOATS = st.floats(width=64) | st.floats(-1.0, 1.0) | st.sampled_from((-0.0, 1e-9, 1e-3, 1.7e308))
SCALARS = FLOATS | st.integers() | st.booleans() | st.text() | st.none() | st.just("u")
VECTORS = st.lists(FLOATS, min_size=2, max_size=4).map(np.array)
MATRICES = st.lists(FLOATS, min_size=16, max_size=16).map(lambda n: np.array(n).reshape(4, 4))


class Motion(NamedTuple):
    speed: Any
    kind: Any
    build: Any


RECORD = c.as_record(Motion, speed=c.as_vector(3), build=c.as_pose, kind=c.as_member("u", "c"))
RECORDS = st.builds(Motion, VECTORS, SCALARS, MATRICES | st.just(np.eye(4)))
CONTRACTS = (
    c.as_bool, c.as_int, c.as_real, c.as_text, c.as_member("u", "c"), c.as_vector(3), c.as_pose,
    c.as_instance(float), RECORD,
)  # fmt: skip


def outcome(contract: Any, value: Any) -> Any:
    """What a contract makes of a value, or says of it."""
    try:
        return _plain(contract(value))
    except Unfit as unfit:
        return unfit.came, unfit.wanted


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tobytes(), value.shape, value.dtype, value.flags.writeable
    if isinstance(value, tuple):
        return (type(value), *map(_plain, value))
    return type(value), repr(value)


@settings(max_examples=how_many(60), deadline=None)
@given(SCALARS | VECTORS | MATRICES | RECORDS)
def test_a_contract_is_what_it_is_without_its_lines(value: Any) -> None:
    for contract in CONTRACTS:
        assert outcome(contract, value) == outcome(contract.__wrapped__, value)


def rotation(angles: Any) -> np.ndarray[Any, Any]:
    """A pose by three angles."""
    pose = np.eye(4)
    for axis, angle in enumerate(angles):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(4)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[i, j], turn[j, i] = -math.sin(angle), math.sin(angle)
        pose = pose @ turn
    return pose


@settings(max_examples=how_many(200), deadline=None)
@given(
    st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3),
    st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9),
    st.sampled_from((0.0, 1e-12, 1e-10, 1e-9, 1e-5, 1e-4, 1e-3, 1e-2)),
)
def test_what_is_nearly_a_rotation(angles: Any, off: Any, size: float) -> None:
    pose = rotation(angles)
    pose[:3, :3] += size * np.array(off).reshape(3, 3)
    for X in (pose, -pose, pose * (1.0, 1.0, -1.0, 1.0), pose.T.copy(), np.asfortranarray(pose)):
        assert outcome(c.as_pose, X) == outcome(c.as_pose.__wrapped__, X)  # type: ignore[attr-defined]  # as wraps does


def test_no_lines_take_what_is_no_rotation() -> None:
    """Stretched and sheared as far as the squares and the determinant allow."""
    for size in np.geomspace(1e-9, 1e-1, 60):
        for off in (np.diag([size, -size, 0.0]), size * np.eye(3, k=1), size * np.eye(3, k=2)):
            X = np.eye(4)
            X[:3, :3] += off
            if outcome(c.as_pose.__wrapped__, X)[0] != X.tobytes():  # type: ignore[attr-defined]  # as wraps does
                with pytest.raises(Unfit):
                    c.as_pose(X)


def test_an_array_that_nobody_can_change_is_not_copied() -> None:
    six, pose = np.frombuffer(np.ones(6).tobytes()), np.ndarray((4, 4), float, np.eye(4).tobytes())
    assert c.as_vector(6)(six) is six
    assert c.as_pose(pose) is pose
    kept = bytearray(six.tobytes())
    for mine in (np.frombuffer(kept), np.frombuffer(memoryview(kept).toreadonly()), six.copy()):
        assert not np.shares_memory(c.as_vector(6)(mine), mine)


def test_operators_of_the_runtime_and_others_are_called_alike() -> None:
    def alone(a: float) -> float:
        return a

    def with_default(a: float, b: float = 1.0) -> float:
        return a + b

    def many(*a: float) -> float:
        return sum(a)

    assert operator("f", alone, c.as_real, "real")(0.5) == 0.5
    assert operator("f", with_default, c.as_real, "real")(0.5) == 1.5
    assert operator("f", with_default, c.as_real, "real")(0.5, 0.5) == 1.0
    assert operator("f", many, c.as_real, "real")(0.5, 0.5) == 1.0
    assert operator("f", math.sqrt, c.as_real, "real")(4.0) == 2.0
    assert operator("f", alone, c.as_optional(c.as_real), "real")(0.5) == 0.5
    with pytest.raises(WrongValue, match="operator f gave the float nan"):
        operator("f", alone, c.as_real, "real")(math.nan)
    with pytest.raises(TypeError, match="alone"):
        operator("f", alone, c.as_real, "real")(1.0, 2.0)  # type: ignore[call-arg]  # that is it


def test_records_of_any_size_have_a_contract() -> None:
    for size in (1, 30, 200):
        names = [f"n{i}" for i in range(size)]
        kind = make_dataclass("Many", names, frozen=True)
        contract = c.as_record(kind, **dict.fromkeys(names, c.as_int))
        assert contract(kind(*range(size))) == kind(*range(size))
        assert (usual_of(contract) is None) == (size == 200)
        came, _ = outcome(contract, kind(*range(size - 1), "x"))
        assert came == f"the text 'x' as .n{size - 1}"
