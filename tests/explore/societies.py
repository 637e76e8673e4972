"""Random systems of many agents: copies, readers of many, events, sporadic devices, rates.

One agent may be described in a file of its own, where parameter and memory may have the names that
constants and elements have elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from specc.pipeline import Result
from tests.explore.modes import add_modes
from tests.soundness.running import compiled
from tests.soundness.specifications import text_of

Tree = dict[str, Any]
LITERALS = {"bool": ("True", "False"), "int": ("0", "1", "2"), "Mode": ("a", "b", "c")}
SHARED = ("limit", "e0")
"""Constants of the system. An element is called `e0`, too."""
RATES_HZ = (10, 20, 50, 100)
REQUIRED = (
    "always(not ({} and {}))",
    "always({} or {})",
    "always({} implies within(0.2[s], {}))",
    "always({} implies throughout(0.1[s], {}))",
    "always({} implies once(0.2[s], {}))",
    "always({} or not since({}, True))",
)

OF_MODES = (
    "always(state({0}) == inner implies within(0.3[s], state({0}) != inner))",
    "always(state({0}) not in {{inner, S0}} or once(0.5[s], inner == state({0})))",
)


@dataclass(slots=True)
class Role:
    """What the machine of a control subsystem may ask and send."""

    values: list[tuple[str, str]] = field(default_factory=list)
    """Texts that have a value from the start, with their types."""
    arrivals: list[str] = field(default_factory=list)
    """What `fresh` can be asked of."""
    many: list[tuple[str, str]] = field(default_factory=list)
    """Elements of each worker, `w.NAME`, with their types."""
    events: list[str] = field(default_factory=list)
    """Inputs that may be ignored."""
    outputs: list[tuple[str, str]] = field(default_factory=list)
    numbers: tuple[str, ...] = SHARED
    """Constants and parameters."""
    count: str = "k"
    """A memory."""

    def literals(self, kind: str) -> tuple[str, ...]:
        """Values of a type that stay."""
        return (*LITERALS[kind], *(self.numbers if kind == "int" else ()))


class Author:
    """Writes one system: a boss, its workers, and sometimes a clerk whom only the boss knows."""

    def __init__(self, rng: Random) -> None:
        self.rng = rng
        self.workers = rng.choice((1, 2, 2, 3))
        self.roles = {name: Role() for name in ("boss", "workers", "clerk")}
        self.trees: dict[str, Tree] = {name: {"x": {}, "y": {}} for name in self.roles}
        self.bound: Tree = {}

    def written(self) -> tuple[Tree, Tree]:
        """The specification, and the file `part.yaml` that it uses."""
        rng = self.rng
        self._connect("boss", "workers")
        self._connect("workers", "boss")
        if rng.randrange(2):
            self._connect("boss", "clerk")
            self._connect("clerk", "boss")
        else:
            del self.roles["clerk"]
        agents: Tree = {}
        for name in self.roles:
            agents[name] = {"for": {"i": f"1..{self.workers}"}} if name == "workers" else {}
            if name == "workers" or rng.randrange(4) == 0:
                self._eye(agents[name], name)
        described = rng.choice(("", *self.roles))
        for name, role in self.roles.items():
            if name == described:
                role.count, parameter = rng.sample(("k", "n", *SHARED), 2)
                role.numbers = (parameter,)
            agents[name]["control"] = self._control(role, self.trees[name])
        part: Tree = {"specc": 1.1, "types": {"Mode": "enum[a, b, c]"}}
        if described:
            part["parameters"] = {parameter: "int"}
            part["subsystem"] = agents[described]["control"]
            given = rng.choice(("0", "1", "3", "i" if described == "workers" else "2"))
            agents[described]["control"] = {"use": "part.yaml", "with": {parameter: given}}
        tree: Tree = {
            "specc": 1.1,
            "system": "society",
            "use": ["part.yaml"],
            "constants": dict(zip(SHARED, rng.choice(((1, 2), (2, 0))), strict=True)),
            "agents": agents,
            "require": [
                {"that": form.format(self._required(), self._required()), "because": "it is so"}
                for form in REQUIRED
            ],
        }
        if self.bound:
            tree["plant"] = {"python": "world:World", "bind": self.bound}
        return tree, part

    def _required(self) -> str:
        """A question about a machine's state, its memory, or what it sends."""
        rng = self.rng
        name = rng.choice([*self.roles])
        role, number = self.roles[name], rng.randrange(self.workers) + 1
        machine = f"workers_{number}.c" if name == "workers" else f"{name}.c"
        way = rng.randrange(4)
        if way < 2:
            return f"state({machine}) == S{rng.randrange(2)}"
        text, kind = f"{machine}.{role.count}", "int"
        if way == 3:
            text, kind = rng.choice(role.outputs)
            text = f"{machine}.{text.replace('y.workers.', f'y.workers_{number}.')}"
        test = _test(rng, text, kind, Role())
        return test if way == 2 else f"(present({text}) and {test})"

    def _connect(self, sender: str, reader: str) -> None:
        rng = self.rng
        for index in range(rng.randrange(1, 3)):
            kind, name = rng.choice([*LITERALS]), f"e{index}"
            is_event = rng.randrange(3) == 0
            element = {"type": kind, "init": rng.choice(LITERALS[kind])}
            if is_event:
                element = {"type": kind, "event": True}
            self.trees[sender]["y"].setdefault(reader, {})[name] = kind
            self.trees[reader]["x"].setdefault(sender, {})[name] = element
            self.roles[sender].outputs.append((f"y.{reader}.{name}", kind))
            role, text = self.roles[reader], f"x.{sender}.{name}"
            if sender != "workers":
                role.arrivals.append(text)
                role.values += [] if is_event else [(text, kind)]
                role.events += [text] if is_event else []
                continue
            role.many.append((name, "" if is_event else kind))
            each = [f"x.workers_{i + 1}.{name}" for i in range(self.workers)]
            role.arrivals += each
            role.events += each if is_event else []
            role.values += [] if is_event else [(one, kind) for one in each]

    def _eye(self, agent: Tree, name: str) -> None:
        """A virtual receptor that says what it sees, in every period or now and then."""
        rng, role = self.rng, self.roles[name]
        agent["real_receptors"] = {"eye": {"y": {"d": "real[m]"}}}
        key = "workers_{i}.R.eye.d" if name == "workers" else f"{name}.R.eye.d"
        self.bound[key] = {"sporadic": True} if rng.randrange(2) else {}
        if name == "workers":
            self.bound[key]["for"] = {"i": f"1..{self.workers}"}
        look: Tree = {
            "rate": f"{rng.choice(RATES_HZ)} Hz",
            "x": {"R": {"d": "real[m]"}},
            "y": {"c": {"near": "bool"}},
            "states": {"S0": "look"},
            "initial_state": "S0",
        }
        say = [{"y.c.near": "x.R.d < 1[m]"}]
        if rng.randrange(2):
            look["behaviours"] = {"look": {"functions": say, "terminal": "never"}}
        else:
            look["conditions"] = {"terminal": {"seen": "fresh(x.R.d) and x.R.d < 1[m]"}}
            look["behaviours"] = {
                "look": {"terminal": "seen"},
                "say": {"functions": say, "terminal": "always"},
            }
            look["states"] = {"S0": "look", "S1": "say"}
            look["transitions"] = [
                ["S0", "terminal", "always", "S1"],
                ["S1", "terminal", "always", "S0"],
            ]
        agent["virtual_receptors"] = {"eye": look}
        self.trees[name]["x"]["eye"] = {"near": {"type": "bool", "init": "False"}}
        # What is seen is asked of more often, also by way of the memory.
        role.values += [("x.eye.near", "bool"), ("b", "bool")] * 3
        role.arrivals.append("x.eye.near")

    def _control(self, role: Role, tree: Tree) -> Tree:
        rng = self.rng
        conditions: Tree = {"initial": {}, "terminal": {}, "error": {}}
        memory = {
            role.count: {"type": "int", "init": 0},
            "m": {"type": "Mode", "init": "a"},
            "b": {"type": "bool", "init": "False"},
        }
        role.values += [(role.count, "int"), ("m", "Mode"), ("b", "bool")]
        states = [f"S{i}" for i in range(rng.randrange(2, 4 if self.workers > 1 else 5))]
        behaviours: Tree = {}
        for state in states:
            behaviours[f"b{state}"] = {
                "functions": [dict(self._assigned(role))],
                "terminal": self._end(role, conditions["terminal"], rng.choice((0, 0, 1, 1, 1, 2))),
                "error": self._end(role, conditions["error"], rng.choice((1, 2, 2, 2))),
            }
        rows = []
        for state in states:
            for cause in ("terminal", "error"):
                if behaviours[f"b{state}"][cause] != "never":
                    rows += self._rows(state, cause, states, role, conditions["initial"])
        tree = {key: part for key, part in tree.items() if part}
        named: Tree = {}
        for state in states:
            ignored = [event for event in role.events if rng.randrange(3) == 0]
            named[state] = f"b{state}"
            if ignored:
                named[state] = {"behaviour": f"b{state}", "ignores": ignored}
        return tree | {
            "rate": f"{rng.choice(RATES_HZ)} Hz",
            "memory": memory,
            "conditions": {kind: part for kind, part in conditions.items() if part},
            "behaviours": behaviours,
            "states": named,
            "initial_state": "S0",
            "transitions": rows,
        }

    def _assigned(self, role: Role) -> list[tuple[str, Any]]:
        rng = self.rng
        found: list[tuple[str, Any]] = []
        for target, kind in role.outputs:
            if rng.randrange(2):
                continue
            text = self._value(role, kind)
            if target.startswith("y.workers."):
                each: Tree = {"for": {"i": f"1..{self.workers}"}, "is": text}
                found.append((target.replace("workers", "workers_{i}"), each))
            else:
                found.append((target, text))
        k = role.count
        if rng.randrange(2):
            found.append(
                (
                    k,
                    rng.choice(
                        (
                            f"min({k} + 1, 3)",
                            f"clamp(2 * {k} - 1, 0, 3)",
                            "0",
                            f"1 if {k} == 0 else 0",
                        )
                    ),
                )
            )
        if rng.randrange(3) == 0:
            found.append(("m", self._value(role, "Mode")))
        if rng.randrange(2):
            found.append(("b", self._value(role, "bool")))
        return found or [(k, k)]

    def _value(self, role: Role, kind: str) -> str:
        same = [text for text, other in role.values if other == kind]
        return self.rng.choice((*role.literals(kind), *same))

    def _end(self, role: Role, known: Tree, way: int) -> str:
        """`always`, a condition of its own, or `never`."""
        if way != 1:
            return "always" if way == 0 else "never"
        known[f"c{len(known)}"] = self._asked(role, 1)
        return f"c{len(known) - 1}"

    def _rows(
        self, state: str, cause: str, states: list[str], role: Role, known: Tree
    ) -> list[list[str]]:
        rng = self.rng
        if rng.randrange(2):
            return [[state, cause, "always", rng.choice(states)]]
        name = f"r{len(known)}"
        known[name] = self._asked(role, 1)
        return [
            [state, cause, name, rng.choice(states)],
            [state, cause, "otherwise", rng.choice(states)],
        ]

    def _asked(self, role: Role, depth: int) -> str:
        rng = self.rng
        if depth and rng.randrange(3) == 0:
            a, b = self._asked(role, depth - 1), self._asked(role, depth - 1)
            return rng.choice((f"({a} and {b})", f"({a} or {b})", f"(not {a})"))
        way = rng.randrange(5)
        if way == 0:
            numbers = [text for text, kind in role.values if kind == "int"]
            patience = rng.choice(
                (f"0.{rng.randrange(1, 4)}[s]", f"{rng.choice(numbers)} * 0.1[s]")
            )
            return f"(elapsed {rng.choice(('>=', '>'))} {patience})"
        if way == 1 and role.arrivals:
            return f"fresh({rng.choice(role.arrivals)})"
        if way < 4 and role.many:
            name, kind = rng.choice(role.many)
            test = _test(rng, f"w.{name}", kind, role) if kind else f"fresh(w.{name})"
            return f"{rng.choice(('any', 'all'))}({test} for w in x.workers)"
        text, kind = rng.choice(role.values)
        return _test(rng, text, kind, role)


def _test(rng: Random, text: str, kind: str, role: Role) -> str:
    if kind == "bool":
        return f"({rng.choice(('', 'not '))}{text})"
    op = rng.choice(("==", "!=", "<", ">=") if kind == "int" else ("==", "!="))
    return f"({text} {op} {rng.choice(role.literals(kind))})"


def society(rng: Random, folder: Path, *, with_modes: bool = False) -> Result:
    """What the compiler makes of a random system of agents (see `Author`), in a folder."""
    author = Author(rng)
    tree, part = author.written()
    for name, agent in tree["agents"].items() if with_modes else ():
        described = "use" in agent["control"]
        control = part["subsystem"] if described else agent["control"]
        add_modes(rng, control, longest_s=1.0, count=author.roles[name].count)
        machine = f"{name}_1.c" if name == "workers" else f"{name}.c"
        that = rng.choice(OF_MODES).format(machine)
        tree["require"].append({"that": that, "because": "it is so"})
    (folder / "part.yaml").write_text(text_of(part), encoding="utf-8")
    return compiled(tree, folder)
