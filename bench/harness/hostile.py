"""Small files that ask for much: a kilobyte that multiplies, a megabyte of one thing."""

from __future__ import annotations

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
    "a model": _model,
    "1 MB of formulas": _formulas,
    "390 agents": lambda: GROWING["agents that talk in a ring"](390),
    "1 MB of no YAML": _nothing,
}
"""What a file asks for -> the file; the first one asks for nothing, for comparison."""
