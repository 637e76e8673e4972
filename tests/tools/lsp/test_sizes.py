"""Parameters that stand for sizes: in the editor, and in a description that nobody uses."""

from pathlib import Path

from specc.pipeline import compile_spec
from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import apply
from tests.tools.lsp.workspace import edited, place

JOINTS = """\
specc: 1.2
parameters: {n: int, k: int, gain: "real[1/s]", v_max: "vector[n, rad/s]"}
operators: {S: {signature: "(v: vector[n, rad/s]) -> vector[n, rad/s]", python: "joints:step"}}
subsystem:
  rate: 10 Hz
  x: {c: {v_d: {type: "vector[n, rad/s]", init: 0 * v_max}}}
  y: {E: {v: "vector[n, rad/s]"}}
  functions: {move: {y.E.v: S(x.c.v_d)}}
  behaviours: {move: {functions: [move], terminal: never}}
  states: {S0: move}
  initial_state: S0
"""
SIZED = """\
specc: 1.2
parameters: {n: int}
subsystem: {x: {E: {p: "vector[n, rad]"}}}
"""
ARM = """\
specc: 1.2
parameters: {n: int, k: int, v: "vector[n, rad/s]", w: "vector[k, rad/s]"}
agent:
  real_effectors: {j: {x: {v: "vector[n, rad/s]"}, y: {p: "vector[n, rad]"}}}
  virtual_effectors: {j: USE}
"""
USER = """\
specc: 1.2
system: demo
agents:
  a:
    real_effectors: {j: {x: {v: "vector[2, rad/s]"}}}
    virtual_effectors:
      j: {use: joints.yaml, with: {n: 2, k: 1, gain: "1[1/s]", v_max: "[1[rad/s], 2[rad/s]]"}}
    control:
      rate: 10 Hz
      y: {j: {v_d: "vector[2, rad/s]"}}
      behaviours: {go: {functions: [{y.j.v_d: "[0, 1[rad/s]]"}], terminal: never}}
      states: {S0: go}
      initial_state: S0
"""


def opened(folder: Path) -> tuple[Project, str]:
    (folder / "user.yaml").write_text(USER)
    return edited(folder / "joints.yaml", JOINTS)


def test_a_size_in_a_type_is_the_parameter(tmp_path: Path) -> None:
    project, path = opened(tmp_path)
    for text in ('y: {E: {v: "vector[|n', 'signature: "(v: vector[|n'):
        (found,) = features.definition(project, path, place(JOINTS, text))
        assert (found.path, found.start) == (path, place(JOINTS, "parameters: {|n"))
        hover = features.hover(project, path, place(JOINTS, text))
        assert hover is not None
        assert "**parameter** `n: int`" in hover.text


def test_renaming_a_size_renames_it_in_types_signatures_and_users(tmp_path: Path) -> None:
    project, path = opened(tmp_path)
    for root in project.find_roots(path, search=True):
        project.analyse(root)
    edits = features.rename_at(project, path, place(JOINTS, 'y: {E: {v: "vector[|n'), "joints")
    own = apply(JOINTS, [e for e in edits if e.path == path])
    assert own == JOINTS.replace("vector[n,", "vector[joints,").replace("{n: int", "{joints: int")
    user = str(tmp_path / "user.yaml")
    theirs = apply(USER, [e for e in edits if e.path == user])
    assert theirs == USER.replace("{n: 2", "{joints: 2")


def test_proposes_parameters_that_may_be_sizes(tmp_path: Path) -> None:
    project, path = opened(tmp_path)
    offset = place(JOINTS, 'y: {E: {v: "vector[|n')
    labels = {c.label: c.kind for c in features.completions(project, path, offset)}
    assert {name for name, kind in labels.items() if kind == "parameter"} == {"n", "k"}


def test_sizes_that_nobody_has_given_differ_and_are_told_by_name(tmp_path: Path) -> None:
    path = tmp_path / "alone.yaml"
    path.write_text(JOINTS.replace('y: {E: {v: "vector[n', 'y: {E: {v: "vector[k'))
    (found,) = Project().analyse(str(path)).diagnostics
    assert found.message == "`S(x.c.v_d)` is `vector[n, rad/s]`; expected `vector[k, rad/s]`"
    path.write_text(JOINTS)
    assert Project().analyse(str(path)).diagnostics == ()


def test_a_size_that_nobody_has_given_equals_no_number(tmp_path: Path) -> None:
    path = tmp_path / "alone.yaml"
    for size in ("11", "12", "1000"):
        path.write_text(JOINTS.replace('y: {E: {v: "vector[n', f'y: {{E: {{v: "vector[{size}'))
        (found,) = Project().analyse(str(path)).diagnostics
        assert found.message.endswith(f"expected `vector[{size}, rad/s]`")
    zeros = ", ".join("0" * 11)
    path.write_text(JOINTS.replace("init: 0 * v_max", f'init: "[{zeros}]"'))
    (found,) = Project().analyse(str(path)).diagnostics
    assert found.message == "11 items; `vector[n, rad/s]` has n"


def test_arithmetic_with_sizes_that_nobody_has_given_is_believed(tmp_path: Path) -> None:
    (tmp_path / "joints.yaml").write_text(JOINTS)
    (tmp_path / "sized.yaml").write_text(SIZED)
    path = tmp_path / "arm.yaml"
    joints = '{{use: joints.yaml, with: {{n: {}, k: 1, gain: "1[1/s]", v_max: {}}}}}'
    for use, told in (
        ("{use: sized.yaml, with: {n: n - 12}}", set()),
        ("{use: sized.yaml, with: {n: 12 - n}}", set()),
        ("{use: sized.yaml, with: {n: 12 - 12}}", {"E0224"}),
        (joints.format("n", "v"), set()),
        (joints.format("n", "w"), {"E0310"}),
        (joints.format("n + 1", "w"), {"E0310"}),
    ):
        path.write_text(ARM.replace("USE", use))
        found = Project().analyse(str(path)).diagnostics
        assert {d.code for d in found if d.severity == "error"} == told, use


def test_a_description_may_be_used_for_its_definitions(tmp_path: Path) -> None:
    (tmp_path / "joints.yaml").write_text(JOINTS)
    path = tmp_path / "user.yaml"
    path.write_text(USER.replace("agents:", "use: [joints.yaml]\nagents:"))
    result = compile_spec(str(path))
    assert [d for d in result.diagnostics if d.severity == "error"] == []


def test_uses_of_one_description_with_several_sizes_have_operators_of_their_own(
    tmp_path: Path,
) -> None:
    (tmp_path / "joints.yaml").write_text(JOINTS)
    agents = USER[USER.index("  a:") :]
    others = (agents.replace("  a:", f"  {name}:", 1) for name in "bc")
    three = agents.replace("vector[2", "vector[3").replace("n: 2", "n: 3").replace("[1[", "[0, 1[")
    four = three.replace("vector[3", "vector[4").replace("n: 3", "n: 4").replace("[0,", "[0, 0,")
    more = [text.replace("  a:", f"  {name}:", 1) for name, text in (("d", three), ("e", four))]
    path = tmp_path / "user.yaml"
    path.write_text(USER + "".join((*others, *more)))
    system = compile_spec(str(path)).system
    assert system is not None
    assert [(o.name, str(o.result)) for o in system.operators] == [
        ("S@joints.yaml#n=2", "vector[2, rad/s]"),
        ("S@joints.yaml#n=3", "vector[3, rad/s]"),
        ("S@joints.yaml#n=4", "vector[4, rad/s]"),
    ]
