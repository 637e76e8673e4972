"""Small files that ask for much: a kilobyte that multiplies, a megabyte of one thing."""

from __future__ import annotations

import json
from collections.abc import Callable

from bench.harness.lists import DOUBLED, GROWING, MAIN, MODEL, Files, small, written

_TRIPLED, _COPIES, _MANY = 30, 60, 500


def _constants() -> Files:
    """List constants that are each made of the one above three times."""
    spec = small()
    names = {f"c{i}": f"c{i - 1} + c{i - 1} + c{i - 1}" for i in range(1, _TRIPLED)}
    spec["constants"] = {"c0": {"type": "list[int]", "is": "[1, 2]"}} | names
    return {MAIN: written(spec)}


def _quantifiers() -> Files:
    """One in the other, over a list of a kilobyte."""
    spec = small()
    inner = "any(any(a + b + c < 0 for a in l) for b in l)"
    spec["constants"] = {"l": str([1] * _MANY), "k": f"any({inner} for c in l)"}
    return {MAIN: written(spec)}


def _interfaces() -> Files:
    """A ring of agents that all use one interface of many elements."""
    spec = small()
    control = {
        "rate": "10 Hz",
        "functions": {},
        "behaviours": {"go": {"functions": [], "terminal": "never"}},
        "states": {"S0": "go"},
        "initial_state": "S0",
    }
    spec["interfaces"] = {"I": {f"e{i}": {"type": "int", "init": 0} for i in range(_MANY)}}
    spec["agents"] = {
        f"a{i}": {
            "control": control
            | {
                "x": {f"a{(i - 1) % _COPIES}": "I"},
                "y": {f"a{(i + 1) % _COPIES}": "I"},
            }
        }
        for i in range(_COPIES)
    }
    return {MAIN: written(spec)}


def _described() -> Files:
    """A description of a subsystem beside 1500 operators and as many enums, used 130 times."""
    spec = small()
    agent = spec["agents"]["a"]
    names = range(1500)
    signature = "(a: vector[n, m], b: real) -> real"
    described = {
        "specc": 1.2,
        "parameters": {"n": "int"},
        "types": {f"T{i}": {"type": f"enum[l{i}, r{i}]"} for i in names},
        "operators": {f"f{i}": {"signature": signature, "python": f"m:f{i}"} for i in names},
        "subsystem": agent["virtual_effectors"]["m"],
    }
    used = {f"m{i}": {"use": "described.yaml", "with": {"n": i + 1}} for i in range(130)}
    agent["virtual_effectors"] |= used
    return {MAIN: written(spec | {"specc": 1.2}), "described.yaml": written(described)}


def _listed() -> Files:
    """A description that uses ten files of 2000 frames each, used 130 times."""
    spec = small()
    agent = spec["agents"]["a"]
    listed = {
        f"frames{i}.yaml": written({"specc": 1.2, "frames": {f"F{i}_{j}": "" for j in range(2000)}})
        for i in range(10)
    }
    described = {
        "specc": 1.2,
        "use": [*listed],
        "parameters": {"n": "int"},
        "subsystem": agent["virtual_effectors"]["m"],
    }
    used = {f"m{i}": {"use": "described.yaml", "with": {"n": i + 1}} for i in range(130)}
    agent["virtual_effectors"] |= used
    return {MAIN: written(spec | {"specc": 1.2}), "described.yaml": written(described), **listed}


def _formulas() -> Files:
    """Most of a megabyte of requirements."""
    spec = small()
    spec["require"] = [
        {
            "that": f"always({' or '.join(f'a.c.k > {i + j}' for j in range(100))})",
            "because": "so it is",
        }
        for i in range(400)
    ]
    return {MAIN: written(spec)}


def _alike() -> Files:
    """Most of a megabyte of comparisons with itself, each of which is told."""
    spec = small()
    spec["constants"] = {"c": "1.5"}
    that = f"always({' or '.join(['near(c, c, 1)'] * 180)})"
    spec["require"] = [{"that": that, "because": "so it is"} for _ in range(400)]
    return {MAIN: written(spec)}


def _over_ticks() -> Files:
    """Requirements that are many questions about ticks, just not too long together."""
    spec = small()
    spec["require"] = [
        {
            "that": " and ".join(
                f"(a.c.k > {40 * i + j} or within(0.{j + 10}[s], a.c.k < {i + j}))"
                for j in range(40)
            ),
            "because": "so it is",
        }
        for i in range(75)
    ]
    return {MAIN: written(spec)}


def rows(count: int) -> Files:
    """So many rows of one state, whose conditions have 50 terms each."""
    spec = small()
    effector, control = (
        spec["agents"]["a"]["virtual_effectors"]["m"],
        spec["agents"]["a"]["control"],
    )
    names = [f"e{i}" for i in range(50)]
    for name in names:
        effector["x"]["c"][name] = {"type": "int", "init": 0}
        control["y"]["m"][name] = "int"
        control["functions"]["go"][f"y.m.{name}"] = "k"
    effector["conditions"]["initial"] = {
        f"i{i}": " and ".join(f"x.c.{name} == {i}" for name in names) for i in range(count)
    }
    effector["behaviours"]["pass"]["terminal"] = "always"
    effector["transitions"] = [["S0", "terminal", f"i{i}", "S0"] for i in range(count)]
    return {MAIN: written(spec)}


def _loop() -> Files:
    """Agents in a ring, each of which hands ten elements on."""
    spec = json.loads(GROWING["agents that talk in a ring"](390)[MAIN])
    for agent in spec["agents"].values():
        control = agent["control"]
        (before,), (behind,) = control["x"], control["y"]
        given, sent = control["x"][before], control["y"][behind]
        for j in range(9):
            given[f"k{j}"], sent[f"k{j}"] = {"type": "int", "init": 0}, "int"
            control["functions"]["go"][f"y.{behind}.k{j}"] = f"x.{before}.k{j}"
    return {MAIN: written(spec)}


def _paths() -> Files:
    """A plant whose model names files by long names that are not there."""
    files = GROWING["plant bindings"](2)
    meshes = "".join(f'<mesh name="m{i}" file="{"d" * 300}{i}.obj"/>' for i in range(3000))
    model = files[MODEL].replace("<worldbody>", f"<asset>{meshes}</asset><worldbody>", 1)
    return files | {MODEL: model}


def _model() -> Files:
    """A plant whose model copies a body a billion times."""
    files = GROWING["plant bindings"](2)
    many = '<worldbody><replicate count="1000000000"><body/></replicate>'
    return files | {MODEL: files[MODEL].replace("<worldbody>", many)}


def _nothing() -> Files:
    return {MAIN: "specc: 1\n" + "- [a]: *b\n" * 100_000}


HOSTILE: dict[str, Callable[[], Files]] = {
    "nothing": lambda: {MAIN: written(small())},
    "constants that triple": _constants,
    "lets that double": lambda: DOUBLED["bool in quantifiers, beside times"](36),
    "quantifiers": _quantifiers,
    "interfaces": _interfaces,
    "definitions used often": _described,
    "files used often": _listed,
    "a model": _model,
    "paths of a model": _paths,
    "1 MB of formulas": _formulas,
    "1 MB of findings": _alike,
    "formulas over ticks": _over_ticks,
    "rows of 50 terms": lambda: rows(194),
    "more rows of 50 terms": lambda: rows(300),
    "ring of ten elements": _loop,
    "390 agents": lambda: GROWING["agents that talk in a ring"](390),
    "1 MB of no YAML": _nothing,
}
"""What a file asks for -> the file; the first one asks for nothing, for comparison."""
