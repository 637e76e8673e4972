"""Random systems that are small enough to be enumerated: counters, ramps, timers, handshakes."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random
from typing import Any

from specc.pipeline import Result
from tests.explore.enumeration import Enumeration, Look
from tests.explore.formulas import Form, Formula
from tests.soundness.running import built

Tree = dict[str, Any]
LONGEST_S = 1.5
TIMES_S = (0.1, 0.25, 0.3, 0.5, 1.0, LONGEST_S)
LIMITS = (3, 3, 4, 5, 7, 9, 12, 17, 25, 40)
SENSORS: dict[str, tuple[str, tuple[Any, ...]]] = {
    "seen": ("bool", (False, True)),
    "part": ("Part", ("u", "v", "w")),
    "count": ("int", (-1, 0, 1, 5)),
}
COUNTED = (
    "{k} + 1",
    *("{k} + 1 if {k} < {n} else {k}",) * 3,
    *("{k} + 1 if {k} < {n} else 0",) * 3,
    "min({k} + {s}, {n})",
    "clamp({k} + {s}, 0, {n})",
    "max({k} - 1, 0)",
    "clamp({other} - {k}, -{n}, {n})",
    "min(abs({k} - {other}), {n})",
    "{k} + 1 if {test} else {k}",
    "{k} if {test} else 0",
    "min({k} + sign({other} - 2), {n})",
    "{other}",
)
RESET = ("0", "0", "0", "1", "{n}", "{other}")
RAMPED = (
    "min(r + 0.125, {s}.5)",
    "r + 0.25 if r < {s} else r",
    "max(r - 0.5, 0.0)",
    "clamp(r + 0.25 * {k}, 0.0, {s}.0)",
    "0.0",
)
COMPARED = (
    *("{k} >= {n}",) * 3,
    "{k} > {n}",
    "{k} == {n}",
    "{k} != {n} and {other} > {s}",
    "{k} - {other} >= {s}",
    "{k} < {other}",
    "abs({k} - {n}) < 2",
    "min({k}, {n}) == {n}",
    "2 * {k} - 3 >= {n}",
    "sign({k} - {s}) > 0",
)
TIMED = (
    "elapsed > {t}[s]",
    "elapsed >= 0.25[s] * q",
    "elapsed >= {t}[s] and {k} < {n}",
    "elapsed > {t}[s] or {k} > {n}",
)


@dataclass(slots=True)
class Writer:
    """Writes one machine."""

    rng: Random
    name: str
    peers: tuple[str, ...]
    sensor: str
    limits: tuple[int, ...]
    numbers: tuple[str, ...] = ("k",)
    events: dict[str, Look] = field(default_factory=dict)

    def control(self) -> Tree:
        """The control subsystem."""
        rng = self.rng
        self.numbers = ("k", "j")[: rng.randrange(1, 3)]
        memory = {n: {"type": "int", "init": rng.choice((0, 0, 0, 1, 3))} for n in self.numbers}
        memory |= {"r": {"type": "real", "init": 0.0}, "q": {"type": "int", "init": 0}}
        tree: Tree = {
            "rate": f"{rng.choice((10, 20, 20, 20))} Hz",
            "x": {
                p: {"n": {"type": "int", "init": 0}, "m": {"type": "int", "init": 0}}
                | {"go": {"type": "bool"} | ({"event": True} if rng.randrange(4) == 0 else {})}
                for p in self.peers
            },
            "y": {p: {"n": "int", "m": "int", "go": "bool"} for p in self.peers},
            "memory": memory,
            "conditions": {"initial": {}, "terminal": {}, "error": {}},
            "functions": {},
            "behaviours": {},
            "states": {},
            "initial_state": "S0",
            "transitions": [],
        }
        if self.sensor:
            kind, values = SENSORS[self.sensor]
            tree["x"]["eye"] = {"d": {"type": kind, "init": str(values[1])}}
        states = [f"S{i}" for i in range(rng.randrange(2, 5))]
        for number, state in enumerate(states):
            self._state(tree, state, states[(number + 1) % len(states)], states)
        return tree

    def _state(self, tree: Tree, state: str, following: str, states: list[str]) -> None:
        rng, conditions = self.rng, tree["conditions"]
        function = self._function()
        tree["functions"][f"f{state}"] = function
        ends = rng.choice(("always", "asked", "asked", "asked", "asked", "never", "asked"))
        if ends == "never" and rng.randrange(3):
            ends = "asked"
        behaviour: Tree = {"functions": [f"f{state}"], "terminal": ends}
        tree["behaviours"][f"b{state}"], tree["states"][state] = behaviour, f"b{state}"
        rows = tree["transitions"]
        if ends == "asked":
            behaviour["terminal"] = f"t{state}"
            conditions["terminal"][f"t{state}"] = self._random_condition()
            if rng.randrange(3):  # else most machines soon stand still
                conditions["terminal"][f"t{state}"] = self._counted(function)
        if ends != "never":
            if rng.randrange(3) == 0:
                conditions["initial"][f"i{state}"] = self._random_condition()
                rows.append([state, "terminal", f"i{state}", rng.choice(states)])
                rows.append([state, "terminal", "otherwise", following])
            else:
                rows.append([state, "terminal", "always", following])
        if rng.randrange(4) == 0:
            behaviour["error"] = f"e{state}"
            conditions["error"][f"e{state}"] = rng.choice(TIMED).format(**self._names())
            rows.append([state, "error", "always", rng.choice(states)])

    def _function(self) -> Tree:
        rng, found = self.rng, dict[str, str]()
        targets = [*self.numbers, *self.numbers, "r", "q"]
        for target in dict.fromkeys(rng.sample(targets, rng.choice((1, 1, 2, 3)))):
            found[target] = self._assigned(target)
        for peer in self.peers:
            if rng.randrange(2):
                names = (*self.numbers, "q", f"x.{rng.choice(self.peers)}.n")
                found[f"y.{peer}.n"] = rng.choice((*names, "{} + 1")).format(self.numbers[0])
            if rng.randrange(3) == 0:
                found[f"y.{peer}.m"] = rng.choice((f"x.{peer}.n", "q"))
            if rng.randrange(4) == 0:
                found[f"y.{peer}.go"] = "True"
        return found

    def _assigned(self, target: str) -> str:
        rng = self.rng
        texts = {"r": RAMPED, "q": ("q + 1 if q < {s} else 0", "0")}.get(target)
        texts = texts or rng.choice((COUNTED, COUNTED, RESET))
        names = self._names()
        if target != "r":
            names["k"] = target
        if names["k"] == names["other"]:
            names["other"] = f"x.{rng.choice(self.peers)}.n"
        return rng.choice(texts).format(**names)

    def _counted(self, function: Tree) -> str:
        """A question about a counter that comes true after some time in a state that counts it."""
        rng, names = self.rng, self._names()
        k, most = rng.choice(self.numbers), rng.choice(self.limits)
        names |= {"k": k, "least": rng.randrange(1, most + 1), "n": most}
        step = rng.choice(("{k} + 1 if {k} < {n} else {k}", "min({k} + {s}, {n})", "{k} + 1"))
        function[k] = step.format(**names)
        ways = ("{k} >= {least}", "{k} >= {least} or {test}", "{k} >= {n} or elapsed > {t}[s]")
        return rng.choice(ways).format(**names)

    def _names(self) -> dict[str, Any]:
        rng, peer = self.rng, self.rng.choice(self.peers)
        k, other = rng.sample((*self.numbers, *self.numbers, f"x.{peer}.n", "q"), 2)
        if k == other:
            other = f"x.{peer}.m"
        return {
            "k": k,
            "other": other,
            "n": rng.choice(self.limits),
            "s": rng.randrange(1, 4),
            "t": rng.choice(TIMES_S),
            "test": self._measured() or f"{self.numbers[0]} < {rng.choice(self.limits)}",
        }

    def _measured(self) -> str:
        rng = self.rng
        return {
            "": "",
            "seen": rng.choice(("x.eye.d", "not x.eye.d")),
            "part": f"x.eye.d {rng.choice(('==', '!='))} {rng.choice('uvw')}",
            "count": f"x.eye.d {rng.choice(('>=', '==', '<'))} {rng.randrange(3)}",
        }[self.sensor]

    def _random_condition(self) -> str:
        rng, names = self.rng, self._names()
        peer = rng.choice(self.peers)
        ways = [rng.choice(COMPARED)] * 4 + [rng.choice(TIMED), "r >= {s}.0", f"x.{peer}.m == q"]
        ways += [f"fresh(x.{peer}.go)", f"fresh(x.{peer}.go) and {{k}} >= {{n}}"]
        if self.sensor:
            ways += [self._measured(), "{test} and {k} >= {s}", "{test} or {k} >= {n}"]
        return rng.choice(ways).format(**names)


@dataclass(slots=True)
class SmallSystem:
    """A system and what its requirements say, for the enumeration."""

    tree: Tree
    formulas: list[Formula]
    domains: dict[str, tuple[Any, ...]]

    def alone(self, number: int) -> Tree:
        """The system with one of its requirements."""
        return {**self.tree, "require": [self.tree["require"][number]]}

    def enumerated(self, result: Result, **options: Any) -> Enumeration:
        """All configurations of what the compiler makes of it."""
        assert result.system is not None
        with built(result.system, None) as system:
            return Enumeration(system, LONGEST_S, self.domains, self._events(), **options)

    def _events(self) -> dict[tuple[str, str], Look]:
        found = {}
        for agent, parts in self.tree["agents"].items():
            control = parts["control"]
            for peer, elements in control["x"].items():
                if elements.get("go", {}).get("event"):
                    text = f"fresh(x.{peer}.go)"
                    found[f"{agent}.c", f"{peer}_go"] = _look(control, text)
        return found


def _look(control: Tree, text: str) -> Look:
    """Who asks for an event; functions here never do."""
    asking = {n for kind in control["conditions"].values() for n, t in kind.items() if text in t}
    states = set()
    for state, name in control["states"].items():
        behaviour = control["behaviours"][name]
        own = {behaviour["terminal"], behaviour.get("error")}
        own |= {row[2] for row in control["transitions"] if row[0] == state}
        if own & asking:
            states.add(state)
    return Look(frozenset(states), frozenset())


def small_system(rng: Random) -> SmallSystem:
    """A random one."""
    names = "ab" if rng.randrange(4) else "abc"
    limits = LIMITS if len(names) == 2 and rng.randrange(3) == 0 else LIMITS[:5]
    agents, domains = {}, dict[str, tuple[Any, ...]]()
    for name in names:
        peers = tuple(n for n in names if n != name)
        sensor = rng.choice(("", *SENSORS))
        agents[name] = {"control": Writer(rng, name, peers, sensor, limits).control()}
        if sensor:
            kind, values = SENSORS[sensor]
            shown = "clamp(x.R.d, 0, 2)" if sensor == "count" else "x.R.d"
            agents[name] |= {
                "real_receptors": {"eye": {"y": {"d": kind}}},
                "virtual_receptors": {
                    "eye": {
                        "rate": agents[name]["control"]["rate"],
                        "x": {"R": {"d": kind}},
                        "y": {"c": {"d": kind}},
                        "through": {"y.c.d": shown},
                    }
                },
            }
            domains[f"{name}.R.eye.d"] = values
    tree: Tree = {"specc": 1.3, "system": "small", "types": {"Part": "enum[u, v, w]"}}
    tree["agents"] = agents
    formulas = [_formula(rng, agents, limits) for _ in range(3)]
    tree["require"] = [{"that": f.text, "because": "it is so"} for f in formulas]
    return SmallSystem(tree, formulas, domains)


def _formula(rng: Random, agents: Tree, limits: tuple[int, ...]) -> Formula:
    form = rng.choice([*Form, Form.ALWAYS, Form.ANSWERED, Form.ANSWERED])
    p, q = (_atom(rng, agents) for _ in range(2))
    # Deadlines are about as long as a state lasts that counts up to a limit.
    span_s = (rng.choice(limits) + rng.randrange(-1, 3)) * rng.choice((0.05, 0.1))
    if form == Form.ANSWERED and rng.randrange(2):
        name = rng.choice([*agents])
        p = f"state({name}.c) == {rng.choice([*agents[name]['control']['states']])}"
        q = f"not ({p})"
    return Formula(form, p, q, round(span_s, 2))


def _atom(rng: Random, agents: Tree) -> str:
    name, other = rng.sample([*agents], 2)
    control = agents[name]["control"]
    state = f"state({name}.c) == {rng.choice([*control['states']])}"
    k = rng.choice([n for n in control["memory"] if n != "r"])
    ways = (
        state,
        state,
        f"{name}.c.{k} {rng.choice(('<', '<=', '>=', '=='))} {rng.choice(LIMITS)}",
    )
    ways += (f"not ({state})", f"{name}.c.k - {other}.c.k < {rng.choice(LIMITS)}")
    ways += (f"{name}.c.r <= {rng.randrange(4)}.5", f"{name}.c.x.{other}.n < {rng.choice(LIMITS)}")
    ways += (f"{state} and {name}.c.k > {rng.randrange(4)}",)
    return rng.choice(ways)
