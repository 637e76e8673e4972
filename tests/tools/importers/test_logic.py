"""Conditions of other formats: reading, folding and writing them."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from specc.model.expr import FALSE, TRUE, BoundVariable, Expr, Logic, Truth, Unary, truth
from specc.model.types import Bool
from specc.tools.importers.logic import LogicError, atom, atoms, parse_logic, render, substitute

NAMES = ("p", "q", "r", "android", "nothing", "order")


def logics() -> st.SearchStrategy[Expr]:
    leaves = st.sampled_from([TRUE, FALSE, *map(atom, NAMES)])
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            inner.map(lambda logic: Unary("not", logic, type=Bool())),
            st.builds(
                Logic,
                st.sampled_from(["and", "or"]),
                st.lists(inner, min_size=2, max_size=3).map(tuple),
                type=st.just(Bool()),
            ),
        ),
        max_leaves=8,
    )


def value(logic: Expr, answers: dict[str, bool]) -> bool:
    match logic:
        case Truth(value=answer):
            return answer
        case BoundVariable(name=text):
            return answers[text]
        case Unary(operand=operand):
            return not value(operand, answers)
    assert isinstance(logic, Logic)
    parts = [value(part, answers) for part in logic.operands]
    return all(parts) if logic.op == "and" else any(parts)


ANSWERS = st.fixed_dictionaries({name: st.booleans() for name in NAMES})


@settings(deadline=None)
@given(logics(), ANSWERS, st.booleans())
def test_what_is_written_reads_back_with_the_same_meaning(
    logic: Expr, answers: dict[str, bool], symbols: bool
) -> None:
    text = render(logic, str)
    if symbols:
        text = text.replace(" and ", "&&").replace(" or ", " || ").replace("not ", "! ")
    assert value(parse_logic(text), answers) == value(logic, answers)


@settings(deadline=None)
@given(logics(), ANSWERS)
def test_substitution_keeps_the_meaning_and_leaves_none_of_the_names(
    logic: Expr, answers: dict[str, bool]
) -> None:
    known = {"p": answers["p"], "order": answers["order"]}
    result = substitute(logic, known)
    assert value(result, answers) == value(logic, answers)
    assert not known.keys() & {atom.name for atom in atoms(result)}


@settings(deadline=None)
@given(logics(), ANSWERS)
def test_everything_known_leaves_a_constant(logic: Expr, answers: dict[str, bool]) -> None:
    assert substitute(logic, answers) == truth(value(logic, answers))


def test_binding() -> None:
    assert render(parse_logic("not p and q or r"), str) == "(not p and q) or r"
    assert render(parse_logic("p or q and r"), str) == "p or (q and r)"
    assert render(parse_logic("not (p or q) and r"), str) == "not (p or q) and r"


def test_constants_in_any_case_and_other_texts_as_they_are() -> None:
    assert parse_logic(" TRUE ") == TRUE
    assert parse_logic("false") == FALSE
    assert [a.name for a in atoms(parse_logic("x > 3 && In('a and b') || y != 2"))] == [
        "x > 3", "In('a and b')", "y != 2",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "stretch"),
    [
        ("p and", "p and"),
        ("", ""),
        ("p (q(r))", "(r"),
        ("(p", "(p"),
        ("p)", ")"),
        ("and p", "and"),
        ("p and and q", "and"),
        ("'p", "'p"),
        ("not", "not"),
        ("(" * 60 + "p" + ")" * 60, None),
        ("p or " * 1000 + "p", None),
    ],
)
def test_what_is_no_condition(text: str, stretch: str | None) -> None:
    with pytest.raises(LogicError) as caught:
        parse_logic(text)
    error = caught.value
    assert 0 <= error.start <= error.end <= len(text)
    if stretch is not None:
        assert stretch.startswith(text[error.start : error.end].strip())


@settings(deadline=None)
@given(st.text(alphabet="pq ()&|!'\"<>andort", max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        logic = parse_logic(text)
    except LogicError as error:
        assert 0 <= error.start <= error.end <= len(text)
    else:
        assert all(atom.name == atom.name.strip() for atom in atoms(logic))
