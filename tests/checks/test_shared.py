"""What is refuted of the rows of several states for one reason is told once."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.diagnostics import Diagnostic
from specc.pipeline import compile_spec

SPEC = """specc: 1
system: demo
agents:
  a:
    control:
      rate: 10 Hz
      y: {m: {d: real, go: int}}
      functions: {send: {y.m.d: 1, y.m.go: 1}}
      behaviours: {work: {functions: [send]}, rest: {}}
      states: {S0: work, S1: rest}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {c: {d: {type: real, init: 0}, go: {type: int, init: 0}}}
        conditions:
          initial: {%s}
          terminal: {late: "elapsed > 1[s]", later: "elapsed > 2[s]", came: fresh(x.c.d)}
          error: {lost: "elapsed > 9[s]"}
        behaviours:
          idle: {terminal: always}
          late: {terminal: late}
          later: {terminal: later}
          came: {terminal: came}
          failing: {terminal: late, error: lost}
        states: {%s}
        initial_state: S0
        transitions:
%s
"""
GAP = ("go_on: fresh(x.c.go)", "stay: not fresh(x.c.go) and not fresh(x.c.d)")
OVERLAP = ("go_on: fresh(x.c.go)", "stay: not fresh(x.c.go) or fresh(x.c.d)")


def told(tmp_path: Path, conditions: tuple[str, str], *behaviours: str) -> list[Diagnostic]:
    """The findings about rows of states with these behaviours, which all ask the same."""
    states = [f"S{index}" for index in range(len(behaviours))]
    names = [condition.partition(":")[0] for condition in conditions]
    following = [*states[1:], "S0"]
    rows = [
        f"          - [{state}, terminal, {name}, {to}]"
        for state, next_ in zip(states, following, strict=True)
        for name, to in zip(names, (next_, state), strict=True)
    ]
    rows += [
        f"          - [{state}, error, always, S0]"
        for state, behaviour in zip(states, behaviours, strict=True)
        if behaviour == "failing"
    ]
    machine = ", ".join(f"{s}: {b}" for s, b in zip(states, behaviours, strict=True))
    quoted = ", ".join('{}: "{}"'.format(*c.split(": ")) for c in conditions)
    path = tmp_path / "spec.yaml"
    path.write_text(SPEC % (quoted, machine, "\n".join(rows)), encoding="utf-8")
    return [d for d in compile_spec(str(path)).diagnostics if d.code in ("E0601", "E0602")]


def others(finding: Diagnostic) -> list[object]:
    said = (related for related in finding.related if related.message.endswith(", too"))
    return [related.place.route[-1] for related in said]


@pytest.mark.parametrize("conditions", [GAP, OVERLAP])
def test_states_that_fail_alike_have_one_finding(
    conditions: tuple[str, str], tmp_path: Path
) -> None:
    (finding,) = told(tmp_path, conditions, "idle", "idle", "idle")
    assert "of states `S0`, `S1` and `S2`" in finding.message
    assert others(finding) == ["S1", "S2"]
    assert "each of these states" in finding.help


@pytest.mark.parametrize("conditions", [GAP, OVERLAP])
def test_a_state_that_ends_more_seldom_fails_for_the_same_reason(
    conditions: tuple[str, str], tmp_path: Path
) -> None:
    (finding,) = told(tmp_path, conditions, "later", "failing", "idle", "late")
    assert "of states `S0`, `S1` and 2 more" in finding.message
    assert others(finding) == ["S1", "S2", "S3"]
    assert "elapsed" not in finding.message


def test_ends_that_have_nothing_to_do_with_each_other_are_told_apart(tmp_path: Path) -> None:
    found = told(tmp_path, GAP, "later", "came")
    assert [others(finding) for finding in found] == [[], []]
    assert [str(finding.primary.route[-1]) for finding in found] == ["S0", "S1"]


def test_what_holds_in_one_state_only_is_told_of_this_one(tmp_path: Path) -> None:
    complete = ("go_on: fresh(x.c.d)", "stay: not fresh(x.c.d) and elapsed > 1[s]")
    (finding,) = told(tmp_path, complete, "idle", "later", "late")
    assert "of state `S0`" in finding.message
    assert others(finding) == []


def test_many_states_are_counted(tmp_path: Path) -> None:
    (finding,) = told(tmp_path, GAP, *["idle"] * 30)
    assert "of states `S0`, `S1` and 28 more" in finding.message
    assert len(others(finding)) == 12
