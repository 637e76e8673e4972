"""Modes are explored: their time, ways back into them, and what traces say of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.explorer import Exploration, explore
from specc.tools.explore.timing import mode_timers
from tests.soundness.running import compiled

Tree = dict[str, Any]
HALF_S = "elapsed > 0.5[s]"


def cell(tired: str, *, rate_hz: int = 20, **changes: Any) -> Tree:
    """An arm with a task of two phases that is paused, resumed, and ended when it is `tired`."""
    desk = {
        "rate": f"{rate_hz} Hz",
        "x": {"b": {"go": {"type": "bool", "init": "False"}}},
        "y": {"arm": {"go": "bool"}},
        "functions": {"pass": {"y.arm.go": "x.b.go"}},
        "behaviours": {"look": {"functions": ["pass"], "terminal": "never"}},
        "states": {"S0": "look"},
        "initial_state": "S0",
    }
    arm = {
        "rate": f"{rate_hz} Hz",
        "x": {"desk": {"go": {"type": "bool", "init": "False"}}},
        "memory": {"k": {"type": "int", "init": 0}, "z": {"type": "real[s]", "init": 0}},
        "conditions": {"terminal": {"half": HALF_S, "asked": "x.desk.go"}},
        "functions": {"note": {"z": "elapsed(working)"}},
        "behaviours": {
            "move": {"functions": ["note"], "terminal": "half"},
            "hold": {"terminal": "asked"},
            "end": {"terminal": "never"},
        },
        "states": {"lifting": "move", "placing": "move", "paused": "hold", "halted": "end"},
        "modes": {
            "working": {
                "states": ["lifting", "placing"],
                "initial": "lifting",
                "error": {"tired": tired, "pause": "x.desk.go and elapsed(working) > 0.2[s]"},
            }
        },
        "initial_state": "working",
        "transitions": [
            ["working", "tired", "always", "halted"],
            ["working", "pause", "always", "paused"],
            ["lifting", "terminal", "always", "placing"],
            ["placing", "terminal", "always", "lifting"],
            ["paused", "terminal", "always", "resume(working)"],
        ],
    }
    eye = {
        "rate": f"{rate_hz} Hz",
        "x": {"R": {"go": "bool"}},
        "y": {"c": {"go": "bool"}},
        "through": "identity",
    }
    return {
        "specc": 1.2,
        "system": "cell",
        "agents": {
            "arm": {"control": arm | changes},
            "desk": {
                "real_receptors": {"b": {"y": {"go": "bool"}}},
                "virtual_receptors": {"b": eye},
                "control": desk,
            },
        },
        "plant": {"python": "plant:Plant", "bind": {"desk.R.b.go": {}}},
    }


def explored(tree: Tree, folder: Path, budget: int = 20_000) -> Exploration:
    result = compiled(tree, folder)
    assert result.ok, [d for d in result.diagnostics if d.severity == "error"]
    return explore(result.proofs, budget)


def turns(tree: Tree, folder: Path) -> dict[str, tuple[int, ...]]:
    """The periods of each mode of the arm that are told apart, where others need not be."""
    cone = Abstraction(compiled(tree, folder).proofs).cone("arm.c")
    found = mode_timers(cone, cone.static_values, counts=True)
    return {name: timer.turns for name, timer in found.items()}


@pytest.mark.parametrize(("late_s", "rate_hz"), [(3.6, 20), (60, 50), (3600, 1000)])
def test_the_time_of_a_mode_is_explored_in_few_states(
    late_s: float, rate_hz: int, tmp_path: Path
) -> None:
    there = explored(cell(f"elapsed(working) > {late_s}[s]", rate_hz=rate_hz), tmp_path)
    (one,) = [each for each in there.slices if "arm.c" in each.names]
    assert there.status == "complete"
    assert one.configurations < 500
    assert one.is_timed
    assert not one.widened


def test_time_is_told_apart_where_conditions_turn(tmp_path: Path) -> None:
    last = "elapsed(working) > 3.6[s] and not elapsed(working) > 5[s]"
    assert turns(cell(last), tmp_path) == {"periods(working)": (0, 1, 5, 73, 101)}
    assert turns(cell("k > 5"), tmp_path) == {"periods(working)": (0, 1, 5)}


@pytest.mark.parametrize(
    "other", ["elapsed(working) > elapsed", "elapsed(working) > 1[s] * k", "z > 3[s]"]
)
def test_time_that_is_compared_with_what_changes_is_memory(other: str, tmp_path: Path) -> None:
    assert turns(cell(other), tmp_path) == {}
    assert explored(cell(other), tmp_path)


def test_time_that_nothing_asks_for_is_not_followed(tmp_path: Path) -> None:
    tree = cell("k > 5")
    working = tree["agents"]["arm"]["control"]["modes"]["working"]
    working["error"]["pause"] = "x.desk.go"
    assert turns(tree, tmp_path) == {}
    there = explored(tree, tmp_path)
    assert there.status == "complete"
    assert not any(each.widened for each in there.slices)


def required(tree: Tree, that: str, folder: Path) -> str:
    """The verdict on a requirement."""
    tree["require"] = [{"that": that, "because": "it is so"}]
    (verdict,) = explored(tree, folder).requirements
    return verdict.verdict


@pytest.mark.parametrize(
    ("that", "verdict"),
    [
        ("always(state(arm.c) in {working, paused, halted})", "proved"),
        ("always(working == state(arm.c) implies state(arm.c) in {lifting, placing})", "proved"),
        ("always(state(arm.c) != working or not state(arm.c) not in {working})", "proved"),
        ("always(state(arm.c) == working)", "may be violated"),
        ("always(state(arm.c) not in {working})", "violated"),
    ],
)
def test_requirements_name_modes(that: str, verdict: str, tmp_path: Path) -> None:
    assert required(cell("k > 5"), that, tmp_path) == verdict


def test_a_trace_says_which_mode_is_resumed(tmp_path: Path) -> None:
    tree = cell("k > 5")
    paused = "state(arm.c) == paused"
    that = f"always({paused} implies throughout(9[s], {paused}))"
    tree["require"] = [{"that": that, "because": "it is so"}]
    there = explored(tree, tmp_path)
    (verdict,) = there.requirements
    assert verdict.finding is not None
    steps = [step.message for step in verdict.finding.trace.shown_steps()]
    assert any("from `paused` to `lifting` by `resume(working)`" in step for step in steps)


def test_what_is_required_follows_from_the_time_of_a_mode(tmp_path: Path) -> None:
    """Without pauses the task is tired after 1.8 s, in its fourth phase."""
    tree = cell("elapsed(working) > 1.8[s]")
    errors = tree["agents"]["arm"]["control"]["modes"]["working"]["error"]
    errors["pause"] = "k > 0"
    halted = "state(arm.c) == halted"
    assert required(tree, f"always(once(1.9[s], {halted}) or not {halted})", tmp_path) == "proved"
    assert required(tree, f"within(1.85[s], {halted})", tmp_path) == "proved"
    assert required(tree, f"within(1.8[s], {halted})", tmp_path) == "violated"
