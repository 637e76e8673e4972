"""An end that is `same` has the elements that its other end has."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from specc import pipeline
from specc.tools.diff import compare

SYSTEM = """\
specc: 1.2
system: demo
interfaces: {Order: {speed: {type: "real[m/s]", init: 0, max_age: 2 s}, go: bool}}
agents:
  a:
    real_effectors:
      hand: {x: {v: {type: "real[m/s]", safe: 0, max_age: 1 s, title: speed}}, y: {w: "real[m]"}}
    virtual_effectors:
      hand:
        rate: 100 Hz
        x: {c: COMMAND, E: REPORT}
        y: {c: {w: {type: "real[m]", title: width, eq: 3}}, E: SPEED}
        through: {y.E.v: "x.c.v if present(x.c.v) else 0", y.c.w: x.E.w}
    control:
      rate: 10 Hz
      x: {hand: WIDTH, b: ORDER}
      y: {hand: {v: "real[m/s]"}}
      through: {y.hand.v: "x.b.speed if fresh(x.b.go) and x.hand.w > 0 else 0"}
  b:
    control:
      rate: 10 Hz
      y: {a: SENT}
      through: {y.a.speed: "1[m/s]", y.a.go: True}
"""
WRITTEN = {
    "COMMAND": '{v: "real[m/s]"}',
    "REPORT": '{w: "real[m]"}',
    "SPEED": '{v: {type: "real[m/s]", title: speed}}',
    "WIDTH": '{w: {type: "real[m]", title: width, eq: 3, init: "1[m]", max_age: 150 ms}}',
    "ORDER": "Order",
    "SENT": "Order",
}
SAME = {
    "COMMAND": "same",
    "REPORT": "{is: same}",
    "SPEED": "same",
    "WIDTH": '{is: same, w: {init: "1[m]", max_age: 150 ms}}',
    "ORDER": "same",
}
GROUP = """\
specc: 1.2
system: demo
agents:
  arm:
    for: {i: 1..2}
    real_effectors:
      m: {x: {q_d: {type: "vector[2, rad]", safe: "[0, 0]"}}, y: {q: "vector[2, rad]"}}
    virtual_effectors: {m: {use: part.yaml, with: {n: 2}}}
    control:
      rate: 10 Hz
      x: {m: JOINTS, boss: BOSS}
      y: {m: GOAL, boss: {at: "vector[2, rad]"}}
      let: {q: "x.m.q if present(x.m.q) else [0, 0]", wait: not present(x.boss.go)}
      through: {y.m.q_d: "q if wait or not x.boss.go else [0, 0]", y.boss.at: q}
  boss:
    control:
      rate: 10 Hz
      x: {arm: AT}
      y: {arm: {go: bool}}
      through: {y.arm.go: "all(fresh(a.at) and a.at[0] > 0 for a in x.arm)"}
"""
PART = """\
specc: 1.2
parameters: {n: int}
subsystem:
  rate: 100 Hz
  x: {c: {q_d: "vector[n, rad]"}, E: REPORT}
  y: {c: {q: "vector[n, rad]"}, E: COMMAND}
  through: {y.E.q_d: "x.c.q_d if present(x.c.q_d) else x.E.q", y.c.q: x.E.q}
"""
JOINTS = {
    "JOINTS": '{q: "vector[2, rad]"}',
    "BOSS": "{go: bool}",
    "GOAL": '{q_d: "vector[2, rad]"}',
    "AT": '{at: "vector[2, rad]"}',
    "REPORT": '{q: "vector[n, rad]"}',
    "COMMAND": '{q_d: "vector[n, rad]"}',
}


def put(folder: Path, text: str, ends: Mapping[str, str], part: str = "") -> str:
    for name, buffer in ends.items():
        text, part = text.replace(name, buffer), part.replace(name, buffer)
    folder.mkdir(exist_ok=True)
    (folder / "part.yaml").write_text(part)
    (folder / "demo.yaml").write_text(text)
    return str(folder / "demo.yaml")


@pytest.mark.parametrize(
    ("text", "part", "written", "same"),
    [
        (SYSTEM, "", WRITTEN, WRITTEN | SAME),
        (SYSTEM, "", WRITTEN, WRITTEN | SAME | {"ORDER": "Order", "SENT": "same"}),
        (GROUP, PART, JOINTS, dict.fromkeys(JOINTS, "same")),
    ],
)
def test_the_system_is_the_one_with_both_ends_written(
    text: str, part: str, written: Mapping[str, str], same: Mapping[str, str], tmp_path: Path
) -> None:
    one, other = (
        put(tmp_path / name, text, ends, part) for name, ends in (("a", written), ("b", same))
    )
    first, second = pipeline.build(one), pipeline.build(other)
    assert first.files
    assert second.result.diagnostics == first.result.diagnostics == ()
    assert second.files == first.files
    systems = [pipeline.read_spec(path).system for path in (one, other)]
    assert systems[0] and systems[1] and compare(systems[0], systems[1]).changes == ()


def found(path: str) -> list[str]:
    return [f"{d.code} {d.message}" for d in pipeline.check_spec(path).diagnostics]


@pytest.mark.parametrize(
    ("ends", "message"),
    [
        ({"COMMAND": "smae"}, "E0201 unknown interface `smae`"),
        ({"COMMAND": '"same[W]"'}, "E0237 `same` takes nothing in brackets"),
        ({"WIDTH": "{is: same, z: {init: 0}}"}, "E0201 unknown element `z`"),
        ({"WIDTH": "{w: {init: 0}}"}, "E0102 missing key `type` in `agents.a.control.x.hand.w`"),
        ({"WIDTH": '{is: same, w: "real[m]"}'}, "E0205 the other end has an element `w` already"),
        ({"WIDTH": '{is: same, w: {init: 1}}'}, "E0310 `1` is `int`; expected `real[m]`"),
        ({"SENT": "{}"}, "E0404 the other end has no elements, so `same` gives none"),
        ({"SENT": "same"}, "E0206 both ends are `same`: each has the elements of the other"),
    ],
)  # fmt: skip
def test_mistakes(ends: Mapping[str, str], message: str, tmp_path: Path) -> None:
    reported = found(put(tmp_path, SYSTEM, WRITTEN | SAME | ends))
    assert message in reported
    assert all(other.startswith("O0205 `y.a.") for other in reported if other != message)


def test_a_device_has_its_elements_itself(tmp_path: Path) -> None:
    text = SYSTEM.replace('y: {w: "real[m]"}', "y: same")
    assert found(put(tmp_path, text, WRITTEN | SAME)) == [
        "E0104 `same` is for the subsystem at the other end: a device has its elements here"
    ]


def test_an_interface_may_be_called_same(tmp_path: Path) -> None:
    text = SYSTEM.replace("Order", "same").replace("WIDTH", WRITTEN["WIDTH"])
    ends = {"ORDER": "same", "SENT": "same"}
    assert found(put(tmp_path, text, WRITTEN | ends)) == []


def test_a_description_alone_knows_no_other_end(tmp_path: Path) -> None:
    put(tmp_path, GROUP, JOINTS, PART.replace("REPORT", "same"))
    assert found(str(tmp_path / "part.yaml")) == []


# Devices that are passed on.


HOIST = """\
specc: 1.2
system: hoist
frames: {T: tip}
agents:
  hoist:
    for: {k: 1..2}
    real_effectors:
      lift:
        title: Lift
        x: {h_d: {type: "real[m]", safe: "0[m]"}}
        y: {h: {type: "real[m]", init: 0, title: height}}
      "wheel_{i}": {for: {i: 1..2}, x: {v_d: {type: "real[m/s]", safe: 0}}}
      door: {for: {i: 1..2}, x: {open: {type: bool, safe: False}}}
    real_receptors: {tip: {y: {F: "wrench[T]"}}}
    virtual_effectors: EFFECTORS
    virtual_receptors: RECEPTORS
    control:
      rate: 10 Hz
      x: INPUTS
      y: OUTPUTS
      through:
        y.lift.h_d: min(x.lift.h + 0.1[m], 2[m])
        y.wheel_1.v_d: "0.1[m/s]"
        y.wheel_2.v_d: "1[m/s] if present(x.tip.F) and x.tip.F.z > 1[N] else 0"
        y.door.open: True
"""
PASSED = {
    "EFFECTORS": """{lift: {title: Lift, rate: 50 Hz, through: identity},
      "wheel_{i}": {for: {i: 1..2}, rate: 20 ms, through: identity},
      door: {for: {i: 1..2}, rate: 50 Hz, through: identity}}""",
    "RECEPTORS": "{tip: {rate: 50 Hz, through: identity}}",
    "INPUTS": """{lift: {h: {type: "real[m]", init: 0, title: height}}, tip: {F: "wrench[T]"}}""",
    "OUTPUTS": """{lift: {h_d: "real[m]"}, "wheel_{i}": {for: {i: 1..2}, v_d: "real[m/s]"},
      door: {open: bool}}""",
}


def passed(text: str) -> str:
    for name in PASSED:
        text = text.replace(name, "{}")
    for old, new in (
        ("init: 0, title: height}}", "init: 0, title: height}}\n        through: 50 Hz"),
        ("safe: 0}}}", "safe: 0}}, through: 20 ms}"),
        ("safe: False}}}", "safe: False}}, through: 50 Hz}"),
        ('y: {F: "wrench[T]"}}', 'y: {F: "wrench[T]"}, through: 50 Hz}'),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    return text


@pytest.mark.parametrize("written", [(), ("INPUTS",), ("OUTPUTS",)])
def test_a_device_is_passed_on_in_one_line(written: tuple[str, ...], tmp_path: Path) -> None:
    text = HOIST
    for name in written:
        text = text.replace(name, PASSED[name])
    first = pipeline.build(put(tmp_path / "a", HOIST, PASSED))
    second = pipeline.build(put(tmp_path / "b", passed(text), {}))
    assert first.files
    assert second.result.diagnostics == first.result.diagnostics == ()
    assert {n: sorted(t.splitlines()) for n, t in second.files.items()} == {
        n: sorted(t.splitlines()) for n, t in first.files.items()
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("through: 50 Hz", "through: identity", "E0104 `identity` is not a rate"),
        ("virtual_effectors: {}", "virtual_effectors: {lift: {rate: 9 Hz}}",
         "E0205 `lift` is defined twice: `through` of the device makes one as well"),
        ("x.lift.h + 0", "x.lift.hh + 0", "E0201 input buffer `x.lift` has no `hh`"),
        (", init: 0, title", ", title", "E0701 `x.lift.h` may have no value in state `through`, "
         "where function `through` reads it"),
        ("y.door.open: True", "n: 1", "W0413 no behaviour of `hoist_1.c` writes `y.door_1.open`"),
    ],
)  # fmt: skip
def test_mistakes_about_devices_that_are_passed_on(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    text = passed(HOIST).replace(
        "rate: 10 Hz", "rate: 10 Hz\n      memory: {n: {type: int, init: 0}}"
    )
    reported = found(put(tmp_path, text.replace(old, new), {}))
    assert any(other.startswith(message) for other in reported)
