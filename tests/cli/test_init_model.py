"""`specc init --model`: what is written validates without a finding and holds the pose."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import posture
from specc_runtime.plants.mujoco.describing import described

from bench.harness import held
from specc.cli import init, main
from specc.pipeline import check_spec
from specc.tools.starting import ModelFacts, NoFacts, NoGroup, actuator_groups, facts, read_facts
from tests.cli import robots
from tests.cli.robots import JOINTS, MOTORS, SERVOS, SPEEDS, arm
from tests.seeds import every, short

SPECS = Path(__file__).parents[2] / "specs"
SERVICES = (
    "architectures/services.yaml",
    "plants/services.xml",
    "parts/services_messages.yaml",
    "parts/carrier.yaml",
)
ASKED = facts._describe
UNUSABLE = "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>"
KNOWN: dict[tuple[str, float], ModelFacts] = {}
"""What the simulator has said of models, by their texts and rehearsals: it says the same again."""
SHORTER_S = 1.0
"""Of a rehearsal, where a test is not about how long a pose is held."""


@pytest.fixture(autouse=True)
def asked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each model is rehearsed in one test only."""

    def known(path: str) -> ModelFacts:
        key = Path(path).read_text(encoding="utf-8"), posture.HELD_S
        if key not in KNOWN:
            KNOWN[key] = read_facts(path)
        return KNOWN[key]

    monkeypatch.setattr(init, "read_facts", known)


@pytest.fixture(autouse=True)
def asked_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Models are read in this process, but where a test is about the one that reads them."""

    def asked(path: str) -> object:
        with chdir(tmp_path):  # where MuJoCo writes its log
            try:
                return json.loads(json.dumps(described(path)))
            except PlantError as error:
                return {"error": str(error)}

    monkeypatch.setattr(facts, "_describe", asked)


@pytest.fixture(autouse=True)
def rehearsed(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rehearsals are shorter, but where a test says `wholly`."""
    if "wholly" not in request.fixturenames:
        monkeypatch.setattr(posture, "HELD_S", SHORTER_S)


@pytest.fixture
def wholly() -> None:
    """Rehearsals are as long as those of users."""


def at(path: Path, text: str) -> Path:
    """A file with a text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def started(text: str, folder: Path, *options: str) -> Path:
    """The specification of a model outside its project."""
    model = at(folder / "models/robot.xml", text)
    assert main(["init", str(folder / "cell"), "--model", str(model), *options]) == 0
    (spec,) = (folder / "cell").glob("*.yaml")
    return spec


def is_clean(spec: Path) -> bool:
    """Whether it validates without a finding, in the canonical layout."""
    return main(["validate", "--strict", str(spec)]) == main(["fmt", "--check", str(spec)]) == 0


@pytest.fixture
def farthest() -> Iterator[dict[str, float]]:
    """Joint -> how far it went from its first position in a run, in parts of what is allowed."""
    with held.farthest() as found:
        yield found


def run(spec: Path) -> None:
    """One cycle, which ends once all joints are near the start after 5 s."""
    report = spec.parent / "report.json"
    done = main(["run", str(spec), "--report", str(report), "--cycle-limit", "6"])
    told = json.loads(report.read_text(encoding="utf-8"))
    assert (done, told["faults"]) == (0, [])
    assert [cycle["ended"] for cycle in told["cycles"]] == ["completed"]


def begin(spec: Path) -> None:
    """The first moments of a run, without a fault."""
    report = spec.parent / "report.json"
    assert main(["run", str(spec), "--report", str(report), "--duration", "0.2"]) == 0
    told = json.loads(report.read_text(encoding="utf-8"))
    assert (told["ended"], told["faults"]) == ("completed", [])


ROBOTS = {
    "servos": (arm(SERVOS), ["arm"]),
    "motors": (arm(MOTORS), ["arm"]),
    "speeds": (arm(SPEEDS), ["arm"]),
    "gripper": (robots.GRIPPER, ["gripper"]),
    "base": (robots.BASE, ["base"]),
    "walker": (robots.WALKER, ["fl_leg", "fr_leg", "hl_leg", "hr_leg"]),
}


@pytest.mark.usefixtures("wholly")
@pytest.mark.parametrize("name", short(ROBOTS, 4))
def test_a_robot_holds_its_pose_at_once(
    name: str,
    tmp_path: Path,
    farthest: dict[str, float],
    capsys: pytest.CaptureFixture[str],
) -> None:
    model, groups = ROBOTS[name]
    spec = started(model, tmp_path)
    assert is_clean(spec)
    assert "NOT HELD" not in spec.read_text()
    run(spec)
    assert farthest and max(farthest.values()) < 1.0
    capsys.readouterr()
    assert main(["test", str(spec), "--budget", "0", "--jobs", "1"]) == 0
    assert "passed  holds" in capsys.readouterr().out
    for group in groups:
        assert f".E.{group}." in spec.read_text()


@pytest.mark.parametrize("name", every(3, list(ROBOTS)))
def test_groups_are_named_after_what_they_move(name: str, tmp_path: Path) -> None:
    model, groups = ROBOTS[name]
    found = actuator_groups(init.read_facts(str(at(tmp_path / "robot.xml", model))), {})
    assert [group.wish for group in found] == groups


@pytest.mark.usefixtures("wholly")
def test_what_is_written_of_an_arm_with_servos(tmp_path: Path) -> None:
    text = started(arm(SERVOS), tmp_path).read_text()
    assert "title: Holds the pose of keyframe home" in text
    assert 'arm_start: "[0.4, -0.8, 0.3] * 1[rad]"' in text
    assert "ArmAngles: vector[3, rad]" in text
    assert "safe: {is: q, otherwise: arm_start}" in text
    assert "camera: hand eye, image: rgb" in text
    assert 'hand_eye: {y: {image: "image[24, 32, 3]"}}' in text
    assert "sensors: [tip_force]" in text
    assert "through: identity" in text
    assert "S0" not in text
    assert 'force: "vector[3, N]"' in text


def test_a_position_and_an_orientation_are_a_pose(tmp_path: Path) -> None:
    sensors = """
    <framepos name="tip_p" objtype="site" objname="tip"/>
    <framequat name="tip_q" objtype="site" objname="tip"/>
    <framequat name="over" objtype="site" objname="tip" reftype="xbody" refname="elbow_link"/>
    <framequat name="alone" objtype="xbody" objname="shoulder_link"/>
    </sensor>"""
    spec = started(arm(SERVOS).replace("</sensor>", sensors), tmp_path)
    assert is_clean(spec)
    text = spec.read_text()
    assert "  world: world\n  tip: site tip\n" in text
    assert "X: pose[world, tip]" in text
    assert ".X: {sensors: [tip_p, tip_q]}" in text
    assert "# MuJoCo gives a quaternion as w, x, y, z;" in text
    assert "tip.framequat: {sensors: [over]}" in text
    assert "sensors.framequat: {sensors: [alone]}" in text


@pytest.mark.usefixtures("wholly")
def test_a_weight_is_carried_by_masses(tmp_path: Path) -> None:
    """Against the moment of three links of 1 kg about the shoulder, in the pose of the keyframe."""
    text = started(arm(MOTORS), tmp_path).read_text()
    line = next(line for line in text.splitlines() if "* 1[N*m]" in line and "is:" in line)
    weight = float(line.partition("[")[2].partition(",")[0])
    ends = np.cumsum([0.3 * np.cos(a) for a in np.cumsum((0.4, -0.8, 0.3))])
    middles = ends - [0.15 * np.cos(a) for a in np.cumsum((0.4, -0.8, 0.3))]
    assert weight == pytest.approx(-9.81 * middles.sum(), rel=1e-3)


@pytest.mark.long
@pytest.mark.usefixtures("wholly")
def test_it_is_the_same_each_time_and_in_another_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, bad = at(tmp_path / "robot.xml", arm(MOTORS)), at(tmp_path / "bad.xml", UNUSABLE)
    here = read_facts(str(model))
    with pytest.raises(NoFacts) as refused:
        read_facts(str(bad))
    monkeypatch.setattr(facts, "_describe", ASKED)
    assert read_facts(str(model)) == here
    with pytest.raises(NoFacts) as again:
        read_facts(str(bad))
    assert str(again.value) == str(refused.value)
    assert str(tmp_path) not in started(arm(MOTORS), tmp_path).read_text()


def test_a_model_inside_the_project_stays_where_it_is(tmp_path: Path) -> None:
    model = at(tmp_path / "plants/robot.xml", arm(SERVOS))
    assert main(["init", str(tmp_path), "--model", str(model)]) == 0
    assert "model: plants/robot.xml" in (tmp_path / "arm.yaml").read_text()
    at(tmp_path / "pyproject.toml", "")
    assert main(["init", str(tmp_path / "a new/folder"), "--model", str(model)]) == 0
    assert "model: ../../plants/robot.xml" in (tmp_path / "a new/folder/arm.yaml").read_text()
    assert sorted(p.name for p in tmp_path.rglob("*.xml")) == ["robot.xml"]


def test_files_of_a_model_are_copied_in_their_places(tmp_path: Path) -> None:
    at(tmp_path / "models/parts/arm.xml", arm(SERVOS))
    include = '<mujoco model="cell"><include file="parts/arm.xml"/></mujoco>'
    spec = started(include, tmp_path)
    assert (spec.parent / "plants/parts/arm.xml").is_file()
    assert main(["validate", "--strict", str(spec)]) == 0


OBJECT = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
PRIVATE = "PRIVATE KEY"


def with_assets(assets: str, beside: str = "") -> str:
    """An arm with these assets."""
    return arm(SERVOS).replace("<worldbody>", f"<asset>{assets}</asset><worldbody>{beside}", 1)


def drawn(file: str) -> str:
    """A texture that MuJoCo draws; it takes no look at the file."""
    return f'<texture name="t" type="2d" builtin="flat" width="2" height="2" {file}/>'


UNOPENED = {
    "drawn": with_assets(drawn('file="id_rsa"')),
    "drawn cube": with_assets(drawn('fileright="id_rsa"').replace("2d", "cube")),
    "in a folder": with_assets(drawn('file="../id_rsa"')).replace(
        "<asset>", '<compiler texturedir="parts"/><asset>'
    ),
    "absolute": with_assets(drawn('file="{folder}/id_rsa"')),
    "grid": with_assets(
        "", '<flexcomp name="f" type="grid" count="2 2 2" dim="3" file="id_rsa" rigid="true"/>'
    ),
    "model that is not attached": with_assets('<model name="p" file="parts/part.xml"/>'),
    "drawn in a model that is attached": with_assets(
        '<model name="p" file="parts/drawn.xml"/>', '<attach model="p" prefix="p_"/>'
    ),
    "sides of a cube beside its file": with_assets(
        '<texture name="t" type="cube" file="side.png" fileright="id_rsa"/>'
    ),
    "two folders": with_assets('<mesh name="m" file="m.obj"/>').replace(
        "<asset>", '<compiler meshdir="parts"/><compiler meshdir="meshes"/><asset>'
    ),
    "a second folder that another element names": with_assets(
        '<mesh name="m" file="m.obj"/><model name="p" file="parts/named.xml"/>',
        '<attach model="p" prefix="p_"/>',
    ).replace("<asset>", '<compiler meshdir="parts"/><compiler meshdir="meshes"/><asset>'),
}
"""Models that name a private file, of which MuJoCo opens none."""


@pytest.mark.parametrize("name", every(4, list(UNOPENED)))
def test_a_model_carries_no_file_that_it_does_not_use(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "models"
    for private in ("id_rsa", "parts/id_rsa", "parts/m.obj"):
        at(folder / private, PRIVATE)
    at(folder / "meshes/m.obj", OBJECT)
    texture = drawn('file="id_rsa"')
    at(folder / "parts/drawn.xml", f"<mujoco><asset>{texture}</asset><worldbody/></mujoco>")
    texture = drawn('file="m.obj"')
    at(folder / "parts/named.xml", f"<mujoco><asset>{texture}</asset><worldbody/></mujoco>")
    texture = texture.replace('builtin="flat"', "")
    at(folder / "parts/part.xml", f"<mujoco><asset>{texture}</asset><worldbody/></mujoco>")
    (folder / "side.png").write_bytes(robots.PNG)
    spec = started(UNOPENED[name].replace("{folder}", str(folder)), tmp_path)
    copied = {each for each in spec.parent.rglob("*") if each.is_file()} - {spec}
    assert not any(PRIVATE in each.read_text(errors="replace") for each in copied)
    said = capsys.readouterr()
    assert {str(each) for each in copied} <= set(said.out.splitlines())
    assert "not copied, since MuJoCo does not open it: " in said.err
    assert main(["validate", "--strict", str(spec)]) == 0
    begin(spec)


OUTSIDE = {
    "above": '<mesh name="m" file="../m.obj"/>',
    "absolute": '<mesh name="m" file="{folder}/m.obj"/>',
    "link": '<mesh name="m" file="link.obj"/>',
    "through a link to a folder": '<mesh name="m" file="up/m.obj"/>',
    "include": '<include file="../mesh.xml"/>',
    "attached": '<model name="p" file="../part.xml"/>',
}


@pytest.mark.parametrize("name", every(3, list(OUTSIDE)))
def test_files_beyond_the_folder_of_a_model_are_copied_if_they_are_named(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    at(tmp_path / "m.obj", OBJECT)
    at(tmp_path / "part.xml", "<mujoco><worldbody/></mujoco>")
    at(tmp_path / "mesh.xml", '<mujocoinclude><mesh name="m" file="../m.obj"/></mujocoinclude>')
    (tmp_path / "models").mkdir()
    (tmp_path / "models/link.obj").symlink_to("../m.obj")
    (tmp_path / "models/up").symlink_to("..")
    text = with_assets(OUTSIDE[name].replace("{folder}", str(tmp_path)))
    model = at(tmp_path / "models/robot.xml", text)
    command = ["init", str(tmp_path / "cell"), "--model", str(model)]
    assert main(command) == 2
    said = capsys.readouterr().err
    assert f"is not below its folder; nothing was written: to have it copied, add {NAMED}" in said
    assert not (tmp_path / "cell").exists()
    done = main([*command, "--assets", str(tmp_path)])
    if name == "absolute":  # the copy would still use the file itself
        assert (done, (tmp_path / "cell").exists()) == (2, False)
        assert "lies outside the project" in capsys.readouterr().err
    else:
        assert done == 0
        (spec,) = (tmp_path / "cell").glob("*.yaml")
        assert main(["validate", "--strict", str(spec)]) == 0
        begin(spec)


NAMED = "--assets "


@pytest.mark.parametrize(
    ("arguments", "refusal"),
    [
        (["new", "--assets", "nowhere"], "there is no folder 'nowhere' for --assets"),
        ([""], "the directory has no name"),
    ],
)
def test_folders_that_are_not_there_are_refused(
    arguments: list[str],
    refusal: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    at(tmp_path / "robot.xml", arm(SERVOS))
    assert main(["init", *arguments, "--model", "robot.xml"]) == 2
    assert refusal in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["robot.xml"]


def test_links_within_the_folder_of_a_model_are_followed(tmp_path: Path) -> None:
    """As they are named; the model itself may be a link, whose folder is that of the file, too."""
    at(tmp_path / "versions/2/m.obj", OBJECT)
    at(tmp_path / "versions/robot.xml", with_assets('<mesh name="m" file="now/m.obj"/>'))
    (tmp_path / "versions/now").symlink_to("2")
    (tmp_path / "models").mkdir()
    (tmp_path / "models/robot.xml").symlink_to("../versions/robot.xml")
    (tmp_path / "models/now").symlink_to("../versions/2")
    assert (
        main(["init", str(tmp_path / "cell"), "--model", str(tmp_path / "models/robot.xml")]) == 0
    )
    plants = tmp_path / "cell/plants"
    assert sorted(each.relative_to(plants).as_posix() for each in plants.rglob("*.*")) == [
        "now/m.obj",
        "robot.xml",
    ]
    assert not any(each.is_symlink() for each in plants.rglob("*"))
    assert main(["validate", "--strict", str(tmp_path / "cell/arm.yaml")]) == 0


def test_of_a_file_in_two_folders_the_one_is_copied_that_the_simulator_opens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It does not say so of sides of a cube: then the model has to name one folder."""
    for folder in ("one", "two"):
        (tmp_path / "models" / folder).mkdir(parents=True)
        (tmp_path / "models" / folder / "side.png").write_bytes(robots.PNG)
    sides = with_assets('<texture name="t" type="cube" fileright="side.png"/>').replace(
        "<asset>", '<compiler texturedir="one"/><compiler texturedir="two"/><asset>'
    )
    model = at(tmp_path / "models/robot.xml", sides)
    assert main(["init", str(tmp_path / "cell"), "--model", str(model)]) == 2
    assert "name one folder" in capsys.readouterr().err
    at(model, sides.replace('texturedir="one"', ""))
    assert main(["init", str(tmp_path / "cell"), "--model", str(model)]) == 0
    assert (tmp_path / "cell/plants/two/side.png").is_file()


def test_groups_can_be_named(tmp_path: Path) -> None:
    spec = started(
        arm(SERVOS), tmp_path, "--group", "upper=shoulder..elbow", "--group", "tip=wrist"
    )
    text = spec.read_text()
    assert "upper_start" in text
    assert 'tip: {x: {q_d: {type: "real[rad]"' in text
    assert is_clean(spec)


@pytest.mark.parametrize(
    ("group", "words"),
    [
        ("a=sholder", "called sholder; did you mean shoulder"),
        ("a=shoulder,shoulder_servo", ""),
        ("a b=shoulder", "a_b would do"),
        ("a=shoulder,wrist", ""),
    ],
)
def test_groups_that_cannot_be(
    group: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = at(tmp_path / "robot.xml", arm(SERVOS))
    done = main(["init", str(tmp_path / "cell"), "--model", str(model), "--group", group])
    assert done == (2 if words else 0)
    assert words in capsys.readouterr().err
    assert (tmp_path / "cell").exists() != bool(words)


def test_an_agent_is_added(tmp_path: Path) -> None:
    """Of what the first one has left, in names of its own; the rest of the file stays."""
    spec = started(arm(SERVOS), tmp_path, "--agent", "lower", "--group", "arm=shoulder,elbow")
    at(spec, "# mine\n" + spec.read_text())
    plant = str(spec.parent / "plants/robot.xml")
    assert main(["init", str(spec), "--model", plant, "--agent", "upper"]) == 0
    text = spec.read_text()
    assert text.startswith("# mine\n")
    assert "upper.E.arm.q_d: {actuators: [wrist_servo]}" in text
    assert text.count("camera: hand eye") == 1
    assert is_clean(spec)
    begin(spec)


def test_an_agent_that_cannot_be_added(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = started(arm(SERVOS), tmp_path, "--agent", "one", "--group", "arm=shoulder")
    before = spec.read_text()
    other = at(tmp_path / "other.xml", robots.GRIPPER)
    plant = str(spec.parent / "plants/robot.xml")
    for model, agent, words in (
        (str(other), "two", "a system has one plant"),
        (plant, "one", "there is an agent one already"),
        (plant, "c", "c_2 would do"),
    ):
        assert main(["init", str(spec), "--model", model, "--agent", agent]) == 2
        assert words in capsys.readouterr().err
    assert spec.read_text() == before


STRANGE = {
    "at a site": ('<motor name="r" site="tip" gear="0 0 1 0 0 0"/>', "it pushes at a site"),
    "muscle": ('<muscle name="m" joint="shoulder" lengthrange="0 1"/>', "it is a muscle"),
    "integrated": ('<intvelocity name="i" joint="elbow" kp="9" actrange="-1 1"/>', "integrated"),
    "on a body": ('<adhesion name="a" body="wrist_link" ctrlrange="0 1"/>', "no joint or tendon"),
    "damper": ('<damper name="d" joint="elbow" kv="1" ctrlrange="0 1"/>', "no law for it"),
}


@pytest.mark.parametrize("name", short(STRANGE, 1))
def test_an_unusual_actuator_is_left_out(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    actuator, why = STRANGE[name]
    model = at(tmp_path / "robot.xml", arm(actuator))
    assert main(["init", str(tmp_path / "cell"), "--model", str(model)]) == 2
    said = capsys.readouterr().err
    assert "left out: " in said and why in said
    assert ("it flies" if name == "at a site" else "no actuator that can be held") in said
    assert "nothing was written" in said
    assert not (tmp_path / "cell").exists()
    spec = started(arm(SERVOS + actuator), tmp_path)
    assert "# Left out: " in spec.read_text()
    assert main(["validate", "--strict", str(spec)]) == 0


def test_strange_names_become_names(tmp_path: Path) -> None:
    """No identifiers, the same once cleaned, or words of the language."""
    names = ("arm/1", "arm 1", "x")
    servos = "".join(f'<position name="{n}:é" joint="{n}" kp="200" kv="20"/>' for n in names)
    groups = [f"--group=g_{i}={name}" for i, name in enumerate(names)]
    spec = started(arm(servos, names), tmp_path, *groups)
    assert is_clean(spec)
    begin(spec)


ODD = ("he said &quot;hi&quot;: #1", "a&#10;b'c \U0001f600", "- {x")


def test_names_may_be_any_texts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In YAML, titles and comments; those with braces, which bindings take for indices, are out."""
    servos = "".join(f'<position name="{n} *&amp;s" joint="{n}" kp="200" kv="20"/>' for n in ODD)
    text = arm(servos, ODD).replace('name="home"', 'name="&quot;x&#10;: # y"')
    spec = started(text.replace('name="hand eye"', 'name="&quot;eye&#10;: b"'), tmp_path)
    assert "left out: - {x *&s: braces in names stand for indices" in capsys.readouterr().err
    assert is_clean(spec)
    begin(spec)


REPLICATED = f"""{robots.HEAD.format(name="row")}<worldbody><replicate count="3" offset="0 0.3 0">
  <body name="b" pos="0 0 1"><joint name="j" axis="0 1 0" damping="1"/>
    <geom size="0.02" fromto="0 0 0 .2 0 0" type="capsule" contype="0"/></body>
  </replicate></worldbody>
  <actuator><position name="a" joint="j1" kp="100" kv="5"/></actuator></mujoco>"""
ATTACHED = """<mujoco model="cell"><asset><model name="arm" file="../parts/arm.xml"/></asset>
  <worldbody>
  <frame pos="0 0 1"><attach model="arm" body="shoulder_link" prefix="l_"/></frame>
  <frame pos="0 1 1"><attach model="arm" body="shoulder_link" prefix="r_"/></frame>
  </worldbody></mujoco>"""


@pytest.mark.parametrize("model", short([REPLICATED, ATTACHED], 1))
def test_names_that_come_into_being_in_the_simulator(model: str, tmp_path: Path) -> None:
    """A camera beside the body that is attached does not."""
    beside = '<worldbody><camera name="beside" pos="0 0 2"/>'
    at(tmp_path / "parts/arm.xml", arm(SERVOS).replace("<worldbody>", beside))
    spec = started(model, tmp_path, "--assets", str(tmp_path / "parts"))
    assert is_clean(spec)
    begin(spec)
    assert "beside" not in spec.read_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<mujoco", "is not XML"),
        ("<sdf/>", "the root of robot.xml is not <mujoco>"),
        (UNUSABLE, "robot.xml: "),
        ('<mujoco><asset><mesh file="arm.obj"/></asset></mujoco>', "arm.obj, which is not there"),
        ("<mujoco/>", "no actuator that can be held"),
    ],
)
def test_a_model_that_cannot_be_used(
    text: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = at(tmp_path / "robot.xml", text)
    assert main(["init", str(tmp_path / "cell"), "--model", str(model)]) == 2
    said = capsys.readouterr().err
    assert words in said and "Traceback" not in said
    assert not (tmp_path / "cell").exists()


def test_a_machine_without_the_simulator_is_told_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The process that reads models finds no MuJoCo."""
    monkeypatch.setattr(facts, "_describe", ASKED)
    missing = "raise ModuleNotFoundError(\"No module named 'mujoco'\", name='mujoco')"
    at(tmp_path / "path/mujoco.py", missing)
    monkeypatch.syspath_prepend(str(tmp_path / "path"))
    model = at(tmp_path / "robot.xml", f"{arm(SERVOS)}<!-- of this test alone -->")
    assert main(["init", str(tmp_path / "cell"), "--model", str(model)]) == 2
    assert "mujoco is not installed: `" in capsys.readouterr().err
    assert not (tmp_path / "cell").exists()


def test_wheels_with_motors_may_be_geared_backwards(tmp_path: Path) -> None:
    """Each gets a damping of its own sign; with one for both the pair would run away."""
    text = robots.BASE.replace('<velocity name="left_drive" joint="wheel_l" kv="2"', "<motor ")
    text = text.replace("<motor ", '<motor name="left_drive" joint="wheel_l" gear="-1"')
    text = text.replace('<velocity name="right_drive" joint="wheel_r" kv="2"', "<motor ")
    text = text.replace("<motor  ", '<motor name="right_drive" joint="wheel_r" gear="2" ')
    spec = started(text, tmp_path)
    numbers = spec.read_text().partition('base_damping: "[')[2].partition("]")[0].split(", ")
    assert [float(number) > 0 for number in numbers] == [False, True]
    assert is_clean(spec)
    run(spec)


def test_every_step_of_the_design_is_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = started(robots.BASE, tmp_path)
    capsys.readouterr()
    assert main(["status", str(spec)]) == 0
    assert capsys.readouterr().out.endswith("\nevery step is done\n")
    text = spec.read_text()
    assert "imu: {y: Imu}" in text
    assert 'Imu: {accelerometer: "vector[3, m/s**2]", gyro: "vector[3, rad/s]"}' in text
    assert "# Left out: eye: it has no cutoff" in text


def test_options_without_a_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", str(tmp_path / "new"), "--group", "a=b"]) == 2
    assert "--group is about a model; add --model" in capsys.readouterr().err


def test_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = started(robots.GRIPPER, tmp_path)
    model = str(tmp_path / "models/robot.xml")
    assert main(["init", str(tmp_path / "cell"), "--model", model]) == 0  # the same once more
    at(spec, "# mine\n" + spec.read_text())
    before = spec.read_text()
    assert main(["init", str(tmp_path / "cell"), "--model", model]) == 2
    assert "exists already; nothing was written" in capsys.readouterr().err
    assert spec.read_text() == before
    assert (spec.parent / "plants/robot.xml").is_file()


@pytest.mark.long
@pytest.mark.usefixtures("wholly")
def test_a_pose_beyond_its_ranges_is_put_inside(tmp_path: Path, farthest: dict[str, float]) -> None:
    """Where the model begins outside of a range, a scene moves it in, and says so."""
    text = (
        arm(MOTORS).replace('range="-100 100"', 'range="30 100"', 1).replace("0.4 -0.8", "0 -0.8")
    )
    spec = started(text, tmp_path)
    assert "scene: {shoulder:" in spec.read_text()
    assert main(["validate", "--strict", str(spec)]) == 0
    run(spec)
    assert max(farthest.values()) < 1.0
    assert set(farthest) == set(JOINTS)


TWO_ON_ONE = {
    "motors": MOTORS + '<motor name="second" joint="elbow" ctrlrange="-9 9"/>',
    "servos": SERVOS + '<position name="second" joint="elbow" kp="50" kv="5"/>',
    "speeds": SPEEDS + '<velocity name="second" joint="elbow" kv="2"/>',
}


@pytest.mark.parametrize("name", short(TWO_ON_ONE, 0))
@pytest.mark.long
def test_two_actuators_of_a_kind_may_move_one_joint(name: str, tmp_path: Path) -> None:
    spec = started(arm(TWO_ON_ONE[name]), tmp_path)
    assert is_clean(spec)
    assert "actuators: [second]" in spec.read_text()
    run(spec)


@pytest.mark.usefixtures("wholly")
@pytest.mark.parametrize(
    ("actuators", "change", "words"),
    [
        (MOTORS.replace("-60", "-inf", 1), ("", ""), "actuator shoulder_motor: the least control"),
        (MOTORS, ('qpos="0.4', 'qpos="nan'), "keyframe home: a position"),
        (MOTORS, ('timestep="0.002"', 'timestep="1e-5"'), "is too short: 5 s would take more"),
    ],
)
def test_numbers_that_give_no_control_are_refused(
    actuators: str,
    change: tuple[str, str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    model = at(tmp_path / "robot.xml", arm(actuators).replace(*change))
    assert main(["init", str(tmp_path / "cell"), "--model", str(model)]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "cell").exists()


@pytest.mark.usefixtures("wholly")
@pytest.mark.long
def test_a_joint_that_is_not_held_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = started(arm(MOTORS.replace("-60 60", "-1 1")), tmp_path)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("specc: NOT HELD: in a rehearsal") and "shoulder " in line
    assert "# NOT HELD: " in spec.read_text()
    assert "scenarios:" not in spec.read_text(), "a test that fails from the beginning"


def files_below(folder: Path) -> dict[Path, bytes | None]:
    return {p: p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}


def test_a_specification_with_errors_is_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its model includes a file by an absolute path, which leads out of the project."""
    parts = at(tmp_path / "elsewhere/parts.xml", arm(SERVOS))
    model = at(
        tmp_path / "models/cell.xml", f'<mujoco model="cell"><include file="{parts}"/></mujoco>'
    )
    before = files_below(tmp_path)
    command = ["init", str(tmp_path / "new/cell"), "--model", str(model)]
    assert main([*command, "--assets", str(parts.parent)]) == 2
    said = capsys.readouterr().err
    assert "nothing was written: the specification would have errors" in said and "  E0" in said
    assert files_below(tmp_path) == before


def in_braces(text: str) -> str:
    return json.dumps(YAML(typ="safe").load(text))


@pytest.mark.parametrize(
    "changed",
    [lambda text: f"{text}...\n", in_braces, lambda text: f"--- # one\n{text}"],
    ids=["an end", "braces", "a beginning"],
)
def test_an_agent_is_in_the_specification_or_nothing_changes(
    changed: Callable[[str], str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = started(arm(SERVOS), tmp_path, "--agent", "lower", "--group", "arm=shoulder,elbow")
    at(spec, changed(spec.read_text()))
    before = files_below(tmp_path)
    capsys.readouterr()
    plant = str(spec.parent / "plants/robot.xml")
    done = main(["init", str(spec), "--model", plant, "--agent", "upper"])
    if done:
        assert "upper cannot be added" in capsys.readouterr().err
        assert files_below(tmp_path) == before
    else:
        read = check_spec(str(spec))
        assert read.system is not None and {a.name for a in read.system.agents} == {
            "lower",
            "upper",
        }


@pytest.mark.parametrize(
    ("agent", "words"), [("extra", "are driven already"), ("carriers_1", "an agent carriers_1")]
)
def test_agents_and_bindings_of_many_are_known(
    agent: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`carriers_{i}`, whose devices are bound with `for`."""
    at(tmp_path / "pyproject.toml", "")
    spec, plant, *_ = (at(tmp_path / each, (SPECS / each).read_text()) for each in SERVICES)
    before = spec.read_text()
    assert main(["init", str(spec), "--model", str(plant), "--agent", agent]) == 2
    assert words in capsys.readouterr().err
    assert spec.read_text() == before


def test_an_agent_that_cannot_be_read_is_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = started(arm(SERVOS), tmp_path, "--agent", "one", "--group", "arm=shoulder")
    text = spec.read_text().replace("agents:\n", "agents:\n  two: {use: nowhere.yaml}\n")
    at(spec, text)
    plant = str(spec.parent / "plants/robot.xml")
    assert main(["init", str(spec), "--model", plant, "--agent", "two"]) == 2
    assert "there is an agent two already" in capsys.readouterr().err
    assert spec.read_text() == text


def test_nothing_stays_after_an_interrupt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = at(tmp_path / "models/robot.xml", arm(SERVOS))
    before = files_below(tmp_path)

    def interrupted(*_: object) -> None:
        assert (tmp_path / "new/cell/plants/robot.xml").is_file()
        raise KeyboardInterrupt

    monkeypatch.setattr(init, "_checked", interrupted)
    assert main(["init", str(tmp_path / "new/cell"), "--model", str(model)]) == 130
    assert files_below(tmp_path) == before


def test_a_name_that_is_too_long_is_a_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = at(tmp_path / "robot.xml", arm(SERVOS))
    folder = str(tmp_path / ("x" * 300))
    for options in (["--model", str(model)], ["--model", str(model), "--agent", "a"], []):
        assert main(["init", folder, *options]) == 2
        assert "cannot write: " in capsys.readouterr().err
    named = at(tmp_path / f"{'y' * 250}.xml", arm(SERVOS).replace("<mujoco model", "<mujoco class"))
    assert main(["init", str(tmp_path / "cell"), "--model", str(named)]) == 2
    assert not (tmp_path / "cell").exists()


@pytest.mark.parametrize("sign", short([signal.SIGKILL, signal.SIGTERM], 0))
def test_nothing_outlives_a_command_that_is_killed(tmp_path: Path, sign: signal.Signals) -> None:
    """Neither the process that rehearses for seconds nor the folder in which it works."""
    slow = arm(MOTORS.replace("-60 60", "-1 1")).replace('timestep="0.002"', 'timestep="5e-5"')
    model = at(tmp_path / "robot.xml", slow)
    (scratch := tmp_path / "scratch").mkdir()
    ours, theirs = os.pipe()
    command = [sys.executable, "-m", "specc", "init", str(tmp_path / "cell"), "--model", str(model)]
    killed = subprocess.Popen(
        command, stdin=theirs, cwd=tmp_path, env={**os.environ, "TMPDIR": str(scratch)}
    )
    os.close(theirs)
    children = Path(f"/proc/{killed.pid}/task/{killed.pid}/children")
    while killed.poll() is None and not children.read_text():
        time.sleep(0.01)
    killed.send_signal(sign)
    assert killed.wait(timeout=60) == (128 + sign if sign == signal.SIGTERM else -sign)
    # All of them hold its standard input, so this waits for their end.
    with os.fdopen(ours, "rb") as end:
        assert end.read() == b""
    assert list(scratch.iterdir()) == []
    assert not (tmp_path / "cell").exists()


# Actuators in another order than their joints; names with what separates names in `--group`.
MIXED = "".join(
    f'<position name="{name}" joint="{joint}" kp="200" kv="20"/>'
    for name, joint in (("a,b", "shoulder"), ("c..d", "wrist"), ("e", "elbow"))
)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("shoulder..elbow", ["a,b", "e"]),
        ("elbow..shoulder", ["a,b", "e"]),
        ("e..c..d", ["c..d", "e"]),
        ("a,b", ["a,b"]),
        ("e, a,b,c..d", ["e", "a,b", "c..d"]),
        ("a,b..c..d", None),
    ],
)
def test_what_a_group_names(text: str, found: list[str] | None, tmp_path: Path) -> None:
    facts = init.read_facts(str(at(tmp_path / "robot.xml", arm(MIXED))))
    if found is None:
        with pytest.raises(NoGroup, match="is called a"):
            actuator_groups(facts, {"g": text}, guess=False)
    else:
        (group,) = actuator_groups(facts, {"g": text}, guess=False)
        assert [each.name for each in group.actuators] == found


def test_joints_that_one_actuator_moves_with_others_are_no_group(tmp_path: Path) -> None:
    tendon = '<fixed name="t"><joint joint="j1" coef="1"/><joint joint="j3" coef="1"/></fixed>'
    text = arm('<motor name="m" tendon="t"/>', ("j1", "j2", "j3"))
    text = text.replace("</mujoco>", f"<tendon>{tendon}</tendon></mujoco>")
    facts = init.read_facts(str(at(tmp_path / "robot.xml", text)))
    with pytest.raises(NoGroup, match="no actuator moves only joints from j1 to j1"):
        actuator_groups(facts, {"g": "j1..j1"})
    assert len(actuator_groups(facts, {"g": "j1..j3"})) == 1


@pytest.mark.parametrize("text", ["j2", "j2..j2", "j1..j2"])
def test_a_joint_without_an_actuator_is_no_group(text: str, tmp_path: Path) -> None:
    model = arm('<motor name="m" joint="j1"/>', ("j1", "j2", "j3"))
    facts = init.read_facts(str(at(tmp_path / "robot.xml", model)))
    with pytest.raises(NoGroup, match=r"no actuator moves joint j2$"):
        actuator_groups(facts, {"g": text})


def test_actuators_of_one_joint_are_no_chain(tmp_path: Path) -> None:
    motors = "".join(f'<motor name="m{i}" joint="j1"/>' for i in range(3))
    text = arm(motors, ("j1", "j2", "j3"))
    facts = init.read_facts(str(at(tmp_path / "robot.xml", text)))
    assert [group.kind for group in actuator_groups(facts, {})] == ["joints"]


UNNAMED = (
    '<position joint="shoulder" kp="200" kv="20"/><position joint="elbow" kp="200" kv="20"/>'
    '<position joint="wrist" kp="200" kv="20"/>'
)


def test_actuators_without_names_are_called_after_their_joints(tmp_path: Path) -> None:
    spec = started(arm(UNNAMED), tmp_path)
    assert "arm.E.arm.q_d: {actuators: [shoulder, elbow, wrist]}" in " ".join(
        spec.read_text().split()
    )
    assert is_clean(spec)
    begin(spec)
    # The model is as it was.
    assert (spec.parent / "plants/robot.xml").read_text() == arm(UNNAMED)


def test_a_name_that_is_taken_gets_a_number(tmp_path: Path) -> None:
    servos = UNNAMED.replace('<position joint="elbow"', '<position name="wrist" joint="elbow"')
    spec = started(arm(servos), tmp_path)
    assert "actuators: [shoulder, wrist, wrist_2]" in " ".join(spec.read_text().split())
    begin(spec)


def test_files_that_are_there_with_the_same_bytes_are_taken_as_they_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = started(arm(SERVOS), tmp_path)
    plant = spec.parent / "plants/robot.xml"
    made_ns = plant.stat().st_mtime_ns
    spec.unlink()
    command = ["init", str(spec.parent), "--model", str(tmp_path / "models/robot.xml")]
    assert main(command) == 0
    assert plant.stat().st_mtime_ns == made_ns
    # What was there stays when something else goes wrong.
    spec.unlink()
    assert main([*command, "--group", "a=sholder"]) == 2
    assert plant.exists()
    plant.write_text(plant.read_text() + "<!-- mine -->")
    assert main(command) == 2
    assert "exists already; nothing was written" in capsys.readouterr().err
    assert "mine" in plant.read_text()
    assert not spec.exists()


def test_bodies_that_mocap_places_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = arm(SERVOS).replace("<worldbody>", '<worldbody><body name="goal" mocap="true"/>')
    assert text.count("mocap") == 1
    spec = started(text, tmp_path)
    assert "MOCAP: goal stays where the model has it: no actuator moves it" in flat(spec)
    tie = '<equality><weld body1="goal" body2="wrist_link"/></equality>'
    capsys.readouterr()
    spec = started(text.replace("<actuator>", f"{tie}<actuator>"), tmp_path / "tied")
    assert "stays where the model has it, with what is tied to it (wrist_link)" in flat(spec)
    assert "specc: MOCAP: goal" in capsys.readouterr().err
    assert main(["validate", "--strict", str(spec)]) == 0


def flat(spec: Path) -> str:
    """A text whose comments are not wrapped."""
    return " ".join(spec.read_text().replace("\n#", "").split())


DRONE = """\
<mujoco><worldbody><body name="drone" pos="0 0 1"><freejoint/><geom size="0.1"/>
  <site name="left" pos="0 0.1 0"/><site name="right" pos="0 -0.1 0"/></body></worldbody>
  <actuator><motor site="left" gear="0 0 1 0 0 0"/>
    <motor site="right" gear="0 0 1 0 0 0"/></actuator>
</mujoco>
"""
URDF = '<robot name="two"><link name="base"/></robot>'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DRONE, ("left, right: it pushes at a site", "it flies", "under `A drone`")),
        (URDF, ("robot.xml is URDF; let MuJoCo write it as MJCF", "under `From URDF`")),
        (arm(""), ("no actuator that can be held", "add `<actuator>` with a drive for each")),
    ],
)
def test_what_to_do_is_said_of_what_cannot_be_started(
    text: str, words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = at(tmp_path / "robot.xml", text)
    assert main(["init", str(tmp_path / "cell"), "--model", str(model)]) == 2
    said = capsys.readouterr().err
    assert [word for word in words if word not in said] == []
    assert not (tmp_path / "cell").exists()
    page = (SPECS.parent / "docs/your_robot.md").read_text()
    assert "### From URDF\n" in page and "### A drone\n" in page
