"""Ground truth for requirements, and scenes that are drawn: neither reaches what else happens."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main

WORLD = """
<mujoco model="world">
  <option timestep="0.01" gravity="0 0 0"/>
  <worldbody>
    <body><joint name="rail" type="slide" axis="1 0 0"/><geom size="0.1"/><site name="cart"/></body>
    <body pos="0 2 0"><joint name="hinge" axis="0 0 1"/><geom size="0.1"/></body>
    <body pos="0 3 0" euler="90 0 0">
      <freejoint name="box"/><geom size="0.1"/><site name="box"/>
    </body>
    <body pos="0 9 0"><joint name="ball" type="ball"/><geom size="0.1"/></body>
  </worldbody>
  <actuator><velocity name="drive" joint="rail" kv="100"/></actuator>
  <sensor>
    <framepos name="cart" objtype="site" objname="cart"/>
    <framepos name="box" objtype="site" objname="box"/>
    <framezaxis name="up" objtype="site" objname="box"/>
    <jointpos name="encoder" joint="rail"/>
  </sensor>
</mujoco>
"""
SPEC = """
specc: 1.1
system: cart
frames: {W: world}
constants: {far: "2[m]", corner: {type: "point[W]", is: "MINUS([far, 0[m], 0[m]])"}}
operators: {MINUS: {signature: "(p: point[W]) -> point[W]", python: "numpy:negative"}}
agents:
  cart:
    real_effectors: {wheel: {x: {v_d: "real[m/s]"}, y: {s: "real[m]"}}}
    virtual_effectors:
      wheel:
        rate: 50 Hz
        x: {c: {v_d: {type: "real[m/s]", init: 0}}, E: {s: "real[m]"}}
        y: {E: {v_d: "real[m/s]"}}
        memory: {s: {type: "real[m]", init: x.E.s}}
        functions: {drive: {y.E.v_d: x.c.v_d, s: x.E.s}}
        behaviours: {drive: {functions: [drive], terminal: never}}
        states: {S0: drive}
        initial_state: S0
    control:
      rate: 10 Hz
      y: {wheel: {v_d: "real[m/s]"}}
      functions: {go: {y.wheel.v_d: "0.5[m/s]"}}
      behaviours: {go: {functions: [go], terminal: never}}
      states: {S0: go}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
task:
  cycle: {of: cart.c, from: S0, to: S0}
"""
MODEL = """
plant:
  model: world.xml
  bind:
    cart.E.wheel.v_d: {actuators: [drive]}
    cart.E.wheel.s: {sensors: [encoder], noise: "0.01[m]"}
  observe:
    at: {type: "point[W]", sensors: [cart]}
    box: {type: "point[W]", sensors: [box]}
    up: {type: "vector[3]", sensors: [up]}
    s: {type: "real[m]", joints: [rail]}
    turn: {type: "real[rad]", joints: [hinge]}
"""


def run(folder: Path, scene: str = "", *required: str, code: int = 0, **options: object) -> Any:
    """The report of a run with this scene and these requirements."""
    (folder / "world.xml").write_text(WORLD)
    spec, report = folder / "cart.yaml", folder / "report.json"
    scene = f"  scene: {{{scene}}}\n" if scene else ""
    items = "".join(f'  - {{that: "{that}", because: of the test}}\n' for that in required)
    plant = options.pop("plant", MODEL)
    spec.write_text(SPEC + scene + f"{plant}" + (f"require:\n{items}" if items else ""))
    given = {"duration": 1, "report": report, **options}
    told = [f for name, value in given.items() for f in (f"--{name}", str(value))]
    assert main(["run", str(spec), *told]) == code
    return json.loads(report.read_text())


def test_requirements_see_what_is_really_so(tmp_path: Path) -> None:
    truths = (
        "always(near(plant.at.x, plant.s, 1e-9[m]))",
        # The encoder is noisy, the truth is not; and it is that of the tick, not of the last step.
        "always(abs(plant.s - cart.E.wheel.s) < 0.1[m])",
        "near(plant.s, 0[m], 1e-9[m])",
        "within(0.9[s], plant.s > 0.3[m])",
        # An array of a constant that is computed when the run begins.
        "always(near(norm(plant.at - 2 * corner), plant.s + 2 * far, 1e-9[m]))",
    )
    report = run(tmp_path, "", *truths, "always(near(plant.s, cart.E.wheel.s, 1e-6[m]))", code=1)
    verdicts = [found["verdict"] for found in report["requirements"]]
    assert verdicts == ["met"] * len(truths) + ["violated"]


def test_what_is_observed_changes_no_record(tmp_path: Path) -> None:
    plain = run(tmp_path, "", plant=MODEL.partition("  observe")[0])
    seen = run(tmp_path, "", "always(plant.s > -1[m])", "always(plant.at.x < 9[m])")
    assert seen["records_sha256"] == plain["records_sha256"]


def test_each_position_is_drawn_by_the_seed_and_its_name_alone(tmp_path: Path) -> None:
    first = "rail: [-far, far], hinge: {one_of: ['0.1[rad]', '0.2[rad]', '0.3[rad]']}"
    scenes = [run(tmp_path, first, duration=0.1, seed=seed)["scene"] for seed in range(8)]
    assert len({scene["rail"] for scene in scenes}) == 8
    assert all(-2 <= scene["rail"] <= 2 for scene in scenes)
    assert {scene["hinge"] for scene in scenes} == {0.1, 0.2, 0.3}
    more = run(tmp_path, f"box.x: ['-1[m]', '1[m]'], {first}", duration=0.1, seed=3)["scene"]
    assert {name: more[name] for name in scenes[3]} == scenes[3]
    assert run(tmp_path, first, duration=0.1, seed=3, set="far=0[m]")["scene"]["rail"] == 0


def test_joints_are_where_the_scene_puts_them(tmp_path: Path) -> None:
    report = run(
        tmp_path,
        "rail: -far, hinge: '30[deg]', box.x: '-1[m]', box.z: '0.5[m]', box.yaw: '90[deg]'",
        "near(plant.at, [-2[m], 0[m], 0[m]], 1e-9[m])",
        "near(plant.turn, 30[deg], 1e-9[rad])",
        "near(plant.box, [-1[m], 3[m], 0.5[m]], 1e-9[m])",
        # It lies on its side, its axis along -y, and is turned about the vertical.
        "near(plant.up, [1, 0, 0], 1e-9)",
    )
    assert {found["verdict"] for found in report["requirements"]} == {"met"}


@pytest.fixture
def python_plant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "own_rail.py").write_text(
        "class Rail:\n"
        "    def reset(self, seed): self.t = 0.0\n"
        "    def sample(self, name):\n"
        "        if name == 'plant.lost': raise ValueError('no such value')\n"
        "        return self.t\n"
        "    def actuate(self, name, value): pass\n"
        "    def advance(self, duration_s): self.t += duration_s\n"
        "    def close(self): pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_rail", raising=False)
    return (
        "plant:\n  python: 'own_rail:Rail'\n  bind: {cart.E.wheel.v_d: {}, cart.E.wheel.s: {}}\n"
        "  observe: {s: {type: 'real[m]'}, lost: {type: 'real[m]'}}\n"
    )


def test_a_plant_in_python_answers_by_name(tmp_path: Path, python_plant: str) -> None:
    report = run(tmp_path, "", "within(0.5[s], plant.s > 0.3[m])", plant=python_plant)
    assert [found["verdict"] for found in report["requirements"]] == ["met"]


def test_what_cannot_be_observed_is_unknown(tmp_path: Path, python_plant: str) -> None:
    required = "always(plant.lost < 0.5[m])", "always(plant.s < 0.5[m])"
    report = run(tmp_path, "", *required, plant=python_plant, code=1)
    assert [found["verdict"] for found in report["requirements"]] == ["unknown", "violated"]
    assert report["faults"] == []
    assert list(report["unobserved"]) == ["plant.lost"]
    assert "no such value" in report["unobserved"]["plant.lost"]


def test_a_recording_does_not_change_a_run_whose_plant_is_not_observed(
    tmp_path: Path, python_plant: str
) -> None:
    plant = python_plant.replace("{s: {type: 'real[m]'}, lost", "{lost")
    recording = tmp_path / "run.mcap"
    plain, recorded = run(tmp_path, plant=plant), run(tmp_path, plant=plant, record=recording)
    assert recorded["records_sha256"] == plain["records_sha256"]
    assert recorded["ended"] == "completed"
    assert main(["replay", str(recording), "--spec", str(tmp_path / "cart.yaml")]) == 0


def test_what_is_not_observed_for_a_while_is_unknown_for_that_long(
    tmp_path: Path, python_plant: str
) -> None:
    """It is not what it was before, nor is it lost for ever."""
    own = tmp_path / "own_rail.py"
    own.write_text(own.read_text().replace("== 'plant.lost'", "== 'plant.lost' and self.t < 0.5"))
    seen = "throughout(0.4[s], plant.lost < 9[m])", "once(0[s], plant.lost > 0.9[m])"
    required = seen[0], f"within(0.97[s], {seen[1]})"
    recording = tmp_path / "run.mcap"
    report = run(tmp_path, "", *required, plant=python_plant, record=recording)
    verdicts = [found["verdict"] for found in report["requirements"]]
    assert verdicts == ["unknown", "met"]
