"""What happens only once something was counted is found, or told as not decided; never silence."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from specc.tools.explore.explorer import Exploration, explore

BUDGET = 3_000
COUNTS = (3, 31, 33, 40, 10**6)
TESTS = {"alone": "k >= {n}", "argument": "k >= {n} and ok(m)", "two": "x.b.k >= {n}"}
"""When the machine `a` does what goes wrong; `m` is only an operator's argument."""
CODES = {
    "deadlock": {"W1001", "W1003", "W1004"},
    "held": {"W1001", "W1003", "W1004"},
    "lost": {"W1005"},
    "assumed": {"W1006"},
    "required": {"W1007"},
}
COUNTING = """\
specc: 1.1
system: counting
operators:
  ok: {{signature: "(k: int) -> bool", python: "specc_runtime.operators.kinematics:ok"}}
agents:
  a:
    control:
      rate: 10 Hz
      x: {{b: {{k: {{type: int, init: 0}}, go: bool}}}}
      y: {{b: {{ping: bool}}}}
      memory: {{k: {{type: int, init: 0}}, m: {{type: int, init: 0}}}}
      conditions: {{terminal: {{counted: "{test}", less: "not ({test})", told: fresh(x.b.go)}}}}
      functions: {{count: {{k: k + 1, m: m + 1}}, tell: {{y.b.ping: True}}}}
      behaviours:
        count: {{functions: [count], terminal: {end}}}
        more: {{functions: [count], terminal: always}}
        tell: {{functions: [tell], terminal: {told}}}
      states: {{S0: count, S1: tell, S2: more}}
      initial_state: S0
      transitions: [[S0, terminal, always, {next}], [S2, terminal, always, S0],
                    [S1, terminal, always, S0]]
  b:
    control:
      rate: 10 Hz
      x: {{a: {{ping: {{type: bool{event}}}}}}}
      y: {{a: {{k: int, go: bool}}}}
      memory: {{k: {{type: int, init: 0}}}}
      functions: {{count: {{k: k + 1, y.a.k: k}}, go: {{y.a.go: True}}}}
      behaviours: {{count: {{functions: [count], terminal: always}}}}
      states: {{S0: count}}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
{assume}
"""


def counting(what: str, where: str, n: int) -> str:
    """A system that goes wrong once something was counted up to `n`."""
    held = what == "held"
    assume = {
        "assumed": '      assume: [{that: "not fresh(x.a.ping)", because: a}]',
        "required": 'require: [{that: "always(state(a.c) != S1)", because: a}]',
    }
    return COUNTING.format(
        test=TESTS[where].format(n=n),
        end="less" if held else "counted",
        next="S2" if held else "S1",
        told="told" if what == "deadlock" else "never",
        event=", event: true" if what == "lost" else "",
        assume=assume.get(what, ""),
    )


def found_in(text: str, folder: Path, budget: int = BUDGET) -> Exploration:
    (folder / "spec.yaml").write_text(text, encoding="utf-8")
    result = compile_spec(str(folder / "spec.yaml"))
    assert result.ok, [d.message for d in result.diagnostics if d.severity == "error"]
    return explore(result.proofs, budget)


def told(what: str, where: str, n: int, found: Exploration) -> str:
    """What is wrong with what is said of such a system; nothing if it is said."""
    there = [finding for finding in found.findings if finding.code in CODES[what]]
    sure = [finding.message for finding in there if finding.way.is_decided]
    if not there and all(each.complete for each in found.slices):
        return f"{what} {where} {n}: silence"
    if n > 40 or where == "argument":
        return f"{what} {where} {n}: {sure} is not sure" if sure and n != 1000 else ""
    return "" if sure else f"{what} {where} {n}: every run comes to it"


def test_what_is_counted_is_found_or_told(tmp_path: Path) -> None:
    cases = [(what, where, n) for what in CODES for where in ("alone", "two") for n in COUNTS]
    said = (told(*case, found_in(counting(*case), tmp_path)) for case in cases)
    assert [wrong for wrong in said if wrong] == []


@pytest.mark.long
def test_what_is_counted_for_long(tmp_path: Path) -> None:
    cases = [(what, where, 1000) for what in CODES for where in ("alone", "two")]
    for what, where, n in cases:
        found = found_in(counting(what, where, n), tmp_path, 20_000)
        assert told(what, where, n, found) == ""
        assert any(f.way.is_decided and f.code in CODES[what] for f in found.findings), what


def test_what_rests_on_an_operator_too(tmp_path: Path) -> None:
    """Whether `held` waits for ever is what the operator says."""
    cases = [(w, "argument", n) for w in CODES if w != "held" for n in (33, 10**6)]
    said = (told(*case, found_in(counting(*case), tmp_path)) for case in cases)
    assert [wrong for wrong in said if wrong] == []
