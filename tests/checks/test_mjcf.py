"""Names, sizes and kinds read from MJCF are those that MuJoCo finds in it."""

from __future__ import annotations

from dataclasses import replace
from math import radians
from pathlib import Path

import pytest
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.model import load_model

from specc.mjcf import Model, ModelError, ModelFiles, read_model
from specc.mjcf.reader import ActuatorNames
from tests.scenarios.runs import INSTALLED, SPECS

PLANTS = [
    pytest.param(path, marks=[INSTALLED] if "../models/" in path.read_text() else [], id=path.stem)
    for path in sorted((SPECS / "plants").glob("*.xml"))
]

SENSORS = """
<touch name="s1" site="p"/> <accelerometer name="s2" site="p"/> <velocimeter name="s3" site="p"/>
<gyro name="s4" site="p"/> <force name="s5" site="p"/> <torque name="s6" site="p"/>
<magnetometer name="s7" site="p"/> <rangefinder name="s8" site="p"/>
<jointpos name="s9" joint="slide"/> <jointvel name="s10" joint="slide"/>
<actuatorfrc name="s11" actuator="push"/> <ballquat name="s12" joint="ball"/>
<ballangvel name="s13" joint="ball"/> <framepos name="s14" objtype="site" objname="p"/>
<framequat name="s15" objtype="site" objname="p"/>
<framelinvel name="s16" objtype="site" objname="p"/>
<subtreecom name="s17" body="b"/> <clock name="s18"/> <user name="s19" dim="5"/>
<e_potential name="s20"/> <camprojection name="s21" site="p" camera="eye"/>
"""
WORLD = f"""
<mujoco>
  <worldbody>
    <camera name="eye" resolution="320 200"/>
    <camera name="plain"/>
    <body><freejoint name="free"/><geom size="0.1"/></body>
    <body name="b">
      <joint name="slide" type="slide"/>
      <geom size="0.1"/>
      <body pos="0 0 1"><joint name="ball" type="ball"/><geom size="0.1"/><site name="p"/></body>
      <body pos="0 1 1"><joint name="hinge"/><geom size="0.1"/></body>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="slide"/><position name="hold" joint="hinge"/></actuator>
  <sensor>{SENSORS}</sensor>
</mujoco>
"""


def names(model: object, kind: object, count: int) -> list[str]:
    return [mujoco.mj_id2name(model, kind, i) for i in range(count)]


def as_mujoco_reads(path: Path) -> Model:
    model = mujoco.MjModel.from_xml_path(str(path))
    kinds = mujoco.mjtObj
    joints = names(model, kinds.mjOBJ_JOINT, model.njnt)
    sensors = names(model, kinds.mjOBJ_SENSOR, model.nsensor)
    actuators = names(model, kinds.mjOBJ_ACTUATOR, model.nu)
    cameras = names(model, kinds.mjOBJ_CAMERA, model.ncam)
    sizes = {int(kind): size for kind, size in zip(range(4), (7, 4, 1, 1), strict=True)}
    resolutions = [(int(w), int(h)) for w, h in model.cam_resolution]
    return Model(
        {n: sizes[int(t)] for n, t in zip(joints, model.jnt_type, strict=True)},
        {n: int(d) for n, d in zip(sensors, model.sensor_dim, strict=True)},
        dict.fromkeys(actuators, 1),
        {n: None if r == (1, 1) else r for n, r in zip(cameras, resolutions, strict=True)},
        {n for n in names(model, kinds.mjOBJ_BODY, model.nbody) if n and n != "world"},
        timestep_s=model.opt.timestep,
    )


def sizes_in(path: Path) -> Model:
    return replace(read_model(str(path)), parts={}, files=ModelFiles(), name="")


def test_the_time_step(tmp_path: Path) -> None:
    part, whole = tmp_path / "part.xml", tmp_path / "whole.xml"
    part.write_text('<mujoco model="p"><option timestep="3e-3"/><worldbody/></mujoco>')
    attached = '<asset><model name="p" file="part.xml"/></asset><worldbody/>'
    options = '<option timestep="0.0005"/><include file="part.xml"/><option gravity="0 0 0"/>'
    for inside in (attached, options, '<option timestep="1e-2"/>', "<worldbody/>"):
        whole.write_text(f"<mujoco>{inside}</mujoco>")
        assert read_model(str(whole)).timestep_s == as_mujoco_reads(whole).timestep_s
    whole.write_text('<mujoco><option timestep="-1"/></mujoco>')
    assert read_model(str(whole)).timestep_s is None


def test_every_kind_of_joint_and_many_sensors(tmp_path: Path) -> None:
    path = tmp_path / "world.xml"
    path.write_text(WORLD)
    assert sizes_in(path) == as_mujoco_reads(path)


@pytest.mark.parametrize("path", PLANTS)
def test_plants(path: Path) -> None:
    read, built = sizes_in(path), as_mujoco_reads(path)
    if "<attach " not in path.read_text():
        assert read == built
    else:  # whose other bodies count, too
        assert read.joints.items() >= built.joints.items()
        assert read.sensors.items() >= built.sensors.items()
        assert read.actuators.items() >= built.actuators.items()
        assert read.bodies >= built.bodies
    assert read.complete


def test_models_that_are_attached_bring_their_names(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    whole = WORLD.replace("<mujoco>", '<mujoco model="w">').replace("freejoint", "joint")
    (tmp_path / "parts" / "whole.xml").write_text(whole)
    (tmp_path / "pair.xml").write_text(
        """<mujoco><asset><model file="parts/whole.xml"/></asset>
        <worldbody><body name="pair"><attach model="w" prefix="l_"/></body>
        <frame pos="0 9 0"><attach model="w" prefix="r_"/></frame></worldbody></mujoco>"""
    )
    path = tmp_path / "pairs.xml"
    path.write_text(
        """<mujoco><asset>
          <model name="p" file="pair.xml"/><model name="same" file="pair.xml"/>
        </asset><worldbody>
          <attach model="p" prefix="a"/><attach model="same" prefix="b"/>
        </worldbody></mujoco>"""
    )
    assert sizes_in(path) == as_mujoco_reads(path)
    assert read_model(str(path)).driven("al_push") == "al_slide"


@pytest.mark.parametrize("attached", ["none.xml", "loop.xml"])
def test_names_are_not_all_known_where_models_cannot_be_read(attached: str, tmp_path: Path) -> None:
    text = "<mujoco><asset>{}</asset><worldbody>{}</worldbody></mujoco>"
    path = tmp_path / "loop.xml"
    path.write_text(
        text.format(
            f'<model name="m" file="{attached}"/>',
            '<camera name="c"/><attach model="m" prefix="a"/>',
        )
    )
    model = read_model(str(path))
    assert not model.complete
    assert "c" in model.cameras


SET_BY_CLASSES = """
<mujoco>
  <default><joint type="slide" range="-1 2"/><motor gear="3"/>
    <default class="one"><joint type="hinge" range="-90 45"/><position gear="1"/>
      <default class="two"><joint limited="false"/></default></default></default>
  <worldbody>
    <body><joint name="a"/><geom size="0.1"/></body>
    <body><joint name="b" class="one"/><geom size="0.1"/></body>
    <body><joint name="c" type="hinge"/><geom size="0.1"/>
      <body childclass="two"><joint name="d"/><geom size="0.1"/>
        <body><joint name="e"/><joint name="f" axis="1 0 0" class="main"/><geom size="0.1"/></body>
      </body></body>
  </worldbody>
  <actuator>
    <motor name="p" joint="a"/> <position name="q" joint="b" class="one"/>
    <motor name="r" joint="c" gear="1"/> <velocity name="s" joint="c" gear="2"/>
  </actuator>
</mujoco>
"""


@pytest.mark.parametrize("text", [WORLD, SET_BY_CLASSES, *PLANTS], ids=str)
def test_what_is_known_of_joints_and_actuators_is_what_mujoco_makes_of_them(
    text: str | Path, tmp_path: Path
) -> None:
    path = text if isinstance(text, Path) else tmp_path / "world.xml"
    if isinstance(text, str):
        path.write_text(text)
    ours, theirs = read_model(str(path)), mujoco.MjModel.from_xml_path(str(path))
    kinds = dict(enumerate(("free", "ball", "slide", "hinge")))
    for index, name in enumerate(names(theirs, mujoco.mjtObj.mjOBJ_JOINT, theirs.njnt)):
        if not name:
            continue
        kind = kinds[int(theirs.jnt_type[index])]
        assert ours.joint_kind(name) == kind
        limited = theirs.jnt_limited[index] and kind in ("hinge", "slide")
        range = tuple(theirs.jnt_range[index]) if limited else None
        assert ours.joint_range(name) == (range and pytest.approx(range))
    for index, name in enumerate(names(theirs, mujoco.mjtObj.mjOBJ_ACTUATOR, theirs.nu)):
        which = int(theirs.actuator_trnid[index][0])
        joint = mujoco.mj_id2name(theirs, mujoco.mjtObj.mjOBJ_JOINT, which)
        if not name or theirs.actuator_trntype[index] != mujoco.mjtTrn.mjTRN_JOINT:
            continue
        assert ours.driven(name) == joint
        is_direct = theirs.actuator_gear[index][0] == 1
        assert ours.driven(name, direct=True) == (joint if is_direct else "")


def test_files_that_are_not_there_are_named(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(
        '<mujoco><asset><mesh file="hand.obj"/></asset><worldbody/></mujoco>'
    )
    (tmp_path / "there.png").write_bytes(b"")
    path = tmp_path / "cell.xml"
    path.write_text(
        '<mujoco><asset><model name="arm" file="arm.xml"/><hfield name="h" file="hills.png"/>'
        '<texture name="t" type="2d" file="there.png"/></asset><worldbody>'
        '<attach model="arm" prefix="a/"/></worldbody></mujoco>'
    )
    assert read_model(str(path)).missing == ("the height field hills.png", "the mesh hand.obj")


def test_includes_stand_for_their_content(tmp_path: Path) -> None:
    head, _, tail = WORLD.partition("<body name=")
    arm = "<body name=" + tail[: tail.index("</worldbody>")]
    (tmp_path / "arm.xml").write_text(f"<mujocoinclude>{arm}</mujocoinclude>")
    (tmp_path / "sensors.xml").write_text(f"<mujoco><sensor>{SENSORS}</sensor></mujoco>")
    rest = tail[tail.index("</worldbody>") : tail.index("<sensor>")]
    main = tmp_path / "main.xml"
    main.write_text(f'{head}<include file="arm.xml"/>{rest}<include file="sensors.xml"/></mujoco>')
    assert sizes_in(main) == as_mujoco_reads(main)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "not XML"),
        ("<mujoco>", "not XML"),
        ("<sdf/>", "root"),
        ("<robot/>", "is URDF; let MuJoCo write it as MJCF"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "document type"),
        ("<mujoco>" + "<body>" * 300 + "</body>" * 300 + "</mujoco>", "nested"),
        ('<mujoco><include file="model.xml"/></mujoco>', "twice"),
        ('<mujoco><include file="none.xml"/></mujoco>', "cannot be read"),
        *(
            (f'<?xml version="1.0" encoding="{name}"?><mujoco/>', "the encoding")
            for name in ("utf-7", "shift_jis", "nothing", "rot13", "zlib", "undefined", "idna")
        ),
    ],
)
def test_what_is_no_model_is_refused(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "model.xml"
    path.write_text(text)
    with pytest.raises(ModelError, match=reason):
        read_model(str(path))


def test_encodings_of_one_byte_are_read(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    text = '<?xml version="1.0" encoding="iso-8859-1"?><mujoco model="b\u00e4r"/>'
    path.write_text(text, encoding="iso-8859-1")
    assert read_model(str(path)).name == "b\u00e4r"


@pytest.mark.parametrize("number", ["\u00b2", "9" * 5000, "-1", ""])
def test_a_size_that_is_no_number_is_not_known(number: str, tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(
        f'<mujoco><worldbody><camera name="c" resolution="{number} 2"/></worldbody>'
        f'<sensor><user name="s" dim="{number}"/></sensor></mujoco>'
    )
    model = read_model(str(path))
    assert (model.cameras, model.sensors) == ({"c": None}, {"s": None})


def test_a_directory_is_no_model(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="cannot be read"):
        read_model(str(tmp_path))


def test_generated_names_make_the_list_open(tmp_path: Path) -> None:
    path = tmp_path / "many.xml"
    path.write_text(WORLD.replace('<body name="b">', '<replicate count="2"/><body name="b">'))
    assert not read_model(str(path)).complete


def _doubling(levels: int) -> dict[str, str]:
    """Models of which each attaches the next one twice."""
    pair = "<attach model='m' prefix='a'/><attach model='m' prefix='b'/>"
    made = {
        f"{i}.xml": f"<mujoco><asset><model name='m' file='{i + 1}.xml'/></asset>"
        f"<worldbody>{pair}</worldbody></mujoco>"
        for i in range(levels)
    }
    return {**made, f"{levels}.xml": PLAIN}


PLAIN = "<mujoco><worldbody><body name='b'><geom size='1'/></body></worldbody></mujoco>"
NESTED = "<replicate count='1000'>" * 3 + "<geom size='1'/>" + "</replicate>" * 3


def _attaching(name: str, times: int) -> str:
    """A model that attaches another one so many times."""
    attached = "".join(f"<attach model='m' prefix='p{i}_'/>" for i in range(times))
    asset = f"<asset><model name='m' file='{name}'/></asset>"
    return f"<mujoco>{asset}<worldbody>{attached}</worldbody></mujoco>"


def _with(*elements: str) -> str:
    return f"<mujoco>{''.join(elements)}</mujoco>"


HOSTILE: dict[str, tuple[str, dict[str, str]]] = {
    "with the copies": (_with(f"<worldbody>{NESTED}</worldbody>"), {}),
    "m.xml, line 1: with the copies": (
        _with("<worldbody><replicate count='1e12'><site/></replicate></worldbody>"),
        {},
    ),
    "with the copies of this": (
        _with("<worldbody><composite count='9999 9999 9999'/></worldbody>"),
        {},
    ),
    "more than 20,000 names": (
        _attaching("a.xml", 150),
        {"a.xml": _attaching("b.xml", 150), "b.xml": PLAIN},
    ),
    "20,000 names": (_attaching("0.xml", 1), _doubling(30)),
    "more than 200,000 elements": (
        _attaching("a.xml", 50),
        {"a.xml": _with("<worldbody><replicate count='9000'><site/></replicate></worldbody>")},
    ),
    "a timestep of 1e-09 s": (_with("<option timestep='1e-9'/>"), {}),
    "line 2: a timestep of 1e+09 s": (_with("\n<option timestep='1e9'/>"), {}),
    "1e+18 `iterations`": (_with("<option iterations='1e30'/>"), {}),
    "a <texture> of 10,000,000,000 numbers": (
        _with("<asset><texture name='t' width='100000' height='100000'/></asset>"),
        {},
    ),
    "more than 20,000 places": (
        _with(
            *(f"<compiler meshdir='d{i}'/>" for i in range(200)),
            "<asset>",
            *(f"<mesh file='{i}.stl'/>" for i in range(200)),
            "</asset>",
        ),
        {},
    ),
    "a <hfield> of": (_with("<asset><hfield nrow='99999' ncol='99999'/></asset>"), {}),
    "<size> reserves": (_with("<size memory='900G'/>"), {}),
    "<size> reserves more": (_with("<size nuserdata='2000000000'/>"), {}),
}
"""What is said of a model -> the model, and others beside it."""


def test_sizes_are_told_from_the_text(tmp_path: Path) -> None:
    for number, (said, (text, others)) in enumerate(HOSTILE.items()):
        folder = tmp_path / str(number)
        folder.mkdir()
        for name, content in {"m.xml": text, **others}.items():
            (folder / name).write_text(content)
        with pytest.raises(ModelError) as refused:
            read_model(str(folder / "m.xml"))
        assert said in str(refused.value)


def test_meshes_are_weighed_and_not_read(tmp_path: Path) -> None:
    (tmp_path / "m.xml").write_text(_with("<asset><mesh name='a' file='a.stl'/></asset>"))
    with (tmp_path / "a.stl").open("wb") as mesh:
        mesh.truncate(400_000_000)
    assert read_model(str(tmp_path / "m.xml")).size == 2 + 1
    with (tmp_path / "a.stl").open("wb") as mesh:
        mesh.truncate(600_000_000)
    with pytest.raises(ModelError, match=r"with a\.stl its files have more than 500,000,000 bytes"):
        read_model(str(tmp_path / "m.xml"))


def test_what_classes_and_prefixes_multiply_is_counted(tmp_path: Path) -> None:
    """Before it is made: 150 classes in one another, and 100 prefixes of 90 kB before 190 names."""
    others = " ".join(f'a{i}="1"' for i in range(99))
    classes = "".join(
        f'<default class="c{i}"><joint range="0 {i + 1}" {others}/>' for i in range(150)
    )
    joints = "".join(f'<joint name="j{i}" class="c149"/>' for i in range(9000))
    path = tmp_path / "model.xml"
    path.write_text(
        f"<mujoco><default>{classes}{'</default>' * 150}</default>"
        f"<worldbody><body>{joints}</body></worldbody></mujoco>"
    )
    assert read_model(str(path)).joint_range("j8999") == (0.0, radians(150))
    bodies = "".join(f'<body name="b{i}"/>' for i in range(190))
    (tmp_path / "part.xml").write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    long = "z" * 90_000
    prefixes = "".join(f'<attach model="p" prefix="{long}{i}"/>' for i in range(100))
    path.write_text(
        '<mujoco><asset><model name="p" file="part.xml"/></asset>'
        f"<worldbody>{prefixes}</worldbody></mujoco>"
    )
    with pytest.raises(ModelError, match="names of over 2,000,000 letters"):
        read_model(str(path))


UNNAMED = """\
<mujoco model="child">
  <default><position kp="3"/></default>
  <worldbody><body name="b"><joint name="j"/><geom size="0.1"/><site name="s"/>
    <body name="b2"><joint name="k"/><geom size="0.1"/><site name="s2"/></body></body></worldbody>
  <tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>
  <actuator>
    <position joint="j"/><motor tendon="t"/><motor site="s"/><motor site="s2" refsite="s"/>
    <adhesion body="b" ctrlrange="0 1"/><motor jointinparent="k"/><motor name="j_2" joint="j"/>
    <motor joint="j"/><motor name="k" joint="k"/><motor joint="k"/><velocity joint="j"/>
    <general cranksite="s2" slidersite="s" cranklength="1"/>
  </actuator>
</mujoco>
"""
AROUND = """\
<mujoco><asset><model name="child" file="child.xml"/></asset>
  <worldbody><frame><attach model="child" body="b" prefix="a_"/></frame>
    <body pos="1 0 0"><joint name="j"/><geom size="0.1"/></body></worldbody>
  <actuator><motor joint="j"/><include file="more.xml"/></actuator>
</mujoco>
"""


def test_actuators_without_names_are_called_alike_by_the_compiler_and_the_runtime(
    tmp_path: Path,
) -> None:
    for name, text in (
        ("child", UNNAMED),
        ("more", '<mujoco><motor joint="j"/><motor joint="j"/></mujoco>'),
        ("around", AROUND),
    ):
        (tmp_path / f"{name}.xml").write_text(text)
    child = ["j", "t", "s", "s2", "b", "k_2", "j_2", "j_3", "k", "k_3", "j_4", "s2_2"]
    around = ["j", "j_2", "j_3", *(f"a_{name}" for name in child)]
    for path, expected in (("child.xml", child), ("around.xml", around)):
        built = load_model(str(tmp_path / path))
        assert list(names(built, mujoco.mjtObj.mjOBJ_ACTUATOR, built.nu)) == expected
        ours = read_model(str(tmp_path / path))
        assert list(ours.actuators) == expected
        assert [ours.parts["actuator", name].joint for name in ours.actuators] == [
            part if ours.joint_kind(part) else ""
            for part in (target(built, i) for i in range(built.nu))
        ]


def target(model: mujoco.MjModel, actuator: int) -> str:
    """The joint that an actuator drives; empty if it is another part, or in another frame."""
    if model.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_JOINT:
        return ""
    return str(model.joint(int(model.actuator_trnid[actuator][0])).name)


def test_the_names_of_very_many_actuators_without_are_found_at_once(tmp_path: Path) -> None:
    """A number for each, not a search from the first one."""
    unnamed = ActuatorNames(f"j_{n}" for n in range(50_000))
    assert unnamed.of({"joint": "j"}) == "j"
    assert [unnamed.of({"joint": "j"}) for _ in range(50_000)][-1] == "j_99999"
