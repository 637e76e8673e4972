"""What is proved of sums holds of the rounded sums of a run, however unpleasant the numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.emit import fill_templates
from specc.lower import lower
from tests.seeds import every, short
from tests.soundness.open_inputs import Findings, tried
from tests.soundness.running import compiled
from tests.soundness.specifications import Tree
from tests.soundness.test_accepted import small
from tests.soundness.values import NASTY

ROUGH = (*NASTY, 0.1, 0.2, 0.3, 0.7, 1 / 3, 1.0000000000000002, 0.30000000000000004, 2**53 + 0.0)
STEPS = 600

TABLES = {
    "order": ("{p} < {q}", "{q} <= {p} and {p} < {r}", "{p} >= {q} and {p} >= {r}"),
    "chain": ("{p} < {q} and {q} < {r}", "{p} < {r} and ({q} <= {p} or {r} <= {q})", "{r} <= {p}"),
    "same sum": ("{p} + {q} < {r}", "{q} + {p} >= {r}"),
    "moved over": ("{p} - {q} > {r}", "{p} <= {q} + {r}"),
    "brackets": ("({p} + {q}) + {r} > 0", "{p} + ({q} + {r}) <= 0"),
    "one more": ("{p} + 1 > {p}",),
    "doubled": ("{p} + {p} > {q}", "2 * {p} <= {q}"),
    "scaled": ("{p} * 0.1 > {q} * 0.1", "{p} <= {q}"),
    "halved": ("{p} / 2 > {q}", "{p} <= {q} * 2"),
    "largest": ("max({p}, {q}) > {r}", "{p} <= {r} and {q} <= {r}"),
    "absolute": ("abs({p}) < {q}", "{p} >= {q} or -{p} >= {q}"),
    "near": ("near({p}, {q}, 1)", "abs({p} - {q}) > 1"),
    "near, both sides": ("near({p}, {q}, 1)", "{p} - {q} > 1", "{q} - {p} > 1"),
    "folded": ("{p} > 0.1 + 0.2", "{p} <= 0.3"),
    "clamped": ("clamp({p}, {q}, {r}) > 0", "{r} <= 0 or {p} <= 0 and {q} <= 0"),
    "between": ("{q} <= {r} and {q} <= clamp({p}, {q}, {r}) <= {r}", "{q} > {r}"),
    "signs": ("sign({p} - {q}) > 0", "sign({p} - {q}) == 0", "sign({q} - {p}) == 1"),
    "whole": ("floor({p}) < 1", "{p} >= 1"),
    "even": ("round({p} + {q}) <= 2", "{p} + {q} > 2.5"),
    "odd": ("round({p}) >= 2", "{p} < 1.5"),
    "below": ("floor({p}) <= {p} and {p} - floor({p}) <= 1",),
    "turned": ("wrap_angle({p} * 1[rad]) >= 0[rad]", "wrap_angle({p} * 1[rad]) < 0[rad]"),
    "wrapped": ("-pi <= wrap_angle({p} * 1[rad]) and wrap_angle({p} * 1[rad]) < pi",),
    "a turn": (
        "{p} < -3 or {p} > 9",
        "-3 <= {p} <= 9 and near(wrap_angle({p} * 1[rad]), {p} * 1[rad], 6.3[rad])",
    ),
    "diagonal": ("hypot({p}, {q}) >= abs({p}) and hypot({p}, {q}) >= -{q}",),
    "way round": ("hypot({p}, {q}) <= 17.2 or abs({p}) > 8.5 or abs({q}) > 8.5",),
    "monotone": ("{p} + {r} < {q} + {r}", "{p} >= {q}"),
}
FAIL = ("one more", "scaled")
"""Right of exact numbers, wrong of rounded ones; the inputs of the test show it."""
WRONG = {("folded", "real"): {"E0601"}}
"""Tables whose rows are wrong of the numbers that are rounded before; all others are right."""


def three(rows: tuple[str, ...], kind: str) -> Tree:
    """A table about three elements that a device reports."""
    names = {name: f"x.E.{name}" for name in "pqr"}
    tree = small({f"r{i}": row.format(**names) for i, row in enumerate(rows)})
    agent = tree["agents"]["a"]
    for ends in (agent["real_effectors"]["m"]["y"], agent["virtual_effectors"]["m"]["x"]["E"]):
        ends.update(dict.fromkeys("pqr", kind))
    agent["virtual_effectors"]["m"]["functions"]["drive"]["y.E.u"] = "0.5"
    return tree


KINDS = [(name, kind) for name in TABLES for kind in ("real", "int")]


@pytest.mark.parametrize(
    ("name", "kind"), short(KINDS, *range(1, len(KINDS), 16), *range(2, len(KINDS), 16))
)
def test_proofs_hold_of_rounded_sums(name: str, kind: str, tmp_path: Path) -> None:
    result = compiled(three(TABLES[name], kind), tmp_path)
    assert result.system is not None
    found = Findings()
    tried(result, name, STEPS, found, odd=ROUGH if kind == "real" else ())
    assert found.faults == []
    proved = result.proofs.is_proved("a.m", "S0", "terminal")
    said = {d.code for d in result.diagnostics} & {"W0606", "E0601", "E0602"}
    assert not (said and proved)
    assert said - {"W0606"} == WRONG.get((name, kind), set())
    if kind == "real" and name in FAIL:
        assert found.ended["undecided where it is not proved"]


@pytest.mark.parametrize(
    "rate, period", every(3, [("10 Hz", 0.1), ("30 ms", 0.03), ("500 Hz", 0.002)])
)
@pytest.mark.parametrize("periods", every(2, [3, 6, 7, 9, 11]))
def test_times_between_two_periods_do_not_occur(
    rate: str, period: float, periods: int, tmp_path: Path
) -> None:
    short, long = (f"{round(k * period, 6)}[s]" for k in (periods, periods + 1))
    tree = small({"soon": f"elapsed <= {short}", "late": f"elapsed >= {long}"})
    machine = tree["agents"]["a"]["virtual_effectors"]["m"]
    machine["rate"] = tree["agents"]["a"]["control"]["rate"] = rate
    machine["conditions"]["terminal"] = {"high": "x.E.p > 2.25"}
    machine["behaviours"]["drive"]["terminal"] = "high"
    result = compiled(tree, tmp_path)
    assert result.proofs.is_proved("a.m", "S0", "terminal")
    found = Findings()
    tried(result, "1", STEPS, found)
    assert found.faults == []
    assert found.rows_taken > 0


@pytest.mark.parametrize(
    "rows",
    [
        ("{p} < 1", "{p} >= 1"),
        ("{p} + {p} - ({q} + {q}) < {r}", "{p} + {p} - ({q} + {q}) >= {r}"),
        ("{p} * {p} * 0 < 1", "{p} * {p} * 0 >= 1"),
        ("{p} - {q} < 1", "not {p} - {q} < 1"),
        ("near({p} + {p}, {q} + {q}, 1)", "not near({p} + {p}, {q} + {q}, 1)"),
        ("max({p}, {q}) > {r}", "not {p} > {r} and not {q} > {r}"),
        ("abs({p}) < 1", "{p} >= 1 or {p} <= -1"),
        ("round({p}) <= 2", "{p} > 2.5"),
        ("sign({p}) <= 0", "floor({p}) > 0", "0 < {p} < 1"),
        ("wrap_angle({p} * 1[rad]) > 1[rad]", "wrap_angle({p} * 1[rad]) <= 1[rad]"),
        ("hypot({p}, {q}) < {r}", "not hypot({p}, {q}) < {r}"),
    ],
    ids=[
        *("reading", "overflow", "product", "negated", "near", "largest", "absolute"),
        *("even", "whole", "wrapped", "diagonal"),
    ],
)
def test_what_is_proved_holds_of_the_largest_numbers(rows: tuple[str, ...], tmp_path: Path) -> None:
    result = compiled(three(rows, "real"), tmp_path)
    assert result.ok
    found = Findings()
    tried(result, "1", STEPS, found, odd=(1.7e308, -1.7e308, 5e-324, -0.0))
    assert found.faults == []


def test_whole_numbers_beside_equal_real_ones(tmp_path: Path) -> None:
    low = "x.E.p <= 2.0 and max(x.E.n, 2) / 2 > x.E.p"
    tree = small({"low": low, "other": "x.E.p <= 2.0 and x.E.n > 0"})
    agent = tree["agents"]["a"]
    agent["real_effectors"]["m"]["y"]["n"] = "int"
    agent["virtual_effectors"]["m"]["x"]["E"]["n"] = "int"
    result = compiled(tree, tmp_path)
    assert {d.code for d in result.diagnostics if d.code[0] == "E"} == {"E0601", "E0602"}


@pytest.mark.parametrize(
    ("last", "is_tested"),
    [("{q} + {p} >= {r}", True), ("not {p} + {q} < {r}", False), ("{p} >= {r}", False)],
    ids=["asked", "negated", "read"],
)
def test_a_last_row_about_a_sum_is_tested(last: str, is_tested: bool, tmp_path: Path) -> None:
    first = "{p} < {r}" if last == "{p} >= {r}" else "{p} + {q} < {r}"
    result = compiled(three((first, last), "real"), tmp_path)
    assert result.ok
    assert result.system is not None
    assert result.proofs.is_proved("a.m", "S0", "terminal")
    module = fill_templates(lower(result.system, result.proofs))["a_m.py"]
    assert ("raise self.undecided(" in module) == is_tested
