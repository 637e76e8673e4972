"""Every name that generated code has of its own can stand in every place where a specification
names something: it works, or `validate` refuses it because it is a word of the language."""

from __future__ import annotations

import ast
import builtins
import keyword
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from inspect import signature
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.faults import UndecidedTransition
from specc_runtime.forms import Layout
from specc_runtime.temporal import UNKNOWN

from specc import pipeline
from specc.diagnostics import blocks
from specc.emit import fill_templates
from specc.lang import RESERVED, TYPE_WORDS
from specc.lang.syntax import USAGE
from specc.lower import lower
from tests.emit import measures
from tests.seeds import SOAK, every
from tests.soundness.running import package

ROOT = Path(__file__).resolve().parents[2]
WORD = re.compile(r"[A-Za-z_]\w*")
SPEC = """\
specc: 1.1
system: probe
frames: {B: base<frames>}
types:
  p_Mode: enum[p_on, p_off<members>]
  p_Item: {python: "tests.emit.measures:Item", fields: {p_width: "real[m]"<fields>}}
<types>
constants:
  p_half: "0.5[m]"
  p_read: p_load(p_data)
<constants>
files: {p_data: measures.py<files>}
operators:
  p_load: {signature: "(path: file) -> real[m]", python: "tests.emit.measures:length"}
  p_make: {signature: "(width: real[m]<parameters>) -> p_Item", python: "tests.emit.measures:item"}
  p_same: {signature: "(width: real[m]) -> real[m]", python: "tests.emit.measures:same"}
<operators>
agents:
  p_robot:
    real_effectors:
      e: {x: {q_d: "real[m]"}, y: {q_m: {type: "real[m]", init: p_half}<reported>}}
<devices>
    virtual_effectors:
      e:
        rate: 10 Hz
        x: {c: {p_go: {type: "real[m]", init: p_half}<inputs>}, E: {q_m: "real[m]"<samples>}}
        y: {E: {q_d: "real[m]"}}
        memory:
          p_kept: {type: "real[m]", init: p_half}
          p_parts: {type: "vector[2]", init: "[0, 1]"}
          p_mode: {type: p_Mode, init: p_on}
<memory>
        let:
          p_double: x.c.p_go + p_kept + p_same(p_read)
          p_small: "all(p_part < 2 for p_part in p_parts)"
          p_item: p_make(p_half<given>)
<lets>
        conditions:
          initial: {p_first: "p_kept > 1[m]", p_last: "p_kept < 2[m]"<initial>}
          terminal: {p_done: p_small<terminal>}
          error: {p_bad: "p_item.p_width > 9[m]"<error>}
        functions:
          p_move: {y.E.q_d: "p_double", p_kept: p_double}
<functions>
        behaviours:
          p_moving: {functions: [p_move<called>], terminal: p_done, error: p_bad}
<behaviours>
        states: {p_S0: p_moving<states>}
        initial_state: p_S0
        transitions:
          - [p_S0, terminal, p_first, p_S0]
          - [p_S0, terminal, p_last, p_S0]
          - [p_S0, error, always, p_S0]
<rows>
    control:
      rate: 10 Hz
      y: {e: {p_go: "real[m]"<outputs>}}
      functions: {send: {y.e.p_go: p_half<sent>}}
      behaviours: {send: {functions: [send], terminal: never}}
      states: {S0: send}
      initial_state: S0
<agents>
plant:
  model: plant.xml
  observe:
    p_seen: {type: "real[m]", joints: [p_slide], through: "tests.emit.measures:same"}
<observed>
  bind: {p_robot.E.e.q_d: {actuators: [p_drive]}, p_robot.E.e.q_m: {joints: [p_slide]}}
task:
  cycle: {of: p_robot.e, from: p_S0, to: p_S0}
  scene: {p_slide: "0.1[m]"}
  disturb:
    - {at: "1[s]", when: "plant.p_seen > p_same(p_half)", move: {p_slide: "0[m]"}, because: e}
require:
  - {that: "always(p_same(p_robot.e.p_kept) <= p_half and p_robot.e.p_mode == p_on)", because: a}
  - {that: "within(1[s], throughout(1[s], not plant.p_seen > p_half))", because: b}
  - {that: "once(1[s], plant.p_seen > 0) or historically(1[s], plant.p_seen < p_read)", because: c}
  - {that: "since(plant.p_seen > 0, p_robot.e.p_kept >= p_half)", because: d}
<required>
"""
PLANT = """\
<mujoco>
  <worldbody><body><joint name="p_slide" type="slide"/><geom size="0.1"/></body></worldbody>
  <actuator><position name="p_drive" joint="p_slide"/></actuator>
</mujoco>
"""


def identifiers() -> Iterator[str]:
    """Whatever lowering and the templates write into generated code, and words of Python."""
    for path in (ROOT / "templates").glob("*.j2"):
        yield from WORD.findall(path.read_text())
    for path in (ROOT / "specc" / "lower").glob("*.py"):
        tree = ast.parse(path.read_text())
        said = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield from WORD.findall(node.value) if id(node) not in said else ()
    yield from (*keyword.kwlist, *keyword.softkwlist, *dir(builtins), "__slots__", "__class__")
    yield from ("os", "sys", "typing", "numpy", "specc_runtime", "state", "step", "violated")


def batched(names: list[str], size: int) -> Iterator[tuple[str, ...]]:
    """Slices of that many names."""
    return (tuple(names[i : i + size]) for i in range(0, len(names), size))


@cache
def every_name() -> list[str]:
    """Names of generated code, and what they are in small letters."""
    written = set(identifiers())
    return sorted(written.union(map(str.lower, written)) - {"B"})


Slots = dict[str, str]


def lines(indent: int, form: str, names: list[str]) -> str:
    """A line for every name."""
    return "\n".join(" " * indent + form.replace("#", n) for n in names)


def listed(form: str, names: list[str]) -> str:
    """An item behind a comma for every name."""
    return "".join(", " + form.replace("#", n) for n in names)


def typed(definition: str) -> Callable[[list[str]], Slots]:
    return lambda names: {
        "types": lines(2, f'"#": {definition}', names),
        "memory": "\n".join(
            f'          p_m{i}: {{type: "optional[{name}]", init: None}}'
            for i, name in enumerate(names)
        ),
        "required": required([f"p_robot.e.p_m{i} is None" for i in range(len(names))]),
    }


FORMULAS = ("always", "historically", "once", "present", "since", "state", "throughout", "within")
"""Words that mean in requirements what no operator means."""


def required(conditions: list[str]) -> str:
    """Requirements that all hold, some in each."""
    said = [" and ".join(some) for some in batched(conditions, 40)]
    return lines(2, '- {that: "#", because: a name is used}', said)


def used(names: list[str], form: str = "#") -> Slots:
    """Functions that add all of them up, some at a time."""
    sums = [
        " + ".join(form.replace("#", name) for name in names[i : i + 40])
        for i in range(0, len(names), 40)
    ]
    numbers = list(map(str, range(len(sums))))
    return {
        "memory": lines(10, 'p_k#: {type: "real[m]", init: p_half}', numbers),
        "functions": "\n".join(
            f'          p_u{n}: {{p_k{n}: "{s}"}}' for n, s in zip(numbers, sums, strict=True)
        ),
        "called": listed("p_u#", numbers),
    }


KINDS: dict[str, Callable[[list[str]], Slots]] = {
    "frame": lambda n: {"frames": listed('"#": a frame', n)},
    "member": lambda n: {
        "members": listed("#", n),
        "lets": '          p_any: "p_mode in {p_on' + listed("#", n) + '}"',
        "terminal": ", p_t: p_any",
    },
    "enum": typed("enum[p_a, p_b]"),
    "record": typed('{fields: {p_a: "real[m]"}}'),
    "opaque": typed("{opaque: true}"),
    "class": typed('{opaque: true, python: "collections:OrderedDict"}'),
    "field": lambda n: {
        "fields": listed('"#": "real[m]"', n),
        **used(n, "p_item.#"),
    },
    "constant": lambda n: {
        "constants": lines(2, '"#": "0.5[m]"', n),
        "required": required([f"{name} < 1[m]" for name in n]),
        **used(n),
    },
    "computed constant": lambda n: {
        "constants": lines(2, '"#": p_same(p_half)', n),
        "required": required([f"{name} < 1[m]" for name in n]),
        **used(n),
    },
    "file": lambda n: {"files": listed('"#": measures.py', n), **used(n, "p_load(#)")},
    "operator": lambda n: {
        "operators": lines(
            2,
            '"#": {signature: "(a: real[m]) -> real[m]", python: "tests.emit.measures:same"}',
            n,
        ),
        "required": required([f"{name}(p_half) < 1[m]" for name in n if name not in FORMULAS]),
        **used(n, "#(p_half)"),
    },
    "observed": lambda n: {
        "observed": lines(
            4, '"#": {type: "real[m]", joints: [p_slide], through: "tests.emit.measures:#"}', n
        ),
        "required": required([f"plant.{name} < 1[m]" for name in n if not keyword.iskeyword(name)]),
    },
    "parameter": lambda n: {
        "parameters": listed("#: real[m]", n),
        "given": listed("p_half", n),
    },
    "element": lambda n: {
        "inputs": listed('"#": {type: "real[m]", init: p_half}', n),
        "outputs": listed('"#": "real[m]"', n),
        "sent": listed('"y.e.#": p_half', n),
        **used(n, "x.c.#"),
    },
    "sample": lambda n: {
        "reported": listed('"#": {type: "real[m]", init: p_half}', n),
        "samples": listed('"#": "real[m]"', n),
        **used(n, "x.E.#"),
    },
    "device": lambda n: {"devices": lines(6, '"#": {x: {q_d: "real[m]"}}', n)},
    "memory": lambda n: {
        **(of := used(n)),
        "memory": lines(10, '"#": {type: "real[m]", init: "p_same(p_half)"}', n)
        + "\n"
        + of["memory"],
    },
    "let": lambda n: {
        "lets": lines(10, '"#": "p_same(p_kept)"', n),
        **used([*n, *n], "p_same(#)"),
    },
    "bound variable": lambda n: {
        "lets": lines(10, '"p_l_#": "all(# < 2 for # in p_parts)"', n),
        **used(n, "(p_half if p_l_# else p_kept)"),
    },
    "initial condition": lambda n: {
        "initial": listed('"#": "p_kept > 3[m]"', n),
        "rows": lines(10, '- [p_S0, terminal, "#", p_S0]', n),
    },
    "terminal condition": lambda n: {
        "terminal": listed('"#": "p_kept > 3[m]"', n),
        "behaviours": lines(10, 'p_b_#: {functions: [p_move], terminal: "#"}', n),
        "states": listed("p_s_#: p_b_#", n),
    },
    "error condition": lambda n: {
        "error": listed('"#": "p_kept > 3[m]"', n),
        "behaviours": lines(10, 'p_b_#: {functions: [p_move], terminal: never, error: "#"}', n),
        "states": listed("p_s_#: p_b_#", n),
    },
    "function": lambda n: {
        "memory": lines(10, 'p_m_#: {type: "real[m]", init: p_half}', n),
        "functions": lines(10, '"#": {p_m_#: "p_double"}', n),
        "called": listed('"#"', n),
    },
    "behaviour": lambda n: {
        "behaviours": lines(10, '"#": {functions: [p_move], terminal: never}', n),
        "states": listed('p_s_#: "#"', n),
        "rows": lines(10, "- [p_S0, terminal, p_first, p_s_#]", n),
    },
    "state": lambda n: {
        "states": listed('"#": p_moving', n),
        "rows": lines(10, '- [p_S0, terminal, p_first, "#"]', n),
    },
    "agent": lambda n: {
        "agents": lines(
            2,
            '"#": {control: {rate: 10 Hz, behaviours: {b: {terminal: never}}, states: {S0: b}, '
            "initial_state: S0}}",
            n,
        )
    },
    "subsystem": lambda n: {
        "agents": "\n".join(
            f'  p_a{i}: {{virtual_effectors: {{"{name}": {{rate: 10 Hz, behaviours: '
            "{b: {terminal: never}}, states: {S0: b}, initial_state: S0}}}"
            for i, name in enumerate(n)
        )
    },
}

WRITTEN_OUT = ("member", "bound variable", "parameter")
"""Kinds whose names stand in texts of Python's grammar, which has no place for its keywords."""
KEYS = {"element": ("is", "for")}
"""Words of Python that are keys where names of a kind stand."""
WORDS = {*RESERVED, *TYPE_WORDS, *USAGE, *keyword.kwlist, "plant"}
PRIVATE = re.compile("__")
"""How names of Python's own begin, which no field has."""
# What E0311 and E0313 say of a name is about the type of an operand beside another name.
NAMED = re.compile(r"E(?!0311|0313)\d+ [^`]*`(\w+)`")
SLOTS = re.compile(r"<([a-z]+)>")


def compiled(kind: str, names: list[str], folder: Path) -> pipeline.Result:
    slots = KINDS[kind](names)
    spec = folder / "probe.yaml"
    spec.write_text(SLOTS.sub(lambda found: slots.get(found[1], ""), SPEC))
    (folder / "measures.py").touch()
    (folder / "plant.xml").write_text(PLANT)
    return pipeline.compile_spec(str(spec))


def errors(result: pipeline.Result) -> list[str]:
    """What stops a build, but for tables that are not proved."""
    found = [d for d in result.diagnostics if blocks(d.code, "build")]
    return [
        f"{d.code} {d.message}"
        for d in found
        if not d.code.startswith(("E06", "O06", "O0402", "E0408"))
    ]


def accepted(kind: str, names: tuple[str, ...], folder: Path) -> tuple[pipeline.Result, set[str]]:
    """The probe with all names that may stand there, and those that `validate` refuses."""
    refused = {*keyword.kwlist} if kind in WRITTEN_OUT else set(KEYS.get(kind, ()))
    while True:
        result = compiled(kind, [name for name in names if name not in refused], folder)
        found = errors(result)
        if not found:
            return result, refused
        said = {m[1] for text in found if (m := NAMED.match(text))} & set(names)
        assert said - refused, found
        refused |= said


AT_ONCE = {"device": 150, "agent": 150, "subsystem": 150, "parameter": 250}
"""How many names of a kind one file may hold, where the language limits them."""


FEW = 12
"""Every name is tried for about one kind; with all of them, for each."""


@pytest.mark.parametrize("kind", every(3, list(KINDS)[::4]))
def test_names_of_generated_code_work(kind: str, tmp_path: Path) -> None:
    start = list(KINDS).index(kind) // 2 % FEW
    names_work(kind, tuple(every_name()[start::FEW]), tmp_path)


@pytest.mark.parametrize(
    "share", [pytest.param(2, marks=pytest.mark.long), pytest.param(1, marks=SOAK)]
)
@pytest.mark.parametrize("kind", KINDS)
def test_all_names_of_generated_code_work(kind: str, share: int, tmp_path: Path) -> None:
    """Each name in at least half of the kinds; in a campaign in all."""
    chosen = every_name()[list(KINDS).index(kind) % share :: share]
    for names in batched(chosen, AT_ONCE.get(kind, len(chosen))):
        names_work(kind, names, tmp_path)


def names_work(kind: str, names: tuple[str, ...], tmp_path: Path) -> None:
    """Those that `validate` accepts make a package whose every method runs."""
    result, refused = accepted(kind, names, tmp_path)
    odd = {name for name in refused if kind == "field" and PRIVATE.match(name)}
    assert refused <= WORDS | odd
    assert result.system is not None
    measures.define([name for name in names if name not in refused] if kind == "field" else [])
    with package(fill_templates(lower(result.system, None))) as modules:
        system = modules["system.py"].build(str(tmp_path))
        layouts = modules["layouts.py"].LAYOUTS
        assert {type(layout) for layout in layouts.values()} == {Layout}
        for scheduled in system.subsystems:
            works(scheduled.subsystem)
        judges(system.requirements)
        judges(system.triggers)


def judges(formulas: Any) -> None:
    """Every condition has a value."""
    values = formulas.values
    for name in values.__slots__:
        setattr(values, name, None if ".p_m" in name else 0.5)
    for atom in (atom for each in formulas.requirements for atom in each.formula.atoms()):
        atom.update()
        assert atom.now != UNKNOWN


def works(machine: Any) -> None:
    """Every method of a subsystem runs."""
    for name in machine.x.__slots__:
        setattr(machine.x, name, getattr(machine.x, name, 0.5))
    machine.step()
    for name in dir(type(machine)):
        method = getattr(machine, name)
        if re.match("_[a-z]", name) and callable(method) and not signature(method).parameters:
            with suppress(UndecidedTransition):
                method()
