"""Whatever stands in names, titles and texts, generated code has the same structure."""

from __future__ import annotations

import ast
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from specc.emit import emit, fill_templates
from specc.lower import lower
from specc.model import expr as m
from specc.model.fsm import Assignment, Axiom, Behaviour, Function, State, Trace, Transition
from specc.model.system import Constant, Let, Memory, NamedType, Operator, System
from specc.model.types import Bool, Enum, ListOf, Real, Record, Text
from specc.model.units import METRE
from tests.lower.models import HERE, NO_TRACE, Known, condition, subsystem_of, system_of
from tests.seeds import examples

REAL = Real(METRE)
NASTY = [
    '"""',
    '"""\nimport os\nos.system("x")\n"""',
    "'''",
    "\\",
    '\\"""',
    '""',
    '"',
    "a\nb",
    "a\r\nimport os",
    "\x0c\x1c\u2028\u2029\x85",
    "# no" + "qa",
    "# type: " + "ignore",
    "fmt: off",
    "# -*- coding: utf-7 -*-",
    "{{ 7 * 7 }}{% raw %}",
    "{x}%s",
    "class",
    "None",
    "self",
    "x",
    "memory",
    "__class__",
    "_a",
    "a b",
    "a-b",
    "1a",
    "",
    "é",
    "ℌ",
    "\udc80",
    "𝔘",
    "l",
    "Final",
    "float",
    "PERIOD",
    "sum",
    "holds",
]
texts = st.sampled_from(NASTY) | st.text(max_size=12)


def spec(t: tuple[str, ...]) -> System:
    """A subsystem with the given texts wherever a specification can put a text of its own."""
    (x_peer, x_name, y_peer, y_name, memory, constant, let, operator, function, behaviour) = t[:10]
    (state_1, state_2, row, member_1, member_2, title, agent, name, record, text) = t[10:]
    mode = Enum(row, (member_1, member_2))
    grip = Record(record, (), (("width", REAL), ("mode", mode)))
    trace = Trace(eq=(7,))
    source = m.Input(x_peer, x_name, type=REAL)
    term = m.Call(operator, (source,), type=REAL)
    chosen = m.Compare(
        "==",
        m.Input(x_peer, "mode", type=mode),
        m.Member(member_1, type=mode),
        type=Bool(),
    )
    sum_ = m.Binary("+", m.LetRef(let, type=REAL), m.ConstantRef(constant, type=REAL), type=REAL)
    made = (
        Assignment(y_peer, y_name, sum_, trace, HERE),
        Assignment(y_peer, "text", m.TextLiteral(text, type=Text()), trace, HERE),
        Assignment("", memory, m.MemoryRef(memory, type=REAL), trace, HERE),
    )
    fresh = m.Fresh(source, type=Bool())
    works = Behaviour(
        behaviour,
        (Function(function, made, title, trace, HERE),),
        condition(row, fresh, "terminal", (1,), title),
        (("error", condition(row, chosen, "error", (2,), title)),),
        title,
        trace,
        HERE,
    )
    states = (
        State(state_1, works, title, trace, HERE),
        State(state_2, works, title, trace, HERE),
    )
    present = m.Present(source, type=Bool())
    rows = tuple(
        Transition(a, cause, condition(row, test), b, trace, HERE)
        for a, b in ((state_1, state_2), (state_2, state_1))
        for cause in CAUSES
        for test in (fresh, present)
    )
    subsystem = subsystem_of(
        x={(x_peer, x_name): REAL, (x_peer, "mode"): mode},
        y={(y_peer, y_name): REAL, (y_peer, "text"): Text(), (y_peer, "grips"): ListOf(grip)},
        behaviours=(works,),
        states=states,
        transitions=rows,
        memory=(Memory(memory, REAL, m.Number(0.0, type=REAL), title, trace, HERE),),
        lets=(Let(let, term, title, trace, HERE),),
        axioms=(Axiom(present, title, HERE),),
        title=title,
        agent=agent,
        name=name,
    )
    return system_of(
        subsystem,
        replace(subsystem, rate_hz=Fraction(100), name=name + "2"),
        operators=(Operator(operator, (("a", REAL),), REAL, "tool:f", title, trace, HERE),),
        constants=(Constant(constant, m.Number(0.5, type=REAL), title, HERE),),
        types=(NamedType(row, trace, HERE), NamedType(record, NO_TRACE, HERE)),
        name=name,
        title=title,
    )


CAUSES: Any = ("terminal", "error")
TEXTS = 20


def shape(tree: ast.AST) -> list[str]:
    """Kinds of the nodes of a module without its names and texts."""
    return [type(node).__name__ for node in ast.walk(tree)]


def shapes(texts_: tuple[str, ...], proved: bool) -> list[list[str]]:
    files = fill_templates(lower(spec(texts_), Known(proved)))
    for text in files.values():
        text.encode()
    return sorted(shape(ast.parse(text)) for text in files.values())


@cache
def plain_shapes(proved: bool) -> list[list[str]]:
    return shapes(tuple(f"plain{i}" for i in range(TEXTS)), proved)


def unlike(values: tuple[str, ...]) -> tuple[str, ...]:
    """Distinct texts: a specification has no two things of one name, and none without a name."""
    return tuple(
        value if value and value not in values[:i] else f"{value}{'_' * i}-"
        for i, value in enumerate(values)
    )


@pytest.mark.parametrize("examples", examples(10, 60))
def test_no_text_changes_the_structure(examples: int) -> None:
    @settings(max_examples=examples, deadline=None)
    @given(st.tuples(*[texts] * TEXTS), st.booleans())
    @example(('"""\nimport os\n',) * TEXTS, True)
    @example(("\\",) * TEXTS, False)
    def holds(found: tuple[str, ...], proved: bool) -> None:
        assert shapes(unlike(found), proved) == plain_shapes(proved)

    holds()


def test_nasty_texts_survive_the_formatter() -> None:
    for start in range(0, len(NASTY), TEXTS // 2):
        chosen = unlike((NASTY * 2)[start : start + TEXTS])
        plan = lower(spec(chosen), Known(True))
        raw, done = fill_templates(plan), emit(plan)
        for path, text in done.items():
            assert without_imports(text) == without_imports(raw[path])


def without_imports(text: str) -> list[str]:
    """The shape of a module but for its imports, which the formatter sorts and merges."""
    tree = ast.parse(text)
    tree.body = [node for node in tree.body if not isinstance(node, ast.ImportFrom)]
    return shape(tree)


def test_texts_are_kept_as_they_are_where_they_are_values() -> None:
    """Names of states, conditions and members are data: they come back exactly."""
    for text in NASTY:
        values = (*(f"plain{i}" for i in range(TEXTS - 1)), text)
        (module, *_) = (
            ast.parse(code)
            for path, code in fill_templates(lower(spec(values), Known(True))).items()
            if path.startswith("plain")
        )
        constants = [n.value for n in ast.walk(module) if isinstance(n, ast.Constant)]
        assert text in constants
