"""Agents that share a module do, step for step, what the interpreter does for each by itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.emit import fill_templates
from specc.lower import lower
from specc.pipeline import compile_spec
from tests.soundness.agreement import differences
from tests.soundness.running import Script, ScriptedPlant, executed, interpreted, package

CASES = Path(__file__).resolve().parents[1] / "cases" / "structure"
ROBOT = """\
specc: 1.1
types: {Place: "vector[2, m]"}
interfaces: {Pass: {s: Place, token: bool}}
parameters: {next: agent, previous: agent, gain: real, home: Place, is_first: bool, name: text}
agent:
  real_effectors:
    wheel: {x: {v: {type: "real[m/s]", safe: "gain * 1[m/s]"}}, y: {s: Place}}
  virtual_effectors:
    wheel:
      rate: 20 Hz
      x: {c: {v: {type: "real[m/s]", init: 0}}, E: {s: Place}}
      y: {c: {s: Place}, E: {v: "real[m/s]"}}
      functions: {drive: {y.E.v: "gain * x.c.v", y.c.s: x.E.s}}
      behaviours: {drive: {functions: [drive], terminal: never}}
      states: {S0: drive}
      initial_state: S0
  control:
    rate: 10 Hz
    x: {previous: Pass, wheel: {s: {type: Place, init: home}}}
    y: {next: Pass, wheel: {v: "real[m/s]"}}
    memory:
      token: {type: bool, init: is_first}
      sum: {type: Place, init: 2 * home}
      known: {type: text, init: name}
    let: {s: "x.previous.s if present(x.previous.s) else home"}
    conditions:
      initial: {mine: fresh(x.previous.token) and x.previous.token}
      terminal: {told: fresh(x.previous.token)}
    functions:
      tell: {y.next.s: s, y.next.token: token, y.wheel.v: "gain * (s[0] + sum[1]) / 1[s]"}
      wait: {token: False, sum: sum + gain * x.wheel.s, y.wheel.v: 0, known: name}
      take: {token: True}
    behaviours:
      wait: {functions: [wait, {y.next.token: token, y.next.s: home}], terminal: told}
      go: {functions: [tell, take], terminal: told}
    states: {S0: wait, S1: go}
    initial_state: S0
    transitions:
      - [[S0, S1], terminal, mine, S1]
      - [[S0, S1], terminal, otherwise, S0]
"""
RING = """\
specc: 1.1
system: ring
agents:
  robots:
    for: {i: 1..4}
    use: robot.yaml
    with:
      next: "robots_{i % 4 + 1}"
      previous: "robots_{(i + 2) % 4 + 1}"
      gain: 0.5 * i
      home: "[i * 1[m], 2[m] - i * 1[m]]"
      is_first: i == 1
      name: '"robot"'
"""


def ring(folder: Path) -> str:
    (folder / "robot.yaml").write_text(ROBOT)
    (folder / "ring.yaml").write_text(RING)
    return str(folder / "ring.yaml")


def test_parameters_of_a_shared_class_are_those_of_each_agent(tmp_path: Path) -> None:
    result = compile_spec(ring(tmp_path))
    assert result.system is not None, result.diagnostics
    assert [d for d in result.diagnostics if d.severity == "error"] == []
    files = fill_templates(lower(result.system, result.proofs))
    names = {"robots_c.py", "robots_wheel.py", "robots_e_wheel.py"}
    assert files.keys() == names | {"__init__.py", "layouts.py", "system.py"}
    for seed in ("a", "b"):
        script = Script(result.system, seed, (0.0, 1.0))
        with package(files) as modules:
            made = executed(modules["system.py"].build(""), ScriptedPlant(script), 60)
        expected = interpreted(result.system, script, 60)
        assert list(differences(made, expected)) == []
        assert len(made.steps["robots_3.c"]) == 30


@pytest.mark.parametrize(
    ("case", "modules"),
    [
        ("ok-ring", 2),
        ("ok-two-pairs", 2),
        ("ok-two-teams", 2),
        ("ok-devices-of-a-kind", 3),
        ("ok-reader-of-many", 2),
        ("ok-commands-to-receptors", 4),
        ("ok-interface", 3),
        ("ok-interface-of-a-device", 3),
    ],
)
def test_cases_of_many_agents(case: str, modules: int) -> None:
    result = compile_spec(str(CASES / f"{case}.yaml"))
    assert result.system is not None
    script = Script(result.system, case, (0.0, 1.0))
    files = fill_templates(lower(result.system, result.proofs))
    assert len(files) == modules + len(("__init__.py", "layouts.py", "system.py"))
    with package(files) as made:
        plant = ScriptedPlant(script) if result.system.devices else None
        found = executed(made["system.py"].build(""), plant, 60)
    assert list(differences(found, interpreted(result.system, script, 60))) == []
