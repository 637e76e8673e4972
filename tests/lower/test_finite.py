"""Arithmetic gives finite numbers, or an error; its arrays are read-only, however they are made."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from specc_runtime.builtins import composed

from tests.lower.models import Spec, running

FAR = np.array([1.7e308, -1.7e308])


def stepped(expr: str, kind: str, **inputs: Any) -> Any:
    """What a subsystem sends that computes an expression of its inputs."""
    s = Spec(
        x={"E.v": "vector[2, rad]", "E.X": "pose[A, A]"},
        y={"E.u": kind},
        constants={"HALF": ("real", "0.5")},
    )
    system = s.system([s.behaviour("go", {"E.u": expr}, terminal="False")], [])
    subsystem, _ = running(system, {}, proved=True)
    for name, value in inputs.items():
        setattr(subsystem.x, name, value)
    subsystem.step()
    return subsystem.y.E_u


@pytest.mark.parametrize("expr", ["-x.E.v", "HALF * x.E.v", "x.E.v / 2", "-(HALF * x.E.v) * HALF"])
def test_what_grows_no_larger_is_not_looked_at_and_read_only(expr: str) -> None:
    found = stepped(expr, "vector[2, rad]", E_v=FAR)
    assert np.isfinite(found).all() and not found.flags.writeable


@pytest.mark.parametrize(
    "expr", ["x.E.v + x.E.v", "2 * x.E.v", "-(2 * x.E.v)", "HALF * (2 * x.E.v)"]
)
def test_what_may_overflow_is_looked_at(expr: str) -> None:
    assert not stepped(expr, "vector[2, rad]", E_v=np.ones(2)).flags.writeable
    with pytest.raises(OverflowError, match="not finite"):
        stepped(expr, "vector[2, rad]", E_v=FAR)


def test_composed_poses_are_what_their_matrices_give() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        X, Y = rng.normal(size=(2, 4, 4)) * 10.0 ** rng.integers(-9, 9)
        assert composed(X, Y).tobytes() == (X @ Y).tobytes()


@pytest.mark.parametrize(
    "expr", ["x.E.X @ x.E.X", "x.E.X @ x.E.X @ x.E.X", "inverse(x.E.X @ x.E.X)"]
)
def test_composed_poses_are_finite_and_read_only(expr: str) -> None:
    assert not stepped(expr, "pose[A, A]", E_X=np.eye(4)).flags.writeable
    far = np.eye(4)
    far[0, 3] = 1.7e308
    with pytest.raises(OverflowError, match="not finite"):
        stepped(expr, "pose[A, A]", E_X=far)
