"""The scene keeps its promises; the judge tells picked from not picked."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest
from specc_runtime.cells.irp6_picking import CrowdedScene, PickingScene, PickJudge
from specc_runtime.cells.irp6_picking.scene import (
    GAP_M,
    REGION_M,
    TABLE_HEIGHT_M,
    gap,
    lying_faces,
)
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import MujocoPlant

from tests.plants.scripted_pick import ACTUATORS, SENSORS, Script, above, pick
from tests.plants.worlds import PICKING
from tests.seeds import every, short

OBJECTS = PickingScene().objects


@dataclass(frozen=True)
class Estimate:
    label: str
    X: np.ndarray


@pytest.fixture(scope="module")
def plant():
    return MujocoPlant(PICKING, SENSORS, ACTUATORS)


def placed(plant, seed):
    plant.reset(seed)
    PickingScene().place(plant, np.random.default_rng(seed))
    return {name: plant.truth.body_pose(name) for name in OBJECTS}


def corners(plant, name, X):
    """Corners (8, 3) of a box in B."""
    half = plant.truth.box_size(name) / 2
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, -1).T
    return (signs * half) @ X[:3, :3].T + X[:3, 3]


@pytest.mark.parametrize("seed", every(4, list(range(20))))
def test_boxes_lie_flat_apart_and_in_the_region(plant, seed):
    poses = placed(plant, seed)
    assert plant.time_s == 0.0
    for name, X in poses.items():
        points = corners(plant, name, X)
        assert points[:, 2].min() == pytest.approx(TABLE_HEIGHT_M, abs=5e-4)
        for axis in (0, 1):
            low, high = REGION_M[axis]
            assert low - 0.002 < X[axis, 3] < high + 0.002
    rng = np.random.default_rng(0)
    for one, other in combinations(OBJECTS, 2):
        weights = rng.dirichlet(np.full(8, 0.2), 300)
        first = (weights @ corners(plant, one, poses[one]))[:, None, :2]
        second = (weights @ corners(plant, other, poses[other]))[None, :, :2]
        assert np.linalg.norm(first - second, axis=2).min() > GAP_M - 0.004


@pytest.mark.parametrize("seed", range(5))
def test_two_boxes_of_a_crowded_scene_are_close_together(plant, seed):
    plant.reset(seed)
    CrowdedScene().place(plant, np.random.default_rng(seed))
    boxes = [(plant.truth.body_pose(name), plant.truth.box_size(name)) for name in OBJECTS]
    nearest = min(gap(*one, *other) for one, other in combinations(boxes, 2))
    assert 0.008 < nearest < 0.022


def test_scenes_depend_on_the_seed_alone(plant):
    first, again, other = (placed(plant, seed) for seed in (4, 4, 5))
    assert all(np.array_equal(first[name], again[name]) for name in OBJECTS)
    assert not any(np.allclose(first[name], other[name], atol=1e-3) for name in OBJECTS)


def test_all_faces_and_turns_occur(plant):
    ups, yaws = set(), []
    for seed in range(40):
        for name, X in placed(plant, seed).items():
            axis = int(np.argmax(np.abs(X[2, :3])))
            ups.add((name, axis, int(np.sign(X[2, axis]))))
            yaws.append(np.arctan2(X[1, 0], X[0, 0]))
    sizes = {name: plant.truth.box_size(name) for name in OBJECTS}
    assert ups == {(n, *face) for n in OBJECTS for face in lying_faces(sizes[n])}
    assert np.histogram(yaws, bins=4, range=(-np.pi, np.pi))[0].min() > 10


def test_a_box_too_wide_or_too_high_has_no_face_to_lie_on():
    assert lying_faces(np.array((0.2, 0.2, 0.2))) == ()
    assert lying_faces(np.array((0.07, 0.07, 0.3))) == ((0, 1), (0, -1), (1, 1), (1, -1))


def test_a_scene_without_room_is_refused(plant, monkeypatch):
    monkeypatch.setattr("specc_runtime.cells.irp6_picking.scene._ATTEMPTS", 100)
    plant.reset(0)
    with pytest.raises(PlantError, match="no room"):
        PickingScene(OBJECTS * 5).place(plant, np.random.default_rng(0))


@pytest.mark.parametrize(("seed", "name"), short(enumerate(OBJECTS), 0))
def test_a_scripted_pick_is_judged_as_picked(plant, seed, name):
    placed(plant, seed)
    judge = PickJudge(plant)
    report = pick(plant, judge, name)
    assert report["object"] == name
    assert report["picked"]
    assert report["lift_height_m"] == pytest.approx(0.215, abs=0.005)
    assert report["position_error_mm"] == pytest.approx(0.0, abs=1e-6)
    assert 1.5 < report["max_force_N"] < 5.0
    assert 0.005 < report["finger_clearance_m"] < 0.03
    assert report["simulated_s"] == pytest.approx(plant.time_s)
    following = judge.end_cycle()
    assert following["object"] is None
    assert not following["picked"]
    assert following["position_error_mm"] is None
    assert following["simulated_s"] == 0.0


def test_lifting_an_empty_hand_is_not_picking(plant):
    X_BO = placed(plant, 0)["mnich"]
    judge = PickJudge(plant)
    script = Script(plant, judge)
    judge.watch("O_s", (Estimate("mnich_1", X_BO),))
    size = plant.truth.box_size("mnich")
    script.move(above(X_BO, size, 0.05), 2.0)
    script.fingers(0.06)
    script.move(above(X_BO, size, 0.25), 2.0)
    report = judge.end_cycle()
    assert report["object"] == "mnich"
    assert not report["picked"]
    assert report["lift_height_m"] == 0.0


def test_the_error_is_that_of_the_last_estimate_before_the_fingers_close(plant):
    X_true = placed(plant, 0)["sen"]
    judge = PickJudge(plant)
    script = Script(plant, judge)
    turn = np.array(((0.6, -0.8, 0, 0), (0.8, 0.6, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1.0)))
    off = X_true @ turn
    off[:3, 3] += (0.003, 0.0, 0.004)
    judge.watch("O_s", (Estimate("mnich_1", X_true), Estimate("sen_2", off)))
    judge.watch("O_s", ())
    script.fingers(0.06)
    judge.watch("O_s", (Estimate("sen_2", X_true),))
    report = judge.end_cycle()
    assert report["object"] == "sen"
    assert report["position_error_mm"] == pytest.approx(5.0)
    assert report["rotation_error_deg"] == pytest.approx(np.degrees(np.arccos(0.6)))
