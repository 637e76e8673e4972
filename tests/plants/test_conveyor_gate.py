"""A ring conveyor that the tutorial drives: parcels come round, the gate holds them."""

from math import pi

import pytest
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.plants.mujoco import MujocoPlant

from tests.plants.worlds import CONVEYOR

NAMES = ("belt_angle", "belt_speed", "gate_angle", "parcel_distance")
SPEED = 0.8


@pytest.fixture
def plant():
    sensors = [SensorBinding(name, sensors=(name,)) for name in NAMES]
    drives = [ActuatorBinding(name, (name,)) for name in ("belt_drive", "gate_drive")]
    plant = MujocoPlant(CONVEYOR, sensors, drives)
    plant.actuate("belt_drive", SPEED)
    return plant


def test_an_open_gate_lets_three_parcels_by_in_every_turn(plant):
    plant.actuate("gate_drive", 1.4)
    seen, before = 0, False
    while plant.sample("belt_angle") < 4 * pi:
        plant.advance(0.01)
        now = plant.sample("parcel_distance") < 0.3
        seen += now and not before
        before = now
    assert seen == 6
    assert plant.sample("belt_speed") == pytest.approx(SPEED, rel=0.01)


def test_the_beam_sees_the_hub_when_there_is_no_parcel(plant):
    assert plant.sample("parcel_distance") == pytest.approx(0.46, abs=0.001)


def test_a_closed_gate_stops_the_belt(plant):
    plant.advance(4.0)
    assert plant.sample("belt_speed") == pytest.approx(0.0, abs=0.01)
    assert plant.sample("belt_angle") < 1.3
    plant.actuate("gate_drive", 1.4)
    plant.advance(2.0)
    assert plant.sample("belt_speed") == pytest.approx(SPEED, rel=0.01)


def test_the_gate_opens_in_less_time_than_a_parcel_needs_from_beam_to_gate(plant):
    while plant.sample("parcel_distance") > 0.3:
        plant.advance(0.002)
    plant.actuate("gate_drive", 1.4)
    plant.advance(0.7)
    assert plant.sample("gate_angle") > 1.2
    assert plant.sample("belt_speed") == pytest.approx(SPEED, rel=0.01)
