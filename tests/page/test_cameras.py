"""Pictures of a run that somebody asks for: what they show, how often, that they change nothing."""

from __future__ import annotations

import time
from base64 import b64decode
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from specc_runtime import forms, main
from specc_runtime.clock import WallClock
from specc_runtime.forms import Element, Layout
from specc_runtime.page.pictures import PERIOD_S, SIZE_PX, Picture, Pictures
from specc_runtime.plant import Viewpoint
from specc_runtime.plants.mujoco.plant import MujocoPlant
from specc_runtime.recording.pictures import COMPRESSED, RAW, png, raw, shown, shown_message

from tests.house.tree import ROOT
from tests.page.fake_server import shown as shown_run
from tests.page.fake_server import written
from tests.recording.runs import report_of

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

NO_LAYOUTS: Mapping[str, Layout] = {}
HOT_CELL = str(ROOT / "specs" / "plants" / "hot_cell.xml")


class Clock(WallClock):
    __slots__ = ("time_s",)

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s


@dataclass
class Slow:
    """A plant that draws when it is told, in a thread of its own."""

    asked: list[Future[Any]] = field(default_factory=list)

    def viewpoints(self) -> list[Viewpoint]:
        return [Viewpoint("door", "world", (0, 0, 1, 1, 0, 0, 0), 1.0)]

    def picture(self, camera: str, width: int, height: int) -> Any:
        raise AssertionError("this would delay the run")

    def picture_of_now(self, camera: str, width: int, height: int) -> Future[Any]:
        self.asked.append(Future())
        return self.asked[-1]


class Simple:
    """A plant that draws at once."""

    def __init__(self, draw: Callable[[], Any]) -> None:
        self.draw = draw

    def viewpoints(self) -> list[Viewpoint]:
        return [Viewpoint("door", "world", (0, 0, 1, 1, 0, 0, 0), 1.0)]

    def picture(self, camera: str, width: int, height: int) -> Any:
        return self.draw()


def pictures_ready(pictures: Pictures, time_s: float) -> list[Picture]:
    """The pictures that are ready soon, without further ones."""
    until_s = time.monotonic() + 10
    while not (found := pictures.take(time_s)) and time.monotonic() < until_s:
        time.sleep(0.01)
    return found


def decoded(data: bytes) -> Any:
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    return image if image.ndim == 2 else image[:, :, ::-1]


def test_a_camera_of_a_model_shows_the_model() -> None:
    plant = MujocoPlant(HOT_CELL)
    pictures = Pictures(plant, NO_LAYOUTS, WallClock())
    assert pictures.cameras == ("overview",)
    assert pictures.take(0.0) == []
    pictures.wanted(["overview", "nobody"])
    ((camera, time_s, data),) = pictures_ready(pictures, 0.5)
    assert (camera, time_s) == ("overview", 0.5)
    width, height = SIZE_PX
    expected = plant.picture("overview", width, height)
    assert np.abs(decoded(data).astype(int) - expected).mean() < 4
    pictures.close()
    assert pictures.take(0.6) == []
    plant.close()


def test_pictures_change_nothing_of_the_plant() -> None:
    ends = []
    for is_watched in (False, True):
        plant = MujocoPlant(HOT_CELL)
        pictures = Pictures(plant, NO_LAYOUTS, WallClock())
        pictures.wanted(pictures.cameras if is_watched else ())
        found = []
        for tick in range(200):
            plant.advance(0.005)
            found += pictures.take(0.005 * tick)
            time.sleep(0.002 if is_watched else 0)
        found += pictures_ready(pictures, 1.0) if is_watched else []
        assert bool(found) == is_watched
        ends.append(plant.saved()["state"].tobytes())
        pictures.close()
        plant.close()
    assert ends[0] == ends[1]


def test_a_slow_camera_is_not_waited_for() -> None:
    plant, clock = Slow(), Clock()
    pictures = Pictures(plant, NO_LAYOUTS, clock)
    pictures.wanted(["door"])
    for tick in range(100):
        clock.time_s += 0.05
        assert pictures.take(0.05 * tick) == []
    assert len(plant.asked) == 1
    plant.asked[0].set_result(np.zeros((4, 6, 3), np.uint8))
    (picture,) = pictures_ready(pictures, 5.0)
    assert picture.time_s == 0.0 and decoded(picture.data).shape == (4, 6, 3)


def test_pictures_come_five_times_a_second_at_most() -> None:
    clock, drawn = Clock(), []
    pictures = Pictures(Simple(lambda: drawn.append(1) or np.zeros((2, 2, 3), np.uint8)), {}, clock)
    pictures.wanted(["door"])
    for tick in range(100):  # 2 s
        clock.time_s = 0.02 * tick
        pictures.take(0.02 * tick)
        while (coming := pictures._demands["door"].coming) and not coming.done():
            time.sleep(0.001)
    assert len(drawn) == pytest.approx(2.0 / PERIOD_S, abs=1)
    clock.time_s += 10.0
    pictures.take(1.98)
    pictures.take(1.98)
    before = len(drawn)
    clock.time_s += 10.0
    pictures.take(1.98)
    assert len(drawn) == before  # nothing is new at the same time


def test_a_camera_that_fails_is_not_asked_again() -> None:
    said: list[str] = []

    def draw() -> Any:
        raise RuntimeError("no lens")

    clock = Clock()
    pictures = Pictures(Simple(draw), NO_LAYOUTS, clock, said.append)
    pictures.wanted(["door"])
    for tick in range(5):
        clock.time_s += 1.0
        assert pictures.take(tick) == []
    assert said == ["there are no pictures of door any more: RuntimeError: no lens"]
    assert pictures.cameras == ()


@pytest.mark.parametrize("plant", [None, object()])
def test_plants_without_cameras(plant: Any) -> None:
    assert Pictures(plant, NO_LAYOUTS, WallClock()).cameras == ()


def test_images_among_inputs_are_shown() -> None:
    colours = Element("R_rgb", ("R", "rgb"), forms.optional(forms.image(2, 3, 3)))
    layout = Layout((colours, Element("R_q", ("R", "q"), forms.array(3))), (), (), {})
    pictures = Pictures(None, {"a.k": layout}, WallClock())
    topic = "/a.k/x/R/rgb"
    assert pictures.cameras == ("a.k.x.R.rgb",)
    pictures.wanted(pictures.cameras)
    assert pictures.take(0.0) == []
    pictures.see("/a.k/x/R/other", 0.1, np.zeros((2, 3, 3), np.uint8))
    pictures.see(topic, 0.1, np.full((2, 3, 3), 200, np.uint8))
    (picture,) = pictures_ready(pictures, 0.3)
    assert picture[:2] == ("a.k.x.R.rgb", 0.1)
    assert np.abs(decoded(picture.data).astype(int) - 200).max() < 5


def test_depth_is_shown_as_grey() -> None:
    depth = np.array([[0.0, 0.5, 1.0], [np.nan, np.inf, 2.0]], np.float32)
    grey = decoded(shown(depth))
    assert grey.dtype == np.uint8
    assert grey[0, 0] == grey[1, 0] == grey[1, 1] == 0
    assert grey[0, 1] > grey[0, 2] > grey[1, 2] > 0
    assert not decoded(shown(np.zeros((2, 2), np.float32))).any()


def test_without_opencv_pictures_are_png(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("specc_runtime.recording.pictures.find_spec", lambda name: None)
    image = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    data = shown(image)
    assert data.startswith(b"\x89PNG")
    np.testing.assert_array_equal(decoded(data), image)
    np.testing.assert_array_equal(decoded(png(image[:, :, 0])), image[:, :, 0])


def test_images_of_a_message() -> None:
    image = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    _, _, make = raw(image)
    data = shown_message(make(image, 0.5, "x"), RAW)
    assert data is not None and decoded(data).shape == (2, 4, 3)
    assert shown_message(b"{}", "specc.Value") is None
    for text in (b"{}", b"[", b'{"format":"svg","data":""}', b'{"format":"jpeg","data":5}'):
        for schema in (RAW, COMPRESSED):
            with pytest.raises(forms.Misshapen):
                shown_message(text, schema)


def test_records_are_the_same_with_pictures(tmp_path: Path) -> None:
    code = written(ROOT / "specs/irp_picking.yaml", tmp_path / "code")
    plain, watched = tmp_path / "plain.json", tmp_path / "watched.json"
    assert main.run(code.options(report=plain, duration_s=1.0)) in (0, 1)
    watch = {"do": "watch", "clients": 1, "scene": False, "cameras": ["kinect", "irp.k.x.R.I_rgb"]}
    with shown_run(code, watch, report=watched, duration_s=1.0, speed=1.0) as run:
        run.thread.join()
    sent = run.server.of("picture")
    assert {message["camera"] for message in sent} == set(watch["cameras"])
    for message in sent:
        assert decoded(b64decode(message["jpeg"])).shape == (480, 640, 3)
        assert 0.0 <= message["time_s"] <= 1.0
    (begin,) = run.server.of("begin")
    assert begin["cameras"] == ["overview", "kinect", "irp.k.x.R.I_rgb", "irp.k.x.R.I_d"]
    assert report_of(watched)["records_sha256"] == report_of(plain)["records_sha256"]
