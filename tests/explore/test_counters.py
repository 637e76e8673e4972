"""What happens only once something was counted is found, or told as not decided; never silence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.commands import specc
from tests.seeds import every, short

BUDGET = 3_000
COUNTS = (3, 31, 33, 40, 1000, 10**6)
LONG = 1000
"""From here on a run may take more steps to count than it is rehearsed for: it is not decided."""
TESTS = {
    "alone": "k >= {n}",
    "timed": "elapsed > {late}[s] and k <= {n}",
    "argument": "k >= {n} and ok(m)",
    "two": "x.b.k >= {n}",
}
"""When the machine `a` does what goes wrong; `m` is only an operator's argument.

Where times are counted roughly, `k` grows beyond what it is when it is `late`.
"""
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
      functions: {{count: {{k: "{step}", m: m + 1}}, tell: {{y.b.ping: True}}}}
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


def counting(what: str, where: str, n: int, step: str = "k + 1") -> str:
    """A system that goes wrong once something was counted up to `n`."""
    held = what == "held"
    assume = {
        "assumed": '      assume: [{that: "not fresh(x.a.ping)", because: a}]',
        "required": 'require: [{that: "always(state(a.c) != S1)", because: a}]',
    }
    return COUNTING.format(
        step=step,
        test=TESTS[where].format(n=n, late=(2 * n - 1) / 20),
        end="less" if held else "counted",
        next="S2" if held else "S1",
        told="told" if what == "deadlock" else "never",
        event=", event: true" if what == "lost" else "",
        assume=assume.get(what, ""),
    )


def explored(text: str, folder: Path, budget: int = BUDGET) -> tuple[int, Any]:
    """What the command says: its exit code, and its data."""
    (folder / "spec.yaml").write_text(text, encoding="utf-8")
    done = specc("explore", folder / "spec.yaml", "--budget", budget, "--format", "json")
    return done.returncode, json.loads(done.stdout)


def told(what: str, where: str, n: int, code: int, data: Any) -> str:
    """What is wrong with what is said of such a system; nothing if it is said."""
    there = [each for each in data["findings"] if each["code"] in CODES[what]]
    sure = [each["message"] for each in there if each["decided"]]
    open_ = sum(not each["confirmed"] for each in data["findings"])
    but = f" but for {open_} finding{'s' * (open_ > 1)} not decided" * bool(open_)
    case = f"{what} {where} {n}"
    if data["status"] not in (f"complete{but}", "ended at the bound"):
        return f"{case}: {open_} findings are not decided, but it is {data['status']}"
    if code != any(each["decided"] for each in data["findings"]):
        return f"{case}: exit code {code}"
    if where == "argument" and what == "held":  # whether it waits for ever is what operators say
        asked = [c for s in data["slices"] for each in s["not_judged"] for c in each["conditions"]]
        return "" if "less" in asked else f"{case}: silence"
    if not there and data["status"] != "ended at the bound":
        return f"{case}: silence"
    if where == "argument":
        return f"{case}: {sure} is not sure" if sure else ""
    if n >= LONG and not any(each["confirmed"] for each in there):
        return ""
    return "" if sure else f"{case}: every run comes to it"


@pytest.mark.parametrize("n", short(COUNTS, 2))
def test_what_is_counted_is_found_or_told(n: int, tmp_path: Path) -> None:
    cases = [(what, where, n) for what in CODES for where in TESTS]
    cases.remove(("held", "timed", n))
    said = (told(*case, *explored(counting(*case), tmp_path)) for case in cases)
    assert [wrong for wrong in said if wrong] == []


@pytest.mark.parametrize(
    ("step", "n", "budget", "status"),
    every(
        3,
        [
            ("k + 1", 33, BUDGET, "complete"),
            ("abs(k) + 1", 10**6, BUDGET, "complete but for 1 finding not decided"),
            ("k + 1", 33, 4, "ended at the bound"),
        ],
    ),
)
def test_how_exploring_ends_is_said_to_people_and_programs(
    step: str, n: int, budget: int, status: str, tmp_path: Path
) -> None:
    _, data = explored(counting("deadlock", "alone", n, step), tmp_path, budget)
    said = specc("explore", tmp_path / "spec.yaml", "--budget", budget).stdout
    assert (data["status"], [each["status"] for each in data["slices"]]) == (status, [status])
    if status == "ended at the bound":
        assert f"a.c, b.c: {status} after" in said
        assert f"not everything was explored in {budget} steps" in said
        assert "all in all" not in said
    else:
        assert f"a.c, b.c: {status.replace('complete', 'explored completely')}: " in said
        assert f"all in all: {status}\n" in said


GROWING = """\
specc: 1.2
system: growing
agents:
  a:
    control:
      rate: 10 Hz
      x: {{b: {{go: bool}}}}
      y: {{b: {{ping: bool}}}}
      memory: {{l: {{type: "list[int]", init: "[]"}}}}
      conditions: {{terminal: {{enough: "len(l) >= {n}", told: fresh(x.b.go)}}}}
      functions: {{grow: {{l: "l + [1]"}}, tell: {{y.b.ping: True}}}}
      behaviours:
        grow: {{functions: [grow], terminal: enough}}
        tell: {{functions: [tell], terminal: told}}
      states: {{S0: grow, S1: tell}}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
  b:
    control:
      rate: 10 Hz
      x: {{a: {{ping: bool}}}}
      y: {{a: {{go: bool}}}}
      functions: {{send: {{y.a.go: True}}}}
      behaviours: {{wait: {{terminal: never}}, send: {{functions: [send], terminal: always}}}}
      states: {{S0: wait, S1: send}}
      initial_state: S0
      transitions: [[S1, terminal, always, S0]]
"""


@pytest.mark.parametrize(("n", "is_followed"), every(2, [(100, True), (1000, False)]))
def test_lists_that_grow_are_followed_up_to_a_size(
    n: int, is_followed: bool, tmp_path: Path
) -> None:
    (tmp_path / "growing.yaml").write_text(GROWING.format(n=n))
    done = specc("explore", "growing.yaml", cwd=tmp_path)
    assert ("not all values followed of: a.c.l" in done.stdout) is not is_followed
    assert ("not judged is whether `enough` ever comes true" in done.stdout) is not is_followed
