"""Random systems that count: two machines, each with memory that changes by all sorts of steps."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

from specc.pipeline import Result
from tests.explore.modes import add_modes, narrow_rows
from tests.soundness.running import compiled

Tree = dict[str, Any]
RATES_HZ = (10, 20, 50)
STEPS = (*("+ 1", "+ 1", "+ 1", "- 1", "+ 2", "+ 7", "- 3") * 2, "* 2", "+ {other}", "- {other}")
REAL_STEPS = ("+ 1.0", "+ 0.5", "- 0.25", "+ 0.1", "+ 0.125 * {other}", "* 1.5")
TESTS = (
    "{k} >= {n}",
    "{k} > {n}",
    "{k} <= -{n}",
    "{k} == {n}",
    "{k} != {m} or elapsed > {late}[s]",
    "2 * {k} - 3 >= {n}",
    "{k} * {k} > {n}",
    "abs({k} - {n}) < 2",
    "{k} / 7 >= {m}",
    "{k} - {other} >= {m}",
    "{k} < {other} - {m}",
    "{k} == {other} + {m}",
    "({k} if {other} > {m} else {k} + {n}) >= {n}",
    "min({k}, {n}) == {n}",
    "elapsed > {late}[s]",
    "elapsed >= {late}[s] and {k} < {n}",
    "elapsed > {k} * 1[s] and {other} > {n}",
    "{k} >= {n} and fresh({told})",
    "{r} >= {m}.25",
    "{r} + {k} > {n}.5",
    "{r} < -{m}",
)
REQUIRED = (
    "always({a} <= {n})",
    "always({a} != {m} or state({c}) == S0)",
    "always(not ({a} > {m} and state({c}) == S1))",
    "always(state({c}) == S1 implies within(1[s], state({c}) != S1))",
    "always(state({c}) == S0 implies within({late}[s], state({c}) != S0))",
    "always({a} > {m} implies within({late}[s], {a} < {m}))",
    "always(state({c}) == S0 implies throughout({late}[s], state({c}) == S0 or {a} > {m}))",
    "always(state({c}) == S1 implies once({late}[s], state({c}) == S0))",
    "always({a} < {n} or historically({late}[s], state({c}) != S2))",
    "always(state({c}) != S1 or since(state({c}) == S1, {a} <= {n}))",
    "always(2 * {a} < {n} or once(2[s], state({c}) == S2))",
    "always({a} - {b} < {m})",
)


def counting(
    rng: Random, folder: Path, *, with_modes: bool = False, narrowed: bool = False
) -> Result:
    """What the compiler makes of a system with two machines that count, in a folder.

    With `narrowed` rows some may be missing.
    """
    agents = {name: {"control": _control(rng, name, peer)} for name, peer in ("ab", "ba")}
    for agent in agents.values() if with_modes else ():
        add_modes(rng, agent["control"], longest_s=12.5)
        if narrowed:
            narrow_rows(rng, agent["control"])
    tree = {"specc": 1.1, "system": "counting", "agents": agents}
    tree["require"] = [
        {"that": rng.choice(REQUIRED).format(**_numbers(rng), **_names(rng)), "because": "it is so"}
        for _ in range(3)
    ]
    return compiled(tree, folder)


def _names(rng: Random) -> dict[str, str]:
    one, other = rng.sample("ab", 2)
    return {"a": f"{one}.c.k", "b": f"{other}.c.{rng.choice('kj')}", "c": f"{one}.c"}


def _numbers(rng: Random) -> dict[str, Any]:
    # A state lasts long enough to be accelerated, and short enough to be run.
    return {
        "n": rng.choice((5, 100, 150, 333, 500, 1000)),
        "m": rng.choice((rng.randrange(100), rng.randrange(100, 500))),
        "late": rng.choice((0.35, 3.5, 7.5, 12.5)),
    }


def _control(rng: Random, name: str, peer: str) -> Tree:
    known: Tree = {}
    states = ["S0", "S1", "S2"][: rng.randrange(2, 4)]
    tree: Tree = {
        "rate": f"{rng.choice(RATES_HZ)} Hz",
        "x": {peer: {"n": {"type": "int", "init": rng.randrange(3)}, "go": _go(rng)}},
        "y": {peer: {"n": "int", "go": "bool"}},
        "memory": {
            "k": {"type": "int", "init": rng.choice((0, 0, 1, -5, 40))},
            "j": {"type": "int", "init": rng.choice((0, 3, 200))},
            "r": {"type": "real", "init": rng.choice((0.0, 0.5, 0.1))},
        },
        "conditions": {"initial": known},
        "functions": {},
        "behaviours": {},
        "states": {},
        "initial_state": "S0",
        "transitions": [],
    }
    for state in states:
        functions = [f"f{state}{i}" for i in range(rng.randrange(1, 4))]
        texts = rng.sample(("k", "j", "r", "n", "go"), len(functions))
        for function, text in zip(functions, texts, strict=True):
            tree["functions"][function] = dict([_assigned(rng, text, peer)])
        end = f"e{state}"
        tree["conditions"].setdefault("terminal", {})[end] = _asked(rng, peer)
        ends = rng.choice((end, end, end, end, "always", "never"))
        tree["behaviours"][f"b{state}"] = {"functions": functions, "terminal": ends}
        tree["states"][state] = f"b{state}"
        if ends == "never":
            continue
        if rng.randrange(3) == 0:
            known[f"r{state}"] = _asked(rng, peer)
            tree["transitions"].append([state, "terminal", f"r{state}", rng.choice(states)])
            tree["transitions"].append([state, "terminal", "otherwise", rng.choice(states)])
        else:
            tree["transitions"].append([state, "terminal", "always", rng.choice(states)])
    return tree


def _go(rng: Random) -> Tree:
    if rng.randrange(3) == 0:
        return {"type": "bool", "event": True}
    return {"type": "bool", "init": "False"}


def _assigned(rng: Random, text: str, peer: str) -> tuple[str, str]:
    if text == "go":
        return f"y.{peer}.go", "True"
    if text == "n":
        return f"y.{peer}.n", rng.choice(("k", "k", "j", "k + 1", "2 * k", "k - j", f"x.{peer}.n"))
    if text == "r":
        return "r", "r " + rng.choice(REAL_STEPS).format(other="k")
    if rng.randrange(6) == 0:
        return text, str(rng.randrange(5))
    other = rng.choice(("k", "j", f"x.{peer}.n"))
    return text, f"{text} " + rng.choice(STEPS).format(other=other)


def _asked(rng: Random, peer: str) -> str:
    k, other = rng.sample(("k", "j", f"x.{peer}.n"), 2)
    text = rng.choice(TESTS)
    return text.format(k=k, other=other, r="r", told=f"x.{peer}.go", **_numbers(rng))
