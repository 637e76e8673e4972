"""Operators, files and types called like those of another file mean what their own file says."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.cli.main import main
from specc.pipeline import build, compile_spec
from specc.testing import Stepped

CONTROL = """\
control:
      rate: 10 Hz
      %s
      memory: {n: {type: int, init: 0}, letters: {type: int, init: 0}, mode: {type: M, init: off}}
      functions: {f: {n: F(3), letters: L(m), mode: mode}, tell: {y.own.n: F(3)}}
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
types: {M: "enum[off, %(is)s]"}
operators:
  F: {signature: "(n: int) -> int", python: "operator:%(is)s"}
  L: {signature: "(p: file) -> int", python: "os.path:getsize"}
"""


def names(function: str) -> str:
    """The definitions of a file, with an operator of this function."""
    return NAMES % {"is": function}


FILES = {
    "a.txt": "three",
    "same.yaml": f"{NAMES % {'is': 'pos'}}agent:\n    {TELLS}",
    "lib/a.txt": "letters",
    "lib/desc.yaml": f"{NAMES % {'is': 'neg'}}agent:\n    {TELLS}",
    "other/a.txt": "2",
    "other/desc.yaml": f"{NAMES % {'is': 'invert'}}agent:\n    {TELLS}",
    "spec.yaml": f"""{names("pos")}
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


def test_types_are_kept_apart(spec: Path) -> None:
    (types,) = (text for name, text in build(str(spec)).files.items() if name.endswith("types.py"))
    named = [line for line in types.splitlines() if line.startswith("M")]
    assert named == [
        'M = Literal["off", "neg"]',
        'M_2 = Literal["off", "invert"]',
        'M_3 = Literal["off", "pos"]',
    ]


def test_messages_say_what_is_written(spec: Path) -> None:
    (code,) = (text for name, text in build(str(spec)).files.items() if name.endswith("a_c.py"))
    assert 'operator("F", neg, ' in code


RECORD = """\
specc: 1
types: {Sample: {fields: {q: "real[m]", p: %s}, python: "recs:S"}}
agent:
  control:
    rate: 10 Hz
    behaviours: {w: {functions: [], terminal: never}}
    states: {S0: w}
    initial_state: S0
  real_receptors: {k: {y: {d: Sample}}}
  virtual_receptors:
    k:
      rate: 10 Hz
      x: {R: {d: Sample}}
      memory: {q: {type: "real[m]", init: "0[m]"}}
      functions: {f: {q: x.R.d.q}}
      behaviours: {w: {functions: [f], terminal: never}}
      states: {S0: w}
      initial_state: S0
"""
TWO = """\
specc: 1
system: two
plant: {python: "world:World", bind: {a.R.k.d: {}, b.R.k.d: {}}}
agents: {a: {use: a.yaml}, b: {use: b.yaml}}
"""


def test_records_of_one_class_are_checked_by_their_own_fields(tmp_path: Path) -> None:
    for name, text in {"a": RECORD % '"real[m]"', "b": RECORD % "int", "two": TWO}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    code = "\n".join(build(str(tmp_path / "two.yaml")).files.values())
    assert "q=as_real, p=as_real)" in code
    assert "q=as_real, p=as_int)" in code


CLOUD = """\
{fields: {q: "real[m]", p: Cloud}, python: "recs:S"}
  Cloud: {opaque: true, python: "recs:C", codec: {encode: "%(of)s:to", decode: "%(of)s:back"}}
"""


def test_records_of_one_class_enter_recordings_by_their_own_codecs(tmp_path: Path) -> None:
    head = 'types: {Sample: {fields: {q: "real[m]", p: %s}, python: "recs:S"}}\n'
    for name in "ab":
        own = RECORD.replace(head, f"types:\n  Sample: {CLOUD % {'of': f'codec_{name}'}}")
        (tmp_path / f"{name}.yaml").write_text(own)
    (tmp_path / "two.yaml").write_text(TWO)
    files = build(str(tmp_path / "two.yaml")).files
    (layouts,) = (text for name, text in files.items() if name.endswith("layouts.py"))
    assert layouts.count("forms.record(") == 2
    assert layouts.count("SAMPLE_2") == 2


ENDS = """\
specc: 1
types: {M: %s}
agent:
  control:
    rate: 10 Hz
    %s: {%s: {v: M}}
    behaviours: {w: {functions: [], terminal: never}}
    states: {S0: w}
    initial_state: S0
"""
APART = {
    "members": ('"enum[off, on]"', '"enum[off, out]"', "M = enum[off, on]", "M = enum[off, out]"),
    "names": ("{fields: {q: int}}", "{fields: {p: int}}", "M {q}", "M {p}"),
    "fields": ("{fields: {q: int}}", "{fields: {q: bool}}", "M with q: int", "M with q: bool"),
}


@pytest.mark.parametrize("differ", APART)
def test_types_of_one_name_are_told_apart(differ: str, tmp_path: Path) -> None:
    one, other, *told = APART[differ]
    (tmp_path / "a.yaml").write_text(ENDS % (one, "y", "b"))
    (tmp_path / "b.yaml").write_text(ENDS % (other, "x", "a"))
    top = tmp_path / "top.yaml"
    top.write_text("specc: 1\nsystem: top\nagents: {a: {use: a.yaml}, b: {use: b.yaml}}\n")
    (found,) = (d for d in compile_spec(str(top)).diagnostics if d.code == "E0405")
    ends = sorted(found.message.split("`")[3::2])
    assert ends == sorted(told)


def test_a_difference_says_whose_operator_it_is(
    spec: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    new = tmp_path / "new"
    for name, text in FILES.items():
        path = new / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace("operator:neg", "operator:abs"))
    main(["diff", str(spec), str(new / "spec.yaml")])
    assert "operator F of lib/desc.yaml" in capsys.readouterr().out
