"""Range finders: a distance that is measured, and what stands for none."""

import math

import numpy as np
import pytest
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import MujocoPlant

from tests.plants.worlds import model_file

REACH = 2.0
WORLD = """
<mujoco>
  <option timestep="0.002" gravity="0 0 0"/>
  <worldbody>
    <geom name="of_the_world" type="sphere" size="0.1" pos="0 0 -1"/>
    <site name="up"/> <site name="down" zaxis="0 0 -1"/>
    <site name="left" zaxis="0 1 0"/> <site name="ahead" zaxis="1 0 0"/>
    <body pos="1 0 0"><geom type="sphere" size="0.1"/></body>
    <body pos="0 5 0"><geom type="sphere" size="0.1"/></body>
  </worldbody>
  <sensor>
    <rangefinder name="near" site="ahead" cutoff="2"/>
    <rangefinder name="far" site="left" cutoff="2"/>
    <rangefinder name="nothing" site="up" cutoff="2"/>
    <rangefinder name="unlimited" site="left"/>
    <rangefinder name="endless" site="up"/>
    <rangefinder name="own_body" site="down" cutoff="2"/>
    <rangefinder name="with_directions" site="up" data="dist dir"/>
    <clock name="clock"/>
  </sensor>
</mujoco>
"""


def sampled(folder, *sensors, times=1, **binding):
    """Values that a binding of these sensors gives, one after the other."""
    plant = MujocoPlant(model_file(folder, WORLD), [SensorBinding("d", sensors=sensors, **binding)])
    values = []
    for _ in range(times):
        values.append(plant.sample("d"))
        plant.advance(0.002)
    return values


@pytest.mark.parametrize(
    ("sensor", "distance"),
    [("near", 0.9), ("far", REACH), ("nothing", REACH), ("unlimited", 4.9), ("own_body", REACH)],
)
def test_what_is_beyond_the_cutoff_is_as_far_as_the_cutoff(tmp_path, sensor, distance):
    assert sampled(tmp_path, sensor) == [pytest.approx(distance)]


def test_several_are_a_vector_in_their_order_among_other_sensors(tmp_path):
    (value,) = sampled(tmp_path, "nothing", "clock", "near", "far")
    assert value == pytest.approx([REACH, 0.0, 0.9, REACH])


def test_noise_changes_distances_and_leads_none_beyond_the_cutoff(tmp_path):
    names, noise = ("near", "far", "nothing"), (1.0, 1.0, 1.0)
    near, far, nothing = np.transpose(sampled(tmp_path, *names, noise=noise, times=500))
    assert near.max() == REACH
    assert np.unique(near).size > 100
    assert set(far) == set(nothing) == {REACH}


def test_without_a_cutoff_nothing_in_the_beam_is_an_error_not_a_distance(tmp_path):
    with pytest.raises(PlantError, match=r"'endless' meets nothing.*`cutoff`"):
        sampled(tmp_path, "near", "endless")


def test_without_a_cutoff_a_function_gets_infinity(tmp_path):
    values = sampled(tmp_path, "near", "endless", noise=(0.0, 0.1), through=list)
    assert values == [[pytest.approx(0.9), math.inf]]


def test_what_a_range_finder_gives_beside_distances_stays_as_it_is(tmp_path):
    assert sampled(tmp_path, "with_directions", through=list) == [[-1.0, 0.0, 0.0, 0.0]]
