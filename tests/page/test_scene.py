"""The view in 3D: what it draws and when, how it is moved, and scenes from strangers."""

from __future__ import annotations

import json
import time
from base64 import b64encode
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from struct import pack
from typing import Any

import cv2
import mujoco
import numpy as np
import pytest
from specc_runtime.plant import Mesh
from specc_runtime.plants.mujoco.plant import MujocoPlant
from specc_runtime.recording.models import glb
from specc_runtime.recording.scene import scene_of

from tests.house.tree import ROOT
from tests.page.browser import Page
from tests.page.site import site

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

PLANTS = ("irp6_picking", "two_cells", "two_rooms", "hot_cell", "beacons", "tray_cell")
PLACE = {"position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
RED = {"r": 0.9, "g": 0.05, "b": 0.05, "a": 1}
CUBE = {"pose": PLACE, "size": {"x": 1, "y": 1, "z": 1}, "color": RED}
CORNERS = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
TRIANGLES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
MESH = glb(Mesh("arm", (0, 0, 0, 1, 0, 0, 0), (1, 1, 1, 1), CORNERS, TRIANGLES))


def scene(body: str = "box", **parts: Any) -> dict[str, Any]:
    return {"deletions": [], "entities": [{"frame_id": body, "id": body, **parts}]}


@contextmanager
def shown(page: Page, message: Any, bodies: list[str], **data: Any) -> Iterator[None]:
    """A page with the scene of a message: `scene` and `notices` are global there."""
    with site(scene=message, **data) as address:
        page.open(address)
        page.evaluate(f"""(async () => {{
            const {{ createScene }} = await import("/static/scene.js");
            window.notices = [];
            const options = {{ onNotice: (text) => notices.push(text) }};
            window.scene = createScene(document.getElementById("canvas"), options);
            scene.load(await (await fetch("/scene.json")).json(), {json.dumps(bodies)});
        }})()""")
        yield


def state(page: Page) -> Mapping[str, Any]:
    found: Mapping[str, Any] = page.evaluate("scene.state()")
    return found


def draws_at_rest(page: Page) -> int:
    """The number of pictures, once nothing is drawn any more."""
    before = -1
    while before != (draws := state(page)["draws"]):
        before = draws
        time.sleep(0.4)
    return int(before)


@pytest.mark.parametrize("name", PLANTS)
def test_shipped_models_are_shown_whole(page: Page, name: str) -> None:
    plant = MujocoPlant(str(ROOT / "specs" / "plants" / f"{name}.xml"))
    message = scene_of(plant)
    plant.close()
    kinds = ("cubes", "spheres", "cylinders", "models")
    parts = sum(len(each.get(kind, ())) for each in message["entities"] for kind in kinds)
    with shown(page, message, list(plant.body_names())):
        page.wait_for("scene.state().draws > 0")
        assert state(page)["parts"] == parts > 0
        assert page.evaluate("notices") == []
        assert page.errors() == []


def test_a_mesh_is_read_as_it_was_written(page: Page) -> None:
    with site(model=b64encode(MESH).decode()) as address:
        page.open(address)
        (found,) = page.evaluate("""(async () => {
            const { bytesOf, parseGlb } = await import("/static/glb.js");
            const text = await (await fetch("/model.json")).json();
            return parseGlb(bytesOf(text)).map(({ points, indices, colour, uv, png }) =>
                ({ points: [...points], indices: [...indices], colour, uv, png }));
        })()""")
    np.testing.assert_allclose(np.array(found["points"]).reshape(-1, 3), CORNERS, atol=1e-6)
    assert found["indices"] == TRIANGLES.ravel().tolist()
    assert found["colour"] == [1, 1, 1, 1] and found["uv"] is None and found["png"] is None


def test_normals_are_smooth_but_for_edges(page: Page) -> None:
    with site() as address:
        page.open(address)
        normals = page.evaluate("""(async () => {
            const { smoothSolid } = await import("/static/geometry.js");
            const roof = [0, 0, 0, 1, 0, 0.1, 0, 1, 0, -1, 0, 0.1, 0, 0, -1];
            const indices = Uint32Array.of(0, 1, 2, 0, 2, 3, 0, 2, 4);
            return [...smoothSolid(new Float32Array(roof), indices, null).normals];
        })()""")
    flat = np.array(normals).reshape(3, 3, 3)
    np.testing.assert_allclose(np.linalg.norm(flat, axis=2), 1, atol=1e-6)
    np.testing.assert_allclose(flat[0, 0], flat[1, 0], atol=1e-6)  # nearly level: one normal
    np.testing.assert_allclose(flat[2], np.tile((-1, 0, 0), (3, 1)), atol=1e-6)  # a sharp edge


def test_poses_agree_with_mujoco(page: Page) -> None:
    rng = np.random.default_rng(7)
    quaternions = rng.normal(size=(2, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    places, axis = rng.normal(size=(2, 3)), rng.normal(size=3)
    with site() as address:
        page.open(address)
        poses = [[*p, *q] for p, q in zip(places.tolist(), quaternions.tolist(), strict=True)]
        numbers = [*places[0].tolist(), *axis.tolist()]
        composed, turned, matrix = page.evaluate(f"""(async () => {{
            const {{ composePose, poseMatrix }} = await import("/static/geometry.js");
            const {{ poseOfNumbers }} = await import("/static/frames.js");
            const [a, b] = {json.dumps(poses)};
            return [composePose(a, b), poseOfNumbers({numbers}), [...poseMatrix(a)]];
        }})()""")
    place, quaternion, moved = np.empty(3), np.empty(4), np.empty(3)
    mujoco.mju_mulPose(place, quaternion, places[0], quaternions[0], places[1], quaternions[1])
    np.testing.assert_allclose(composed, [*place, *quaternion], atol=1e-12)
    mujoco.mju_axisAngle2Quat(quaternion, axis / np.linalg.norm(axis), np.linalg.norm(axis))
    np.testing.assert_allclose(turned[:3], places[0])
    assert abs(np.dot(turned[3:], quaternion)) == pytest.approx(1.0)
    mujoco.mju_rotVecQuat(moved, np.array((1.0, 2.0, 3.0)), quaternions[0])
    found = np.array(matrix).reshape(4, 4).T @ (1.0, 2.0, 3.0, 1.0)
    np.testing.assert_allclose(found[:3], moved + places[0], atol=1e-5)


def test_it_draws_only_what_has_changed(page: Page) -> None:
    with shown(page, scene(cubes=[CUBE]), ["box"]):
        draws = draws_at_rest(page)
        time.sleep(0.5)
        assert state(page)["draws"] == draws
        page.evaluate("""new Promise((done) => {
            let n = 0;
            const timer = setInterval(() => {
                scene.poses([[n / 200, 0, 0, 1, 0, 0, 0]]);
                n += 1;
                if (n === 200) { clearInterval(timer); done(); }
            }, 5);
        })""")
        assert draws < draws_at_rest(page) <= draws + 40  # 20 pictures a second, of more than 1 s


def test_what_is_drawn(page: Page, tmp_path: Path) -> None:
    with shown(page, scene(cubes=[CUBE]), ["box"]):
        draws_at_rest(page)
        blue, green, red = _pixel(page, tmp_path)
        assert red > 100 and blue < 90 and green < 90
        page.evaluate("scene.poses([[30, 0, 0, 1, 0, 0, 0]])")
        draws_at_rest(page)
        assert min(_pixel(page, tmp_path)) > 150  # the ground of a light theme
        page.evaluate("scene.setTheme(true)")
        draws_at_rest(page)
        assert max(_pixel(page, tmp_path)) < 90


def _pixel(page: Page, folder: Path) -> list[int]:
    """Blue, green and red in the middle of the canvas."""
    page.screenshot(folder / "x.png")
    image = cv2.imread(str(folder / "x.png"))
    assert image is not None
    found: list[int] = image[150, 200].tolist()
    return found


def test_the_first_view_is_that_of_the_camera_overview(page: Page) -> None:
    entity = scene(cubes=[CUBE])
    camera = {"key": "camera overview", "value": "0 0 7 1 0 0 0 0.6"}
    entity["entities"][0]["metadata"] = [None, {"key": "camera x", "value": "1 2"}, camera]
    with shown(page, entity, ["box"]):
        draws_at_rest(page)
        assert state(page)["distance"] == pytest.approx(7.0)
        assert state(page)["pitch"] == pytest.approx(np.pi / 2, abs=0.01)


def test_mouse_and_keys_move_the_camera(page: Page) -> None:
    with shown(page, scene(cubes=[CUBE]), ["box"]):
        draws_at_rest(page)
        first = state(page)
        page.press(200, 150)
        page.move(260, 150, buttons=1)
        page.release(260, 150)
        turned = state(page)
        assert turned["yaw"] != first["yaw"] and turned["pitch"] == first["pitch"]
        page.evaluate("document.getElementById('canvas').focus()")
        page.key("ArrowUp")
        page.key("+")
        moved = state(page)
        assert moved["pitch"] > turned["pitch"] and moved["distance"] < turned["distance"]
        wheel = {"x": 200, "y": 150, "deltaX": 0, "deltaY": 300}
        page.call("Input.dispatchMouseEvent", type="mouseWheel", **wheel)
        page.wait_for(f"scene.state().distance > {moved['distance']}")
        page.key("Home")
        back = state(page)
        assert {n: back[n] for n in ("yaw", "pitch", "distance")} == {
            n: first[n] for n in ("yaw", "pitch", "distance")
        }


def test_two_fingers_zoom(page: Page) -> None:
    with shown(page, scene(cubes=[CUBE]), ["box"]):
        draws_at_rest(page)
        first = state(page)
        for kind, gap in (("touchStart", 40), ("touchMove", 60), ("touchMove", 100)):
            points = [
                {"x": 200 - gap / 2, "y": 150, "id": 1},
                {"x": 200 + gap / 2, "y": 150, "id": 2},
            ]
            page.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        assert state(page)["distance"] < 0.7 * first["distance"]


def test_a_lost_context_comes_back(page: Page, tmp_path: Path) -> None:
    with shown(page, scene(cubes=[CUBE]), ["box"]):
        draws = draws_at_rest(page)
        page.evaluate("""(() => {
            const gl = document.getElementById("canvas").getContext("webgl2");
            window.extension = gl.getExtension("WEBGL_lose_context");
            extension.loseContext();
        })()""")
        time.sleep(0.2)
        page.evaluate("scene.poses([[0, 0, 0, 1, 0, 0, 0]])")
        time.sleep(0.2)
        assert state(page)["draws"] == draws
        page.evaluate("extension.restoreContext()")
        page.wait_for(f"scene.state().draws > {draws}")
        draws_at_rest(page)
        assert _pixel(page, tmp_path)[2] > 100
        page.evaluate("scene.destroy()")
        assert page.errors() == []


def test_without_webgl_there_is_a_text(page: Page) -> None:
    with site() as address:
        page.open(address)
        found = page.evaluate("""(async () => {
            HTMLCanvasElement.prototype.getContext = () => null;
            const { createScene } = await import("/static/scene.js");
            const scene = createScene(document.getElementById("canvas"));
            scene.load({}, []);
            scene.poses([]);
            scene.destroy();
            return [scene.available, scene.text];
        })()""")
    assert found == [False, "This browser has no WebGL2, so there is no view in 3D."]


def test_frames_have_their_names_as_text(page: Page) -> None:
    with shown(page, scene(cubes=[CUBE]), ["box"]):
        name = "<img src=x onerror=alert(1)>"
        frames = [
            {"name": name, "pose": [0, 0, 0.5, 1, 0, 0, 0]},
            {"name": "bad", "pose": [None] * 7},
        ]
        page.evaluate(f"scene.frames({json.dumps(frames)})")
        draws_at_rest(page)
        labels = page.evaluate(
            "[...document.querySelectorAll('.scene-label')].map((each) => each.textContent)"
        )
        assert labels == [name] and state(page)["frames"] == 1
        assert page.evaluate("document.querySelectorAll('img').length") == 0


def _changed(data: bytes, at: int, to: bytes) -> bytes:
    return data[:at] + to + data[at + len(to) :]


def _described(**changes: Any) -> bytes:
    """A file with another description than its own."""
    size = int.from_bytes(MESH[12:16], "little")
    told = json.loads(MESH[20 : 20 + size]) | changes
    text = json.dumps(told).encode()
    text += b" " * (-len(text) % 4)
    rest = MESH[20 + size :]
    return (
        pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
        + pack("<I", len(text))
        + (b"JSON" + text + rest)
    )


_NODES = {"mesh": 0, "children": [0]}
_TEXTURE = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
_LONG = [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 10**9}]
HOSTILE = {
    "empty": b"",
    "no GLB": b"x" * 100,
    "cut": MESH[:-20],
    "cut description": _changed(MESH, 12, pack("<I", 2**31)),
    "description": _changed(MESH, 20, b"\xff\xff"),
    "corners that are not there": MESH[:-4] + pack("<I", 2**32 - 1),
    "no numbers": MESH.replace(pack("<f", 1.0), pack("<f", np.nan)),
    "far away": MESH.replace(pack("<f", 1.0), pack("<f", 1e30)),
    "a circle of nodes": _described(nodes=[_NODES]),
    "no accessors": _described(accessors=None),
    "a long accessor": _described(accessors=_LONG * 2),
    "no views": _described(bufferViews=[{"byteOffset": -8, "byteLength": 1e9}]),
    "no meshes": _described(meshes=[None]),
    "null": _described(nodes={"a": 1}),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_meshes_are_left_out(page: Page, name: str) -> None:
    models = [{"pose": PLACE, "data": b64encode(data).decode()} for data in (HOSTILE[name], MESH)]
    with shown(page, scene(models=models, cubes=[CUBE]), ["box"]):
        page.wait_for("scene.state().draws > 0")
        assert state(page)["parts"] == 2  # the other mesh and the cube
        notices = page.evaluate("notices")
        assert name == "null" or (len(notices) == 1 and "mesh is left out: " in notices[0]), notices
        assert page.errors() == []


def test_hostile_messages(page: Page) -> None:
    bad = [
        None, 5, {}, {"pose": None}, {**CUBE, "size": {"x": -1, "y": 1, "z": 1}},
        {**CUBE, "size": {"x": 1e300, "y": 1, "z": 1}}, {**CUBE, "pose": {"position": None}},
        {**CUBE, "pose": {**PLACE, "position": {"x": "a", "y": 0, "z": 0}}},
        {**CUBE, "pose": {**PLACE, "orientation": {"x": 0, "y": 0, "z": 0, "w": 0}}},
        {**CUBE, "color": {"r": "red"}},
    ]  # fmt: skip
    entities = [None, 7, {"frame_id": "box", "cubes": bad, "models": bad, "metadata": bad}]
    for message in (None, [], {"entities": 3}, {"entities": entities}):
        with shown(page, message, ["box"]):
            page.evaluate("scene.poses([null, [1], 3])")
            page.evaluate("scene.poses('x')")
            page.evaluate("scene.frames([{}, {pose: 'x'}].slice(0, 1))")
            page.wait_for("scene.state().draws > 0")
            assert page.errors() == []


@pytest.mark.long
def test_a_scene_of_too_many_parts_is_shown_in_part(page: Page) -> None:
    corners, triangles = _sheet(150)
    mesh = glb(Mesh("arm", (0, 0, 0, 1, 0, 0, 0), (1, 1, 1, 1), corners, triangles), 10**6)
    models = [{"pose": PLACE, "data": b64encode(mesh).decode()}] * 8
    with shown(page, scene(cubes=[CUBE] * 3000), ["box"]):
        page.wait_for("scene.state().draws > 0", 30.0)
        assert state(page)["parts"] == 2000
        assert page.evaluate("notices") == ["The scene shows 2000 parts; the others are left out."]
    with shown(page, scene(models=models, cubes=[CUBE]), ["box"]):
        page.wait_for("scene.state().draws > 0", 30.0)
        assert page.evaluate("notices") == [
            "A mesh is left out: the scene has more than 250000 triangles."
        ]


def _sheet(edge: int) -> tuple[Any, Any]:
    """Corners and triangles of a square with so many points along each edge."""
    x, y = np.meshgrid(np.linspace(0, 1, edge), np.linspace(0, 1, edge))
    first = np.arange(edge * edge).reshape(edge, edge)[:-1, :-1].ravel()
    corners = np.stack((x.ravel(), y.ravel(), 0 * x.ravel()), axis=1)
    near = np.stack((first, first + 1, first + edge + 1), axis=1)
    return corners, np.concatenate((near, np.stack((near[:, 0], near[:, 2], first + edge), axis=1)))


def test_frames_of_poses_are_chosen_and_remembered(page: Page) -> None:
    poses = [
        {"name": "a.c.y.m.T_d", "base": "B", "end": "E"},
        {"name": "other", "base": "W", "end": "O"},
    ]
    make = f"""(async () => {{
        const {{ FrameChooser }} = await import("/static/frames.js");
        window.changes = 0;
        window.chooser = new FrameChooser(document.getElementById("beside"), {{
            poses: {json.dumps(poses)}, bodies: ["base", "tip"],
            carriers: {{ B: "base", W: "nobody" }}, system: "arm",
            changed: () => {{ changes += 1; }},
        }});
    }})()"""
    bodies = json.dumps([[1, 0, 0, 1, 0, 0, 0], [0, 5, 0, 1, 0, 0, 0]])
    frames = f"chooser.frames({{'a.c.y.m.T_d': [0, 2, 0, 0, 0, 0], other: null}}, {bodies})"
    with site() as address:
        page.open(address)
        page.evaluate("localStorage.clear()")
        page.evaluate(make)
        assert page.evaluate(frames) == []
        page.click("#beside input")
        (frame,) = page.evaluate(frames)
        assert frame == {"name": "a.c.y.m.T_d (E)", "pose": [1, 2, 0, 1, 0, 0, 0]}
        page.evaluate("""(() => {
            const select = document.querySelector("#beside select");
            select.value = "tip";
            select.dispatchEvent(new Event("change"));
        })()""")
        page.evaluate("document.getElementById('beside').replaceChildren()")
        page.evaluate(make)
        (frame,) = page.evaluate(frames)
        assert (
            frame["pose"] == [0, 7, 0, 1, 0, 0, 0] and page.evaluate("chooser.wanted.length") == 1
        )
