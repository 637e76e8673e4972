"""A condition reacts to a member of an enum where some values show that its arrival matters."""

from __future__ import annotations

import itertools
import random

import pytest

from specc.lang import Environment, evaluate
from specc.model.expr import Compare, Expr, Fresh, Input, IsOneOf, Logic, Member, Present, Unary
from specc.proof import Prover
from tests.checks.conditions import BOOL, FLAG, MODE, machine
from tests.seeds import Seeds, blocks

E, F = (Input("p", name, type=MODE) for name in "ef")


def condition(rng: random.Random, depth: int) -> Expr:
    if depth == 0:
        member = Member(rng.choice(MODE.members), type=MODE)
        several = frozenset(rng.sample(MODE.members, 2))
        return rng.choice(
            (
                FLAG,
                Fresh(E, type=BOOL),
                Fresh(E, type=BOOL),
                Present(E, type=BOOL),
                Compare("==", E, member, type=BOOL),
                Compare("!=", E, F, type=BOOL),
                IsOneOf(E, several, type=BOOL),
            )
        )
    parts = condition(rng, depth - 1), condition(rng, depth - 1)
    if rng.random() < 0.25:
        return Unary("not", parts[0], type=BOOL)
    return Logic(rng.choice(("and", "and", "or")), parts, type=BOOL)


def differs(condition: Expr, member: str) -> bool:
    """Whether it is different for some values, with the member and without."""

    def holds(e: str, arrived: str, f: str, flag: bool) -> object:
        return evaluate(
            condition,
            Environment(
                inputs={("p", "e"): e, ("p", "f"): f, ("p", "flag"): flag},
                fresh={("p", "e")} if arrived == "fresh" else (),
                present={("p", "f"), ("p", "flag"), *([("p", "e")] if arrived else [])},
            ),
        )

    return any(
        holds(member, "fresh", f, flag) != holds(old, before, f, flag)
        for f, flag in itertools.product(MODE.members, (False, True))
        for old, before in itertools.product(MODE.members, ("", "old"))
    )


@pytest.mark.parametrize("seeds", blocks(range(40), long=60, each=300))
def test_reactions_agree_with_trying(seeds: Seeds) -> None:
    found = set()
    for seed in seeds:
        asked = condition(random.Random(seed), 2)
        prover = Prover(machine([asked]), {})
        for member in MODE.members:
            reacts = prover.reacts(asked, E, member)
            assert reacts == differs(asked, member), (seed, member)
            found.add(reacts)
    assert found == {False, True}
