"""Texts of about a kilobyte that double what they name: lets of lets, `for` of `for`, many of many.

A seed gives a text: how many agents there are, a chain of lets of which each names the one below
more than once, and what the last one is used for. What it asks for may be anything between a moment
and longer than the universe lasts, so a command has to count it before it makes it.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

from bench.harness.lists import MAIN, Files, written

Spec = dict[str, Any]

_NUMBERS = (
    "{0} + {0}",
    "{0} * {0} - {0}",
    "min({0}, {0} + 1)",
    "{0} if {0} > 1 else {0} + 1",
    "clamp({0}, -{0}, {0} + 1)",
    "argmin({0} + r.n for r in x.a)",
    "argmax(r.n - {0} for r in x.a)",
    "argmin(r.n if r.n > {0} else {0} for r in x.a)",
    "argmin(r.n for r in x.a) + {0}",
    "argmax(v - {0} for v in x.d.three) + {0}",
    "(1 if {1} else 2) + {0}",
    "(1 if any(r.n > {0} for r in x.a) else {0})",
)
_CONDITIONS = (
    "{1} and x.d.k > {2} or {1} and x.d.k < {2}",
    "not {1} or {1} and {0} > 3",
    "all(r.n > {2} or {1} for r in x.a)",
    "any({1} and r.b for r in x.a)",
    "any({1} and v > {2} for v in x.d.three)",
    "all(any(r.n > s.n and {1} for s in x.a) for r in x.a)",
    "all({0} > r.n for r in x.a)",
    "any(all({0} > v and {1} for v in x.d.three) for r in x.a)",
    "argmin({0} + r.n for r in x.a) > {0}",
    "{0} > 3 or {1}",
    "({1}) if ({1}) else {0} > 2",
)
"""Steps of a chain: numbers and conditions by those below, `{0}` and `{1}`, at the place `{2}`."""


def _control(rate: str = "10 Hz") -> Spec:
    return {
        "rate": rate,
        "functions": {},
        "behaviours": {"go": {"functions": [], "terminal": "never"}},
        "states": {"S0": "go"},
        "initial_state": "S0",
    }


def _ranges(random: Random) -> dict[str, str]:
    """Of a `for`: one index, or a grid of up to three."""
    sides = random.choice(
        ((2,), (5,), (12,), (32,), (60,), (300,), (2, 3), (5, 6), (18, 20), (6, 7, 8))
    )
    return {name: f"1..{side}" for name, side in zip("ijk", sides, strict=False)}


def _agents(each: dict[str, str]) -> Spec:
    """Many agents that talk to one, which is `hub`."""
    many = _control() | {
        "x": {"hub": {"g": {"type": "real", "init": 0}}},
        "y": {"hub": {"n": "real", "b": "bool"}},
        "memory": {"s": {"type": "real", "init": 0}},
        "functions": {"go": {"y.hub.n": "s", "y.hub.b": "s > 1", "s": "x.hub.g"}},
    }
    many["behaviours"]["go"]["functions"] = ["go"]
    return {"a": {"for": each, "control": many}}


def _hub(lets: Spec) -> Spec:
    control: Spec = _control() | {
        "x": {
            "a": {"n": {"type": "real", "init": 0}, "b": {"type": "bool", "init": False}},
            "d": {
                "k": {"type": "real", "init": 0},
                "three": {"type": "vector[3]", "init": "[0, 0, 0]"},
            },
        },
        "y": {"a": {"g": "real"}, "d": {"u": "real"}},
        "memory": {"m": {"type": "real", "init": 0}},
        "let": lets,
        "functions": {"go": {"y.a.g": "m", "y.d.u": "m", "m": "x.d.k"}},
    }
    control["behaviours"]["go"]["functions"] = ["go"]
    return control


def _lets(random: Random, *, compared: bool) -> Spec:
    """A chain of lets, each written by itself, or all of them by one `for`.

    Members of a group are `compared` where one index numbers them.
    """
    length = random.choice((3, 6, 10, 20, 40, 60))
    all_numbers, all_conditions = (
        [step for step in steps if compared or "x.a)" not in step or "arg" not in step]
        for steps in (_NUMBERS, _CONDITIONS)
    )
    numbers, conditions = random.choice(all_numbers), random.choice(all_conditions)
    lets: Spec = {"n_0": "x.d.k", "c_0": "x.d.k > 0"}
    if random.random() < 0.4:
        each = {"i": f"1..{random.choice((length, length, 200, 900))}"}
        below = "n_{i - 1}", "c_{i - 1}", "i"
        lets |= {
            "n_{i}": {"for": each, "is": numbers.format(*below)},
            "c_{i}": {"for": each, "is": conditions.format(*below)},
        }
        last = int(each["i"].rpartition("..")[2])
    else:
        last = length
        for i in range(1, length + 1):
            step = random.choice(all_numbers) if random.random() < 0.3 else numbers
            test = random.choice(all_conditions) if random.random() < 0.3 else conditions
            below = f"n_{i - 1}", f"c_{i - 1}", str(i)
            lets |= {f"n_{i}": step.format(*below), f"c_{i}": test.format(*below)}
    lets |= {"number": f"n_{last}", "test": f"c_{last}"}
    return lets


def _in_functions(spec: Spec, hub: Spec, random: Random) -> None:
    hub["functions"]["go"] |= {"y.a.g": "number", "m": "1 if test else number"}


def _in_rows(spec: Spec, hub: Spec, random: Random) -> None:
    other = random.choice(("not test", "number > 3", "not (number > 3 and test)"))
    hub["conditions"] = {"initial": {"one": "test", "other": other}}
    hub["behaviours"]["go"]["terminal"] = "always"
    hub["transitions"] = [["S0", "terminal", name, "S0"] for name in ("one", "other")]


def _at_the_end(spec: Spec, hub: Spec, random: Random) -> None:
    hub["conditions"] = {
        "terminal": {"late": "elapsed > 3[s] or test"},
        "error": {"lost": "number > 4 and elapsed > 4[s] and test"},
    }
    hub["behaviours"]["go"] |= {"terminal": "late", "error": "lost"}
    hub["transitions"] = [["S0", cause, "always", "S0"] for cause in ("terminal", "error")]


def _assumed(spec: Spec, hub: Spec, random: Random) -> None:
    _in_rows(spec, hub, random)
    hub["assume"] = [{"that": "x.d.k > 3 or test", "because": "so it is"}]


def _required(spec: Spec, hub: Spec, random: Random) -> None:
    """Lets of requirements, which double, too, beside those of the machine."""
    step = random.choice(
        (
            "f_{0} and within(1[s], f_{0})",
            "f_{0} or all(r.c.s > {1} and f_{0} for r in a)",
            "f_{0} or not f_{0}",
            "any(r.c.s > {1} or f_{0} for r in a)",
            "argmin(r.c.s for r in a) > {1} and f_{0} or f_{0}",
        )
    )
    count = random.choice((3, 12, 30))
    spec["let"] = {"f_0": "hub.c.m > 3"}
    spec["let"] |= {f"f_{i}": step.format(i - 1, i) for i in range(1, count + 1)}
    spec["require"] = [{"that": f"always(f_{count})", "because": "so it is"}]
    _in_functions(spec, hub, random)


_USES: tuple[Callable[[Spec, Spec, Random], None], ...] = (
    _in_functions,
    _in_rows,
    _at_the_end,
    _assumed,
    _required,
)


def _of_lets(random: Random) -> Spec:
    """Many agents and one that says something of all of them, by lets of lets."""
    each = _ranges(random)
    hub = _hub(_lets(random, compared=len(each) == 1))
    agents = _agents(each)
    spec: Spec = {"specc": 1.2, "system": "doubled", "agents": agents}
    device: Spec = {"x": {"u": "real"}, "y": {"k": "real", "three": "vector[3]"}}
    passing = _control() | {
        "x": {"c": {"u": {"type": "real", "init": 0}}, "E": device["y"]},
        "y": {"c": device["y"], "E": {"u": "real"}},
        "functions": {"go": {"y.c.k": "x.E.k", "y.c.three": "x.E.three", "y.E.u": "x.c.u"}},
    }
    passing["behaviours"]["go"]["functions"] = ["go"]
    agents["hub"] = {
        "real_effectors": {"d": device},
        "virtual_effectors": {"d": passing},
        "control": hub,
    }
    random.choice(_USES)(spec, hub, random)
    return spec


def _of_constants(random: Random) -> Spec:
    """Constants that are each made of the one below more than once."""
    step = random.choice(
        ("{0} + {0}", "[{0}[0] + {0}[1], {0}[0]]", "{0} * {0}", "any(a > {0} for a in [1, 2, 3])")
    )
    step = random.choice((step, "max({0}, {0} + 1)", "argmin({0} - a for a in [1, 2, 3]) + {0}"))
    first = "[1, 2]" if "[0]" in step else "1 > 0" if step.startswith("any") else "1"
    count = random.choice((10, 30, 100))
    spec = _of_lets(random)
    spec["constants"] = {"k_0": first}
    spec["constants"] |= {f"k_{i}": step.format(f"k_{i - 1}") for i in range(1, count + 1)}
    return spec


def _of_machines(random: Random) -> Spec:
    """Many small machines in a grid that wait for each other, with memory by a `for`."""
    sides = random.choice(((3,), (30,), (300,), (3, 3), (6, 6), (18, 20), (3, 3, 3), (6, 7, 8)))
    names = "ijk"[: len(sides)]
    each = {name: f"1..{side}" for name, side in zip(names, sides, strict=True)}
    tail = "_".join(f"{{{name}}}" for name in names[1:])
    tail = f"_{tail}" if tail else ""
    following = f"g_{{i % {sides[0]} + 1}}{tail}"
    before = f"g_{{(i + {sides[0] - 2}) % {sides[0]} + 1}}{tail}"
    wide = random.choice((1, 4, 40))
    element = random.choice(("bool", "int", "optional[int]"))
    value = {"bool": "x.{0}.e_{1}", "int": "x.{0}.e_{1} + {1}", "optional[int]": "None"}[element]
    initial = {"bool": False, "int": 0, "optional[int]": "None"}[element]
    many = {"m": f"1..{wide}"}
    states = random.choice((2, 5, 12))
    control = {
        "rate": random.choice(("10 Hz", "10 Hz", "7 Hz", "{i} Hz")),
        "x": {before: {f"e_{m}": {"type": element, "init": initial} for m in range(1, wide + 1)}},
        "y": {following: {f"e_{m}": element for m in range(1, wide + 1)}},
        "memory": {"n_{m}": {"for": many, "type": "int", "init": 0}},
        "functions": {
            "go": {
                **{f"y.{following}.e_{m}": value.format(before, m) for m in range(1, wide + 1)},
                "n_{m}": {"for": many, "is": "n_{m} + 1"},
            }
        },
        "conditions": {
            "terminal": {
                "due": random.choice(("n_1 > 3", f"fresh(x.{before}.e_1)", "elapsed > 1[s]"))
            }
        },
        "behaviours": {"go": {"functions": ["go"], "terminal": "due"}},
        "states": {f"S{s}": "go" for s in range(states)},
        "initial_state": "S0",
        "transitions": [
            [f"S{s}", "terminal", "always", f"S{(s + 1) % states}"] for s in range(states)
        ],
    }
    return {
        "specc": 1.2,
        "system": "doubled",
        "agents": {f"g_{{i}}{tail}": {"for": each, "control": control}},
    }


def _shape(random: Random) -> Spec:
    return random.choices((_of_lets, _of_constants, _of_machines), (6, 1, 3))[0](random)


def doubled(seed: int) -> tuple[Files, list[str]]:
    """A text, and the command that reads it, without the name of the file."""
    random = Random(seed)
    spec = _shape(random)
    explored = "hub" not in spec["agents"] or random.random() < 0.25
    commands = (["validate"], ["build", "--out", "gen"], ["explore", "--budget", "100"])
    command = commands[2] if explored and random.random() < 0.7 else random.choice(commands)
    return {MAIN: written(spec)}, command
