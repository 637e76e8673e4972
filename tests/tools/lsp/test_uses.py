"""What a name names is what resolving took it for, in texts with errors as well."""

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.rename import RenameError
from tests.tools.lsp.workspace import LIBRARY, SYSTEM, edited, opened, place

PAIR = """\
specc: 1.1
system: pair
agents:
  rovers:
    for: {i: 1..2}
    control:
      rate: 10 Hz
      y: {base: {n: int, done: bool}}
      functions: {tell: {y.base.n: "1", y.base.done: "True"}}
      behaviours: {tell: {functions: [tell], terminal: never}}
      states: {S0: {behaviour: tell, holds: [y.base.n]}}
      initial_state: S0
  base:
    control:
      rate: 10 Hz
      x: {rovers: {n: int, done: {type: bool, event: true}}}
      memory: {last: {type: int, init: 0}, seen: {type: bool, init: False}}
      functions:
        hear: {last: "x.rovers[1].n if present(x.rovers[1].n) else last", seen: heard}
      let: {heard: "any(present(r.n) and fresh(r.done) for r in x.rovers)"}
      behaviours: {hear: {functions: [hear], terminal: never}, rest: {terminal: never}}
      states: {S0: hear, S1: {behaviour: rest, ignores: [x.rovers_1.done]}}
      initial_state: S0
require:
  - {let: {low: base.c.last < 3}, that: always(low), because: a}
  - {let: {low: base.c.last < 4}, that: always(low or base.c.seen), because: b}
"""


@pytest.mark.parametrize(
    ("at", "definition"),
    [
        ("rovers[1].|n if", "x: {rovers: {|n: int"),
        ("present(r.|n)", "x: {rovers: {|n: int"),
        ("fresh(r.|done)", "|done: {type: bool, event"),
        ("x.rovers_1.|done", "|done: {type: bool, event"),
        ("holds: [y.base.|n", "y: {base: {|n: int"),
        ("that: always(|low),", "{|low: base.c.last < 3}"),
        ("that: always(|low or", "{|low: base.c.last < 4}"),
    ],
)
def test_a_name_leads_to_what_it_was_taken_for(at: str, definition: str, tmp_path: Path) -> None:
    project, path = edited(tmp_path / "pair.yaml", PAIR)
    found = features.definition(project, path, place(PAIR, at))
    assert place(PAIR, definition) in [stretch.start for stretch in found]


@pytest.mark.parametrize(
    ("old", "new", "at", "definition"),
    [
        # An expression with an error, a declaration with one, a target that is not there.
        ("near(q_p, x.E.q_m", "near(q_p, x.E.q_x", "near(|q_p", "|q_p: {type: Joints"),
        ("q_p: {type: Joints", "q_p: {type: Joint", "near(|q_p", "|q_p: {type: Joint,"),
        ("move: {y.E.q_d", "move: {y.E.q_x", "y.E.q_x: x.c.|q_d", "c: {|q_d: {type"),
    ],
)
def test_an_error_leaves_names_known(
    old: str, new: str, at: str, definition: str, tmp_path: Path
) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace(old, new)
    project.put(system, text)
    project.analyse(system)
    found = features.definition(project, system, place(text, at))
    assert place(text, definition) in [stretch.start for stretch in found]


def test_a_description_that_its_user_misuses_is_known_by_itself(tmp_path: Path) -> None:
    project, system, library = opened(tmp_path)
    project.put(system, SYSTEM.replace('with: {tolerance: "0.001[m]"}', "with: {}"))
    project.put(library, LIBRARY)
    project.analyse(system)
    (found,) = features.definition(project, library, place(LIBRARY, "[S0, terminal, |moved"))
    assert (found.path, found.start) == (library, place(LIBRARY, "{|moved: "))


def test_a_text_that_was_not_read_keeps_a_name_from_changing(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace("grip: {type: Grip,", "grip: {type: Grips,")
    project.put(system, text)
    project.analyse(system)
    with pytest.raises(RenameError, match="first correct the expression"):
        features.rename_at(project, system, place(text, "|GR: {signature"), "GRIP")


PASSES_ON = """\
specc: 1.2
system: demo
agents:
  a:
    real_effectors:
      lift: {x: {h_d: {type: "real[m]", safe: {is: t, otherwise: "0[m]"}}}, y: {t: "real[m]"}}
    virtual_effectors:
      lift: {rate: 50 Hz, through: identity}
    control:
      rate: 10 Hz
      x: {lift: {t: {type: "real[m]", init: 0}}}
      y: {lift: {h_d: "real[m]"}}
      functions: {go: {y.lift.h_d: "x.lift.t + 1[m]"}}
      behaviours: {work: {functions: [go], terminal: never}}
      states: {S0: work}
      initial_state: S0
"""


def test_targets_that_through_writes_are_no_names_in_the_file(tmp_path: Path) -> None:
    project, path = edited(tmp_path / "demo.yaml", PASSES_ON)
    at = place(PASSES_ON, 'y: {|t: "real')
    found = {PASSES_ON[s.start : s.end] for s in features.references(project, path, at)}
    assert found == {"t"}
