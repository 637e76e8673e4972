"""Constants of described files, and arguments that are called like what they are given to."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import build

MONITOR = """\
specc: 1
parameters: {threshold: int}
constants: {step: 2, most: threshold + step}
subsystem:
  rate: 10 Hz
  x: {tells: {k: {type: int, init: 0}}}
  conditions: {terminal: {told: x.tells.k > most}}
  behaviours: {wait: {terminal: told}}
  states: {S0: wait}
  initial_state: S0
  transitions: [[S0, terminal, always, S0]]
"""
AGENT = """\
specc: 1
parameters: {limit: int}
constants: {more: limit + 4}
agent: {control: {use: monitor.yaml, with: {threshold: more}}}
"""
SYSTEM = """\
specc: 1
system: demo
constants: {threshold: 5, over: threshold + 1}
agents:
  hears: %s
  tells:
    control:
      rate: 10 Hz
      y: {hears: {k: int}}
      functions: {tell: {y.hears.k: over}}
      behaviours: {tell: {functions: [tell], terminal: never}}
      states: {S0: tell}
      initial_state: S0
"""
USES = {
    "{control: {use: monitor.yaml, with: {threshold: 3}}}": "3",
    "{control: {use: monitor.yaml, with: {threshold: threshold}}}": "5",
    "{control: {use: monitor.yaml, with: {threshold: over}}}": "5 + 1",
    "{use: agent.yaml, with: {limit: 3}}": "3 + 4",
    "{use: agent.yaml, with: {limit: threshold}}": "THRESHOLD + 4",
}


@pytest.mark.parametrize("use", USES)
def test_generated_code_has_the_values(use: str, tmp_path: Path) -> None:
    (tmp_path / "monitor.yaml").write_text(MONITOR)
    (tmp_path / "agent.yaml").write_text(AGENT)
    (tmp_path / "spec.yaml").write_text(SYSTEM % use)
    built = build(str(tmp_path / "spec.yaml"))
    assert built.result.ok
    namespace: dict[str, object] = {}
    text = next(code for name, code in built.files.items() if name.endswith("hears_c.py"))
    constants = [line for line in text.splitlines() if ": Final = " in line]
    exec("from typing import Final\n" + "\n".join(constants), namespace)
    expected = eval(USES[use], {"THRESHOLD": 5})
    assert namespace["THRESHOLD"] == expected
    assert "x.tells_k > THRESHOLD + 2" in text
