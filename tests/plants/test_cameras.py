"""Cameras: the pinhole law, and that it does not matter what draws."""

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from specc_runtime.cells.irp6_picking import PickingScene
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import MujocoPlant, gl

from tests.plants.worlds import CONVEYOR, PICKING, model_file

KINECT = (
    SensorBinding("rgb", camera="kinect"),
    SensorBinding("depth", camera="kinect", image="depth"),
    SensorBinding("noisy", camera="kinect", image="depth", depth_noise="kinect"),
)
FX, CX, CY = 525.0, 319.5, 239.5

BALL = """
<mujoco>
  <worldbody>
    <light type="directional" dir="0 0 -1" diffuse="0.5 0.5 0.5"/>
    <camera name="eye" pos="0.1 0.2 2" euler="5 -8 20" resolution="320 240"
      focalpixel="300 310" principalpixel="7 -4" sensorsize="0.0032 0.0024"/>
    <body name="ball" pos="0.35 0.05 0.3">
      <freejoint/>
      <geom type="sphere" size="0.02" rgba="1 0 0 1"/>
    </body>
  </worldbody>
</mujoco>
"""


@cache
def gl_works():
    try:
        MujocoPlant(CONVEYOR, renderer="gl").picture("overview", 64, 48)
    except PlantError:
        return False
    return True


# A text is looked at when a test begins, not when it is collected.
needs_gl = pytest.mark.skipif("not gl_works()", reason="no OpenGL here")
RENDERERS = [pytest.param("gl", marks=needs_gl), "raycast"]
RAYS_FIRST = [pytest.param("gl", marks=[needs_gl, pytest.mark.long]), "raycast"]
"""Of tests that make several large images."""


def scene(renderer, seed=3):
    plant = MujocoPlant(PICKING, KINECT, renderer=renderer)
    plant.reset(seed)
    PickingScene().place(plant, np.random.default_rng(seed))
    return plant


@pytest.fixture(autouse=True)
def closed(monkeypatch):
    """Every plant is closed: a renderer holds hundreds of megabytes."""
    made, make = [], MujocoPlant.__init__

    def noted(self, *given, **options):
        make(self, *given, **options)
        made.append(self)

    monkeypatch.setattr(MujocoPlant, "__init__", noted)
    yield
    for plant in made:
        plant.close()


@pytest.mark.long
@pytest.mark.parametrize("renderer", RAYS_FIRST)
def test_points_of_a_depth_image_lie_on_what_was_seen(renderer):
    """X = (u - cx) / fx Z, in the optical frame at the published pose, falls on the table."""
    depth = scene(renderer).sample("depth").value()
    assert depth.dtype == np.float32
    assert depth.shape == (480, 640)
    v, u = np.mgrid[0:480, 0:640]
    points = np.stack(((u - CX) / FX * depth, (v - CY) / FX * depth, depth), axis=-1)
    z = np.array((-0.16549, -0.04335, -0.98526))
    x = np.array((0.00396, -0.99905, 0.04329))
    R_BK = np.column_stack((x, np.cross(z, x), z))
    in_B = points @ R_BK.T + (0.88317, -0.21239, 2.0291)
    over = (in_B[..., 0] > 0.5) & (in_B[..., 0] < 0.9) & (np.abs(in_B[..., 1] + 0.65) < 0.15)
    assert over.sum() > 5000
    assert in_B[over][:, 2] == pytest.approx(0.906, abs=2e-4)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_a_ball_appears_where_the_pinhole_has_it(renderer, tmp_path):
    sensors = (
        SensorBinding("rgb", camera="eye"),
        SensorBinding("depth", camera="eye", image="depth"),
    )
    plant = MujocoPlant(model_file(tmp_path, BALL), sensors, renderer=renderer)
    camera = plant._cameras.camera("eye")
    X_WC = np.eye(4)
    X_WC[:3, :3] = plant._data.cam("eye").xmat.reshape(3, 3)
    X_WC[:3, 3] = plant._data.cam("eye").xpos
    right, up, backward, _ = np.linalg.inv(X_WC) @ (0.35, 0.05, 0.3, 1.0)
    v, u = np.nonzero(plant.sample("depth").value())
    assert camera.cx + camera.fx * right / -backward == pytest.approx(u.mean(), abs=0.2)
    assert camera.cy - camera.fy * up / -backward == pytest.approx(v.mean(), abs=0.2)
    nearest = plant.sample("depth").value()[plant.sample("depth").value() > 0].min()
    assert nearest == pytest.approx(-backward - 0.02, abs=1e-3)
    red = plant.sample("rgb").value()[v, u]
    assert np.all(red[:, 0] > red[:, 1] + 20)


@needs_gl
@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 3])
def test_both_renderers_see_the_same(seed):
    drawn, cast = scene("gl", seed), scene("raycast", seed)
    depth_gl, depth_rays = drawn.sample("depth").value(), cast.sample("depth").value()
    assert np.array_equal(depth_gl == 0, depth_rays == 0)
    error = np.abs(depth_gl - depth_rays)
    assert np.median(error) < 1e-6
    # OpenGL draws cylinders as prisms; their flanks and the edges of all things differ a little.
    assert np.mean(error > 1e-3) < 0.02
    difference = np.abs(drawn.sample("rgb").value().astype(int) - cast.sample("rgb").value()).max(
        axis=2
    )
    assert difference.mean() < 0.5
    assert np.percentile(difference, 99) < 8
    table = np.abs(depth_rays - np.median(depth_rays)) < 0.12
    assert np.mean(difference[table & (error < 1e-3)] > 30) < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("renderer", RAYS_FIRST)
def test_pictures_leave_no_trace_in_later_frames(renderer):
    filmed = scene(renderer, 0)
    filmed.sample("depth").value()
    filmed.picture("overview", 320, 240)
    pictures = [filmed.picture("overview", 320, 240)]
    filmed.advance(0.2)
    plain = scene(renderer, 0)
    plain.advance(0.2)
    for name in ("rgb", "depth"):
        assert np.array_equal(filmed.sample(name).value(), plain.sample(name).value())
    pictures.append(filmed.picture("overview", 320, 240))
    assert not np.array_equal(pictures[0], np.zeros_like(pictures[0]))
    assert np.array_equal(pictures[1], plain.picture("overview", 320, 240))


@pytest.mark.long
def test_frames_of_rays_do_not_remember_where_things_were():
    plant = scene("raycast", 0)
    before = plant.sample("depth").value()
    X = plant.truth.body_pose("sen")
    X[:3, 3] += (-0.05, -0.3, 0.1)
    plant.truth.move_body("sen", X)
    fresh = MujocoPlant(PICKING, KINECT, renderer="raycast")
    for name in PickingScene().objects:
        fresh.truth.move_body(name, plant.truth.body_pose(name))
    for each in (plant, fresh):
        each.advance(0.002)
    moved = plant.sample("depth").value()
    assert np.mean(np.abs(moved - before) > 0.01) > 0.01
    assert np.mean(np.abs(fresh.sample("depth").value() - moved) > 1e-5) < 1e-4
    difference = fresh.sample("rgb").value().astype(int) - plant.sample("rgb").value()
    assert np.mean(np.abs(difference) > 2) < 1e-4


@pytest.mark.parametrize("renderer", RENDERERS)
def test_a_picture_has_the_size_that_was_asked_for(renderer):
    picture = MujocoPlant(CONVEYOR, renderer=renderer).picture("overview", 160, 90)
    assert picture.shape == (90, 160, 3)
    assert picture.std() > 10


def test_without_libraries_auto_casts_rays_and_gl_refuses(monkeypatch):
    monkeypatch.setattr(gl, "is_there", lambda library: False)
    assert MujocoPlant(CONVEYOR, renderer="auto").picture("overview", 64, 48).any()
    with pytest.raises(PlantError, match="needs the library"):
        MujocoPlant(CONVEYOR, renderer="gl").picture("overview", 64, 48)


def test_an_unusable_backend_in_the_environment_does_no_harm():
    script = (
        "from specc_runtime.plants.mujoco import MujocoPlant, gl\n"
        "gl.is_there = lambda library: False\n"
        f"print(MujocoPlant({CONVEYOR!r}).picture('overview', 64, 48).shape)"
    )
    path = os.pathsep.join(p for p in sys.path if p)
    environment = {**os.environ, "MUJOCO_GL": "osmesa", "PYTHONPATH": path}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == "(48, 64, 3)", done.stderr


def test_an_unknown_renderer_is_refused():
    with pytest.raises(PlantError, match="raycast"):
        MujocoPlant(CONVEYOR, renderer="vulkan")


def test_a_camera_on_the_arm_moves_with_it(tmp_path):
    """A camera that is carried has no still background."""
    model = """
    <mujoco>
      <worldbody>
        <geom type="plane" size="5 5 1"/>
        <body pos="0 0 1">
          <joint name="x" type="slide" axis="0 0 1"/>
          <geom type="sphere" pos="0 0 0.1" size="0.01" mass="1"/>
          <camera name="eye"/>
        </body>
      </worldbody>
      <actuator><position name="lift" joint="x" kp="1000" kv="100"/></actuator>
    </mujoco>
    """
    plant = MujocoPlant(
        model_file(tmp_path, model),
        (SensorBinding("d", camera="eye", image="depth"), SensorBinding("x", joints=("x",))),
        (ActuatorBinding("lift", ("lift",)),),
        renderer="raycast",
    )
    for height in (0.5, -0.3):
        plant.actuate("lift", height)
        plant.advance(1.0)
        assert plant.sample("d").value()[240, 320] == pytest.approx(
            1.0 + plant.sample("x"), abs=1e-5
        )


def test_a_model_without_an_overview_gets_one_that_sees_it(tmp_path: Path) -> None:
    model = tmp_path / "ball.xml"
    ball = '<body pos="3 4 5"><freejoint/><geom size="0.2" rgba="1 0 0 1" mass="1"/></body>'
    model.write_text(f"<mujoco><worldbody>{ball}</worldbody></mujoco>")
    plant = MujocoPlant(str(model), renderer="raycast")
    picture = plant.picture("overview", 64, 48).astype(int)
    plant.close()
    red = (picture[..., 0] > 60) & (picture[..., 1] < 30)
    rows, columns = np.nonzero(red)
    assert 18 <= rows.mean() <= 30 and 26 <= columns.mean() <= 38


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("renderer", RAYS_FIRST)
@pytest.mark.long
def test_an_image_is_that_of_its_instant_whenever_it_is_drawn(renderer, count):
    """Neither what the plant did since nor what else was drawn can be seen in it.

    And it is the same in every run.
    """
    names = ("rgb", "depth", "noisy")
    prompt, late = scene(renderer), scene(renderer)
    wanted, samples = [], []
    for _ in range(count):
        wanted.append([prompt.sample(name).value() for name in names])
        samples.append([late.sample(name) for name in names])
        for plant in (prompt, late):
            X = plant.truth.body_pose("sen")
            X[:3, 3] += (0.0, -0.02, 0.05)
            plant.truth.move_body("sen", X)
            plant.advance(0.1)
    samples[0][2].value()  # noise of one sample does not shift that of others
    for before, now in zip(wanted[::-1], samples[::-1], strict=True):
        assert all(np.array_equal(a, b.value()) for a, b in zip(before, now, strict=True))
    assert not np.array_equal(wanted[0][1], wanted[1][1])


def test_what_draws_and_fails_is_the_fault_of_each_reader(monkeypatch):
    monkeypatch.setattr(gl, "is_there", lambda library: False)
    plant = MujocoPlant(PICKING, KINECT, renderer="gl")
    samples = [plant.sample(name) for name in ("rgb", "depth")]
    plant.advance(0.002)
    for sample in samples:
        with pytest.raises(PlantError, match="no OpenGL"):
            sample.value()
    plant.close()
