"""Whatever fails leaves one record: who is to blame, where it was, what it was computing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.runtime.hinge import SPEC, hinge, run

KEYS = {
    "fault", "culprit", "subsystem", "state", "stamp", "time_s", "message", "row", "condition",
    "equations", "inputs", "place", "line",
}  # fmt: skip
NO = "raise ValueError('no')"
UNSAID = """class Unsaid(Exception):
    def __str__(self):
        raise RuntimeError('not even that')
class Base(BaseException):
    pass
"""


def fault_of(tmp_path: Path, *arguments: str, head: str = "", **parts: str) -> dict[str, Any]:
    """The only fault of a run with these parts."""
    package = hinge(tmp_path, head, **parts)
    report = run(package, "--duration", "0.3", *arguments)
    (fault,) = report["faults"]
    assert set(fault) >= KEYS
    return dict(fault)


def test_operator_in_a_function(tmp_path: Path) -> None:
    fault = fault_of(tmp_path, drive=f"def drive(e):\n    if e > 0.5: {NO}\n    return 0.1 * e")
    assert fault["culprit"] == "operator drive (hinge_parts:drive)"
    assert (fault["subsystem"], fault["state"]) == ("arm.j", "S0")
    assert fault["stamp"] > 1 and fault["time_s"] == pytest.approx(fault["stamp"] / 100)
    assert fault["message"] == "ValueError: no"
    assert fault["equations"] == [1]
    assert fault["inputs"].keys() >= {"c_q_d", "E_q"} and fault["inputs"]["c_q_d"] == "1.0"
    assert fault["place"] == "drive (hinge_parts.py:6)"
    assert "drive(" in fault["line"]


def test_operator_in_a_row(tmp_path: Path) -> None:
    fault = fault_of(tmp_path, high=f"def high(q):\n    {NO}")
    assert fault["culprit"] == "operator high (hinge_parts:high)"
    assert (fault["condition"], fault["equations"]) == ("is_high", [3])
    assert fault["row"] == "S0 terminal is_high -> S0"


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("raise StopIteration", "RuntimeError: operator high raised StopIteration"),
        ("raise ValueError('no')", "ValueError: no"),
        ("return 1", "operator high gave the int 1"),
    ],
)
def test_operator_in_a_quantifier(tmp_path: Path, body: str, said: str) -> None:
    spec = SPEC.replace("high(x.E.q)", "any(high(a) for a in l)")
    spec = spec.replace('parts:high"', 'parts:high", eq: 8')
    spec = spec.replace(
        "  let:", '  memory: {l: {type: "list[real[rad]]", init: "[1[rad]]"}}\n        let:'
    )
    fault = fault_of(tmp_path, spec=spec, high=f"def high(q):\n    {body}")
    assert fault["culprit"].startswith("operator high")
    assert said in fault["message"]
    assert fault["equations"] == [3, 8]


def test_operator_of_a_constant(tmp_path: Path) -> None:
    fault = fault_of(tmp_path, gain=f"def gain():\n    {NO}")
    assert fault["culprit"] == "operator gain (hinge_parts:gain)"
    assert fault["message"] == "ValueError: no"


@pytest.mark.parametrize(
    ("raised", "message"),
    [
        ("SystemExit(3)", "SystemExit: 3"),
        ("KeyboardInterrupt()", "KeyboardInterrupt"),
        ("Base('odd')", "Base: odd"),
        ("Unsaid()", "Unsaid, whose message raises RuntimeError"),
        ("RuntimeError('\\x1b[31m\\udc80')", "RuntimeError: \x1b[31m\udc80"),
    ],
)
def test_whatever_an_operator_raises(tmp_path: Path, raised: str, message: str) -> None:
    fault = fault_of(tmp_path, head=UNSAID, drive=f"def drive(e):\n    raise {raised}")
    assert fault["message"] == message
    assert fault["culprit"] == "operator drive (hinge_parts:drive)"


def test_through_of_a_sensor(tmp_path: Path) -> None:
    fault = fault_of(
        tmp_path, angle=f"def angle(raw):\n    if raw[0] > 1e-4: {NO}\n    return float(raw[0])"
    )
    assert fault["fault"] == "DeviceFailed"
    assert fault["culprit"] == "device arm.E.j.q, through hinge_parts:angle"
    assert fault["subsystem"] == "arm.j" and fault["stamp"] > 0
    assert fault["inputs"]["raw"].startswith("array([")


@pytest.mark.parametrize("body", [NO, "return float('nan')", "return [1.0, 2.0]", "return 'abc'"])
def test_through_of_an_actuator(tmp_path: Path, body: str) -> None:
    fault = fault_of(tmp_path, torque=f"def torque(command, raw):\n    {body}")
    assert fault["culprit"] == "device arm.E.j.tau, through hinge_parts:torque"
    assert (fault["subsystem"], fault["state"], fault["stamp"]) == ("arm.j", "S0", 0)
    assert fault["equations"] == [1]
    assert fault["line"].startswith("y.E_tau = ")
    assert set(fault["inputs"]) == {"command", "raw"}


def test_plant_that_diverges(tmp_path: Path) -> None:
    fault = fault_of(tmp_path, drive="def drive(e):\n    return 1e9 * e")
    assert fault["fault"] == "PlantFailed"
    assert fault["culprit"] == "plant joint 'hinge'"
    assert "diverged" in fault["message"] and "joint 'hinge'" in fault["message"]
    assert (fault["subsystem"], fault["equations"]) == ("arm.j", [1])
    assert fault["inputs"].keys() == {"command"}


@pytest.mark.parametrize("place", [f"    def place(self, plant, rng):\n        {NO}"])
def test_scene(tmp_path: Path, place: str) -> None:
    fault = fault_of(tmp_path, place=place)
    assert (fault["fault"], fault["culprit"]) == ("SceneFailed", "scene hinge_parts:Scene")
    assert fault["message"] == "ValueError: no"


@pytest.mark.parametrize(
    ("part", "text", "message"),
    [
        ("observe", f"    def observe(self):\n        {NO}", "ValueError: no"),
        ("end_cycle", f"    def end_cycle(self):\n        {NO}", "ValueError: no"),
        ("end_cycle", "    def end_cycle(self):\n        return {}", "KeyError: 'good'"),
        ("end_cycle", "    def end_cycle(self):\n        return 5", "TypeError: "),
    ],
)
def test_judge(tmp_path: Path, part: str, text: str, message: str) -> None:
    fault = fault_of(tmp_path, **{part: text})
    assert (fault["fault"], fault["culprit"]) == ("JudgeFailed", "judge hinge_parts:Judge")
    assert fault["message"].startswith(message)


def test_what_a_judge_says_is_written_whatever_it_is(tmp_path: Path) -> None:
    head = "class Odd:\n    def __repr__(self):\n        raise ValueError('no')"
    text = "    def end_cycle(self):\n        return {'good': True, 'odd': Odd(), 'set': {1}}"
    report = run(hinge(tmp_path, head, end_cycle=text), "--cycles", "1", code=0)
    (cycle,) = report["cycles"]
    assert cycle["odd"] == "<Odd, whose repr raises ValueError>"
    assert cycle["set"] == "{1}"
