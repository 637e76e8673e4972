"""Commands that the actuators of a model cannot obey are counted by element."""

import json
from pathlib import Path

import pytest
from specc_runtime.plants.binding import ActuatorBinding
from specc_runtime.plants.mujoco import MujocoPlant
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.limits import limits

from specc.analysis.plant import limits_of_control
from specc.mjcf import read_model
from tests.commands import specc
from tests.plants.worlds import model_file
from tests.scenarios.runs import INSTALLED, SPECS

LIMITS = Path(__file__).parents[1] / "cases/plant/plants/limits.xml"
MODELS = [
    pytest.param(path, marks=[INSTALLED] if "../models/" in path.read_text() else [], id=path.stem)
    for path in (*sorted((SPECS / "plants").glob("*.xml")), LIMITS)
]


@pytest.mark.parametrize("path", MODELS)
def test_what_the_compiler_knows_of_limits_is_so(path: Path) -> None:
    """It knows fewer: of `general` actuators only the `ctrlrange`."""
    read, built = read_model(str(path)), mujoco.MjModel.from_xml_path(str(path))
    for index in range(built.nu):
        found = {of.split()[0]: ends for of, *ends in limits(built, index)}
        known = {
            of.strip("`").split()[0]: list(ends)
            for of, ends in limits_of_control(built.actuator(index).name, read)
        }
        for of, ends in known.items():
            assert found.pop(of) == pytest.approx(ends)
        part = read.parts["actuator", built.actuator(index).name]
        assert not found or part.kind not in ("motor", "position", "velocity")


def test_clamping_that_is_switched_off_limits_nothing(tmp_path: Path) -> None:
    text = LIMITS.read_text().replace(
        "<default>", '<option><flag clampctrl="disable"/></option><default>', 1
    )
    path = model_file(tmp_path, text)
    model = mujoco.MjModel.from_xml_path(path)
    for found in (
        [*limits_of_control("b_servo", read_model(path))],
        [*limits(model, model.actuator("b_servo").id)],
    ):
        assert ["range" in limit[0] and "ctrl" not in limit[0] for limit in found] == [True]


def plant_of(folder: Path) -> MujocoPlant:
    bindings = [
        ActuatorBinding("q", actuators=("a_servo", "b_servo")),
        ActuatorBinding("tau", actuators=("c_motor",), through=lambda tau, raw: 2 * tau),
        ActuatorBinding("g", actuators=("b_geared",)),
    ]
    return MujocoPlant(model_file(folder, LIMITS.read_text()), (), bindings)


def test_ticks_beyond_a_limit_are_counted_and_the_first_is_kept(tmp_path: Path) -> None:
    plant = plant_of(tmp_path)
    commands = {"q": [0.0, 2.0], "tau": 1.0, "g": 100.0}
    for command in ([0.0, 2.0], [0.0, 2.2], [-1.6, 2.3], [1.5, -0.5]):
        for name, value in (commands | {"q": command}).items():
            plant.actuate(name, value)
        plant.advance(0.002)
    assert plant.clipped() == {
        "q": {
            "ticks": 2,
            "first_s": pytest.approx(0.002),
            "actuator": "b_servo",
            "value": 2.2,
            "of": "ctrlrange",
            "range": (-0.5, 2.0),
        }
    }
    plant.actuate("tau", 1.1)
    plant.advance(0.002)
    assert plant.clipped()["tau"]["of"] == "forcerange"
    saved, before = json.loads(json.dumps(plant.saved(), default=list)), plant.clipped()
    plant.reset(0)
    assert plant.clipped() == {}
    plant.restore(saved)
    assert plant.clipped() == before


@pytest.mark.parametrize(("goal", "ticks"), [("[70[deg], 0]", 189), ("[50[deg], 0]", None)])
def test_a_run_tells_how_long_commands_were_cut(
    tmp_path: Path, goal: str, ticks: int | None
) -> None:
    """The goal comes after the period of control and that of the effector, 0.11 s."""
    model_file(
        tmp_path,
        LIMITS.read_text().replace(
            'name="a_servo" joint="a"', 'name="a_servo" joint="a" ctrlrange="-1 1"'
        ),
    )
    (tmp_path / "arm.yaml").write_text(f"""
specc: 1.2
system: arm
agents:
  arm:
    real_effectors: {{j: {{x: {{q_d: {{type: "vector[2, rad]", safe: "[0, 0]"}}}}}}}}
    virtual_effectors: {{j: {{rate: 100 Hz, through: identity}}}}
    control: {{rate: 10 Hz, y: {{j: {{q_d: "vector[2, rad]"}}}}, through: {{y.j.q_d: goal}}}}
constants: {{goal: "{goal}"}}
plant: {{model: model.xml, bind: {{arm.E.j.q_d: {{actuators: [a_servo, b_servo]}}}}}}
""")
    done = specc("run", "arm.yaml", "--duration", "2", "--report", "r.json", cwd=tmp_path)
    clipped = json.loads((tmp_path / "r.json").read_text()).get("clipped")
    if ticks is None:
        assert clipped is None
        assert "clipped" not in done.stdout
    else:
        (found,) = clipped.items()
        assert found == (
            "arm.E.j.q_d",
            {
                "ticks": ticks,
                "time_s": pytest.approx(ticks * 0.01),
                "first_s": pytest.approx(0.11),
                "actuator": "a_servo",
                "value": pytest.approx(1.2217, abs=1e-4),
                "of": "ctrlrange",
                "range": [-1.0, 1.0],
            },
        )
        assert "clipped arm.E.j.q_d for 1.890 s (189 ticks): first 1.222 at 0.110 s" in done.stdout
