"""The declarations that the packages of operators for any arm show are those of their functions."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

import specc_runtime.operators.arms as arms
import yaml
from specc_runtime.operators import trajectories

from tests.commands import specc
from tests.operators import seven_joints as panda

CELL = """\
constants:
  q_0: "[0, -0.3, 0, -2.2, 0, 1.9, 0.785398] * 1[rad]"
  one: "[1, 1, 1, 1, 1, 1, 1]"
  j_max: one * 1[rad/s**3]
agents:
  c:
    real_effectors: {arm: {x: {q_d: {type: "vector[7, rad]", safe: q_0}}}}
    virtual_effectors: {arm: {rate: 50 Hz, through: identity}}
    control:
      rate: 50 Hz
      y: {arm: {q_d: "vector[7, rad]"}}
      memory:
        way:
          type: Trajectory
          init: planned(resting(0.5 * q_0), q_0, one * 1[rad/s], one * 1[rad/s**2], j_max)
      let: {q: "sampled(way, elapsed).q", found: "IK(arm, DK(arm, q), q)"}
      functions: {go: {y.arm.q_d: q if found is None else found}}
      behaviours: {go: {functions: [go], terminal: never}}
      states: {going: go}
      initial_state: going
"""


def shown(text: str) -> dict[str, dict[str, object]]:
    """The lines that a docstring sets off, as YAML."""
    return yaml.safe_load(textwrap.dedent("\n".join(re.findall(r"^ {4}.*$", text, re.MULTILINE))))


def test_what_is_shown_can_be_declared_and_used(tmp_path: Path) -> None:
    data = {"specc": 1.2, "system": "s"}
    for part in (shown(arms.__doc__), shown(trajectories.__doc__), yaml.safe_load(CELL)):
        for key, named in part.items():
            data[key] = {**data.get(key, {}), **named}
    (tmp_path / "plants").mkdir()
    model = panda.model().replace('"flange"', '"tool"')
    (tmp_path / "plants" / "robot.xml").write_text(model)
    spec = tmp_path / "s.yaml"
    spec.write_text(yaml.safe_dump(data, sort_keys=False))
    done = specc("validate", "--strict", spec)
    assert done.returncode == 0, done.stderr
