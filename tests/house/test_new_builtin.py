"""A function of the language takes a row of one table, and a line of the documentation."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.house.scratch import copied, in_copy

ROW = """\
    "hypot": BuiltinFunction(
        "a, b -> number: length of the diagonal of a rectangle",
        rules.of_numbers("a, b", 2, 2, is_real=True),
        math.hypot,
        python="math",
        shows=True,
        not_negative=True,
    ),
"""
LINE = "| `hypot(a, b)` | length of the diagonal of a rectangle |\n"
SPEC = """\
specc: 1
system: demo
agents:
  a:
    control:
      rate: 10 Hz
      behaviours: {idle: {terminal: never}}
      states: {S0: idle}
      initial_state: S0
    real_effectors: {m: {x: {u: "real[m]"}}}
    virtual_effectors:
      m:
        rate: 10 Hz
        y: {m: {u: "real[m]"}}
        memory:
          p: {type: "real[m]", init: "hypot(3[m], 4[m])"}
          far: {type: "real[m]", init: "1e299[m]"}
        let: {sum: "hypot(p, far)"}
        conditions: {terminal: {negative: "hypot(p, 1[m]) < 0[m]"}}
        functions: {work: {y.m.u: "hypot(p, 12[m])", p: "hypot(p, 12[m])", far: sum}}
        behaviours: {work: {functions: [work], terminal: negative}}
        states: {S0: work}
        initial_state: S0
        transitions: [[S0, terminal, always, S0]]
"""
TEST = """\
import math
from pathlib import Path

import pytest
from specc_runtime.loading import load_system

from specc.pipeline import build
from specc.lang import Environment, ExprErrors, Scope, evaluate, expression


def test_expressions():
    expr = expression("hypot(3[m], 4[m])", Scope())
    assert (str(expr.type), evaluate(expr, Environment())) == ("real[m]", 5.0)
    for wrong, code in (("hypot(1[m])", "E0314"), ("hypot(1[m], 1[s])", "E0311")):
        with pytest.raises(ExprErrors) as found:
            expression(wrong, Scope())
        assert [error.code for error in found.value.errors] == [code]


def test_generated_code():
    built = build("demo.yaml")
    assert [d.code for d in built.result.diagnostics if d.code[0] == "E"] == []
    # It is never negative, so that proofs find the error impossible.
    assert "W0613" in [d.code for d in built.result.diagnostics]
    for name, text in built.files.items():
        Path("demo", name).parent.mkdir(exist_ok=True)
        Path("demo", name).write_text(text)
    _, scheduled = load_system(Path("demo"), "").subsystems
    machine = scheduled.subsystem
    machine.step()
    assert (machine.memory.p, machine.memory.far) == (13.0, 1e299)
    machine.memory.far = machine.memory.p = 1.7e308
    with pytest.raises(OverflowError, match="not finite"):
        machine.step()
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    names = ("specc", "runtime", "templates", "specs", "pyproject.toml", "docs", "tests")
    scratch = copied(tmp_path_factory.mktemp("copy"), *names)
    table, page = scratch / "specc/lang/builtins.py", scratch / "docs/language.md"
    before, row = '    "float": BuiltinFunction(\n', "| `sqrt(a)` |"
    table.write_text(table.read_text("utf-8").replace(before, ROW + before), "utf-8")
    page.write_text(page.read_text("utf-8").replace(row, LINE + row), "utf-8")
    (scratch / "demo.yaml").write_text(SPEC, "utf-8")
    (scratch / "test_demo.py").write_text(TEST, "utf-8")
    return scratch


@pytest.mark.long
def test_a_row_and_a_line_are_all_there_is_to_write(copy: Path) -> None:
    tests = ["test_demo.py", "tests/docs/test_language.py::test_the_table_of_functions_is_complete"]
    done = in_copy(copy, "pytest", "-q", *tests, "tests/lang/test_codes.py")
    assert done.returncode == 0, done.stdout
