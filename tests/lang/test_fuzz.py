"""No text does anything but mean something or raise the errors of expressions."""

import random

import pytest
from hypothesis import strategies as st

from specc.lang import ExprErrors, expression, parse_signature, parse_type, show
from specc.model.types import Bool
from tests.seeds import drawn
from tests.strategies import NAMES, SCOPE, expressions

FEW, MANY = 15, 100
"""Examples of a random test, and of a long one."""


def words(text: str) -> list[str]:
    return text.split(" ")


WORDS = words(
    "x y _ c E T_d b d_d m_m q_p p T_c F_c ratio tolerance best seen entered elapsed u g open "
    "widen far chain near inverse identity translation rotation rpy pose fresh present all any len "
    "norm abs min max sqrt position for in not and or if else is True None 0 1 2.5 1e999 'a' m s "
    "rad foo + - * / ** @ < <= == != > = ( ) [ ] { } , . : := lambda # \n \\ \t ü ∧ 1[m] x.c.b "
    "x.E.m_m"
)
soups = st.lists(st.sampled_from(WORDS), max_size=25).map(" ".join)
texts = st.text(max_size=60) | soups | soups.map(lambda text: text.replace(" ", ""))


def complain(text: str, scope_type: object = None) -> None:
    try:
        tree = expression(text, SCOPE, scope_type)
    except ExprErrors as failure:
        assert failure.errors
        for error in failure.errors:
            assert 0 <= error.start <= error.end <= len(text)
            assert error.message
            assert error.code[:3] in ("E02", "E03", "O02")
    else:
        assert expression(show(tree), SCOPE, tree.type) == tree


@drawn(texts, few=FEW, many=MANY)
def test_random_texts(text: str) -> None:
    complain(text)


@drawn(texts, few=FEW, many=MANY)
def test_random_texts_where_a_condition_is_expected(text: str) -> None:
    complain(text, Bool())


@drawn(expressions(), st.randoms(use_true_random=False), few=FEW, many=MANY)
def test_damaged_expressions(tree: object, chance: random.Random) -> None:
    text = show(tree)
    for _ in range(chance.randint(1, 3)):
        place = chance.randrange(len(text) + 1)
        text = text[:place] + chance.choice(WORDS) + text[place + chance.randint(0, 2) :]
    complain(text)


TYPE_WORDS = words(
    "vector pose wrench twist spatial image list enum real int bool Mode Reading B E K Q m rad "
    "kg*m**2 6 0 -1 [ ] , ( ) -> : q a"
)


@drawn(
    st.lists(st.sampled_from(TYPE_WORDS), max_size=20).map(" ".join) | st.text(max_size=40),
    few=FEW,
    many=MANY,
)
def test_random_types_and_signatures(text: str) -> None:
    for read in (parse_type, parse_signature):
        for given_text in (text, f"({text}) -> int", f"vector[{text}]"):
            try:
                read(given_text, NAMES)
            except ExprErrors as failure:
                for error in failure.errors:
                    assert 0 <= error.start <= error.end <= len(given_text)


@pytest.mark.parametrize("opening", ["(", "[", "{", "f(", "-", "not ", "x.", "a[", "'", "1 if "])
@pytest.mark.parametrize("count", [70, 1000, 9000])
def test_repeated_openings(opening: str, count: int) -> None:
    complain((opening * count)[:9999] + "1")
