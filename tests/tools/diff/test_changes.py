"""Every kind of change is found, once, and called what it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.tools.diff import Difference
from tests.seeds import every
from tests.tools.diff.conftest import BASE, Differ, edited

CASES = Path(__file__).parents[2] / "cases"
Edit = tuple[str, str]
Found = tuple[str, str, str, str, str]


def brief(change: Difference) -> Found:
    return change.where, change.part, change.name, change.change, change.aspect


DIFFERENCES: list[tuple[list[Edit], list[Found]]] = [
    ([("mode: {type: Mode, init: stop}", "mode: {type: Mode, init: stop, event: true}"),
      ("creeping: creep}", "creeping: {behaviour: creep, ignores: [x.desk.mode]}}")],
     [("cart.c", "element", "x.desk.mode", "changed", "event"),
      ("cart.c", "state", "creeping", "changed", "ignored events")]),
    ([("creeping: creep}", "creeping: {behaviour: creep, holds: [y.desk.arrived]}}")],
     [("cart.c", "state", "creeping", "changed", "held outputs")]),
    ([("system: cart", "system: trolley")], [("", "system", "", "changed", "name")]),
    ([("v_max: 0.5", "v_max: 0.6")], [
        ("", "constant", "v_max", "changed", "value"),
        ("cart.wheels", "function", "drive", "changed", "y.E.v_d"),
        ("cart.c", "function", "go", "changed", "y.wheels.v_d"),
    ]),
    ([("enum[slow, fast, stop]", "enum[slow, fast, stop, back]")],
     [("", "type", "Mode", "added", "")]),
    ([("mode: Mode}, python", "mode: Mode, due: \"real[s]\"}, python")],
     [("", "type", "Order", "added", "")]),
    ([("cart.orders:Order", "cart.jobs:Order")], [("", "type", "Order", "changed", "class")]),
    ([("cart.maps:Map", "cart.charts:Map")], [("", "type", "Map", "changed", "class")]),
    ([("cart.drive:brake", "cart.drive:slow_down")],
     [("", "operator", "brake", "changed", "function")]),
    ([("(map: Map, s: real[m])", "(s: real[m], map: Map)")],
     [("", "operator", "blocked", "changed", "signature")]),
    ([("rate: 20 Hz", "rate: 25 Hz")], [("cart.c", "subsystem", "cart.c", "changed", "rate")]),
    ([("y: {cart: {order", "y: {cart: {again: bool, order"),
      ("desk: {order: {type", "desk: {again: bool, order: {type")],
     [("cart.c", "element", "x.desk.again", "added", ""),
      ("desk.c", "element", "y.cart.again", "added", "")]),
    ([("desk: {arrived: bool}}", "desk: {arrived: int}}"),
      ("{cart: {arrived: bool}}", "{cart: {arrived: int}}"),
      ("y.desk.arrived: near_goal", "y.desk.arrived: 1 if near_goal else 0")],
     [("cart.c", "element", "y.desk.arrived", "changed", "type"),
      ("cart.c", "function", "tell", "changed", "y.desk.arrived"),
      ("desk.c", "element", "x.cart.arrived", "changed", "type")]),
    ([("mode: {type: Mode, init: stop}", "mode: {type: Mode, init: slow}")],
     [("cart.c", "element", "x.desk.mode", "changed", "initial value")]),
    ([("mode: {type: Mode, init: stop}", "mode: Mode")],
     [("cart.c", "element", "x.desk.mode", "changed", "initial value")]),
    ([("runs: {type: int, init: 0}", "runs: {type: int, init: 1}")],
     [("cart.c", "memory", "runs", "changed", "initial value")]),
    ([("runs: {type: int, init: 0}",
       "runs: {type: int, init: 0}\n        rest: {type: int, init: 0}")],
     [("cart.c", "memory", "rest", "added", "")]),
    ([("d: abs(x.wheels.s - goal)", "d: abs(x.wheels.s - goal - 1[m])")],
     [("cart.c", "let", "d", "changed", "value"),
      ("cart.c", "let", "near_goal", "changed", "value"),
      ("cart.c", "terminal condition", "there", "changed", "meaning"),
      ("cart.c", "error condition", "stuck", "changed", "meaning"),
      ("cart.c", "function", "tell", "changed", "y.desk.arrived")]),
    ([("elapsed > 5[s]", "elapsed > 6[s]")],
     [("cart.c", "error condition", "stuck", "changed", "meaning")]),
    ([("unsent: not fresh(x.desk.order)", "unsent: fresh(x.desk.mode)")],
     [("cart.c", "initial condition", "unsent", "changed", "meaning")]),
    ([("runs: runs + 1", "runs: runs + 2")],
     [("cart.c", "function", "take", "changed", "runs")]),
    ([(", runs: runs + 1", "")], [("cart.c", "function", "take", "changed", "runs")]),
    ([("  go: {functions: [go, tell]", "  go: {functions: [go]")],
     [("cart.c", "behaviour", "go", "changed", "y.desk.arrived")]),
    ([("creep: {functions: [go, tell], terminal: there, error: stuck}",
       "creep: {functions: [go, tell], terminal: there}")],
     [("cart.c", "behaviour", "creep", "changed", "error condition")]),
    ([("terminal: asked", "terminal: always")],
     [("cart.c", "behaviour", "wait", "changed", "terminal condition")]),
    ([("[stand, tell, take], terminal: asked", "[go, tell, take], terminal: asked")],
     [("cart.c", "behaviour", "wait", "changed", "y.wheels.v_d")]),
    ([("initial_state: idle", "initial_state: going")],
     [("cart.c", "initial state", "", "changed", "")]),
    ([("creeping: creep}", "creeping: wait}")],
     [("cart.c", "state", "creeping", "changed", "behaviour")]),
    ([("creeping: creep}", "creeping: creep, done: wait}")],
     [("cart.c", "state", "done", "added", "")]),
    ([("[going, error, always, idle]", "[going, error, always, creeping]")],
     [("cart.c", "row", "going --error--> idle", "removed", ""),
      ("cart.c", "row", "going --error--> creeping", "added", "")]),
    ([("told_else, going", "sent, going")],
     [("cart.c", "row", "idle --terminal--> going", "changed", "condition")]),
    ([("(fresh(x.desk.order) and fresh(x.desk.map))", "fresh(x.desk.map)")],
     [("cart.c", "assumption", "", "removed", ""), ("cart.c", "assumption", "", "added", "")]),
    ([("actuators: [drive]", "actuators: [motor]")],
     [("", "binding", "cart.E.wheels.v_d", "changed", "actuators")]),
    ([(', noise: "0.001[m]"', "")], [("", "binding", "cart.E.wheels.s_m", "changed", "noise")]),
    ([("model: cart.xml", "model: other.xml")], [("", "plant", "", "changed", "model")]),
    ([("model: cart.xml", 'python: "cart.own:Cart"')], [
        ("", "plant", "", "changed", "model"), ("", "plant", "", "changed", "python"),
    ]),
    ([(', noise: "0.001[m]"', ', noise: "0.001[m]", sporadic: true, max_gap: 50 ms')], [
        ("", "binding", "cart.E.wheels.s_m", "changed", "sporadic"),
        ("", "binding", "cart.E.wheels.s_m", "changed", "max_gap"),
    ]),
    ([("from: going", "from: creeping")], [("", "task", "", "changed", "source")]),
    ([(BASE[BASE.index("task:") :], "")], [("", "task", "", "removed", "")]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("edits", "found"), every(2, DIFFERENCES), ids=lambda value: str(value)[:60]
)
def test_differences(edits: list[Edit], found: list[Found], differ: Differ) -> None:
    comparison = differ(BASE, edited(*edits))
    assert sorted(map(brief, comparison.differences)) == sorted(found)


def test_agents_subsystems_and_devices_come_and_go_as_wholes(differ: Differ) -> None:
    agent = (
        "  another:\n    control: {rate: 10 Hz, behaviours: {b: {terminal: never}},"
        " states: {s: b}, initial_state: s}\nplant:"
    )
    more = edited(("plant:", agent))
    (found,) = differ(BASE, more).differences
    assert brief(found) == ("", "agent", "another", "added", "")
    lamp = "    real_effectors:\n      lamp: {x: {on: bool}}\n"
    device = edited(("    real_effectors:\n", lamp))
    (found,) = differ(BASE, device).differences
    assert brief(found) == ("cart", "device", "cart.E.lamp", "added", "")
    eye = (
        "    virtual_receptors:\n      eye: {rate: 10 Hz, behaviours: {b: {terminal: never}},"
        " states: {s: b}, initial_state: s}\n    control:\n      rate: 20"
    )
    subsystem = edited(("    control:\n      rate: 20", eye))
    (found,) = differ(subsystem, BASE).differences
    assert brief(found) == ("cart", "subsystem", "cart.eye", "removed", "")


REMARKS: list[tuple[list[Edit], list[Found]]] = [
    ([("title: Cart\nframes", "title: A cart\nframes")], [("", "system", "", "changed", "title")]),
    ([("W: world", "W: the hall")], [("", "frame", "W", "changed", "")]),
    ([("title: Wheels", "title: Two wheels")],
     [("cart.wheels", "subsystem", "cart.wheels", "changed", "title")]),
    ([("v_max: 0.5[m/s]", "v_max: 500[mm/s]")], []),
    ([("v_max: 0.5[m/s]", "v_max: 0.25[m/s] * 2")],
     [("", "constant", "v_max", "changed", "value")]),
    ([("v_max: 0.5[m/s]", "v_max: 0.5[m/s]\n  v_min: 0.1[m/s]")],
     [("", "constant", "v_min", "added", "")]),
    ([("d < gap", "abs(x.wheels.s - goal) < 0.1[m]")],
     [("cart.c", "let", "near_goal", "changed", "value")]),
    ([("d: abs", "e: abs"), ("d < gap", "e < gap")],
     [("cart.c", "let", "d", "removed", ""), ("cart.c", "let", "e", "added", ""),
      ("cart.c", "let", "near_goal", "changed", "value")]),
    ([("there: near_goal", "arrived: near_goal"), ("terminal: there", "terminal: arrived")],
     [("cart.c", "terminal condition", "there", "changed", "name"),
      ("cart.c", "behaviour", "go", "changed", "terminal condition"),
      ("cart.c", "behaviour", "creep", "changed", "terminal condition")]),
    ([("stand: {y", "halt: {y"), ("[stand", "[halt")],
     [("cart.c", "function", "stand", "removed", ""), ("cart.c", "function", "halt", "added", "")]),
    ([("creep: {", "crawl: {"), (": creep}", ": crawl}")],
     [("cart.c", "behaviour", "creep", "changed", "name"),
      ("cart.c", "state", "creeping", "changed", "behaviour")]),
    ([("runs: runs + 1", "runs: 1 + runs")], [("cart.c", "function", "take", "changed", "runs")]),
    ([("because: the desk sends one at a time", "because: they share a line")],
     [("cart.c", "assumption", "not (fresh(x.desk.order) and fresh(x.desk.map))", "changed",
       "reason")]),
    ([("sent: fresh(x.desk.order)\n", "\n")],
     [("cart.c", "initial condition", "sent", "removed", "")]),
    ([("take: {goal", "take: {eq: 4, title: take it, goal")],
     [("cart.c", "function", "take", "changed", "title"),
      ("cart.c", "function", "take", "changed", "trace")]),
    ([("[going, error, always, idle]",
       "{from: going, cause: error, when: always, to: idle, eq: 7}")],
     [("cart.c", "row", "going --error--> idle", "changed", "trace")]),
    ([("enum[slow, fast, stop]", "enum[stop, slow, fast]")], []),
    ([("brake: {signature: \"(v:", "brake: {signature: \"(speed:")], []),
]  # fmt: skip


@pytest.mark.parametrize(("edits", "found"), every(2, REMARKS), ids=lambda value: str(value)[:60])
def test_changes_that_leave_the_meaning(
    edits: list[Edit], found: list[Found], differ: Differ
) -> None:
    comparison = differ(BASE, edited(*edits))
    assert comparison.differences == ()
    assert sorted(map(brief, comparison.remarks)) == sorted(found)


def test_a_row_is_compared_where_its_cause_occurs(differ: Differ) -> None:
    """`sent` and `unsent` are complements of what `asked` leaves open."""
    old = edited(
        (
            "unsent: not fresh(x.desk.order)",
            "unsent: fresh(x.desk.mode) and not fresh(x.desk.order)",
        ),
    )
    new = edited(("[idle, terminal, unsent, idle]", "[idle, terminal, other, idle]"),
                 ("unsent: not", "other: not"))  # fmt: skip
    comparison = differ(old, new)
    assert comparison.differences == ()
    (row,) = [c for c in comparison.remarks if c.part == "row"]
    assert row.note == "proved equal"


def test_what_a_text_refers_to_may_have_changed(differ: Differ) -> None:
    comparison = differ(BASE, edited(('gap: {is: "0.1[m]"', 'gap: {is: "0.2[m]"')))
    there = next(c for c in comparison.differences if c.name == "there")
    assert (there.old, there.new) == ("near_goal", "near_goal")
    assert "what it refers to has changed" in there.note
    assert there.only_old == ()
    assert there.only_new == (("d < gap (old)", "false"), ("d < gap (new)", "true"))


def test_pairs_of_names_are_told_as_they_are_written(differ: Differ) -> None:
    text = (CASES / "plant" / "ok-ros2.yaml").read_text(encoding="utf-8")
    assert "{B: base_link," in text
    (found,) = differ(text, text.replace("{B: base_link,", "{B: bb,")).differences
    assert (found.old, found.new) == tuple(
        f"B: {name}, E: tool0, S: ft_frame, K: camera" for name in ("base_link", "bb")
    )
