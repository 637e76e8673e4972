"""Bounded response is decided: the head of each specification says what exploring says of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.cli.main import main
from specc.pipeline import compile_spec
from specc.tools.explore.explorer import explore
from tests.seeds import short

CASES = sorted(Path(__file__).parent.glob("bounded/*.yaml"))
DEAR = {"fast_motion"}
"""Thousands of periods are counted there."""


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, marks=[pytest.mark.long] if c.stem in DEAR else []) for c in CASES],
    ids=lambda case: case.stem,
)
def test_bounded_response_is_decided(case: Path) -> None:
    verdict = case.read_text(encoding="utf-8").partition(":")[0].removeprefix("# ")
    result = compile_spec(str(case))
    assert result.ok, [d for d in result.diagnostics if d.severity == "error"]
    found = explore(result.proofs, 700_000)
    assert [judged.summary().partition(" ")[0] for judged in found.requirements] == [verdict]
    assert found.status == "complete"


def test_lets_about_time_that_name_each_other_twice_are_searched_once(tmp_path: Path) -> None:
    """A chain of 28 has 2^28 paths."""
    doubled = '"(l{0} and x.d.m > {1}) or (l{0} and elapsed > {1}[s])"'
    lets = [f"l{n}: {doubled.format(n - 1, n)}" for n in range(1, 28)]
    text = "\n        ".join(["l0: x.d.m > 0", *lets])
    path = tmp_path / "chain.yaml"
    path.write_text(_CHAIN.replace("LETS", text), encoding="utf-8")
    assert main(["explore", str(path), "--budget", "100"]) == 0


_CHAIN = """\
specc: 1.2
system: chain
agents:
  a:
    real_receptors:
      d: {y: {m: real}}
    virtual_receptors:
      d: {rate: 200 Hz, through: identity}
    control:
      rate: 10 Hz
      x: {d: {m: {type: real, init: 0}}}
      let:
        LETS
      conditions:
        terminal: {t: l27}
      behaviours: {b: {terminal: t}}
      states: {s: b}
      initial_state: s
      transitions: [[s, terminal, always, s]]
"""


NUMBERS = """\
specc: 1.2
system: cuts
agents:
  a:
    real_receptors: {{eye: {{y: {{go: real}}}}}}
    virtual_receptors: {{eye: {{rate: 10 Hz, through: identity}}}}
    control:
      rate: 10 Hz
      x: {{eye: {{go: {{type: real, init: 0}}}}}}
      memory: {{{memory}}}
      let: {{{lets}}}
      conditions: {{terminal: {{t: {test}}}}}
      functions: {{f: {{{assigned}}}}}
      behaviours: {{b: {{functions: [f], terminal: t}}}}
      states: {{s: b}}
      initial_state: s
      transitions: [[s, terminal, always, s]]
"""


@pytest.mark.parametrize("kind", short(["delay line", "nested sizes"], 1))
def test_cuts_of_numbers_are_found_in_bounded_time(kind: str, tmp_path: Path) -> None:
    """A cut moves back through 600 assignments; 40 sizes within one another would make 2^40."""
    if kind == "delay line":
        memory = [f"n{i}: {{type: real, init: 0}}" for i in range(600)]
        assigned = ["n0: x.eye.go", *(f"n{i}: n{i - 1}" for i in range(1, 600))]
        parts = {"memory": memory, "assigned": assigned, "lets": ["l: 1"], "test": ["n599 > 3"]}
    else:
        lets = ["l0: abs(n - 1)", *(f"l{i}: abs(l{i - 1} - {i + 1})" for i in range(1, 40))]
        memory, assigned = ["n: {type: real, init: 0}"], ["n: x.eye.go"]
        parts = {"memory": memory, "assigned": assigned, "lets": lets, "test": ["l39 > 3"]}
    text = NUMBERS.format(**{name: ", ".join(each) for name, each in parts.items()})
    path = tmp_path / "numbers.yaml"
    path.write_text(text, encoding="utf-8")
    assert main(["explore", str(path), "--budget", "100"]) == 0
