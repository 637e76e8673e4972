"""Operators and files of described files that are called like others mean what their file says."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import build, compile_spec
from specc.testing import Stepped

CONTROL = """\
control:
      rate: 10 Hz
      %s
      memory: {n: {type: int, init: 0}, letters: {type: int, init: 0}}
      functions: {f: {n: F(3), letters: L(m)}, tell: {y.own.n: F(3)}}
      behaviours: {w: {functions: [%s], terminal: never}}
      states: {S0: w}
      initial_state: S0
"""
TELLS = CONTROL % ("y: {own: {n: int}}", "f, tell")
HEARS = CONTROL % ("x: {a: {n: int}, b: {n: int}, same: {n: int}}", "f")
HEARS = HEARS.replace(", tell: {y.own.n: F(3)}", "")
NAMES = """\
specc: 1
files: {m: a.txt}
operators:
  F: {signature: "(n: int) -> int", python: "operator:%s"}
  L: {signature: "(p: file) -> int", python: "os.path:getsize"}
"""
FILES = {
    "a.txt": "three",
    "same.yaml": f"{NAMES % 'pos'}agent:\n    {TELLS}",
    "lib/a.txt": "letters",
    "lib/desc.yaml": f"{NAMES % 'neg'}agent:\n    {TELLS}",
    "other/a.txt": "2",
    "other/desc.yaml": f"{NAMES % 'invert'}agent:\n    {TELLS}",
    "spec.yaml": f"""{NAMES % "pos"}
system: top
agents:
  a: {{use: lib/desc.yaml}}
  b: {{use: other/desc.yaml}}
  same: {{use: same.yaml}}
  own:
    {HEARS}""",
}
MEANT = {"a": (-3, 7), "b": (-4, 1), "same": (3, 5), "own": (3, 5)}


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return tmp_path / "spec.yaml"


@pytest.mark.parametrize("agent", MEANT)
def test_each_file_means_its_own(agent: str, spec: Path) -> None:
    subsystem = Stepped(spec, f"{agent}.c")
    subsystem.step()
    assert (subsystem["n"], subsystem["letters"]) == MEANT[agent]


def test_what_is_equal_has_one_name(spec: Path) -> None:
    system = compile_spec(str(spec)).system
    assert system is not None
    names = sorted(operator.name for operator in system.operators)
    assert names == ["F", "F@lib/desc.yaml", "F@other/desc.yaml", "L"]
    assert dict(system.files) == {
        "m": "a.txt",
        "m@lib/desc.yaml": "lib/a.txt",
        "m@other/desc.yaml": "other/a.txt",
    }


def test_messages_say_what_is_written(spec: Path) -> None:
    (code,) = (text for name, text in build(str(spec)).files.items() if name.endswith("a_c.py"))
    assert 'operator("F", neg, ' in code
