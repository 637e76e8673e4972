"""A specification of one driven hinge, compiled on the spot; any part of it can be made to fail."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from specc_runtime.main import main

from specc.output import write
from specc.pipeline import build

SPEC = """specc: 1
system: hinge
operators:
  drive: {signature: "(e: real[rad]) -> real[N*m]", python: "hinge_parts:drive"}
  high: {signature: "(q: real[rad]) -> bool", python: "hinge_parts:high"}
  hold: {signature: "(q: real[rad]) -> real[N*m]", python: "hinge_parts:hold"}
  gain: {signature: "() -> real", python: "hinge_parts:gain"}
constants:
  k: gain()
agents:
  arm:
    real_effectors:
      j:
        x: {tau: {type: "real[N*m]", safe: {is: hold(q), otherwise: "7[N*m]"}}}
        y: {q: "real[rad]"}
    virtual_effectors:
      j:
        rate: 100 Hz
        x: {c: {q_d: {type: "real[rad]", init: 0}}, E: {q: "real[rad]"}}
        y: {c: {q: "real[rad]"}, E: {tau: "real[N*m]"}}
        let: {torque: drive(x.c.q_d - x.E.q)}
        conditions:
          initial: {is_high: {when: high(x.E.q), eq: 3}, is_low: {when: not high(x.E.q), eq: 4}}
          terminal: {late: {when: "elapsed > 0.05[s]", eq: 5}}
        functions: {push: {eq: 1, y.E.tau: k * torque}, tell: {eq: 2, y.c.q: x.E.q}}
        behaviours: {move: {functions: [push, tell], terminal: late, eq: 9}}
        states: {S0: move, S1: move}
        initial_state: S0
        transitions:
          - [S0, terminal, is_high, S0]
          - [S0, terminal, is_low, S1]
          - [S1, terminal, is_high, S0]
          - [S1, terminal, is_low, S1]
    control:
      rate: 50 Hz
      x: {j: {q: {type: "real[rad]", init: 0}}}
      y: {j: {q_d: "real[rad]"}}
      memory: {q: {type: "real[rad]", init: 0}}
      functions: {ask: {y.j.q_d: "1[rad]", q: x.j.q}}
      behaviours: {ask: {functions: [ask], terminal: never}}
      states: {S0: ask}
      initial_state: S0
plant:
  model: hinge.xml
  bind:
    arm.E.j.tau: {actuators: [motor], joints: [hinge], through: "hinge_parts:torque"}
    arm.E.j.q: {joints: [hinge], through: "hinge_parts:angle"}
task:
  cycle: {of: arm.j, from: S0, to: S1}
  scene: "hinge_parts:Scene"
  judge: "hinge_parts:Judge"
  watch: []
"""
MODEL = """<mujoco>
  <worldbody>
    <camera name="overview" pos="0 -2 0" xyaxes="1 0 0 0 0 1"/>
    <camera name="top" pos="0 0 2"/>
    <body><joint name="hinge" axis="0 1 0" damping="1"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/></body>
  </worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
</mujoco>
"""
PARTS = {
    "drive": "def drive(e):\n    return 0.1 * e",
    "high": "def high(q):\n    return q > 0.5",
    "gain": "def gain():\n    return 2.0",
    "hold": "def hold(q):\n    return 3.0 + 0 * q",
    "torque": "def torque(command, raw):\n    return command",
    "angle": "def angle(raw):\n    return float(raw[0])",
    "place": "    def place(self, plant, rng):\n        pass",
    "init": "    def __init__(self, plant):\n        pass",
    "observe": "    def observe(self):\n        pass",
    "watch": "    def watch(self, name, value):\n        pass",
    "end_cycle": "    def end_cycle(self):\n        return {'good': True}",
}


def hinge(folder: Path, head: str = "", spec: str = SPEC, **parts: str) -> Path:
    """The folder of the generated package, with these parts in place of the good ones.

    `head` stands at the top of the module of the parts.
    """
    p = PARTS | parts
    functions = [p[name] for name in ("drive", "high", "gain", "hold", "torque", "angle")]
    scene = "class Scene:\n" + p["place"]
    judge = "\n".join(
        (
            "class Judge:\n    criterion = 'good'",
            p["init"],
            p["observe"],
            p["watch"],
            p["end_cycle"],
        )
    )
    text = "\n\n".join(("import time", head, *functions, scene, judge))
    (folder / "hinge_parts.py").write_text(f"{text}\n")
    (folder / "hinge.xml").write_text(MODEL)
    (folder / "hinge.yaml").write_text(spec)
    built = build(str(folder / "hinge.yaml"), is_read=False)
    assert built.files, built.result.diagnostics
    write(folder / "hinge", built.files)
    return folder / "hinge"


def run(package: Path, *arguments: str, code: int = 1) -> dict[str, Any]:
    """The report of a run of the package in this process."""
    report = package.parent / "report.json"
    common = [str(package), "--base", str(package.parent), "--report", str(report), "--quiet"]
    sys.path.insert(0, str(package.parent))
    try:
        sys.modules.pop("hinge_parts", None)
        assert main([*common, *arguments]) == code
    finally:
        sys.path.remove(str(package.parent))
    return dict(json.loads(report.read_text()))
