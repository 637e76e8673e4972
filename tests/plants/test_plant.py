"""Laws of the plant: what it returns depends on seed, time and commands only."""

import numpy as np
import pytest
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import MujocoPlant

from tests.plants.worlds import SLIDER, model_file

SENSORS = (
    SensorBinding("x", joints=("x",)),
    SensorBinding("v", sensors=("speed",)),
    SensorBinding("f", actuators=("push",)),
    SensorBinding("p", sensors=("place",), noise=(0.1,)),
    SensorBinding("all", ("x",), ("speed", "place"), ("push",), noise=(0.0, 0.1)),
    SensorBinding("slow", sensors=("speed",), noise=(1.0,), rate_hz=100.0),
    SensorBinding("twice", joints=("x",), through=lambda raw: 2.0 * raw),
)
PUSH = ActuatorBinding("push", ("push",))


@pytest.fixture
def plant(tmp_path):
    return MujocoPlant(model_file(tmp_path), SENSORS, (PUSH,))


def run(plant, order, ticks=20):
    """All values sampled in that order at every tick."""
    seen = {name: [] for name in order}
    for _ in range(ticks):
        for name in order:
            seen[name].append(np.array(plant.sample(name)))
        plant.advance(0.002)
    return {name: np.array(values) for name, values in seen.items()}


def test_controls_of_the_home_keyframe_hold_until_a_command_comes(tmp_path):
    text = SLIDER.replace('qpos="0.5"', 'qpos="0.5" ctrl="3"')
    plant = MujocoPlant(model_file(tmp_path, text), SENSORS, (PUSH,))
    plant.advance(0.002)
    assert plant.sample("f") == 3.0
    plant.actuate("push", -1.0)
    plant.advance(0.002)
    assert plant.sample("f") == -1.0
    plant.reset(0)
    plant.advance(0.002)
    assert plant.sample("f") == 3.0


def test_it_starts_at_rest_in_the_home_keyframe(plant):
    assert plant.time_s == 0.0
    assert plant.sample("x") == 0.5
    assert plant.sample("v") == 0.0


def test_a_command_is_held_until_the_next_one(plant):
    plant.actuate("push", 4.0)
    for _ in range(50):
        plant.advance(0.002)
    assert plant.sample("v") == pytest.approx(4.0 / 2.0 * 0.1)
    assert plant.sample("f") == 4.0
    plant.actuate("push", 0.0)
    plant.advance(0.1)
    assert plant.sample("v") == pytest.approx(0.2)


def test_controls_are_computed_from_the_state_at_each_advance(tmp_path):
    def spring(command, raw):
        position, velocity = raw
        return command - 50.0 * position - 40.0 * velocity

    binding = ActuatorBinding("hold", ("push",), joints=("x",), through=spring)
    plant = MujocoPlant(model_file(tmp_path), SENSORS, (binding,))
    plant.actuate("hold", 10.0)
    for _ in range(3000):
        plant.advance(0.002)
    assert plant.sample("x") == pytest.approx(0.2, abs=1e-3)


def test_one_advance_is_as_many_steps(plant):
    plant.actuate("push", 1.0)
    plant.advance(0.02)
    once = plant.sample("x"), plant.time_s
    plant.reset(0)
    plant.actuate("push", 1.0)
    for _ in range(10):
        plant.advance(0.002)
    assert (plant.sample("x"), plant.time_s) == once


@pytest.mark.parametrize("duration", [0.001, 0.003, 0.0, -0.002])
def test_only_whole_steps_can_pass(plant, duration):
    with pytest.raises(PlantError, match="whole number"):
        plant.advance(duration)


def test_raw_is_joints_then_sensors_then_actuators(plant):
    plant.actuate("push", 4.0)
    plant.advance(0.002)
    value = plant.sample("all")
    assert value.shape == (6,)
    assert value[0] == plant.sample("x")
    assert value[1] == plant.sample("v")  # its noise is 0
    assert value[5] == 4.0
    assert np.all(value[2:5] != [plant.sample("x"), 0.0, 0.0])


def test_a_value_goes_through_the_function_of_its_binding(plant):
    assert plant.sample("twice") == 1.0


def test_the_same_seed_gives_the_same_run(plant):
    plant.reset(7)
    first = run(plant, ("p", "slow"))
    plant.reset(7)
    second = run(plant, ("p", "slow"))
    plant.reset(8)
    third = run(plant, ("p", "slow"))
    assert np.array_equal(first["p"], second["p"])
    assert np.array_equal(first["slow"], second["slow"])
    assert not np.array_equal(first["p"], third["p"])


def test_noise_of_a_sensor_depends_on_no_other_sensor(plant, tmp_path):
    plant.reset(3)
    together = run(plant, ("all", "p", "slow"))
    plant.reset(3)
    reverse = run(plant, ("slow", "p", "all"))
    alone = MujocoPlant(model_file(tmp_path), (SENSORS[3],))
    alone.reset(3)
    assert all(np.array_equal(together[name], reverse[name]) for name in together)
    assert np.array_equal(run(alone, ("p",))["p"], together["p"])


def test_noise_has_the_given_deviation(plant):
    plant.reset(1)
    values = run(plant, ("p",), ticks=3000)["p"]
    assert values.std(axis=0) == pytest.approx(0.1, rel=0.05)
    assert values.mean(axis=0) == pytest.approx([0.5, 0.0, 0.0], abs=0.01)


def test_sampling_again_at_the_same_time_changes_nothing(plant):
    assert np.array_equal(plant.sample("p"), plant.sample("p"))


def test_a_sensor_with_a_rate_holds_its_value(plant):
    values = run(plant, ("slow",), ticks=200)["slow"]
    changes = np.flatnonzero(np.diff(values)) + 1
    assert np.array_equal(changes, np.arange(5, 200, 5))


def test_arrays_are_read_only(plant):
    with pytest.raises(ValueError, match="read-only"):
        plant.sample("p")[0] = 1.0


@pytest.mark.parametrize(
    ("binding", "known"),
    [
        (SensorBinding("a", joints=("y",)), "x"),
        (SensorBinding("a", sensors=("sped",)), "speed"),
        (SensorBinding("a", actuators=("pull",)), "push"),
        (SensorBinding("a", camera="ear"), "eye"),
    ],
)
def test_an_unknown_name_is_refused_with_the_known_ones(tmp_path, binding, known):
    with pytest.raises(PlantError) as refusal:
        MujocoPlant(model_file(tmp_path), (binding,))
    assert known in refusal.value.known
    assert known in str(refusal.value)


@pytest.mark.parametrize(
    "binding",
    [
        SensorBinding("a"),
        SensorBinding("a", sensors=("speed", "place"), noise=(1.0,)),
        SensorBinding("a", joints=("x",), camera="eye"),
        SensorBinding("a", joints=("x",), depth_noise="kinect"),
        SensorBinding("a", camera="eye", image="rgb", depth_noise="kinect"),
    ],
)
def test_a_contradictory_sensor_is_refused(tmp_path, binding):
    with pytest.raises(PlantError, match="sensor 'a'"):
        MujocoPlant(model_file(tmp_path), (binding,))


def test_names_of_bindings_are_unique(tmp_path):
    with pytest.raises(PlantError, match="'x'"):
        MujocoPlant(model_file(tmp_path), (SENSORS[0], SENSORS[0]))


def test_unbound_names_are_refused_with_the_bound_ones(plant):
    with pytest.raises(PlantError, match="slow"):
        plant.sample("y")
    with pytest.raises(PlantError, match="push"):
        plant.actuate("pull", 1.0)


@pytest.mark.parametrize("command", [float("nan"), float("inf"), np.zeros(2)])
def test_a_bad_command_is_refused(plant, command):
    plant.actuate("push", command)
    with pytest.raises(PlantError, match="'push'"):
        plant.advance(0.002)


def test_divergence_is_reported(plant):
    plant.actuate("push", 1e20)
    with pytest.raises(PlantError, match="diverged"):
        plant.advance(0.02)


@pytest.mark.parametrize("text", ["", "<mujoco><bad/></mujoco>", "<mujoco>"])
def test_an_unreadable_model_is_refused(tmp_path, text):
    with pytest.raises(PlantError, match=r"model\.xml"):
        MujocoPlant(model_file(tmp_path, text))


def test_a_missing_model_is_refused(tmp_path):
    with pytest.raises(PlantError, match=r"none\.xml"):
        MujocoPlant(str(tmp_path / "none.xml"))
