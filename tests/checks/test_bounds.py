"""Questions that would take too long are given up, or decided some other way."""

from __future__ import annotations

from dataclasses import replace

import pytest

from specc.limits import one_run, remaining
from specc.model.expr import (
    Binary,
    Choice,
    Compare,
    ConstantRef,
    Expr,
    LetRef,
    MemoryRef,
    Number,
    Unary,
)
from specc.model.types import Bool, Int, Real
from specc.proof import Prover
from specc.proof.solver import Theory
from tests.checks.conditions import machine
from tests.checks.texts import MODE, condition, prove

REAL = Real()
ANY = [f"any(v > {i} and R(v + {i}) for v in l)" for i in range(24)]
MANY = [f"R(d + {i})" for i in range(40)]
TABLES = {
    "kinds of items": (" and ".join(ANY[:18]), f"not ({' and '.join(ANY[:18])})"),
    "more kinds of items": (" and ".join(ANY), f"not ({' and '.join(ANY)})"),
    "facts": (" and ".join(MANY), " or ".join(f"not {fact}" for fact in MANY)),
    "neighbours": (
        f"n >= k and {' and '.join(f'n != k + {i}' for i in range(30))}",
        "n >= k and n < k + 30",
        "n < k",
    ),
    "ranges": (*(f"{i} <= n < {i + 1}" for i in range(40)), "n < 0 or n >= 40"),
}


@pytest.mark.parametrize("rows", TABLES.values(), ids=TABLES)
def test_large_tables_are_decided(rows: tuple[str, ...]) -> None:
    assert prove(*rows).proved


def test_sums_beyond_bounds_are_not_proved_and_say_so() -> None:
    sums = " and ".join(f"d * {i}.5 + e < f" for i in range(70))
    decision = prove(sums, f"not ({sums}) and d * 1.5 < f").decision
    assert "too many sums" in decision.unknown


LONG = {
    "quantifiers": " or ".join(f"len(l) > {i} and any(v > {i} for v in l)" for i in range(80)),
    "nested": " and ".join(f"any(all(v > it + {i} for v in q) for it in l)" for i in range(60)),
}


@pytest.mark.parametrize("row", LONG.values(), ids=LONG)
def test_quantifiers_too_long_to_spell_out_are_not_proved_and_say_so(row: str) -> None:
    decision = prove(row, "len(l) > 0").decision
    assert "spelt out" in decision.unknown


@pytest.mark.long
def test_spelling_out_counts_against_the_budget_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Theory, "_steps", lambda *_: 0)  # only what comes before the search
    few, more, many = (_spent(quantifiers) for quantifiers in (10, 20, 40))
    assert many - more > 3 * (more - few) > 3000  # beside what any question takes


def _spent(quantifiers: int) -> int:
    """Steps of a question about quantifiers over one list."""
    row = " or ".join(f"len(l) > {i} and any(v > {i} for v in l)" for i in range(quantifiers))
    with one_run():
        before = remaining("proof")
        prove(row, "len(l) > 0")
        return before - remaining("proof")


@pytest.mark.parametrize(
    ("first", "row"), [(MemoryRef("d", type=REAL), "d < 1"), (MemoryRef("m", type=MODE), "m == u")]
)
def test_choices_of_choices_are_followed_once(first: Expr, row: str) -> None:
    lets = {"l0": first}
    for i in range(1, 60):
        before = LetRef(f"l{i - 1}", type=first.type)
        lets[f"l{i}"] = Choice(condition(f"n > {i}"), before, before, type=first.type)
    asked = condition(row)
    assert isinstance(asked, Compare)
    last = replace(asked, left=LetRef("l59", type=first.type))
    rows = [last, Unary("not", last, type=Bool())]
    assert Prover(machine(rows, lets=lets), {}).prove_rows("S", "terminal").proved


def test_powers_of_powers_are_not_computed() -> None:
    nine = Number(9, type=Int())
    constants: dict[str, Expr] = {"k0": Binary("**", Number(10, type=Int()), nine, type=Int())}
    for i in range(1, 12):
        before = ConstantRef(f"k{i - 1}", type=Int())
        constants[f"k{i}"] = Binary("**", before, nine, type=Int())
    row = Compare("<", MemoryRef("n", type=Int()), ConstantRef("k11", type=Int()), type=Bool())
    rows = [row, Unary("not", row, type=Bool())]
    assert Prover(machine(rows), constants).prove_rows("S", "terminal").proved
