"""Subsystems that tests step by hand."""

from pathlib import Path

import pytest
from specc_runtime.faults import AxiomViolated

from specc.testing import Stepped
from tests.recording.runs import CONVEYOR, ROOT
from tests.recording.test_past import LANES
from tests.runtime.test_ages import text_of

STILL = {"x.belt.v": 0, "x.barrier.a": 0.0, "x.eye.parcel": False}


@pytest.fixture
def gate() -> Stepped:
    """The gate after its first period."""
    stepped = Stepped(CONVEYOR, "gate.c")
    assert stepped.step(STILL) == "" and stepped.state == "closed"
    return stepped


def test_a_way_through_the_states(gate: Stepped) -> None:
    assert gate["y.belt.go"] == gate.value("cruise")
    assert gate.step({"x.belt.v": "0.5[rad/s]", "x.eye.parcel": "True"}) == gate.row
    assert gate.row == "closed terminal always -> halting"
    assert gate.sent == {"y.belt.hold": gate.value("2 * patience"), "y.barrier.a_d": 0.0}
    assert gate.step() == ""
    assert gate.step({"x.belt.v": "1[deg/s]"}) == "halting terminal always -> opening"
    assert [gate.step() for _ in range(61)][-1] == "opening error always -> closing"


def test_states_and_memory_can_be_put_in_place(gate: Stepped) -> None:
    gate.place("passing", periods=60)
    assert gate.step() == "passing terminal always -> closing"
    drive = Stepped(CONVEYOR, "belt.drive", {"ramp": "2[rad/s**2]"})
    drive.step({"x.E.v_m": 0, "x.c.v_d": "1[rad/s]"})
    assert drive["v_p"] == pytest.approx(0.02)
    drive.place(memory={"v_p": "0.9[rad/s]"})
    drive.step()
    assert drive["y.E.v_s"] == pytest.approx(0.92)


def test_vectors_are_arrays_and_broken_assumptions_faults() -> None:
    arm = Stepped(ROOT / "specs" / "irp_picking.yaml", "irp.m")
    inputs = {"x.E.m_m": "[0, 0, 0, 0, 0, 0]", "x.E.F_m": "[0, 0, 10[N], 0, 0, 0]"}
    arm.step(inputs)
    assert arm["m_d"].tolist() == [0.0] * 6
    pose = {"x.c.T_d": "identity()", "x.c.b": "[u, u, u, u, u, s]"}
    with pytest.raises(AxiomViolated):
        arm.step(pose)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"x.eye.parcl": True}, "no element 'x.eye.parcl'; did you mean"),
        ({"x.belt.v": "1[m]"}, "expected `real"),
        ({"x.belt.v": "1["}, "'1['"),
        ({"x.belt.v": "cruise * (cruise / (cruise - cruise))"}, "has no value here"),
    ],
)
def test_wrong_inputs_are_told(gate: Stepped, values: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError) as raised:
        gate.step(values)
    assert words in str(raised.value)


def test_wrong_names_and_specifications_are_told(gate: Stepped, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"no subsystem 'gate\.x'; did you mean gate\.c"):
        Stepped(CONVEYOR, "gate.x")
    with pytest.raises(ValueError, match="no state 'open'"):
        gate.place("open")
    with pytest.raises(ValueError, match=r"y\.belt\.hold has no value yet"):
        _ = gate["y.belt.hold"]
    (tmp_path / "x.yaml").write_text("specc: 1\nsystem: x\nagents: {a: {}}\nfoo: 1\n")
    with pytest.raises(ValueError, match="has errors"):
        Stepped(tmp_path / "x.yaml", "a.c")


def test_lets_and_memory_of_many_have_the_value_of_their_index() -> None:
    many = ROOT / "tests/cases/structure/ok-lets-and-memory-of-many.yaml"
    counter = Stepped(many, "counter.c")
    for total in (66, 69):  # the sum of 10 i + i for i from 1 to 3, and one more for each
        counter.step()
        assert counter["y.listener.n"] == total
    assert [counter[f"k_{i}"] for i in (1, 2, 3)] == [12, 22, 32]


def test_there_is_no_state_before_memory_has_values() -> None:
    rover = Stepped(ROOT / "specs/rovers.yaml", "rovers_1.c")
    with pytest.raises(ValueError, match="has no value before the first"):
        rover.place("going")


def test_what_is_made_of_memory_once_follows_memory_that_is_put_in_place(tmp_path: Path) -> None:
    spec = tmp_path / "lanes.yaml"
    spec.write_text(LANES, encoding="utf-8")
    lane = Stepped(spec, "a.c")
    lane.step()
    lane.place("B")
    for memory, expected in (({}, [0, 2]), ({"aside": "5[m]"}, [0, 5])):
        lane.place(memory=memory)
        lane.step()
        assert list(lane["y.b.v"]) == expected


def test_ages_are_given_like_inputs(tmp_path: Path) -> None:
    (tmp_path / "watched.yaml").write_text(text_of())
    arm = Stepped(tmp_path / "watched.yaml", "arm.c")
    arm.step({"x.cam.d": 1.0})
    assert (arm["age"], arm["late"]) == (0.0, 0)
    assert not arm.step(there={"age(x.cam.d)": "95[ms]", "late(x.cam.d)": 2})
    assert (arm["age"], arm["late"]) == (0.095, 2)
    assert arm.step(there={"late(x.cam.d)": 0}) == "S0 terminal always -> S0"
    with pytest.raises(ValueError, match="there is no element 'age"):
        arm.step(there={"age(x.cam.e)": 0.1})
