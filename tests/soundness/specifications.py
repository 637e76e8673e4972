"""Random specification files: agents, subsystems of different rates, buffers, tables, a plant."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Any

from tests.soundness.operators import SIGNATURES
from tests.soundness.phrases import MODES, SIDES, TYPES, UNIT, Phrases, Scope
from tests.soundness.reliance import Held

PERIODS_MS = (10, 20, 30, 40, 50, 100)
MORE_MEMORY = ("int", "real[m]", "Mode", "bool", "optional[real[m]]", "list[real[m]]")
HERE = "tests.soundness.operators"
_IN_INTERFACES = 2
"""Buffers with so many elements have them through an interface."""
Tree = dict[str, Any]

MODEL = """\
<mujoco>
  <worldbody><body><joint name="j" type="hinge"/><geom size="0.1"/></body></worldbody>
  <actuator>
    <motor name="a" joint="j"/><motor name="b" joint="j"/><motor name="c" joint="j"/>
    <motor name="d" joint="j"/><motor name="e" joint="j"/><motor name="f" joint="j"/>
  </actuator>
</mujoco>
"""
"""Stands for the plant of every specification; it is read by the compiler and never simulated."""


@dataclass(slots=True)
class Draft:
    """A subsystem before its machine: its buffers with types."""

    agent: str
    name: str
    tree: Tree = field(default_factory=dict)
    inputs: list[tuple[str, str, str, bool]] = field(default_factory=list)
    """Peer, element, type, and whether it has a value from the start."""
    outputs: list[tuple[str, str, str]] = field(default_factory=list)
    device: str = ""
    """A device that nobody else reads, so that its sensors may have any rate."""


class Author:
    """Writes one specification."""

    def __init__(
        self,
        rng: Random,
        careless: int | None = None,
        trusting: int | None = None,
        *,
        ages: bool = False,
    ) -> None:
        """Of a hundred inputs that may be absent, `careless` are read unasked, and `trusting` of a
        hundred optional values and lists that may be empty. With `ages` it is asked for those."""
        self.rng = rng
        self.ages = ages
        self.bind: Tree = {}
        self.interfaces: Tree = {}
        self.actuators = iter("abcdef")
        self.careless = rng.choice((0, 0, 0, 4)) if careless is None else careless
        self.trusting = rng.choice((0, 0, 0, 25)) if trusting is None else trusting
        self.wild = rng.choice((0, 0, 15))
        """Of a hundred tables, how many are made without care."""

    def specification(self) -> Tree:
        """The whole file as a tree of mappings, lists and texts."""
        agents = self._agents()
        tree: Tree = {
            "specc": 1,
            "system": "random_system",
            "frames": {"B": "base", "E": "effector"},
            "types": {
                "Mode": f"enum[{', '.join(MODES)}]",
                "Side": f"enum[{', '.join(SIDES)}]",
                "Reading": {
                    "fields": {"d": "real[m]", "mode": "Mode"}, "python": f"{HERE}:Reading",
                },
            },
            "constants": {
                "limit": "0.5[m]", "gain": "2 * 0.25", "X_EE": "turn(1)",
                "whole": 2, "first": "best(readings(3))",
            },
            "operators": {
                name: {"signature": signature, "python": f"{HERE}:{function}"}
                for name, (signature, function) in SIGNATURES.items()
            },
            "agents": agents,
        }  # fmt: skip
        for bound in self.bind.values():
            if "joints" in bound and "rate" not in bound and self.rng.random() < 0.3:
                bound["sporadic"] = True
        if self.interfaces:
            tree["interfaces"] = self.interfaces
        if self.bind:
            tree["plant"] = {"model": "plant.xml", "bind": self.bind}
        return tree

    def _agents(self) -> Tree:
        drafts: dict[str, list[Draft]] = {}
        names = ["one", "two"][: self.rng.choice((1, 2, 2))]
        agents: Tree = {}
        for agent in names:
            control = Draft(agent, "c")
            parts = [control]
            agents[agent] = {"control": control.tree}
            for part in ["m", "g"][
                : self.rng.choice((1, 1, 2)) if len(names) == 1 else self.rng.randrange(2)
            ]:
                effector = Draft(agent, part, device=f"E.{part}")
                agents[agent].setdefault("virtual_effectors", {})[part] = effector.tree
                self._connect(control, effector, part, "c")
                self._connect(effector, control, "c", part)
                self._device(agents[agent], effector)
                parts.append(effector)
            parts += self._receptors(agents[agent], control)
            drafts[agent] = parts
        if len(names) == 2:
            self._connect(drafts["one"][0], drafts["two"][0], "two", "one")
            self._connect(drafts["two"][0], drafts["one"][0], "one", "two")
        for part in (p for parts in drafts.values() for p in parts):
            part.tree.update(Machine(self, part).tree())
        return agents

    def _receptors(self, agent: Tree, control: Draft) -> Iterator[Draft]:
        """Up to two virtual receptors that read one real one."""
        count = self.rng.choice((0, 0, 1, 2))
        reports = {f"s{i}": self.rng.choice(TYPES) for i in range(self.rng.randrange(1, 3))}
        if count:
            agent["real_receptors"] = {"k": {"y": reports}}
        for name in reports if count else ():
            bound = {"joints": ["j"], "through": f"{HERE}:raw"}
            self.bind[f"{control.agent}.R.k.{name}"] = bound
        for part in ("r", "v")[:count]:
            receptor = Draft(control.agent, part, device="R.k" if count == 1 else "")
            agent.setdefault("virtual_receptors", {})[part] = receptor.tree
            receptor.tree["uses"] = ["k"]
            receptor.tree["x"] = {"R": dict(reports)}
            receptor.inputs += [("R", name, type_, True) for name, type_ in reports.items()]
            self._connect(receptor, control, "c", part)
            if self.rng.randrange(2):
                self._connect(control, receptor, part, "c")
            yield receptor

    def _connect(self, a: Draft, b: Draft, peer_of_a: str, peer_of_b: str) -> None:
        """A buffer from `a` to `b`, both ends of it."""
        for index in range(self.rng.randrange(1, 4)):
            type_ = self.rng.choice(TYPES)
            name = f"e{index}"
            started = self.rng.randrange(100) < 50
            element: Any = type_
            if started:
                element = {"type": type_, "init": Phrases(self.rng, Scope()).literal(type_, 0)}
            a.tree.setdefault("y", {}).setdefault(peer_of_a, {})[name] = type_
            b.tree.setdefault("x", {}).setdefault(peer_of_b, {})[name] = element
            a.outputs.append((peer_of_a, name, type_))
            b.inputs.append((peer_of_b, name, type_, started))
        elements = b.tree["x"][peer_of_b]
        if len(elements) == _IN_INTERFACES:
            shared = f"I{len(self.interfaces)}"
            self.interfaces[shared] = elements
            a.tree["y"][peer_of_a] = b.tree["x"][peer_of_b] = shared

    def _device(self, agent: Tree, effector: Draft) -> None:
        """The real effector of a virtual one, with what stands behind it."""
        reports, device = {}, f"{effector.agent}.E.{effector.name}"
        for index in range(self.rng.randrange(1, 4)):
            type_ = self.rng.choice(TYPES)
            reports[f"s{index}"] = type_
            effector.inputs.append(("E", f"s{index}", type_, True))
            bound = {"joints": ["j"], "through": f"{HERE}:raw"}
            self.bind[f"{device}.s{index}"] = bound
        commanded = self.rng.choice(TYPES)
        effector.outputs.append(("E", "u", commanded))
        self.bind[f"{device}.u"] = {"actuators": [next(self.actuators)], "through": f"{HERE}:raw"}
        device_tree = {"x": {"u": commanded}, "y": reports}
        agent.setdefault("real_effectors", {})[effector.name] = device_tree
        effector.tree.setdefault("x", {})["E"] = dict(reports)
        effector.tree.setdefault("y", {})["E"] = {"u": commanded}


class Machine:
    """Memory, conditions, functions, behaviours, states and table of one subsystem."""

    def __init__(self, author: Author, draft: Draft) -> None:
        self.rng = author.rng
        self.author = author
        self.draft = draft
        self.conditions: dict[str, Tree] = {}
        self.scope = self._scope()
        self.timeless = self._scope(clock=False)
        self.bold = bool(self.scope.absent) and self.rng.randrange(3) == 0
        """Whether behaviours but the first trust the rows to see to it that inputs have values."""
        self.held = Held(self.rng) if self.rng.randrange(3) == 0 else None
        """What behaviours but the first trust the rows to see to."""
        self.memory = self._memory()
        self.lets = self._lets()

    def tree(self) -> Tree:
        """The subsystem without its buffers."""
        rng = self.rng
        period = rng.choice(PERIODS_MS)
        self._sample_rates(period)
        behaviours, functions = self._behaviours()
        names = list(behaviours)
        states = {f"S{i}": names[i % len(names)] for i in range(rng.randrange(1, 5))}
        rows = [row for state in states for row in self._table(state, states, behaviours)]
        made: Tree = {
            "rate": f"{period} ms" if rng.randrange(2) else _hertz(period),
            "memory": self.memory, "let": self.lets, "conditions": self.conditions,
            "functions": functions, "behaviours": behaviours, "states": states,
            "initial_state": "S0", "transitions": rows, "assume": list(self._axioms()),
        }  # fmt: skip
        return {key: part for key, part in made.items() if part not in ({}, [])}

    def _sample_rates(self, period_ms: int) -> None:
        """Some sensors have a rate of their own, a multiple or a whole fraction of the reader's."""
        for key, bound in self.author.bind.items():
            device = f"{self.draft.agent}.{self.draft.device}."
            if (
                self.draft.device
                and key.startswith(device)
                and "joints" in bound
                and self.rng.randrange(3) == 0
            ):
                bound["rate"] = f"{period_ms * self.rng.choice((2, 3))} ms"

    def _scope(self, clock: bool = True) -> Scope:
        scope = Scope(clock=clock)
        for peer, name, type_, started in self.draft.inputs:
            text = f"x.{peer}.{name}"
            scope.inputs.append((text, type_))
            scope.add(type_, text) if started else scope.absent.append((text, type_))
            if self.author.ages and started:
                scope.add("real[s]", f"age({text})")
                if peer not in ("E", "R"):
                    scope.add("int", f"late({text})")
        scope.add("real[m]", "limit")
        scope.add("real", "gain")
        scope.add("int", "whole")
        scope.add("Reading", "first")
        return scope

    def _phrases(self, clock: bool = True, careless: int = 0) -> Phrases:
        careless = careless or self.author.careless
        scope = self.scope if clock else self.timeless
        return Phrases(self.rng, scope, careless, self.author.trusting)

    def _memory(self) -> Tree:
        found: Tree = {}
        for index in range(self.rng.randrange(2, 6)):
            type_ = self.rng.choice((*TYPES, *MORE_MEMORY))
            init = Phrases(self.rng, Scope()).literal(type_, 0)
            inputs = [
                f"x.{p}.{n}" for p, n, t, started in self.draft.inputs if t == type_ and started
            ]
            if inputs and self.rng.randrange(2):
                init = self.rng.choice(inputs)
            found[f"k{index}"] = {"type": type_, "init": init}
        found |= self.held.memory() if self.held else {}
        for name, item in found.items():
            for scope in (self.scope, self.timeless):
                scope.add(item["type"], name)
        asked = [text for text, _ in self.scope.inputs][:6]
        found["seen"] = {
            "type": f"vector[{2 * len(asked) + 1}, bool]",
            "init": _list(["False"] * (2 * len(asked) + 1)),
        }
        found["since"] = {"type": "real[s]", "init": 0}
        if self.author.ages and asked:
            found["aged"] = {"type": f"vector[{len(asked)}, s]", "init": _list(["0"] * len(asked))}
        return found

    def _lets(self) -> Tree:
        found: Tree = {}
        for index in range(self.rng.randrange(3)):
            type_ = self.rng.choice(("bool", "bool", "real[m]", "int", "real", "Mode"))
            clock = self.rng.randrange(3) == 0
            text = self._phrases(clock).composite(type_, 2)
            found[f"l{index}"] = text
            for scope in (self.scope,) if clock else (self.scope, self.timeless):
                scope.add(type_, f"l{index}")
        return found

    def _behaviours(self) -> tuple[Tree, Tree]:
        behaviours: Tree = {}
        functions: Tree = {"probe": self._probe()}
        for index in range(self.rng.randrange(1 + (self.bold or self.held is not None), 4)):
            targets: Tree = {}
            phrases = self._phrases(careless=60 if self.bold and index else 0)
            for peer, name, type_ in self.draft.outputs:
                if self.rng.randrange(100) < 70:
                    targets[f"y.{peer}.{name}"] = phrases.value(type_)
            for name, item in self.memory.items():
                if name.startswith("k") and self.rng.randrange(100) < 50:
                    targets[name] = _bounded(item["type"], phrases.value(item["type"]))
            if self.held and (index == 0 or self.rng.randrange(5) == 0):
                targets["held"] = phrases.value(self.held.type)
            if self.held and index:
                targets |= self.held.targets()
            used = ["probe"]
            if targets:
                functions[f"f{index}"] = targets
                used.append(f"f{index}")
            behaviours[f"b{index}"] = {
                "functions": used,
                "terminal": self._given("terminal", self._end()),
                "error": self._given(
                    "error", self._end() if self.rng.randrange(3) == 0 else "never"
                ),
            }
        return behaviours, functions

    def _probe(self) -> Tree:
        """What is fresh and present, and the clock, as memory that the test sees."""
        asked = [text for text, _ in self.scope.inputs][:6]
        told = [f"{kind}({text})" for text in asked for kind in ("fresh", "present")]
        ages = [f"age({text}) if present({text}) else 0" for text in asked]
        aged = {"aged": _list(ages)} if self.author.ages and asked else {}
        return {"seen": _list([*told, "entered"]), "since": "elapsed", **aged}

    def _end(self) -> str:
        phrases = self._phrases()
        way = self.rng.randrange(10)
        if self.bold and way < 5:
            return f"fresh({self.rng.choice(self.scope.absent)[0]})"
        if way < 2 + 3 * (self.held is not None):
            return "always"
        if way == 2:
            return "never"
        if way < 5:
            return f"elapsed {self.rng.choice(('>', '>='))} 0.{self.rng.randrange(1, 5)}[s]"
        return phrases.condition(self.rng.randrange(3))

    def _given(self, kind: str, text: str) -> str | Tree:
        """A condition of a behaviour, by name or in its place."""
        in_place = text not in ("always", "never") and Random(text).randrange(4) == 0
        return {"when": text} if in_place else self._named(kind, text)

    def _named(self, kind: str, text: str) -> str:
        if text in ("always", "never"):
            return text
        known = self.conditions.setdefault(kind, {})
        for name, other in known.items():
            if other == text:
                return name
        name = f"{kind[0]}{len(known)}"
        known[name] = text
        return name

    def _table(self, state: str, states: Tree, behaviours: Tree) -> Iterator[list[str]]:
        behaviour = behaviours[states[state]]
        for cause in ("terminal", "error"):
            end = behaviour[cause]
            if end == "never":
                continue
            in_place = isinstance(end, dict)
            ended = end["when"] if in_place else self.conditions.get(cause, {}).get(end, "")
            texts = self._partition(ended)
            # Drawn apart, so that the rest of what a seed makes does not depend on it.
            remainder = len(texts) > 1 and Random(f"{state} {texts}").randrange(4) == 0
            for text in texts:
                target = self.rng.choice(self._targets(text, states))
                last = remainder and text is texts[-1]
                name = "otherwise" if last else self._named("initial", text)
                yield [state, cause, name, target]

    def _targets(self, row: str, states: Tree) -> list[str]:
        """States that a row may lead to: most of the time those that can rely on it."""
        first = [state for state in states if states[state] == "b0"]
        if self.held is None or self.held.is_asked(row):
            return list(states)
        return list(states) if self.rng.randrange(100) < 3 + self.author.trusting else first

    def _partition(self, ended: str) -> list[str]:
        """Conditions of which one holds whenever `ended` does, most of the time."""
        rng, phrases = self.rng, self._phrases()
        if rng.randrange(100) < self.author.wild:
            return [phrases.condition(1) for _ in range(rng.randrange(1, 4))]
        if self.bold and rng.randrange(10) < 7:
            return self._arrivals()
        if self.held and rng.randrange(10) < 7:
            return self.held.rows()
        way = rng.randrange(8)
        if way == 0:
            return ["always"]
        if way == 1:
            condition = phrases.condition(2)
            return [condition, f"not {condition}"]
        if way == 2:
            return self._thresholds(phrases)
        if way == 3 and (item := phrases.name("Mode")):
            return self._members(phrases, item)
        if way == 4 and ended:
            first = phrases.atom()
            return [first, f"{ended} and not {first}"]
        if way == 5:
            return self._sums(phrases)
        return self._tree(phrases, 2)

    def _arrivals(self) -> list[str]:
        """What came of one or two inputs that may be without a value."""
        texts = [text for text, _ in self.scope.absent]
        first, second = self.rng.choice(texts), self.rng.choice(texts)
        asked = self.rng.choice(("fresh", "fresh", "present"))
        if first == second or self.rng.randrange(2):
            return [f"{asked}({first})", f"not {asked}({first})"]
        rest = f"not {asked}({first})"
        return [
            f"{asked}({first})",
            f"{rest} and fresh({second})",
            f"{rest} and not fresh({second})",
        ]

    def _thresholds(self, phrases: Phrases) -> list[str]:
        type_ = self.rng.choice(("int", "real", "real[m]"))
        left, unit = phrases.rooted(type_), UNIT.get(type_, "")
        low, high = (f"1{unit}", f"2{unit}") if type_ == "int" else (f"0.5{unit}", f"1.5{unit}")
        last = f"{left} >= {high}" if self.rng.randrange(2) else f"not {left} < {high}"
        return [f"{left} < {low}", f"{low} <= {left} and {left} < {high}", last]

    def _sums(self, phrases: Phrases) -> list[str]:
        """A sum compared with a number, spelt in two ways."""
        type_ = self.rng.choice(("int", "real[m]", "real"))
        a, b, c = (phrases.rooted(type_, 0) for _ in range(3))
        return self.rng.choice((
            [f"{a} + {b} < {c}", f"{b} + {a} >= {c}"],
            [f"{a} < {b}", f"{b} <= {a} and {a} < {c}", f"{a} >= {c} and {a} >= {b}"],
            [f"{a} - {b} > {c}", f"{a} <= {b} + {c}"],
            [f"max({a}, {b}) > {c}", f"{a} <= {c} and {b} <= {c}"],
            [f"abs({a}) < {b}", f"{a} >= {b} or -{a} >= {b}"],
        ))  # fmt: skip

    def _members(self, phrases: Phrases, item: str) -> list[str]:
        modes, over = list(MODES), phrases.name("vector[2, Mode]")
        self.rng.shuffle(modes)
        if over and self.rng.randrange(2):
            some = f"{{{modes[0]}, {modes[1]}}}"
            return [f"all(v in {some} for v in {over})", f"any(v not in {some} for v in {over})"]
        return [
            f"{item} == {modes[0]}",
            f"{item} in {{{modes[1]}, {modes[2]}}}",
            f"{item} == {modes[3]}",
        ]

    def _tree(self, phrases: Phrases, depth: int) -> list[str]:
        atom = phrases.atom()
        sides = []
        for side in (atom, f"not {atom}"):
            deeper = depth > 1 and self.rng.randrange(2)
            below = self._tree(phrases, depth - 1) if deeper else [""]
            sides += [f"{side} and {rest}" if rest else side for rest in below]
        return sides

    def _axioms(self) -> Iterator[Tree]:
        if self.rng.randrange(7):
            return
        arrivals = [text for text, _ in self.scope.inputs]
        if len(arrivals) > 1 and self.rng.randrange(2):
            a, b = self.rng.sample(arrivals, 2)
            yield {"that": f"not (fresh({a}) and fresh({b}))", "because": "so it is"}
        else:
            yield {"that": self._phrases(clock=False).condition(1), "because": "so it is"}


def _bounded(type_: str, text: str) -> str:
    """What memory may keep from period to period without growing for ever."""
    if type_ == "int":
        return f"min(max({text}, -9), 9)"
    if type_ in UNIT and text not in ("0",):
        return f"min(max({text}, -8.0{UNIT[type_]}), 8.0{UNIT[type_]})"
    return text


def _list(items: list[str]) -> str:
    return f"[{', '.join(items)}]"


def _hertz(period_ms: int) -> str:
    return f"{1000 // period_ms} Hz" if 1000 % period_ms == 0 else f"{period_ms} ms"


def specification(
    rng: Random, careless: int | None = None, trusting: int | None = None, *, ages: bool = False
) -> Tree:
    """A random specification (see `Author`)."""
    return Author(rng, careless, trusting, ages=ages).specification()


def text_of(tree: Tree) -> str:
    """A specification as YAML."""
    return "\n".join(_lines(tree, "")) + "\n"


def _lines(tree: Tree, indent: str) -> Iterator[str]:
    for key, part in tree.items():
        if isinstance(part, dict) and part:
            yield f"{indent}{key}:"
            yield from _lines(part, indent + "  ")
        elif isinstance(part, list) and part:
            yield f"{indent}{key}:"
            yield from (f"{indent}  - {json.dumps(item)}" for item in part)
        else:
            yield f"{indent}{key}: {json.dumps(part)}"
