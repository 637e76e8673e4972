"""Pictures for people: meshes as fine as a picture shows, sizes, groups of geoms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from specc_runtime.companion import View
from specc_runtime.options import Options, UsageError, parse
from specc_runtime.plants.mujoco import MujocoPlant
from specc_runtime.plants.mujoco.coarse import coarse
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.progress.bar import Lines
from specc_runtime.report import check_outputs


def _ball(rows: int, columns: int, name: str) -> str:
    """A mesh of a ball with bumps, of 2 rows x columns triangles."""
    u, v = np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns, endpoint=False)
    up, around = (grid.ravel() for grid in np.meshgrid(u, v, indexing="ij"))
    out = 0.3 * (1 + 0.05 * np.sin(6 * up) * np.cos(7 * around))
    points = np.stack((np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)), 1)
    i, j = (grid.ravel() for grid in np.meshgrid(range(rows), range(columns), indexing="ij"))
    a, b = i * columns + j, i * columns + (j + 1) % columns
    faces = np.stack((a, a + columns, b, b, a + columns, b + columns), 1)
    vertex = " ".join(f"{x:.5f}" for x in (out[:, None] * points).ravel())
    return f'<mesh name="{name}" vertex="{vertex}" face="{" ".join(map(str, faces.ravel()))}"/>'


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("films") / "balls.xml"
    path.write_text(f"""<mujoco>
      <asset>{_ball(80, 160, "fine")}{_ball(20, 40, "plain")}</asset>
      <worldbody><light pos="0 0 3"/><geom type="plane" size="2 2 .1"/>
      <geom type="mesh" mesh="fine" pos="0 0 .5" rgba="1 0 0 1"/>
      <geom type="mesh" mesh="plain" pos="0 0 .5" group="3" rgba="0 1 0 1"/>
      <camera name="overview" pos="0 -1.5 .8" xyaxes="1 0 0 0 .2 1"/></worldbody></mujoco>""")
    return path


def test_meshes_are_as_fine_as_is_asked_for(model: Path) -> None:
    whole = mujoco.MjModel.from_xml_path(str(model))
    before = whole.mesh_face.copy()
    assert list(coarse(whole, 10**6).mesh_facenum) == [25_600, 1600]
    for most in (20_000, 9000):
        less = coarse(whole, most)
        fine, plain = map(int, less.mesh_facenum)
        assert plain == 1600 and most / 4 < fine + plain <= most
        faces = less.mesh_face[:fine]
        assert faces.min() >= 0 and faces.max() < less.mesh_vertnum[0]
        a, b, c = (less.mesh_vert[faces[:, k]].astype(float) for k in range(3))
        assert (np.linalg.norm(b - a, axis=1) < 0.1).all()
        # The surface is where it was, and its normals stand on it.
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        assert area == pytest.approx(4 * np.pi * 0.3**2, rel=0.1)
        normals = less.mesh_normal[less.mesh_facenormal[:fine, 0]]
        outward = a / np.linalg.norm(a, axis=1)[:, None]
        assert ((normals * outward).sum(axis=1) > 0.2).all()
    assert (whole.mesh_face == before).all() and list(whole.mesh_facenum) == [25_600, 1600]


def test_few_triangles_show_what_many_do(model: Path) -> None:
    whole = MujocoPlant(str(model))
    picture = whole.picture("overview", 320, 240).astype(float)
    small = whole.picture("overview", 64, 48).astype(float)
    whole.close()
    assert picture.shape == (240, 320, 3)
    shrunk = picture.reshape(48, 5, 64, 5, 3).mean(axis=(1, 3))
    assert abs(shrunk - small).mean() < 12


@pytest.mark.parametrize("renderer", ["auto", "raycast"])
def test_groups_of_geoms(model: Path, renderer: Any) -> None:
    plant = MujocoPlant(str(model), renderer=renderer)
    usual = plant.picture("overview", 64, 48)[24, 32].astype(int)
    plant.show_geom_groups((3,))
    other = plant.picture("overview", 64, 48)[24, 32].astype(int)
    plant.close()
    assert usual[0] > usual[1] and other[1] > other[0]


@pytest.mark.parametrize(
    ("words", "wrong"),
    [
        ("--fps 0", "'0' is not a number from 0.01 to 240"),
        ("--fps fast", "'fast' is not a number"),
        ("--size 640", "'640' is not WIDTHxHEIGHT, both even and from 16 to 4096"),
        ("--size 641x480", "both even"),
        ("--size 8192x480", "from 16 to 4096"),
        ("--geom-groups 1,6", "'1,6' is not numbers from 0 to 5"),
    ],
)
def test_wrong_looks(words: str, wrong: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parse(["generated", *words.split()])
    assert wrong in capsys.readouterr().err


def test_a_film_in_another_look(model: Path, tmp_path: Path) -> None:
    import cv2
    from specc_runtime.video import Video

    path = tmp_path / "a.mp4"
    words = f"out --video {path} --fps 50 --size 160x120 --geom-groups 3,0"
    options, clock = parse(words.split()), _Clock()
    assert (options.fps, options.size, options.geom_groups) == (50.0, (160, 120), (0, 3))
    plant = MujocoPlant(str(model), renderer="raycast")
    video = Video(options, plant, 0.002, clock)  # type: ignore[arg-type]  # a clock of this test
    assert video.period_s == pytest.approx(0.02)
    for tick in range(3):
        video.tick(View(0.02 * tick, {"a.c": "S0"}, (), None, None))
    video.close()
    plant.close()
    film = cv2.VideoCapture(str(path))
    assert film.get(cv2.CAP_PROP_FPS) == 50 and film.read()[1].shape == (120, 160, 3)
    assert video.busy_s == 3.0


class _Clock:
    """A second passes with each look at it."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def now_s(self) -> float:
        self.seconds += 1.0
        return self.seconds


def test_progress_says_that_rendering_takes_the_time(capsys: pytest.CaptureFixture[str]) -> None:
    view = View(1.0, {"a.c": "S0"}, (), None, 2.0)
    clock: Any = _Clock()
    Lines(clock, lambda: 2.0).tick(view)
    assert capsys.readouterr().err == "running  1.00 s  rendering takes 100% of the time  a.c S0\n"
    Lines(clock, lambda: 0.1).tick(view)
    assert capsys.readouterr().err == "running  1.00 s  a.c S0\n"


def test_looks_are_those_of_films() -> None:
    for look in ({"fps": 10.0}, {"size": (64, 64)}, {"geom_groups": (0,)}):
        with pytest.raises(UsageError, match="the run is not filmed; add --video"):
            check_outputs(Options(Path("out"), **look))  # type: ignore[arg-type]  # each its own
