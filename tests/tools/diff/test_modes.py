"""Modes in comparisons: a row of the file is one difference, and notation is none."""

from __future__ import annotations

import pytest

from specc.tools.diff import Comparison
from tests.commands import ROOT
from tests.seeds import every
from tests.tools.diff.conftest import Differ

ARM = (ROOT / "tests/tools/modes.yaml").read_text(encoding="utf-8")
FLAT = """
specc: 1.2
system: arm
agents:
  arm:
    control:
      rate: 20 Hz
      memory: {k: {type: int, init: 0}, stop: {type: bool, init: False}}
      conditions:
        terminal: {there: "elapsed > 0.5[s]", reset: not stop}
        error: {off: stop}
      functions: {try: {k: k + 1, stop: k > 5}}
      behaviours:
        move: {functions: [try], terminal: there, error: off}
        brake: {functions: [try], terminal: reset}
      states: {a: move, b: move, c: move, d: move, halted: brake}
      initial_state: a
      transitions:
        - [[a, b, c, d], error, always, halted]
        - [a, terminal, always, b]
        - [b, terminal, always, c]
        - [c, terminal, always, d]
        - [d, terminal, always, a]
        - [halted, terminal, always, a]
"""
Edits = list[tuple[str, str]]


def edited(text: str, edits: Edits) -> str:
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def brief(comparison: Comparison) -> list[str]:
    return [f"{d.part} {d.name} {d.change} {d.aspect}".strip() for d in comparison.differences]


OFF_TO_MODE = [
    ("terminal: there, error: off", "terminal: there"),
    ("[[a, b, c, d], error", "[m, off"),
]


@pytest.mark.parametrize(
    "edits",
    [
        [
            (
                "      initial_state",
                "      modes: {m: {states: [a, b, c, d]}}\n      initial_state",
            ),
            ("[[a, b, c, d],", "[m,"),
        ],
        [
            (
                "      initial_state",
                "      modes: {m: {states: [a, n]}, n: {states: [b, c, d]}}\n      initial_state",
            ),
            ("[[a, b, c, d],", "[m,"),
        ],
        [
            (
                "      initial_state",
                "      modes: {m: {states: [a, b, c, d], error: {off: stop}}}\n      initial_state",
            ),
            *OFF_TO_MODE,
        ],
    ],
)
def test_a_list_of_states_as_a_mode_is_no_difference(edits: Edits, differ: Differ) -> None:
    for pair in ((FLAT, edited(FLAT, edits)), (edited(FLAT, edits), FLAT)):
        comparison = differ(*pair)
        assert brief(comparison) == []
        assert {"mode"} <= {remark.part for remark in comparison.remarks}


def test_a_state_that_has_no_error_any_more_is_a_difference(differ: Differ) -> None:
    modes = "      modes: {m: {states: [a, b, c], error: {off: stop}}}\n      initial_state"
    comparison = differ(FLAT, edited(FLAT, [("      initial_state", modes), *OFF_TO_MODE]))
    assert brief(comparison) == [
        "behaviour move changed error condition",
        "row d --error--> halted removed",
    ]


@pytest.mark.parametrize(
    ("edits", "found"),
    every(2, [
        (
            [("[working, tired, always, failed]", "[working, tired, always, halted]")],
            ["row working --tired--> failed removed", "row working --tired--> halted added"],
        ),
        (
            [("[picking, error, again",
              "[[looking, approaching, grasping, lifting], error, again")],
            [],
        ),
        (
            [("error: {tripped: x.desk.halt}", 'error: {tripped: "x.desk.halt or x.desk.pause"}')],
            ["error condition powered.tripped changed meaning"],
        ),
        (
            [
                (", pause: x.desk.pause}", "}"),
                ("        - [working, pause, always, paused]\n", ""),
            ],
            [
                "mode working changed error condition pause",
                "row working --pause--> paused removed",
            ],
        ),
        (
            [
                (
                    'tired: "elapsed(working) > 60[s]", pause: x.desk.pause',
                    'pause: x.desk.pause, tired: "elapsed(working) > 60[s]"',
                )
            ],
            ["mode working changed order of error conditions"],
        ),
        (
            [("initial: carrying", "initial: lowering")],
            ["row lifting --terminal--> carrying removed",
             "row lifting --terminal--> lowering added"],
        ),
        ([("title: the task", "title: a task")], []),
        (
            [("resume(working)", "working")],
            ["row paused --terminal--> resume(working) removed",
             "row paused --terminal--> looking added"],
        ),
    ]),
)  # fmt: skip
def test_differences(edits: Edits, found: list[str], differ: Differ) -> None:
    assert brief(differ(ARM, edited(ARM, edits))) == found


def test_entering_a_mode_anew_is_an_effect_of_a_row(differ: Differ) -> None:
    old = edited(
        ARM, [("[backing, terminal, always, waiting]", "[backing, terminal, always, looking]")]
    )
    new = edited(
        old, [("[backing, terminal, always, looking]", "[backing, terminal, always, working]")]
    )
    (found,) = differ(old, new).differences
    assert (found.name, found.aspect) == ("backing --terminal--> looking", "effect on modes")
    assert (found.old, found.new) == ("none", "enters working")


def test_a_state_of_another_mode_is_told_by_what_it_changes(differ: Differ) -> None:
    new = edited(
        ARM,
        [
            ("[picking, placing, retrying]", "[picking, placing]"),
            ("[booting, homing, waiting, working, paused]",
             "[booting, homing, waiting, working, paused, retrying]"),
        ],
    )  # fmt: skip
    comparison = differ(ARM, new)
    assert brief(comparison) == [
        "mode working changed states",
        "state retrying changed error condition tired",
        "state retrying changed error condition pause",
        "row retrying --pause--> paused removed",
        "row retrying --tired--> failed removed",
        "row picking --error--> retrying changed effect on modes",
        "row retrying --slow--> failed changed effect on modes",
        "row retrying --terminal--> looking changed effect on modes",
        "row retrying --tripped--> halted changed effect on modes",
    ]
