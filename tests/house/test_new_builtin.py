"""A function of the language, with its proofs, takes a row of a table and a line of its page."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.house.scratch import copied, in_copy

ROW = """\
    "trunc": exact(
        "a -> int: the whole number next to it on the way to zero",
        rules.unary_rule(
            "trunc(a)", "takes a number without unit", rules.integer_type, rules.unit_help
        ),
        value=math.trunc,
        python="math",
        is_foldable=True,
        range=_increasing(math.trunc),
        term=lambda of, a: of.choice(a < 0, -of.floor(-a), of.floor(a)),
        inverse=_from_whole,
    ),
"""
LINE = "| `trunc(a)` | `int`: the whole number next to it on the way to zero |\n"
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
    real_effectors: {m: {x: {u: int}, y: {d: real}}}
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {m: {d: {type: real, init: 0}}}
        y: {m: {u: int}}
        memory: {n: {type: int, init: trunc(-2.5)}}
        conditions:
          initial: {up: x.m.d >= 1, down: trunc(x.m.d) < 0}
          terminal: {far: trunc(x.m.d) != 0}
          error: {strange: trunc(x.m.d) > 0 and x.m.d < 1, late: "trunc(elapsed / 1[s]) > 1"}
        functions: {work: {y.m.u: trunc(x.m.d), n: n + trunc(x.m.d)}}
        behaviours:
          work: {functions: [work], terminal: far, error: strange}
          wait: {functions: [work], terminal: never, error: late}
        states: {S0: work, S1: wait}
        initial_state: S0
        transitions:
          - [S0, terminal, up, S0]
          - [S0, terminal, down, S1]
          - [S0, error, always, S0]
          - [S1, error, always, S0]
"""
TEST = """\
from pathlib import Path

import pytest
from specc_runtime.loading import load_system

from specc.pipeline import build
from specc.lang import Environment, ExprErrors, Scope, evaluate, expression


def test_expressions():
    expr = expression("trunc(-2.5)", Scope())
    assert (str(expr.type), evaluate(expr, Environment())) == ("int", -2)
    for wrong, code in (("trunc(1, 2)", "E0315"), ("trunc(1[m])", "E0315")):
        with pytest.raises(ExprErrors) as found:
            expression(wrong, Scope())
        assert [error.code for error in found.value.errors] == [code]


def test_proofs_and_generated_code():
    built = build("demo.yaml")
    found = [d.code for d in built.result.diagnostics]
    assert [code for code in found if code[0] == "E"] == []
    # Tables know no term of the function, but the solver does.
    (rows,) = (d.message for d in built.result.diagnostics if d.code == "W0606")
    assert "but the solver z3 does" in rows
    for name, text in built.files.items():
        Path("demo", name).parent.mkdir(exist_ok=True)
        Path("demo", name).write_text(text)
    _, scheduled = load_system(Path("demo"), "").subsystems
    machine = scheduled.subsystem
    machine.step()
    assert machine.memory.n == -2
"""
FILES = ("specc/lang/number_functions.py", "docs/language.md")
"""All that is touched; Python has the function."""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    names = ("specc", "runtime", "templates", "specs", "pyproject.toml", "docs", "tests")
    scratch = copied(tmp_path_factory.mktemp("copy"), *names)
    table, page = (scratch / name for name in FILES)
    before, row = "    m.FLOAT: BuiltinFunction(\n", "| `sqrt(a)` |"
    table.write_text(table.read_text("utf-8").replace(before, ROW + before), "utf-8")
    page.write_text(page.read_text("utf-8").replace(row, LINE + row), "utf-8")
    (scratch / "demo.yaml").write_text(SPEC, "utf-8")
    (scratch / "test_demo.py").write_text(TEST, "utf-8")
    return scratch


@pytest.mark.long
def test_a_row_and_a_line_are_all_there_is_to_write(copy: Path) -> None:
    tests = ["test_demo.py", "tests/docs/test_language.py::test_the_table_of_functions_is_complete"]
    tests += ["tests/lang/test_codes.py", "tests/house/test_functions.py"]
    done = in_copy(copy, "pytest", "-q", *tests)
    assert done.returncode == 0, done.stdout
