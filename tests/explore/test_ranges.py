"""What unknown values lie within decides conditions and requirements, as far as it goes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.graph import Graph
from specc.tools.explore.values import MOST_COMBINED
from tests.commands import specc
from tests.seeds import every

SPEC = """\
specc: 1.2
system: bounded
constants: {{fast: "1[m/s]"}}
agents:
  a:
    real_effectors:
      m: {{x: {{u: "real[m/s]", w: "vector[2, m/s]"}}, y: {{v: "real[m/s]"}}}}
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {{E: {{v: {{type: "real[m/s]", init: 0}}}}, c: {{go: bool}}}}
        y: {{E: {{u: "real[m/s]", w: "vector[2, m/s]"}}, c: {{speed: "real[m/s]"}}}}
        memory: {{kept: {{type: "real[m/s]", init: 0}}, total: {{type: "real[m/s]", init: 0}}}}
        conditions: {{terminal: {{asked: fresh(x.c.go)}}}}
        functions:
          drive:
            y.E.u: "clamp(x.E.v + fast, -fast, fast)"
            y.E.w: "[clamp(x.E.v, -fast, fast), 0.5 * kept]"
            y.c.speed: "max(abs(kept), abs(x.E.v) + 2[m/s])"
            kept: "clamp(kept + x.E.v, -fast, fast)"
            total: total + x.E.v
          rest: {{y.E.u: "0[m/s]", y.c.speed: "3[m/s]"}}
        behaviours:
          work: {{functions: [drive], terminal: asked}}
          stop: {{functions: [rest], terminal: asked}}
        states: {{go: work, end: stop}}
        initial_state: end
        transitions: [[go, terminal, always, end], [end, terminal, always, go]]
    control:
      rate: 10 Hz
      x: {{m: {{speed: {{type: "real[m/s]", init: "2[m/s]"}}}}}}
      y: {{m: {{go: bool}}}}
      memory: {{n: {{type: int, init: 0}}}}
      conditions: {{terminal: {{slow: "{slow}"}}}}
      functions:
        count: {{n: "n + 1 if n < 5 else 0", y.m.go: n == 3}}
        tell: {{y.m.go: "n == 3"}}
      behaviours:
        work: {{functions: [count], terminal: slow}}
        tell: {{functions: [tell], terminal: never}}
      states: {{S0: work, S1: tell}}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
require:
  - {{that: "always({that})", because: it is tried}}
"""
VERDICTS = {
    "present(a.E.m.u) implies a.E.m.u <= fast": "proved",
    "not present(a.E.m.u) or abs(a.E.m.u) < 1.5[m/s]": "proved",
    "present(a.E.m.u) implies a.E.m.u <= 0.5[m/s]": "not decided",
    "present(a.E.m.w) implies a.E.m.w[0] <= fast and abs(a.E.m.w[1]) <= fast": "proved",
    "present(a.E.m.w) implies a.E.m.w[1] <= 0.4[m/s]": "not decided",
    "a.m.kept + 1[m/s] <= 2 * fast": "proved",
    "a.m.total < 100[m/s]": "not decided",
    # A run does not know it where the value is absent, or more than any number.
    "abs(a.m.total) >= 0[m/s]": "not decided",
    "abs(a.E.m.u) >= 0[m/s]": "not decided, since `a.E.m.u` is absent at some time: ",
    "a.E.m.u <= fast": "not decided, since `a.E.m.u` is absent at some time: "
    "write `present(a.E.m.u) implies ...`",
}


def explored(folder: Path, that: str, slow: str = "x.m.speed > 1e6[m/s]") -> str:
    (folder / "bounded.yaml").write_text(SPEC.format(that=that, slow=slow), "utf-8")
    done = specc("explore", folder / "bounded.yaml")
    return str(done.stdout + done.stderr)


@pytest.mark.parametrize("that", every(2, list(VERDICTS)))
def test_a_requirement_is_decided_where_all_values_in_its_bounds_say_the_same(
    that: str, tmp_path: Path
) -> None:
    (told,) = (
        line for line in explored(tmp_path, that).splitlines() if line.startswith("requirement")
    )
    assert told.partition("`: ")[2].startswith(VERDICTS[that])


def test_a_wait_for_what_no_measurement_makes_true_is_found(tmp_path: Path) -> None:
    assert "W1004" not in explored(tmp_path, "a.m.kept <= fast", "x.m.speed > 5[m/s]")
    assert "`a.c` can never leave `S0`" in explored(
        tmp_path, "a.m.kept <= fast", "x.m.speed < 2[m/s]"
    )


PAIR = """\
specc: 1.2
system: pair
operators:
  some: {{signature: "(q: int) -> int", python: "tests.soundness.operators:holds"}}
  turn: {{signature: "(s: real[s]) -> bool", python: "tests.soundness.operators:holds"}}
agents:
  b:
    control:
      rate: 10 Hz
      y: {{a: {{s: {type}}}}}
      memory: {{k: {{type: int, init: 0}}}}
{sender}
  a:
    control:
      rate: 10 Hz
      x: {{b: {{s: {{type: {type}, init: 0}}}}}}
      conditions: {{terminal: {{high: "{high}"}}}}
      behaviours: {{wait: {{terminal: high}}, end: {{terminal: never}}}}
      states: {{S0: wait, S1: end}}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
require:
  - {{that: always(state(a.c) == S0), because: it is tried}}
"""
COUNTED_RANGE = """\
      conditions: {terminal: {full: k >= 1000}}
      functions: {count: {k: k + 1, y.a.s: "clamp(some(k), 0, max(500, k))"}}
      behaviours: {work: {functions: [count], terminal: full}, rest: {terminal: never}}
      states: {go: work, full: rest}
      initial_state: go
      transitions: [[go, terminal, always, full]]"""
ROUNDED = """\
      functions: {count: {k: 1 - k, y.a.s: "clamp(some(k), 0, 9007199254740995)"}}
      behaviours: {work: {functions: [count], terminal: never}}
      states: {go: work}
      initial_state: go"""
IN_TIME = """\
      conditions: {terminal: {one: "elapsed > 4.95[s]", two: "elapsed > 0.15[s]"}}
      functions: {up: {k: k + 1, y.a.s: k}, null_: {k: 0, y.a.s: k}}
      behaviours:
        A: {functions: [up], terminal: one}
        B: {functions: [null_], terminal: two}
      states: {SA: A, SB: B}
      initial_state: SA
      transitions: [[SA, terminal, always, SB], [SB, terminal, always, SA]]"""
BRANCHING = """\
      conditions: {terminal: {go: turn(elapsed)}, initial: {full: k > 900, more: k <= 900}}
      functions: {up: {k: k + 3, y.a.s: k}, null_: {k: 0}}
      behaviours:
        A: {terminal: go}
        U: {functions: [up], terminal: always}
        B: {functions: [null_], terminal: always}
      states: {SA: A, SU: U, SB: B}
      initial_state: SA
      transitions: [[SA, terminal, more, SU], [SA, terminal, full, SB],
                    [SU, terminal, always, SA], [SB, terminal, always, SA]]"""
MAY_GO, STAYS = "may be violated", "proved"
PAIRS = [
    (COUNTED_RANGE, "real", "x.b.s > 700", MAY_GO),
    (ROUNDED, "real", "x.b.s >= 9007199254740996.0", MAY_GO),
    (ROUNDED, "int", "x.b.s >= 9007199254740996", STAYS),
    (IN_TIME, "int", "x.b.s == 60", STAYS),
]


@pytest.mark.parametrize(("sender", "of", "high", "verdict"), every(2, PAIRS))
def test_what_counts_and_what_rounds_moves_its_range(
    sender: str, of: str, high: str, verdict: str, tmp_path: Path
) -> None:
    text = PAIR.format(sender=sender, type=of, high=high)
    (tmp_path / "pair.yaml").write_text(text, encoding="utf-8")
    done = specc("explore", tmp_path / "pair.yaml")
    assert f"requirement `always(state(a.c) == S0)`: {verdict}" in done.stdout
    assert ("`a.c`" in done.stderr and "W100" in done.stderr) or verdict == MAY_GO


@pytest.mark.parametrize(("count", "is_found"), [(881, True), (882, False)])
def test_a_wait_that_ranges_hide_is_found_among_all_values(
    count: int, is_found: bool, tmp_path: Path
) -> None:
    text = PAIR.format(sender=BRANCHING, type="int", high=f"x.b.s == {count}")
    (tmp_path / "pair.yaml").write_text(text.partition("require:")[0], encoding="utf-8")
    done = specc("explore", "--budget", "60000", tmp_path / "pair.yaml")
    assert ("`a.c` can never leave `S0`" in done.stderr) == is_found


def test_what_is_measured_in_every_period_has_its_range(tmp_path: Path) -> None:
    text = SPEC.format(that="a.c.x.m.speed <= 2[m/s]", slow="x.m.speed > 7[m/s]")
    text = text.replace("max(abs(kept), abs(x.E.v) + 2[m/s])", "clamp(x.E.v, -fast, fast)")
    text = text.replace('y.c.speed: "3[m/s]"', "y.c.speed: kept")
    (tmp_path / "noise.yaml").write_text(text, encoding="utf-8")
    done = specc("explore", tmp_path / "noise.yaml")
    assert "`always(a.c.x.m.speed <= 2[m/s])`: proved" in done.stdout
    assert "`a.c` can never leave `S0`" in done.stderr


ALONE = """\
specc: 1.2
system: alone
agents:
  a:
    control:
      rate: 10 Hz
      y: {{b: {{v: "vector[2, int]"}}}}
      memory: {{r: {{type: real, init: 0}}, n: {{type: int, init: 0}}}}
      through: {{r: "{r}", n: "{n}", y.b.v: "{v}"}}
  b:
    control:
      rate: 10 Hz
      x: {{a: {{v: {{type: "vector[2, int]", init: "[0, 0]"}}}}}}
      memory: {{seen: {{type: int, init: 0}}}}
      through: {{seen: "x.a.v[1]"}}
require:
  - {{that: "always({that})", because: it is tried}}
"""
UNDECIDED = "not decided"
NUMBERS = [
    ("-r", "0", "[0, 0]", "atan2(a.c.r, -1) > 0", "violated"),
    ("-r", "0", "[0, 0]", "a.c.r <= 0 and a.c.r >= 0", "proved"),
    ("0", "0", "[floor(9007199254740993 / 3), n]", "b.c.x.a.v[0] < 3002399751580331", UNDECIDED),
    ("0", "0", "[-9007199254740993, n]", "b.c.x.a.v[0] >= -9007199254740992", UNDECIDED),
]


@pytest.mark.parametrize(("r", "n", "v", "that", "verdict"), NUMBERS)
def test_zeros_have_signs_and_whole_numbers_are_not_rounded(
    r: str, n: str, v: str, that: str, verdict: str, tmp_path: Path
) -> None:
    (tmp_path / "alone.yaml").write_text(ALONE.format(r=r, n=n, v=v, that=that), encoding="utf-8")
    assert f"`always({that})`: {verdict}" in specc("explore", tmp_path / "alone.yaml").stdout


REGIONS = """\
specc: 1.2
system: regions
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {n: int}}
      memory: {i: {type: int, init: 1}, j: {type: int, init: 2}, k: {type: int, init: 3}}
      conditions:
        terminal: {far: "elapsed > 5.9[s]", odd: i in_tens or j in_tens or k in_tens}
      functions:
        up: {i: i + 3, j: j + 5, k: k + 7, y.b.n: k}
        down: {i: i - 1000, j: j - 1000, k: k - 1000}
      behaviours: {A: {functions: [up], terminal: far}, B: {functions: [down], terminal: odd}}
      states: {SA: A, SB: B}
      initial_state: SA
      transitions: [[SA, terminal, always, SB], [SB, terminal, always, SA]]
  b:
    control:
      rate: 10 Hz
      x: {a: {n: {type: int, init: 0}}}
      memory: {n: {type: int, init: 0}}
      through: {n: x.a.n}
"""


def test_regions_of_many_values_have_few_combinations(tmp_path: Path) -> None:
    """Each of three values may come to lie in any of fifteen regions, all in one step."""
    tens = [f"{{0}} == {10 * number}" for number in range(7)]
    text = re.sub(r"(\w) in_tens", lambda of: " or ".join(tens).format(of[1]), REGIONS)
    (tmp_path / "regions.yaml").write_text(text, encoding="utf-8")
    abstraction = Abstraction(compile_spec(str(tmp_path / "regions.yaml")).proofs)
    (names,) = abstraction.slices()
    graph = Graph(Composition(names, abstraction, Precision(counts_time=True)), 500)
    assert 15 < max(map(len, graph.edges)) <= MOST_COMBINED
