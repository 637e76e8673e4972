"""Every term is computed once in a period, only if it is needed, and never outside its guard."""

from __future__ import annotations

from typing import Any

import pytest

from tests.lower.models import Calls, Spec, running

OPERATORS = {
    "f": ("(a: real) -> real", lambda a: a + 1.0),
    "g": ("(a: real) -> real", lambda a: 2.0 * a),
}


def spec(**parts: Any) -> Spec:
    elements = {"c.a": "real", "c.b": "real", "E.m": "real"}
    return Spec(
        x=elements,
        y={"E.u": "real", "E.v": "real"},
        memory={"k": ("real", "0"), "n": ("real", "1")},
        operators=OPERATORS,
        **parts,
    )


def names(calls: Calls) -> list[str]:
    """Operators that were called since last time, in alphabetical order."""
    found = sorted(name for name, _ in calls)
    calls.clear()
    return found


def stepped(subsystem: Any, **inputs: Any) -> int:
    for name, value in inputs.items():
        setattr(subsystem.x, name, value)
    return subsystem.step()


def test_a_let_that_conditions_and_behaviour_need_is_computed_once() -> None:
    s = spec(lets={"w": "f(x.E.m)"})
    system = s.system(
        [s.behaviour("go", {"E.u": "g(w)", "E.v": "g(w)", "k": "w"}, terminal="w > 3")],
        [("go", "terminal", "w > 4", "go"), ("go", "terminal", "w <= 4", "go")],
    )
    for proved in (True, False):
        subsystem, calls = running(system, {n: f for n, (_, f) in OPERATORS.items()}, proved=proved)
        for m, row in ((0.0, -1), (1.0, -1), (2.5, 1), (9.0, 0)):
            assert stepped(subsystem, E_m=m) == row
            assert names(calls) == ["f", "g"]
            assert (subsystem.y.E_u, subsystem.y.E_v) == (2.0 * (m + 1.0),) * 2


def test_equal_subterms_are_computed_once_without_a_let() -> None:
    s = spec()
    system = s.system(
        [s.behaviour("go", {"E.u": "g(f(x.E.m))", "E.v": "g(f(x.E.m)) + f(x.E.m)"})],
        [("go", "terminal", "True", "go")],
    )
    subsystem, calls = running(system, s.functions, proved=True)
    stepped(subsystem, E_m=1.0)
    assert names(calls) == ["f", "g"]
    assert (subsystem.y.E_u, subsystem.y.E_v) == (4.0, 6.0)


def test_what_only_one_branch_needs_is_not_computed_in_the_other() -> None:
    s = spec(lets={"w": "f(x.E.m)"})
    system = s.system(
        [
            s.behaviour("idle", {"E.u": "0"}, terminal="x.E.m > 1"),
            s.behaviour("go", {"E.u": "w", "E.v": "w"}),
        ],
        [("idle", "terminal", "True", "go"), ("go", "terminal", "True", "idle")],
    )
    subsystem, calls = running(system, s.functions, proved=True)
    for m, expected in ((0.0, []), (0.5, []), (2.0, ["f"]), (2.0, [])):
        stepped(subsystem, E_m=m)
        assert names(calls) == expected


@pytest.mark.parametrize("proved", [True, False])
def test_a_guarded_term_is_computed_behind_its_guard_only(proved: bool) -> None:
    s = spec(lets={"w": "f(x.c.a)"})
    system = s.system(
        [
            s.behaviour("idle", {"E.u": "0"}, terminal="fresh(x.c.a) and w > 1 and g(w) < 9"),
            s.behaviour("go", {"E.u": "w"}, terminal="True"),
        ],
        [
            ("idle", "terminal", "w > 2", "go"),
            ("idle", "terminal", "w <= 2", "idle"),
            ("go", "terminal", "not present(x.c.a) or w > 3", "idle"),
            ("go", "terminal", "present(x.c.a) and w <= 3", "go"),
        ],
    )
    subsystem, calls = running(system, s.functions, proved=proved)
    assert stepped(subsystem) == -1  # first period: no conditions, and x.c.a has no value
    assert stepped(subsystem) == -1
    assert names(calls) == []
    subsystem.x.fresh_c_a = subsystem.x.present_c_a = True
    assert stepped(subsystem, c_a=0.0) == -1  # w = 1
    assert names(calls) == ["f"]
    assert stepped(subsystem, c_a=1.5) == 0  # w = 2.5
    assert names(calls) == ["f", "g"]
    assert subsystem.y.E_u == 2.5
    assert stepped(subsystem, c_a=0.5) == 3
    assert names(calls) == ["f"]


def test_a_term_that_only_some_paths_computed_is_computed_once_on_all() -> None:
    """The terminal condition computes w if x.c.a is fresh; staying needs it, leaving does not."""
    s = spec(lets={"w": "f(x.c.a)"})
    system = s.system(
        [
            s.behaviour("wait", {"E.u": "0"}),
            s.behaviour("go", {"E.u": "w"}, terminal="fresh(x.c.a) and w > 1 or x.c.b > 1"),
            s.behaviour("rest", {"E.u": "0"}),
        ],
        [
            ("wait", "terminal", "True", "go"),
            ("go", "terminal", "True", "rest"),
            ("rest", "terminal", "True", "go"),
        ],
    )
    subsystem, calls = running(system, s.functions, proved=True)
    stepped(subsystem)
    assert stepped(subsystem, c_a=0.0, c_b=0.0) == 0
    assert names(calls) == ["f"]
    for fresh, a, b, row, expected in (
        (False, 5.0, 0.0, -1, ["f"]),
        (True, 0.0, 0.0, -1, ["f"]),
        (True, 5.0, 0.0, 1, ["f"]),
    ):
        subsystem.x.fresh_c_a = fresh
        assert stepped(subsystem, c_a=a, c_b=b) == row
        assert names(calls) == expected
    assert stepped(subsystem) == 2
    names(calls)
    subsystem.x.fresh_c_a = False
    assert stepped(subsystem, c_b=2.0) == 1
    assert names(calls) == []


def test_an_optional_term_reaches_the_behaviour_from_every_path() -> None:
    """Whichever operand of `or` ended the behaviour, the next one computes w at most once."""
    s = spec(lets={"w": "f(x.c.a)"})
    system = s.system(
        [s.behaviour("go", {"E.u": "w if x.E.m > 0 else 0"}, terminal="x.c.b > 0 or w > 1")],
        [("go", "terminal", "True", "go")],
    )
    subsystem, calls = running(system, s.functions, proved=True)
    for b, a, m, row, expected in (
        (0.0, 0.0, 0.0, -1, []),
        (1.0, 0.0, 1.0, 0, ["f"]),
        (1.0, 0.0, 0.0, 0, []),
        (0.0, 1.0, 1.0, 0, ["f"]),
        (0.0, 0.0, 1.0, -1, ["f"]),
    ):
        assert stepped(subsystem, c_a=a, c_b=b, E_m=m) == row
        assert names(calls) == expected
        assert subsystem.y.E_u == (a + 1.0 if m else 0.0)


def fails_at_nine(a: float) -> float:
    if a == 9.0:
        raise ValueError(a)
    return a


def entering(test: str, rows: tuple[str, ...], proved: bool) -> Any:
    """`wait` ends by `test` and goes on to `go`, by whichever of `rows`; both compute w."""
    s = spec(lets={"w": "f(x.E.m)"})
    system = s.system(
        [s.behaviour("wait", {"E.v": "w"}, terminal=test), s.behaviour("go", {"E.u": "w"})],
        [
            *(("wait", "terminal", row, "go") for row in rows),
            ("go", "terminal", "w > 3", "wait"),
            ("go", "terminal", "w <= 3", "wait"),
        ],
    )
    subsystem, _ = running(system, {**s.functions, "f": fails_at_nine}, proved=proved)
    stepped(subsystem, E_m=0.0, c_a=0.0, c_b=1.0)
    return subsystem


@pytest.mark.parametrize("proved", [True, False])
def test_what_a_behaviour_computes_fails_in_the_state_that_is_entered(proved: bool) -> None:
    for test, rows in (
        ("x.c.a > 0", ("True",)),
        ("x.c.a > 0", ("x.c.a > 1",)),
        ("x.c.a > 0", ("x.c.a <= 1", "x.c.a > 1")),
        ("x.c.a > 0", ("x.c.a <= 1 and w > 1", "x.c.a > 1 or w <= 1")),
        ("x.c.a > 0 and (x.c.b > 0 or w > 1)", ("x.c.a > 1",)),
    ):
        subsystem = entering(test, rows, proved)
        with pytest.raises(ValueError, match="9"):
            stepped(subsystem, E_m=9.0, c_a=2.0)
        assert subsystem.state == "go", (test, rows)
        subsystem = entering(test, rows, proved)
        with pytest.raises(ValueError, match="9"):
            stepped(subsystem, E_m=9.0)
        assert subsystem.state == "wait", (test, rows)


@pytest.mark.parametrize("proved", [True, False])
def test_what_a_condition_computes_fails_in_the_state_that_it_ends(proved: bool) -> None:
    for test, rows in (
        ("w > 3", ("True",)),
        ("x.c.a > 0 and w > 1", ("True",)),
        ("x.c.a > 0", ("w > 1", "w <= 1")),
        ("x.c.a > 0", ("x.c.b > 0 and w > 1", "x.c.b <= 0 or w <= 1")),
    ):
        subsystem = entering(test, rows, proved)
        with pytest.raises(ValueError, match="9"):
            stepped(subsystem, E_m=9.0, c_a=2.0)
        assert subsystem.state == "wait", (test, rows)


def test_functions_take_effect_at_once_whatever_their_order() -> None:
    swap = {"k": "n", "n": "k", "E.u": "k - n"}
    for assignments in (swap, dict(reversed(swap.items()))):
        s = spec()
        system = s.system([s.behaviour("go", assignments)], [("go", "terminal", "True", "go")])
        subsystem, _ = running(system, s.functions, proved=True)
        for k, n in ((1.0, 0.0), (0.0, 1.0), (1.0, 0.0)):
            stepped(subsystem)
            assert (subsystem.memory.k, subsystem.memory.n) == (k, n)
            assert subsystem.y.E_u == n - k


def test_time_in_a_state_is_counted_from_its_start() -> None:
    s = spec()
    system = s.system(
        [
            s.behaviour("go", {"E.u": "1 if entered else 0"}, terminal="elapsed >= 0.005[s]"),
            s.behaviour("back", {"E.u": "0"}),
        ],
        [("go", "terminal", "True", "back"), ("back", "terminal", "True", "go")],
    )
    subsystem, _ = running(system, s.functions, proved=True)
    rows, entered = [], []
    for _ in range(9):
        rows.append(stepped(subsystem))
        entered.append(subsystem.y.E_u)
    assert rows == [-1, -1, -1, 0, 1, -1, -1, 0, 1]
    assert entered == [1, 0, 0, 0, 1, 0, 0, 0, 1]


def test_a_term_of_the_clock_is_computed_anew_when_a_state_is_entered() -> None:
    s = spec(lets={"w": "f(elapsed * (1/period))"})
    system = s.system(
        [s.behaviour("go", {"E.u": "w"}, terminal="w > 2")],
        [("go", "terminal", "True", "go")],
    )
    subsystem, calls = running(system, s.functions, proved=True)
    seen = []
    for _ in range(5):
        stepped(subsystem)
        seen.append((subsystem.y.E_u, len(names(calls))))
    assert seen == [(1.0, 1), (2.0, 1), (1.0, 2), (2.0, 1), (1.0, 2)]
