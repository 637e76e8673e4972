"""Pairs of specifications, and what the second one is against the first.

Weaker and stronger are said of what is guaranteed or checked where agents do the same; everything
else that is not equal is different.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from specc.tools.diff import compare
from tests.seeds import short
from tests.tools.diff.conftest import Reader

TEXT = (Path(__file__).parent / "pairs.yaml").read_text(encoding="utf-8")
PLAIN = "x.eye.count > 0"

CONDITIONS = [
    # At 10 Hz a state ends a whole number of periods after it began.
    ("elapsed >= 0.3[s]", "elapsed > 0.2[s]", "equal"),
    ("elapsed >= 0.3[s]", "elapsed > 0.25[s]", "equal"),
    ("elapsed >= 0.3[s]", "not elapsed < 0.3[s]", "equal"),
    ("elapsed >= 0.3[s]", "elapsed >= patience", "equal"),
    ("elapsed >= 0.3[s]", "elapsed > 0.3[s]", "different"),
    ("elapsed >= 0.3[s]", "elapsed >= 0.2[s]", "different"),
    ("elapsed > 0.05[s]", "True", "equal"),
    ("elapsed + 0.1[s] > 0.35[s]", "elapsed > 0.2[s]", "equal"),
    ("elapsed > 0.25[s] and elapsed < 0.35[s]", "3 * period <= elapsed <= 3 * period", "different"),
    ("entered", "False", "equal"),
    ("x.eye.count > 0 and elapsed > 0.1[s]", "x.eye.count > 0 and elapsed >= 0.2[s]", "equal"),
    # Integers, and sums of them.
    ("x.eye.count > 0", "x.eye.count >= 1", "equal"),
    ("x.eye.count > 0", "x.eye.count != 0", "equal"),  # it is assumed that it is not negative
    ("x.eye.other > 0", "x.eye.other != 0", "different"),
    ("x.eye.count - x.eye.other > 0", "x.eye.count > x.eye.other", "equal"),
    ("x.eye.count + 1 > x.eye.other", "x.eye.count >= x.eye.other", "equal"),
    ("x.eye.count > 2", "x.eye.count > 3", "different"),
    ("x.eye.count > 2 and x.eye.count > 3", "x.eye.count > 3", "equal"),
    ("x.eye.count == 1 and x.eye.count == 2", "False", "equal"),
    # Floats: a difference of two is positive just where one is more, however small it is.
    ("x.eye.far - x.eye.near_by > 0", "x.eye.far > x.eye.near_by", "equal"),
    ("x.eye.far - x.eye.near_by <= 0", "not x.eye.far > x.eye.near_by", "equal"),
    ("0 <= x.eye.near_by - x.eye.far", "x.eye.far <= x.eye.near_by", "equal"),
    ("gap > 0", "x.eye.far > x.eye.near_by", "equal"),
    ("x.eye.far - 1[m] > 0", "x.eye.far > 1[m]", "equal"),
    ("x.eye.far + 1[m] > x.eye.near_by + 1[m]", "x.eye.far > x.eye.near_by", "different"),
    ("near(x.eye.far, x.eye.near_by, limit)", "abs(x.eye.far - x.eye.near_by) <= limit", "equal"),
    ("near(x.eye.far, x.eye.near_by, limit)", "abs(x.eye.near_by - x.eye.far) <= limit", "equal"),
    ("near(x.eye.far, x.eye.near_by, limit)", "abs(gap) < limit", "different"),
    ("near(x.eye.far, x.eye.near_by, limit)", "abs(gap) <= 2[m]", "equal"),
    ("near(x.eye.far, x.eye.near_by, limit)", "near(x.eye.far, x.eye.near_by, 1[m])", "different"),
    ("abs(x.eye.far) > 1[m]", "x.eye.far > 1[m] or x.eye.far < -1[m]", "equal"),
    ("abs(x.eye.far) > 1[m]", "x.eye.far > 1[m]", "different"),
    ("max(x.eye.far, gap) > limit", "x.eye.far > limit or gap > limit", "equal"),
    ("2 * x.eye.far > 4[m]", "x.eye.far > 2[m]", "equal"),
    # Members, truth values, arrival.
    ("x.eye.mode != off", "x.eye.mode in {dim, full}", "equal"),
    ("x.eye.mode != off", "x.eye.mode == dim", "different"),
    ("x.eye.alarm == True", "x.eye.alarm", "equal"),
    ("fresh(x.eye.alarm) or present(x.eye.alarm)", "True", "equal"),
    ("fresh(x.eye.far) and x.eye.far > limit", "x.eye.far > limit and fresh(x.eye.far)", "equal"),
    ("x.eye.alarm if x.eye.count > 0 else False", "x.eye.count > 0 and x.eye.alarm", "equal"),
    ("x.eye.count >= 0", "True", "equal"),
]  # fmt: skip

ASSUMED = '        - {that: "x.eye.count >= 0", because: it is counted}\n'
REQUIRED = '  - {that: "always(lamp.c.runs >= 0)", because: they are counted}\n'
EDITS = [
    # What is guaranteed of inputs, and checked in runs.
    ("init: 0, event: true", "init: 0, event: false", "weaker"),
    ("init: 0, event: true", "init: 0", "weaker"),
    ("mode: {type: Mode, init: dim}", "mode: {type: Mode, init: dim, event: true}", "stronger"),
    (", max_age: 200 ms", "", "weaker"),
    ("max_age: 200 ms", "max_age: 300 ms", "weaker"),
    ("max_age: 200 ms", "max_age: 0.2 s", "equal"),
    ("max_age: 200 ms", "max_age: 100 ms", "stronger"),
    (', safe: {is: "0", otherwise: "0.5"}', "", "weaker"),
    (', otherwise: "0.5"', "", "weaker"),
    ('is: "0", otherwise', 'is: "0.1", otherwise', "different"),
    ('otherwise: "0.5"', 'otherwise: "1 / 2"', "equal"),
    (", ignores: [x.eye.alarm]", "", "stronger"),
    ("states: {idle: wait", "states: {idle: {behaviour: wait, ignores: [x.eye.alarm]}", "weaker"),
    ("states: {idle: wait", "states: {idle: {behaviour: wait, holds: [y.eye.seen]}", "weaker"),
    (ASSUMED, ASSUMED + ASSUMED.replace("count", "other"), "weaker, weaker"),
    ("      assume:\n" + ASSUMED, "", "weaker, weaker"),
    ("x.eye.count >= 0", "not x.eye.count < 0", "equal"),
    ("because: it is counted", "because: the eye counts it", "equal"),
    ("require:\n" + REQUIRED, "", "weaker"),
    (REQUIRED, REQUIRED + REQUIRED.replace(">= 0", "< 9"), "stronger"),
    ("because: they are counted", "because: they only grow", "equal"),
    # What agents do.
    ("rate: 100 Hz", "rate: 50 Hz", "different"),
    ("enum[off, dim, full]", "enum[off, dim, full, blink]", "different"),
    ("enum[off, dim, full]", "enum[full, dim, off]", "equal"),
    ("patience: 0.3[s]", "patience: 300[ms]", "equal"),
    ("count: {type: int, init: 0}", "count: {type: int, init: 1}", "different"),
    ("runs: {type: int, init: 0}", "runs: {type: int, init: 2 - 2}", "equal"),
    ("runs: runs + 1", "runs: 1 + runs", "equal"),
    ("runs: runs + 1", "runs: runs + 2", "different"),
    ("1 if x.eye.mode == full else 0.5", "0.5 if x.eye.mode != full else 1", "equal"),
    ("y.eye.seen: True", "y.eye.seen: x.eye.mode == x.eye.mode", "equal"),
    (", y.eye.seen: True", "", "different"),
    ("terminal: asked, error: broken", "terminal: asked", "different"),
    ("initial_state: idle", "initial_state: shining", "different"),
    ("[idle, terminal, calm, idle]", "[idle, terminal, calm, shining]", "different"),
    ("[idle, terminal, calm, idle]", "[idle, terminal, otherwise, idle]", "equal"),
    ("shine: {functions", "glow: {functions", "equal"),
    ("let:\n        gap", "let:\n        spare: 2 * limit\n        gap", "equal"),
    ("W: world", "W: hall", "equal"),
    ("system: lamp", "system: light", "different"),
]  # fmt: skip


def conditioned(condition: str) -> str:
    return TEXT.replace("TEST", f'"{condition}"')


@pytest.mark.parametrize("conditions", short([CONDITIONS, CONDITIONS[::4]], 1), ids=len)
def test_pairs(conditions: list[tuple[str, str, str]], read: Reader) -> None:
    system = cache(lambda condition: read(conditioned(condition)))
    wrong = []
    for old, new, expected in conditions:
        for pair in ((old, new), (new, old)):
            found = compare(*map(system, pair)).verdict
            if found != expected:
                wrong.append((*pair, expected, found))
    assert not wrong, "\n".join(map(str, wrong))


OTHER_WAY = {"weaker": "stronger", "stronger": "weaker"}


@pytest.mark.long
def test_edited_pairs(read: Reader) -> None:
    text, wrong = conditioned(PLAIN), []
    base = read(text)
    for old, new, expected in EDITS:
        assert old in text, old
        edited = text.replace(old, new)
        if "glow" in new:
            edited = edited.replace("behaviour: shine", "behaviour: glow")
        there, _, back = expected.partition(", ")
        back = back or OTHER_WAY.get(there, there)
        other = read(edited)
        for pair, said in (((base, other), there), ((other, base), back)):
            found = compare(*pair).verdict
            if found != said:
                wrong.append((old, new, said, found))
    assert not wrong, "\n".join(map(str, wrong))
