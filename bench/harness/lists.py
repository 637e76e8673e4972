"""Specifications with one list that grows: an entry for every list that a specification can have.

Each is a small sound system whose list has n parts; those of `faulty` have n mistakes in theirs.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

Files = dict[str, str]
"""Texts by path; the specification is `MAIN`."""
Spec = dict[str, Any]
MAIN = "spec.yaml"
MODEL = "plant.xml"
GROWING: dict[str, Callable[[int], Files]] = {}
"""Name of a list -> files with n parts in it."""
COMPONENTS = "components of vectors that are compared"
"""The list that is a number in the file, however long it is."""

_Grow = Callable[[Spec, int], None]


def _listed(name: str) -> Callable[[_Grow], _Grow]:
    """Enter a function that lets the list `name` of the small system grow."""

    def enter(grow: _Grow) -> _Grow:
        def files(n: int) -> Files:
            spec = small()
            grow(spec, n)
            return {MAIN: written(spec)}

        GROWING[name] = files
        return grow

    return enter


def put(files: Files, folder: Path) -> None:
    """Write the files into a folder."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def written(spec: Spec) -> str:
    """The specification as YAML, a line for every scalar: JSON is YAML."""
    return json.dumps(spec, indent=1) + "\n"


def small() -> Spec:
    """One agent: a motor, the virtual effector that drives it, and a control subsystem."""
    return {
        "specc": 1,
        "system": "small",
        "frames": {},
        "types": {},
        "constants": {},
        "files": {},
        "operators": {},
        "agents": {
            "a": {
                "real_effectors": {"m": {"x": {"u": "int"}, "y": {"s": "int"}}},
                "virtual_effectors": {"m": _effector()},
                "virtual_receptors": {},
                "control": _control(),
            }
        },
    }


def _effector(device: str = "E") -> Spec:
    return {
        "rate": "100 Hz",
        "x": {"c": {"go": {"type": "int", "init": 0}}, device: {"s": "int"}},
        "y": {"c": {"done": "int"}, device: {"u": "int"}},
        "memory": {},
        "let": {},
        "conditions": {"initial": {}, "terminal": {}, "error": {}},
        "functions": {"pass": {f"y.{device}.u": "x.c.go", "y.c.done": f"x.{device}.s"}},
        "behaviours": {"pass": {"functions": ["pass"], "terminal": "never"}},
        "states": {"S0": "pass"},
        "initial_state": "S0",
        "transitions": [],
        "assume": [],
    }


def _control() -> Spec:
    return {
        "rate": "100 Hz",
        "x": {"m": {"done": {"type": "int", "init": 0}}},
        "y": {"m": {"go": "int"}},
        "memory": {"k": {"type": "int", "init": 0}},
        "functions": {"go": {"y.m.go": "k", "k": "x.m.done"}},
        "behaviours": {"go": {"functions": ["go"], "terminal": "never"}},
        "states": {"S0": "go"},
        "initial_state": "S0",
    }


def _m(spec: Spec) -> Spec:
    found: Spec = spec["agents"]["a"]["virtual_effectors"]["m"]
    return found


def _c(spec: Spec) -> Spec:
    found: Spec = spec["agents"]["a"]["control"]
    return found


def _sum(names: list[str]) -> str:
    return " + ".join(names)


@_listed("agents that talk in a ring")
def _agents(spec: Spec, n: int) -> None:
    agents = spec["agents"] = {}
    for i in range(n):
        before, behind = f"a{(i - 1) % n}", f"a{(i + 1) % n}"
        agents[f"a{i}"] = {
            "control": _control()
            | {
                "x": {before: {"k": {"type": "int", "init": 0}}},
                "y": {behind: {"k": "int"}},
                "functions": {"go": {f"y.{behind}.k": "k", "k": f"x.{before}.k"}},
            }
        }


@_listed("agents that talk to one")
def _star(spec: Spec, n: int) -> None:
    hub = _c(spec)
    for i in range(n):
        hub["x"][f"b{i}"] = {"k": {"type": "int", "init": 0}}
        hub["functions"]["go"][f"y.b{i}.j"] = f"x.b{i}.k"
        hub["y"][f"b{i}"] = {"j": "int"}
        spec["agents"][f"b{i}"] = {
            "control": _control()
            | {
                "x": {"a": {"j": {"type": "int", "init": 0}}},
                "y": {"a": {"k": "int"}},
                "functions": {"go": {"y.a.k": "k", "k": "x.a.j"}},
            }
        }


@_listed("virtual effectors with their devices")
def _effectors(spec: Spec, n: int) -> None:
    agent, control = spec["agents"]["a"], _c(spec)
    for i in range(n):
        agent["virtual_effectors"][f"m{i}"] = _effector()
        agent["real_effectors"][f"m{i}"] = {"x": {"u": "int"}, "y": {"s": "int"}}
        control["x"][f"m{i}"] = {"done": {"type": "int", "init": 0}}
        control["y"][f"m{i}"] = {"go": "int"}
        control["functions"]["go"][f"y.m{i}.go"] = f"x.m{i}.done"


@_listed("virtual receptors with their devices")
def _receptors(spec: Spec, n: int) -> None:
    agent, control = spec["agents"]["a"], _c(spec)
    agent["real_receptors"] = {f"r{i}": {"y": {"s": "int"}} for i in range(n)}
    for i in range(n):
        agent["virtual_receptors"][f"r{i}"] = _effector() | {
            "x": {"R": {"s": "int"}},
            "y": {"c": {"s": "int"}},
            "functions": {"pass": {"y.c.s": "x.R.s"}},
        }
        control["x"][f"r{i}"] = {"s": {"type": "int", "init": 0}}
    control["functions"]["go"]["k"] = _sum([f"x.r{i}.s" for i in range(n)])


@_listed("devices of one effector (uses)")
def _devices(spec: Spec, n: int) -> None:
    agent, effector = spec["agents"]["a"], _m(spec)
    effector |= _effector("m")
    effector["uses"] = ["m", *(f"d{i}" for i in range(n))]
    for i in range(n):
        agent["real_effectors"][f"d{i}"] = {"x": {"u": "int"}, "y": {"s": "int"}}
        effector["x"][f"d{i}"], effector["y"][f"d{i}"] = {"s": "int"}, {"u": "int"}
        effector["functions"]["pass"][f"y.d{i}.u"] = f"x.d{i}.s"


@_listed("elements of a buffer")
def _elements(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["x"]["c"][f"e{i}"] = {"type": "int", "init": 0}
        _m(spec)["y"]["c"][f"f{i}"] = "int"
        _m(spec)["functions"]["pass"][f"y.c.f{i}"] = f"x.c.e{i}"
        _c(spec)["x"]["m"][f"f{i}"] = {"type": "int", "init": 0}
        _c(spec)["y"]["m"][f"e{i}"] = "int"
        _c(spec)["functions"]["go"][f"y.m.e{i}"] = f"x.m.f{i}"


@_listed("elements that wait for a value")
def _waiting(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["x"]["c"][f"e{i}"] = "int"
        _c(spec)["y"]["m"][f"e{i}"] = "int"
        _c(spec)["functions"][f"go{i}"] = {f"y.m.e{i}": "k"}
        _c(spec)["behaviours"][f"go{i}"] = {"functions": [f"go{i}"], "terminal": "always"}
        _c(spec)["states"][f"T{i}"] = f"go{i}"
        _m(spec)["memory"][f"k{i}"] = {"type": "int", "init": 0}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"x.c.e{i} if fresh(x.c.e{i}) else k{i}"
    _c(spec)["behaviours"]["go"]["terminal"] = "always"
    names = ["S0", *(f"T{i}" for i in range(n))]
    _c(spec)["transitions"] = [
        [one, "terminal", "always", other] for one, other in pairwise([*names, "S0"])
    ]


@_listed("elements of a device")
def _device_elements(spec: Spec, n: int) -> None:
    device = spec["agents"]["a"]["real_effectors"]["m"]
    for i in range(n):
        device["x"][f"u{i}"], device["y"][f"s{i}"] = "int", "int"
        _m(spec)["x"]["E"][f"s{i}"], _m(spec)["y"]["E"][f"u{i}"] = "int", "int"
        _m(spec)["functions"]["pass"][f"y.E.u{i}"] = f"x.E.s{i}"


@_listed("memory")
def _memory(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["memory"][f"k{i}"] = {"type": "int", "init": i}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"k{i} + x.c.go"


@_listed("memory, each of the one before")
def _memory_chain(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["memory"][f"k{i}"] = {"type": "optional[int]", "init": None}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"k{i - 1}" if i else "x.c.go"


@_listed("let")
def _lets(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["let"][f"l{i}"] = f"x.c.go + {i}"
    _m(spec)["functions"]["pass"]["y.E.u"] = _sum([f"l{i}" for i in range(n)])


@_listed("let, each of the one below")
def _let_chain(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["let"][f"l{i}"] = f"l{i + 1} + 1" if i + 1 < n else "x.c.go"
    _m(spec)["functions"]["pass"]["y.E.u"] = "l0"


@_listed("let, each twice the one below")
def _let_doubling(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["let"][f"l{i}"] = f"l{i + 1} + l{i + 1}" if i + 1 < n else "x.c.go"
    _m(spec)["functions"]["pass"]["y.E.u"] = "l0"
    _m(spec)["conditions"]["terminal"]["over"] = "l0 > 3"
    _m(spec)["behaviours"]["pass"]["terminal"] = "over"
    _m(spec)["transitions"] = [["S0", "terminal", "always", "S0"]]


_DOUBLING = {
    "numbers": ("x.c.go", "{0} + {0}", "{0} > 3"),
    "results": ("x.c.go", "size({0}) + size({0} + 1)", "{0} > 3"),
    "times": ("elapsed", "{0} - 0.5 * {0}", "{0} > 3[s]"),
    "bool": ("x.c.lit", "{0} and x.c.go > {1} or {0} and x.c.go < {1}", "{0}"),
    "guards": ("fresh(x.c.some)", "({0} or fresh(x.c.lit)) and ({0} or present(x.c.lit))", "{0}"),
    "optional": ("x.c.some", "{0} if x.c.go > {1} else {0}", "(0 if {0} is None else {0}) > 3"),
    "records": ("x.c.box", "{0} if x.c.go > {1} else {0}", "{0}.a > 3"),
    "enum": ("x.c.mode", "{0} if {0} == u else v", "{0} == u"),
    "poses": ("x.c.pose", "{0} @ {0}", "near({0}, identity(), 1[m], 1[rad])"),
    "vectors": ("x.c.three", "[{0}[0] + {0}[1], {0}[1], {0}[2]]", "any(n > 3 for n in {0})"),
    "constants": ("[1, 2, 3]", "{0} + {0}", "any(n > 3 for n in {0})"),
    "memory": ("fixed", "{0} + {0}", "any(n > 3 for n in {0})"),
    "bool in quantifiers": (
        "x.c.lit",
        "{0} and x.c.go > {1} or {0} and x.c.go < {1}",
        "any({0} and m == u for m in x.c.modes)",
    ),
    "quantifiers": ("x.c.lit", "any({0} and n > {1} for n in x.c.three)", "{0}"),
}
"""Of a kind of value: the last let of a chain, a let by the one below, and a condition."""
_INPUTS: Spec = {
    "lit": {"type": "bool", "init": False},
    "some": {"type": "optional[int]", "init": "None"},
    "box": {"type": "Box", "init": "box(1)"},
    "mode": {"type": "Mode", "init": "u"},
    "pose": {"type": "pose[F, F]", "init": "identity()"},
    "three": {"type": "vector[3]", "init": "[0, 0, 0]"},
    "modes": {"type": "vector[2, Mode]", "init": "[u, v]"},
}


def _doubled(kind: str, use: Callable[[Spec, str], None]) -> Callable[[int], Files]:
    """Lets that each name the one below twice, and a use of the condition about the first one."""
    last, step, condition = _DOUBLING[kind]

    def files(n: int) -> Files:
        spec = small() | {"frames": {"F": "a frame"}}
        spec["types"] = {"Box": {"fields": {"a": "int"}}, "Mode": "enum[u, v]"}
        spec["operators"] = {
            "box": {"signature": "(a: int) -> Box", "python": "p:box"},
            "size": {"signature": "(a: int) -> int", "python": "p:size"},
        }
        _m(spec)["x"]["c"] |= _INPUTS
        _m(spec)["memory"]["fixed"] = {"type": "vector[3]", "init": "[0, 0, 0]"}
        _c(spec)["y"]["m"] |= {name: element["type"] for name, element in _INPUTS.items()}
        sent = {f"y.m.{name}": str(element["init"]) for name, element in _INPUTS.items()}
        _c(spec)["functions"]["go"] |= sent | {"y.m.lit": "k > 3"}
        for i in range(n):
            _m(spec)["let"][f"l{i}"] = step.format(f"l{i + 1}", i) if i + 1 < n else last
        use(spec, condition.format("l0"))
        return {MAIN: written(spec)}

    return files


def _rows(spec: Spec, one: str, other: str) -> None:
    effector = _m(spec)
    effector["conditions"]["initial"] = {"one": one, "other": other}
    effector["behaviours"]["pass"]["terminal"] = "always"
    effector["transitions"] = [["S0", "terminal", name, "S0"] for name in ("one", "other")]


def _needed(spec: Spec, when: str) -> None:
    """What is there only where a condition holds is needed, and written to memory."""
    _m(spec)["memory"]["kept"] = {"type": "optional[int]", "init": "None"}
    _m(spec)["functions"]["pass"] |= {
        "kept": f"1 if {when} else None",
        "y.E.u": f"kept if kept is not None and ({when}) else 0",
    }


def _ended(spec: Spec, when: str) -> None:
    effector = _m(spec)
    effector["conditions"]["terminal"]["late"] = f"elapsed > 3[s] or ({when})"
    effector["conditions"]["error"]["lost"] = f"elapsed > 4[s] and ({when})"
    effector["behaviours"]["pass"] |= {"terminal": "late", "error": "lost"}
    effector["transitions"] = [["S0", cause, "always", "S0"] for cause in ("terminal", "error")]


def _assumed(spec: Spec, when: str) -> None:
    _rows(spec, "x.c.go > 1", "x.c.go <= 1")
    _m(spec)["assume"] = [{"that": "x.c.go > 3", "because": "so it is"}]
    if "elapsed" not in str(_m(spec)["let"]):
        _m(spec)["assume"][0]["that"] += f" or {when}"


_USES: dict[str, Callable[[Spec, str], None]] = {
    "in rows": lambda spec, when: _rows(spec, when, f"not ({when})"),
    "in rows that overlap": lambda spec, when: _rows(spec, when, "x.c.go < 7"),
    "beside times": lambda spec, when: _rows(
        spec, f"(2[s] if {when} else 1[s]) < elapsed", f"elapsed > 3[s] and ({when})"
    ),
    "for what is needed": _needed,
    "at the end": _ended,
    "assumed": _assumed,
}
DOUBLED: dict[str, Callable[[int], Files]] = {
    f"{kind}, {name}": _doubled(kind, use) for kind in _DOUBLING for name, use in _USES.items()
}
"""Kind of value and its use -> n lets that each name the one below twice, and that use."""


@_listed("initial conditions of one state")
def _initial(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["conditions"]["initial"][f"i{i}"] = f"x.c.go == {i}"
        _m(spec)["transitions"].append(["S0", "terminal", f"i{i}", "S0"])
    _m(spec)["conditions"]["initial"]["rest"] = f"x.c.go < 0 or x.c.go >= {n}"
    _m(spec)["transitions"].append(["S0", "terminal", "rest", "S0"])
    _m(spec)["behaviours"]["pass"]["terminal"] = "always"


@_listed("enum members, with a row for each")
def _members(spec: Spec, n: int) -> None:
    spec["types"]["Mode"] = f"enum[{', '.join(f'm{i}' for i in range(n))}]"
    _m(spec)["x"]["c"]["mode"] = {"type": "Mode", "init": "m0"}
    _c(spec)["y"]["m"]["mode"] = "Mode"
    _c(spec)["functions"]["go"]["y.m.mode"] = "m0"
    for i in range(n):
        _m(spec)["conditions"]["initial"][f"i{i}"] = f"x.c.mode == m{i}"
        _m(spec)["transitions"].append(["S0", "terminal", f"i{i}", "S0"])
    _m(spec)["behaviours"]["pass"]["terminal"] = "always"


@_listed("terminal and error conditions, each of a state")
def _ends(spec: Spec, n: int) -> None:
    effector = _m(spec)
    for i in range(n):
        effector["conditions"]["terminal"][f"t{i}"] = f"x.c.go > {i}"
        effector["conditions"]["error"][f"e{i}"] = f"x.E.s > {i}"
        effector["behaviours"][f"b{i}"] = {
            "functions": ["pass"],
            "terminal": f"t{i}",
            "error": f"e{i}",
        }
        effector["states"][f"T{i}"] = f"b{i}"
        effector["transitions"] += [
            [f"T{i}", "terminal", "always", f"T{(i + 1) % n}"],
            [f"T{i}", "error", "always", "T0"],
        ]
    effector["states"].pop("S0")
    effector["behaviours"].pop("pass")
    effector["initial_state"] = "T0"


@_listed("functions, each of a behaviour and a state")
def _machine(spec: Spec, n: int) -> None:
    effector = _m(spec)
    for i in range(n):
        effector["functions"][f"f{i}"] = {"y.E.u": str(i), "y.c.done": "x.E.s"}
        effector["behaviours"][f"b{i}"] = {"functions": [f"f{i}"], "terminal": "always"}
        effector["states"][f"T{i}"] = f"b{i}"
        effector["transitions"].append([f"T{i}", "terminal", "always", f"T{(i + 1) % n}"])
    del effector["functions"]["pass"], effector["behaviours"]["pass"], effector["states"]["S0"]
    effector["initial_state"] = "T0"


@_listed("functions of one behaviour")
def _functions(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["memory"][f"k{i}"] = {"type": "int", "init": 0}
        _m(spec)["functions"][f"f{i}"] = {f"k{i}": f"k{i} + x.c.go"}
        _m(spec)["behaviours"]["pass"]["functions"].append(f"f{i}")


@_listed("states that are entered from every state")
def _dense(spec: Spec, n: int) -> None:
    side = max(2, round(n**0.5))
    effector = _m(spec)
    effector["behaviours"]["pass"]["terminal"] = "always"
    effector["states"] = {f"S{i}": "pass" for i in range(side)}
    for j in range(side):
        effector["conditions"]["initial"][f"i{j}"] = (
            f"x.c.go == {j}" if j + 1 < side else f"x.c.go < 0 or x.c.go >= {j}"
        )
    effector["transitions"] = [
        [f"S{i}", "terminal", f"i{j}", f"S{j}"] for i in range(side) for j in range(side)
    ]


@_listed("assumptions")
def _assumptions(spec: Spec, n: int) -> None:
    effector = _m(spec)
    effector["assume"] = [
        {"that": f"x.c.go < {1000 + i} or x.E.s < {i}", "because": "so it is"} for i in range(n)
    ]
    effector["conditions"]["initial"] = {"low": "x.c.go < 5", "high": "x.c.go >= 5"}
    effector["behaviours"]["pass"]["terminal"] = "always"
    effector["transitions"] = [["S0", "terminal", i, "S0"] for i in ("low", "high")]


@_listed("types")
def _types(spec: Spec, n: int) -> None:
    for i in range(n):
        spec["types"][f"T{i}"] = {"fields": {"a": "real[m]", "b": "int"}}
        _m(spec)["memory"][f"k{i}"] = {"type": f"optional[T{i}]", "init": None}
    _m(spec)["let"]["l"] = _sum([f"(0 if k{i} is None else k{i}.b)" for i in range(n)])
    _m(spec)["functions"]["pass"]["y.E.u"] = "l"


@_listed("types, each an alias of the one below")
def _aliases(spec: Spec, n: int) -> None:
    for i in range(n):
        spec["types"][f"T{i}"] = f"T{i + 1}" if i + 1 < n else "int"
    _m(spec)["memory"]["t"] = {"type": "T0", "init": 0}
    _m(spec)["functions"]["pass"]["y.E.u"] = "t"


@_listed("types, each a record of two of the one below")
def _record_doubling(spec: Spec, n: int) -> None:
    for i in range(n):
        below = f"T{i + 1}" if i + 1 < n else "int"
        spec["types"][f"T{i}"] = {"fields": {"a": below, "b": below}}
    spec["operators"]["make"] = {"signature": "(a: int) -> T0", "python": "p:make"}
    spec["operators"]["size"] = {"signature": "(t: T0) -> int", "python": "p:size"}
    _m(spec)["memory"]["t"] = {"type": "T0", "init": "make(1)"}
    _m(spec)["functions"]["pass"] |= {"t": "t", "y.E.u": "size(t)"}


@_listed("types with a frame, each of two of the one below")
def _framed_doubling(spec: Spec, n: int) -> None:
    spec["frames"] = {"F": "a frame"}
    for i in range(n):
        below = f"T{i + 1}[F]" if i + 1 < n else "pose[F, F]"
        spec["types"][f"T{i}"] = {"frames": ["F"], "fields": {"a": below, "b": below}}
    spec["operators"]["make"] = {"signature": "(a: int) -> T0[F]", "python": "p:make"}
    spec["operators"]["size"] = {"signature": "(t: T0[G]) -> int", "python": "p:size"}
    _m(spec)["memory"]["t"] = {"type": "T0[F]", "init": "make(1)"}
    _m(spec)["functions"]["pass"] |= {"t": "t", "y.E.u": "size(t)"}


@_listed("fields of a record")
def _fields(spec: Spec, n: int) -> None:
    spec["types"]["T"] = {"fields": {f"f{i}": "int" for i in range(n)}}
    spec["operators"]["make"] = {"signature": "(a: int) -> T", "python": "p:make"}
    _m(spec)["memory"]["t"] = {"type": "T", "init": "make(1)"}
    _m(spec)["functions"]["pass"] |= {"y.E.u": _sum([f"t.f{i}" for i in range(n)])}


@_listed("enums with the same members")
def _enums(spec: Spec, n: int) -> None:
    for i in range(n):
        spec["types"][f"E{i}"] = "enum[u, v]"
        _m(spec)["memory"][f"k{i}"] = {"type": f"E{i}", "init": "u"}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"v if k{i} == u else u"


@_listed("operators")
def _operators(spec: Spec, n: int) -> None:
    for i in range(n):
        spec["operators"][f"OP{i}"] = {"signature": "(a: int) -> int", "python": f"p:op{i}"}
    _m(spec)["functions"]["pass"]["y.E.u"] = _sum([f"OP{i}(x.c.go)" for i in range(n)])


@_listed("parameters of an operator")
def _operator_parameters(spec: Spec, n: int) -> None:
    parameters = ", ".join(f"a{i}: int" for i in range(n))
    spec["operators"]["OP"] = {"signature": f"({parameters}) -> int", "python": "p:op"}
    _m(spec)["functions"]["pass"]["y.E.u"] = f"OP({', '.join(['x.c.go'] * n)})"


@_listed("constants")
def _constants(spec: Spec, n: int) -> None:
    spec["constants"] = {f"c{i}": str(i) for i in range(n)}
    _m(spec)["functions"]["pass"]["y.E.u"] = _sum([f"c{i}" for i in range(n)])


@_listed("constants, each of the one above")
def _constant_chain(spec: Spec, n: int) -> None:
    spec["constants"] = {f"c{i}": f"c{i - 1} + 1" if i else "1" for i in range(n)}
    _m(spec)["functions"]["pass"]["y.E.u"] = f"c{n - 1}"
    _m(spec)["conditions"]["terminal"]["over"] = f"x.c.go > c{n - 1}"
    _m(spec)["behaviours"]["pass"]["terminal"] = "over"
    _m(spec)["transitions"] = [["S0", "terminal", "always", "S0"]]


@_listed("constants, each twice the one above")
def _constant_doubling(spec: Spec, n: int) -> None:
    spec["constants"] = {f"c{i}": f"c{i - 1} + c{i - 1}" if i else "0" for i in range(n)}
    _m(spec)["functions"]["pass"]["y.E.u"] = f"c{n - 1}"
    _m(spec)["conditions"]["terminal"]["over"] = f"x.c.go > c{n - 1}"
    _m(spec)["behaviours"]["pass"]["terminal"] = "over"
    _m(spec)["transitions"] = [["S0", "terminal", "always", "S0"]]


@_listed("frames")
def _frames(spec: Spec, n: int) -> None:
    spec["frames"] = {f"F{i}": "a frame" for i in range(n)}
    for i in range(n):
        _m(spec)["memory"][f"k{i}"] = {"type": f"pose[F{i}, F{(i + 1) % n}]", "init": "identity()"}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"k{i}"


@_listed("equation numbers")
def _numbers(spec: Spec, n: int) -> None:
    _m(spec)["functions"]["pass"]["eq"] = list(range(n))
    _m(spec)["eq"] = list(range(n))


@_listed("terms of a sum")
def _terms(spec: Spec, n: int) -> None:
    _m(spec)["functions"]["pass"]["y.E.u"] = _sum(["x.c.go"] * n)


@_listed("terms of a condition")
def _parts_of_conditions(spec: Spec, n: int) -> None:
    when = " or ".join(f"x.c.go == {i}" for i in range(n))
    _m(spec)["conditions"]["initial"] = {"some": when, "none": f"not ({when})"}
    _m(spec)["behaviours"]["pass"]["terminal"] = "always"
    _m(spec)["transitions"] = [["S0", "terminal", i, "S0"] for i in ("some", "none")]


@_listed("Booleans of a condition")
def _booleans(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["memory"][f"b{i}"] = {"type": "bool", "init": False}
        _m(spec)["functions"]["pass"][f"b{i}"] = f"not b{i}"
    when = " and ".join(f"b{i}" for i in range(n))
    _m(spec)["conditions"]["initial"] = {"some": when, "none": f"not ({when})"}
    _m(spec)["behaviours"]["pass"]["terminal"] = "always"
    _m(spec)["transitions"] = [["S0", "terminal", i, "S0"] for i in ("some", "none")]


@_listed("numbers of a vector")
def _vector(spec: Spec, n: int) -> None:
    _m(spec)["memory"]["v"] = {"type": f"vector[{n}]", "init": f"[{', '.join(['0.5'] * n)}]"}
    _m(spec)["functions"]["pass"]["v"] = "2 * v"


def _first_of(spec: Spec, first: str, second: str) -> None:
    """Two rows, of conditions of which the solver is asked whether they exclude each other."""
    _m(spec)["conditions"]["initial"] = {"first": first, "second": second}
    _m(spec)["behaviours"]["pass"]["terminal"] = "always"
    _m(spec)["transitions"] = [["S0", "terminal", i, "S0"] for i in ("first", "second")]


@_listed(COMPONENTS)
def _compared_vectors(spec: Spec, n: int) -> None:
    for element in ("v", "w"):
        _m(spec)["x"]["E"][element] = f"vector[{n}, int]"
        spec["agents"]["a"]["real_effectors"]["m"]["y"][element] = f"vector[{n}, int]"
    _first_of(spec, "x.E.v == x.E.w", "x.E.v[0] != x.E.w[0]")


def _with_lists(spec: Spec) -> None:
    for element in ("l", "k"):
        _m(spec)["x"]["E"][element] = "list[real]"
        spec["agents"]["a"]["real_effectors"]["m"]["y"][element] = "list[real]"


@_listed("quantifiers over one list, and its length")
def _quantifiers(spec: Spec, n: int) -> None:
    _with_lists(spec)
    some = " or ".join(f"len(x.E.l) > {i} and any(v > {i} for v in x.E.l)" for i in range(n))
    _first_of(spec, some, "len(x.E.l) > 0")


@_listed("quantifiers in quantifiers over two lists")
def _nested_quantifiers(spec: Spec, n: int) -> None:
    _with_lists(spec)
    each = (f"any(all(v > w + {i} for v in x.E.l) for w in x.E.k)" for i in range(n))
    _first_of(spec, " and ".join(each), "len(x.E.l) > 0")


@_listed("characters of titles")
def _titles(spec: Spec, n: int) -> None:
    _m(spec)["title"] = "long \n" * n


def _commented(comment: str) -> Callable[[int], Files]:
    return lambda n: {MAIN: written(small()) + comment * n}


GROWING["ignore comments"] = _commented("# specc: ignore[W0606] so it is\n")
GROWING["ignore comments of unknown codes"] = _commented("# specc: ignore[W9999] so it is\n")
GROWING["ignore comments that say nothing"] = _commented("# specc: W0606\n")
GROWING["codes of one comment"] = lambda n: {
    MAIN: written(small()) + f"# specc: ignore[{', '.join(['W0606'] * n)}] so it is\n"
}
GROWING["comments"] = _commented("# nothing of interest\n")
GROWING["empty lines"] = _commented("\n")
GROWING["spaces"] = _commented("      ")


def _used(n: int) -> Files:
    spec = small() | {"use": [f"lib{i}.yaml" for i in range(n)]}
    spec["constants"] = {"all": _sum([f"c{i}" for i in range(n)])}
    _m(spec)["functions"]["pass"]["y.E.u"] = "all"
    libraries = {f"lib{i}.yaml": f"specc: 1\nconstants: {{c{i}: 1}}\n" for i in range(n)}
    return {MAIN: written(spec), **libraries}


def _use_chain(n: int) -> Files:
    spec = small() | {"use": ["lib0.yaml"]}
    _m(spec)["functions"]["pass"]["y.E.u"] = "c0"
    libraries = {
        f"lib{i}.yaml": f"specc: 1\nuse: [lib{i + 1}.yaml]\nconstants: {{c{i}: c{i + 1}}}\n"
        for i in range(n)
    }
    return {MAIN: written(spec), **libraries, f"lib{n}.yaml": f"specc: 1\nconstants: {{c{n}: 1}}\n"}


def _use_diamonds(n: int) -> Files:
    """Each of two files uses both of the next: 2^n ways to the last."""
    spec = small() | {"use": ["a0.yaml", "b0.yaml"]}
    _m(spec)["functions"]["pass"]["y.E.u"] = "last"
    libraries = {
        f"{side}{i}.yaml": f"specc: 1\nuse: [a{i + 1}.yaml, b{i + 1}.yaml]\n"
        for i in range(n)
        for side in "ab"
    }
    ends = {f"a{n}.yaml": "specc: 1\nconstants: {last: 1}\n", f"b{n}.yaml": "specc: 1\n"}
    return {MAIN: written(spec), **libraries, **ends}


def _spellings(n: int) -> Files:
    spec = small() | {"use": [f"{'./' * i}lib.yaml" for i in range(n)]}
    return {MAIN: written(spec), "lib.yaml": "specc: 1\n"}


def _instances(n: int) -> Files:
    spec = small()
    for i in range(n):
        spec["agents"][f"b{i}"] = {"use": "agent.yaml", "with": {"step": str(i)}}
        _c(spec)["x"][f"b{i}"] = {"n": {"type": "int", "init": 0}}
    _c(spec)["functions"]["go"]["k"] = _sum([f"x.b{i}.n" for i in range(n)])
    return {MAIN: written(spec), "agent.yaml": _DESCRIPTION.format(parameters="step: int")}


def _parameters(n: int) -> Files:
    spec = small()
    arguments = {f"p{i}": str(i) for i in range(n)}
    spec["agents"]["b"] = {"use": "agent.yaml", "with": {"step": "1", **arguments}}
    _c(spec)["x"]["b"] = {"n": {"type": "int", "init": 0}}
    _c(spec)["functions"]["go"]["k"] = "x.b.n"
    parameters = ", ".join(["step: int", *(f"p{i}: int" for i in range(n))])
    return {MAIN: written(spec), "agent.yaml": _DESCRIPTION.format(parameters=parameters)}


def _local_constants(n: int) -> Files:
    """A description whose constants are a chain; they stand for their values where it is used."""
    spec = small()
    spec["agents"]["b"] = {"use": "agent.yaml", "with": {"step": "1"}}
    _c(spec)["x"]["b"] = {"n": {"type": "int", "init": 0}}
    _c(spec)["functions"]["go"]["k"] = "x.b.n"
    chain = "\n".join(f"  c{i}: c{i - 1} + c{i - 1}" if i else "  c0: 1" for i in range(n))
    text = _DESCRIPTION.format(parameters="step: int").replace("k + step", f"k + step * c{n - 1}")
    return {MAIN: written(spec), "agent.yaml": f"{text}constants:\n{chain}\n"}


_DESCRIPTION = """\
specc: 1
parameters: {{{parameters}}}
agent:
  control:
    rate: 100 Hz
    y: {{a: {{n: int}}}}
    memory: {{k: {{type: int, init: 0}}}}
    functions: {{count: {{k: k + step, y.a.n: k}}}}
    behaviours: {{count: {{functions: [count], terminal: never}}}}
    states: {{S0: count}}
    initial_state: S0
"""


def _files(n: int) -> Files:
    spec = small()
    spec["files"] = {f"f{i}": "data.txt" for i in range(n)}
    spec["operators"]["OP"] = {"signature": "(a: file) -> int", "python": "p:op"}
    spec["constants"] = {"all": _sum([f"OP(f{i})" for i in range(n)])}
    _m(spec)["functions"]["pass"]["y.E.u"] = "all"
    return {MAIN: written(spec), "data.txt": ""}


GROWING |= {
    "uses": _used,
    "uses, each of the next": _use_chain,
    "uses, two ways to each": _use_diamonds,
    "spellings of one used file": _spellings,
    "uses of one description": _instances,
    "parameters": _parameters,
    "constants of a description, each twice the one above": _local_constants,
    "files": _files,
}


def _plant(n: int) -> Files:
    spec = small()
    agent = spec["agents"]["a"]
    agent["real_effectors"]["m"] = {
        "x": {f"u{i}": "real" for i in range(n)},
        "y": {f"s{i}": "real[rad]" for i in range(n)},
    }
    effector = _m(spec)
    effector["x"]["E"] = {f"s{i}": "real[rad]" for i in range(n)}
    effector["y"]["E"] = {f"u{i}": "real" for i in range(n)}
    effector["functions"]["pass"] = {f"y.E.u{i}": f"x.E.s{i} / 1[rad]" for i in range(n)} | {
        "y.c.done": "x.c.go"
    }
    bind: Spec = {}
    for i in range(n):
        bind[f"a.E.m.u{i}"] = {"actuators": [f"u{i}"]}
        bind[f"a.E.m.s{i}"] = {"joints": [f"j{i}"], "noise": "0.001[rad]"}
    spec["plant"] = {"model": MODEL, "bind": bind}
    bodies = "".join(f'<body><joint name="j{i}"/><geom size="1"/></body>\n' for i in range(n))
    motors = "".join(f'<motor name="u{i}" joint="j{i}"/>\n' for i in range(n))
    model = f"<mujoco><worldbody>\n{bodies}</worldbody><actuator>\n{motors}</actuator></mujoco>\n"
    return {MAIN: written(spec), MODEL: model}


def _includes(n: int) -> Files:
    files = _plant(2)
    files[MODEL] = files[MODEL].replace(
        "<worldbody>", "".join(f'<include file="part{i}.xml"/>\n' for i in range(n)) + "<worldbody>"
    )
    return {**files, **{f"part{i}.xml": "<mujoco/>" for i in range(n)}}


def _include_spellings(n: int) -> Files:
    files = _plant(2)
    files[MODEL] = files[MODEL].replace(
        "<worldbody>",
        "".join(f'<include file="{"./" * i}part.xml"/>\n' for i in range(n)) + "<worldbody>",
    )
    return {**files, "part.xml": "<mujoco/>"}


def _watched(n: int) -> Files:
    spec = small()
    for i in range(n):
        _c(spec)["memory"][f"k{i}"] = {"type": "int", "init": 0}
        _c(spec)["functions"]["go"][f"k{i}"] = f"k{i} + 1"
    _c(spec)["behaviours"]["go"]["terminal"] = "always"
    _c(spec)["transitions"] = [["S0", "terminal", "always", "S0"]]
    spec["task"] = {
        "cycle": {"of": "a.c", "from": "S0", "to": "S0"},
        "judge": "p:Judge",
        "watch": [f"a.c.k{i}" for i in range(n)],
    }
    return {MAIN: written(spec)}


GROWING |= {
    "plant bindings": _plant,
    "includes of the model": _includes,
    "spellings of one include": _include_spellings,
    "watched memory of the task": _watched,
}

_FAULTY = "faulty: "


def _faulty(name: str) -> Callable[[_Grow], _Grow]:
    return _listed(_FAULTY + name)


@_faulty("unknown keys")
def _unknown_keys(spec: Spec, n: int) -> None:
    spec |= {f"key{i}": 1 for i in range(n)}


@_faulty("wrong kinds")
def _wrong_kinds(spec: Spec, n: int) -> None:
    _m(spec)["memory"] = {f"k{i}": {"type": [], "init": []} for i in range(n)}


@_faulty("rows of a wrong length")
def _wrong_rows(spec: Spec, n: int) -> None:
    _m(spec)["transitions"] = [["S0", "terminal"]] * n


@_faulty("rows of wrong kinds")
def _wrong_items(spec: Spec, n: int) -> None:
    _m(spec)["transitions"] = [{"from": 1, "cause": 2, "when": [], "to": {}}] * n


@_faulty("unknown names")
def _unknown_names(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["memory"][f"k{i}"] = {"type": "int", "init": 0}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"kk{i} + 1"


@_faulty("slips of one name")
def _slips(spec: Spec, n: int) -> None:
    _m(spec)["memory"]["distance"] = {"type": "int", "init": 0}
    for i in range(n):
        _m(spec)["memory"][f"k{i}"] = {"type": "int", "init": 0}
        _m(spec)["functions"]["pass"][f"k{i}"] = "distanse + 1"


@_faulty("unknown names in one expression")
def _unknown_terms(spec: Spec, n: int) -> None:
    _m(spec)["functions"]["pass"]["y.E.u"] = _sum([f"k{i}" for i in range(n)])


@_faulty("unknown elements")
def _unknown_elements(spec: Spec, n: int) -> None:
    _m(spec)["x"]["c"] |= {f"e{i}": {"type": "int", "init": 0} for i in range(n)}
    for i in range(n):
        _m(spec)["memory"][f"k{i}"] = {"type": "int", "init": 0}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"x.c.ee{i}"


@_faulty("unknown types")
def _unknown_types(spec: Spec, n: int) -> None:
    spec["types"] = {f"Type{i}": f"Typo{i}" for i in range(n)}


@_faulty("unknown states")
def _unknown_states(spec: Spec, n: int) -> None:
    _m(spec)["states"] |= {f"T{i}": "pass" for i in range(n)}
    _m(spec)["transitions"] = [[f"U{i}", "terminal", "always", f"V{i}"] for i in range(n)]


@_faulty("unknown behaviours")
def _unknown_behaviours(spec: Spec, n: int) -> None:
    _m(spec)["states"] |= {f"T{i}": f"passs{i}" for i in range(n)}


@_faulty("unknown functions")
def _unknown_functions(spec: Spec, n: int) -> None:
    _m(spec)["behaviours"]["pass"]["functions"] = [f"f{i}" for i in range(n)]


@_faulty("unknown conditions")
def _unknown_conditions(spec: Spec, n: int) -> None:
    _m(spec)["conditions"]["initial"] = {f"i{i}": "fresh(x.c.go)" for i in range(n)}
    _m(spec)["transitions"] = [["S0", "terminal", f"j{i}", "S0"] for i in range(n)]


@_faulty("unknown peers")
def _unknown_peers(spec: Spec, n: int) -> None:
    _c(spec)["x"] |= {f"b{i}": {"k": "int"} for i in range(n)}


@_faulty("missing elements of a peer")
def _missing_elements(spec: Spec, n: int) -> None:
    _c(spec)["x"]["m"] |= {f"e{i}": "int" for i in range(n)}
    _m(spec)["y"]["c"] |= {f"f{i}": "int" for i in range(n)}


@_faulty("missing files")
def _missing_files(spec: Spec, n: int) -> None:
    spec["files"] = {f"f{i}": f"data{i}.txt" for i in range(n)}
    spec["use"] = [f"lib{i}.yaml" for i in range(n)]


@_faulty("wrong bindings")
def _wrong_bindings(spec: Spec, n: int) -> None:
    spec["plant"] = {"model": MODEL, "bind": {f"a.E.m.u{i}": {} for i in range(n)}}


@_faulty("rows that overlap")
def _overlapping(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["conditions"]["initial"][f"i{i}"] = f"x.c.go > {i}"
        _m(spec)["transitions"].append(["S0", "terminal", f"i{i}", "S0"])
    _m(spec)["behaviours"]["pass"]["terminal"] = "always"


@_faulty("states without rows")
def _without_rows(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["conditions"]["initial"][f"i{i}"] = f"x.c.go > {i}"
        _m(spec)["states"][f"T{i}"] = "pass"
        _m(spec)["transitions"].append([f"T{i}", "terminal", f"i{i}", f"T{(i + 1) % n}"])
    _m(spec)["behaviours"]["pass"]["terminal"] = "always"


@_faulty("parts that nothing uses")
def _unused(spec: Spec, n: int) -> None:
    for i in range(n):
        spec["types"][f"Type{i}"] = "int"
        spec["constants"][f"constant{i}"] = "1"
        _m(spec)["functions"][f"f{i}"] = {"y.E.u": "1"}
        _m(spec)["behaviours"][f"b{i}"] = {"functions": [f"f{i}"], "terminal": "never"}
        _m(spec)["states"][f"T{i}"] = f"b{i}"
        _m(spec)["let"][f"l{i}"] = "1"
        _m(spec)["conditions"]["initial"][f"i{i}"] = "fresh(x.c.go)"


@_faulty("values that may be missing")
def _unpresent(spec: Spec, n: int) -> None:
    for i in range(n):
        _m(spec)["x"]["c"][f"e{i}"] = "int"
        _c(spec)["y"]["m"][f"e{i}"] = "int"
        _m(spec)["memory"][f"k{i}"] = {"type": "int", "init": 0}
        _m(spec)["functions"]["pass"][f"k{i}"] = f"x.c.e{i}"


def _repeated_keys(n: int) -> Files:
    return {MAIN: "specc: 1\n" + "system: s\n" * n}


def _digits(n: int) -> Files:
    spec = small()
    _m(spec)["functions"]["pass"]["y.E.u"] = "1." * n + "$"
    return {MAIN: written(spec)}


def _nested(n: int) -> Files:
    spec = small()
    _m(spec)["functions"]["pass"]["y.E.u"] = "(" * n + "1" + ")" * n
    return {MAIN: written(spec)}


def _depth(n: int) -> Files:
    return {MAIN: "[" * n}


GROWING |= {
    f"{_FAULTY}repeated keys": _repeated_keys,
    f"{_FAULTY}digits and points": _digits,
    f"{_FAULTY}brackets of an expression": _nested,
    f"{_FAULTY}brackets of the file": _depth,
}
