"""Random specifications whose control subsystem has a machine with modes.

Tables are made so as to decide, then some get a defect: a row less, one too many, a condition that
is narrower. What is reached behind a test relies on it, most of the time rightly.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any

Tree = dict[str, Any]
COLOURS = ("red", "green", "blue")
STEADY = {"go": "bool", "n": "int", "d": "real[m]", "k": "Colour"}
"""What comes in every period, from a device through an effector."""
SPORADIC = {"e": "int", "c": "Colour"}
"""What comes now and then, from a receptor; without a value until then."""
IN_STATES = True
"""Whether behaviours may stand in their states."""
RATES = {
    "10 Hz": ("0.1", "0.2", "0.3", "0.5"),
    "30 Hz": ("0.05", "0.1", "0.2", "0.3"),
    "25 ms": ("0.025", "0.05", "0.1", "0.3"),
    "7 Hz": ("0.1", "0.2", "0.3", "1"),
    "3 s": ("3", "6", "10", "15"),
}
"""Rates of all subsystems, with times in seconds that conditions compare with."""


@dataclass(slots=True)
class Forest:
    """States and modes; `members` of each mode, states and modes."""

    states: list[str]
    members: dict[str, list[str]] = field(default_factory=dict)

    def tops(self) -> list[str]:
        """What is in no mode."""
        inside = {name for members in self.members.values() for name in members}
        return [n for n in (*self.members, *self.states) if n not in inside]

    def leaves(self, name: str) -> list[str]:
        """The states of a mode, or the state."""
        if name not in self.members:
            return [name]
        return [leaf for member in self.members[name] for leaf in self.leaves(member)]

    def around(self, name: str) -> list[str]:
        """The modes around a state or mode, outermost first."""
        outer = next((m for m, members in self.members.items() if name in members), None)
        return [] if outer is None else [*self.around(outer), outer]

    def depth(self, name: str) -> int:
        """How many modes are inside each other below a name, with it."""
        if name not in self.members:
            return 0
        return 1 + max(self.depth(member) for member in self.members[name])


class Author:
    """Writes one specification."""

    def __init__(self, rng: Random, *, modes: bool = True, probes: bool = True) -> None:
        """`probes` write the clocks into memory; without `modes` it is of language 1.2."""
        self.rng = rng
        self.probes = probes
        self.modes = modes
        self.rate = rng.choice(("10 Hz", "10 Hz", *RATES))
        self.times = RATES[self.rate]
        self.conditions: dict[str, Tree] = {}
        self.forest = self._forest(modes)
        states = self.forest.states
        self.behaviour_of: dict[str, str] = {}
        self.initial = {m: self._inside(m) for m in self.forest.members}
        self.initial_state = states[0] if rng.random() < 0.7 else rng.choice(states)
        if (ways := [m for m in self.initial if self.first_state(m)]) and rng.random() < 0.15:
            self.initial_state = rng.choice(ways)
        self.let = f"elapsed({self._mode()}) > {rng.choice(self.times)}[s]" if self.initial else ""
        """The value of a let that conditions may name."""
        self.asks = rng.choice(("", "", "e", "e", "held", "held"))
        """What some states rely on: an input that may be absent, or memory that may be empty."""
        self.gate = {"e": "fresh(x.v.e)", "held": "held is not None", "": ""}[self.asks]
        self.relying = self._relying()
        self.errors: dict[str, dict[str, str]] = {}
        """Mode or behaviour -> its named error conditions."""
        self.rows: list[list[Any]] = []

    # The tree --------------------------------------------------------------------------

    def _forest(self, modes: bool) -> Forest:
        rng = self.rng
        forest = Forest([f"S{i}" for i in range(rng.randrange(2, 7))])
        for number in range(rng.randrange(1, 5) if modes else 0):
            fitting = [name for name in forest.tops() if forest.depth(name) < 3]
            nested = [name for name in fitting if name in forest.members]
            chosen = set(rng.sample(fitting, min(len(fitting), rng.randrange(1, 4))))
            if nested and rng.random() < 0.6:
                chosen.add(rng.choice(nested))
            if len(chosen) == len(forest.tops()) and rng.random() < 0.8:
                chosen.remove(min(chosen))
            if chosen:
                forest.members[f"M{number}"] = sorted(chosen)
        return forest

    def _inside(self, mode: str) -> str:
        """Where it is entered: most of the time something inside of it, now and then nothing."""
        way = self.rng.random()
        if way < 0.1:
            return ""
        members = self.forest.members[mode]
        return self.rng.choice(members if way < 0.85 else self.forest.leaves(mode))

    def first_state(self, name: str) -> str:
        """The state in which a state or mode is entered; empty where there is none."""
        while name in self.forest.members:
            name = self.initial[name]
        return name

    def _relying(self) -> set[str]:
        if not self.asks:
            return set()
        forest, rng = self.forest, self.rng
        nodes = [*forest.members, *forest.states]
        found = {s for node in rng.sample(nodes, min(2, len(nodes))) for s in forest.leaves(node)}
        return found - {self.first_state(self.initial_state)}

    # Conditions ------------------------------------------------------------------------

    def atom(self, relies: bool = False) -> str:
        """A question; `relies` where what is relied on may be read."""
        rng, mode = self.rng, self._mode()
        time, colour = rng.choice(self.times), rng.choice(COLOURS)
        op = rng.choice((">", ">="))
        if relies and rng.random() < 0.4:
            return "x.v.e > 1" if self.asks == "e" else "held > 1"
        ways = [
            "x.m.go", f"x.m.n > {rng.randrange(3)}", f"x.m.n == {rng.randrange(3)}",
            f"x.m.d {op} 0.5[m]", f"x.m.k == {colour}", f"x.m.k in {{{colour}, red}}",
            f"(fresh(x.v.c) and x.v.c == {colour})", "fresh(x.v.e)",
            "(present(x.v.e) and x.v.e > 0)",
            f"n0 {op} 2", "n0 == n1", "flag", "held is None", "(held is None or held > 1)",
            f"elapsed {op} {time}[s]",
        ]  # fmt: skip
        if mode:
            ways += [f"elapsed({mode}) {op} {time}[s]"] * 3
            ways += [f"elapsed({mode}) < {time}[s]", "late"]
            ways += [f"entered({mode})"] if rng.random() < 0.1 else []
        return rng.choice(ways)

    def _mode(self) -> str:
        modes = list(self.forest.members)
        return self.rng.choice(modes) if modes else ""

    def condition(self, relies: bool = False) -> str:
        """An atom or two."""
        rng, one = self.rng, self.atom(relies)
        way = rng.randrange(6)
        if way == 0:
            return f"not ({one})"
        if way < 3:
            return f"({one} {rng.choice(('and', 'or'))} {self.atom(relies)})"
        return one

    def named(self, kind: str, text: str) -> str:
        """A declared condition with this text."""
        if text in ("always", "never", "otherwise"):
            return text
        known = self.conditions.setdefault(kind, {})
        for name, other in known.items():
            if other == text:
                return name
        name = f"{kind[0]}{len(known)}"
        known[name] = text
        return name

    def partition(self, relies: bool) -> list[str]:
        """Conditions of which exactly one holds."""
        rng = self.rng
        way, one = rng.randrange(8), self.condition(relies)
        if way < 2:
            return ["always"]
        if way < 4:
            return [one, f"not ({one})"]
        if way == 4:
            low, high = rng.choice((("1", "2"), ("0", "1")))
            return [f"x.m.n < {low}", f"{low} <= x.m.n and x.m.n < {high}", f"x.m.n >= {high}"]
        if way == 5:
            other = self.condition(relies)
            return [f"({one}) and ({other})", f"({one}) and not ({other})", f"not ({one})"]
        if way == 6:
            return ["x.m.k == red", "x.m.k == green", "x.m.k == blue"]
        return [one, "otherwise"]

    # Behaviours ------------------------------------------------------------------------

    def _functions(self) -> Tree:
        rng, mode = self.rng, self._mode()
        reset = rng.choice(("entered", *([f"entered({mode})"] * 2 if mode else ())))
        functions: Tree = {
            "count": {"n0": f"0 if {reset} else min(n0 + 1, 3)"},
            "more": {"n1": "min(n1 + 1, 3)", "y.m.u": "n1"},
            "less": {"n1": "max(n1 - 1, 0)", "flag": "not flag"},
            "hold": {"held": "x.m.n if x.m.go else None"},
            "drop": {"held": "None"},
            "tell": {"y.m.u": "n0 + 1 if flag else 0"},
        }
        if self.asks:
            functions["rely"] = {"taken": "x.v.e" if self.asks == "e" else "held + 1"}
        if self.probes:
            functions["probe"] = {"s": "elapsed", "b": "entered"}
            for name in self.forest.members:
                if rng.random() < 0.7:
                    functions["probe"][f"t_{name}"] = f"elapsed({name})"
                if rng.random() < 0.7:
                    functions["probe"][f"b_{name}"] = f"entered({name})"
        return functions

    def _behaviours(self, functions: Tree) -> Iterator[tuple[str, Tree]]:
        """Some that rely on what was asked, and some that do not; each state gets one."""
        rng, written = self.rng, {n: set(t) for n, t in functions.items()}
        groups = [s for s in (self.relying, set(self.forest.states) - self.relying) if s]
        for group in groups:
            relies = group is self.relying
            names = [f"b{'r' * relies}{i}" for i in range(rng.randrange(1, 4))]
            for state in sorted(group):
                self.behaviour_of[state] = rng.choice(names)
            for name in names:
                used = ["probe"] * self.probes
                for function in rng.sample(sorted(functions), len(functions)):
                    taken = {t for f in used for t in written[f]}
                    keeps = self.asks == "held" and function in ("hold", "drop") and relies
                    fits = not taken & written[function] and function != "probe"
                    fits = fits and (function != "rely" or relies)
                    fits = fits and (not keeps or rng.random() < 0.05)
                    often = {"rely": 0.9, "hold": 0.3, "drop": 0.2}.get(function, 0.4)
                    if fits and rng.random() < often:
                        used.append(function)
                yield name, {"functions": used, **self._endings(name, relies)}

    def _endings(self, name: str, relies: bool) -> Tree:
        rng = self.rng
        terminal = rng.choice((
            "always", "never", f"elapsed >= {rng.choice(self.times)}[s]", self.condition(relies),
            self.condition(relies),
        ))  # fmt: skip
        made: Tree = {"terminal": self.named("terminal", terminal)}
        way = rng.randrange(6) if self.modes else rng.choice((3, 4))
        if way < 2:
            self.errors[name] = {
                f"{name}_{i}": self.condition(relies) for i in range(rng.randrange(1, 3))
            }
            made["error"] = dict(self.errors[name])
        elif way == 2:
            declared = self.named("error", self.condition(relies))
            self.errors[name] = {declared: self.conditions["error"][declared]}
            made["error"] = declared
        elif way == 3:
            self.errors[name] = {"": self.condition(relies)}
            made["error"] = {"when": self.errors[name][""]}
        return made

    def _modes(self) -> Tree:
        rng, found = self.rng, {}
        for name, members in self.forest.members.items():
            found[name] = {"states": list(members)}
            if self.initial[name]:
                found[name]["initial"] = self.initial[name]
            all_rely = set(self.forest.leaves(name)) <= self.relying
            count = rng.choice((0, 0, 1, 1, 2))
            if count and rng.random() < 0.2:
                declared = f"{name.lower()}_lost"
                self.errors[name] = {declared: self.condition(all_rely)}
                self.conditions.setdefault("error", {}).update(self.errors[name])
                found[name]["error"] = declared
            elif count:
                self.errors[name] = {
                    self._name_of_error(name, i): self.condition(all_rely) for i in range(count)
                }
                found[name]["error"] = dict(self.errors[name])
        return found

    def _name_of_error(self, mode: str, number: int) -> str:
        """Modes that are not in each other may have errors of one name."""
        forest = self.forest
        near = [m for m in forest.members if mode in forest.around(m) or m in forest.around(mode)]
        known = [name for m in (mode, *near) for name in self.errors.get(m, ())]
        if number == 0 and "stop" not in known and self.rng.random() < 0.2:
            return "stop"
        return f"{mode.lower()}_{number}"

    # Rows ------------------------------------------------------------------------------

    def causes(self, state: str) -> list[str]:
        """Names of the conditions that end a state; empty for an error without a name."""
        owners = (*self.forest.around(state), self.behaviour_of[state])
        return [name for owner in owners for name in self.errors.get(owner, ())]

    def cover(self, states: Collection[str]) -> list[str]:
        """Modes and states that together have these states and no others."""

        def of(name: str) -> list[str]:
            inside = self.forest.leaves(name)
            if set(inside) <= set(states) and (
                name not in self.forest.members or self.rng.random() < 0.7
            ):
                return [name]
            if not set(inside) & set(states) or name not in self.forest.members:
                return []
            return [n for member in self.forest.members[name] for n in of(member)]

        return [n for top in self.forest.tops() for n in of(top)]

    def _tables(self, behaviours: Tree) -> None:
        states, rng = self.forest.states, self.rng
        ending = [s for s in states if behaviours[self.behaviour_of[s]]["terminal"] != "never"]
        self._table("terminal", ending)
        unnamed = {s for s in states if "" in self.causes(s)}
        for cause in sorted({c for s in states for c in self.causes(s)} - {""}):
            having = [s for s in states if cause in self.causes(s)]
            way = rng.random()
            by_name = having if way < 0.45 else having[:1] if way < 0.6 else []
            self._table(cause, by_name)
            unnamed |= set(having) - set(by_name)
        self._table("error", [s for s in states if s in unnamed])

    def _table(self, cause: str, states: Sequence[str]) -> None:
        """Rows of a cause in some states."""
        rng = self.rng
        whole = [m for m in self.forest.members if set(self.forest.leaves(m)) <= set(states)]
        if whole and rng.random() < 0.35:
            self._shared(cause, rng.choice(whole))
            mode_states = self.forest.leaves(str(self.rows[-1][-1]))
            self.rows[-1].pop()
            states = [s for s in states if s not in mode_states]
        sources = self.cover(states)
        rng.shuffle(sources)
        while sources:
            count = rng.choice((1, 1, len(sources)))
            some, sources = sources[:count], sources[count:]
            self._rows(cause, some, self._split(self._states(some)))

    def _shared(self, cause: str, mode: str) -> None:
        """A row of a mode, and rows of what is in it for the rest; the last one notes the mode."""
        states = self.forest.leaves(mode)
        first = self.condition(set(states) <= self.relying)
        self._rows(cause, [mode], [first])
        for source in self.cover(states) if self.rng.random() < 0.3 else self.forest.members[mode]:
            rest = self.rng.choice(("otherwise", f"not ({first})"))
            self._rows(cause, [source], [rest])
        self.rows[-1].append(mode)

    def _states(self, sources: Sequence[str]) -> list[str]:
        return [leaf for source in sources for leaf in self.forest.leaves(source)]

    def _split(self, states: Collection[str]) -> list[str]:
        relies = set(states) <= self.relying
        if self.asks and not relies and self.rng.random() < 0.6:
            return [self.gate, self.rng.choice(("otherwise", f"not ({self.gate})"))]
        return self.partition(relies)

    def _rows(self, cause: str, sources: Sequence[str], conditions: Sequence[str]) -> None:
        states = self._states(sources)
        for text in conditions:
            asked = text == self.gate or set(states) <= self.relying
            target = self.target(states, asked)
            source = sources[0] if len(sources) == 1 else list(sources)
            self.rows.append([source, cause, self.named("initial", text), target])

    def target(self, states: Collection[str], asked: bool) -> str:
        """A state, a mode or a mode to resume; what relies is entered if it was `asked` for."""
        rng, forest = self.rng, self.forest
        careless = rng.random() < 0.03
        options: list[str] = []
        for name in forest.states:
            if asked or careless or name not in self.relying:
                options.append(name)
        for name in forest.members:
            first = self.first_state(name)
            safe = asked or careless or first not in self.relying
            if first and safe:
                options += [name] * 2
            leaves = set(forest.leaves(name))
            kept = self.asks != "held" or not leaves & self.relying or rng.random() < 0.4
            if not leaves & set(states) and safe and kept and (first or rng.random() < 0.5):
                options += [f"resume({name})"] * 4
        return rng.choice(options)

    def _defect(self) -> None:
        rng, rows = self.rng, self.rows
        row = rng.choice(rows)
        way = rng.randrange(4)
        if way == 0 and len(rows) > 1:
            rows.remove(row)
        elif way == 1:
            text = self.named("initial", self.condition())
            rows.append([row[0], row[1], text, self.target(self._states(_listed(row[0])), False)])
        elif way == 2 and row[2] != "otherwise":
            text = self.conditions.get("initial", {}).get(row[2], "x.m.go")
            row[2] = self.named("initial", f"({text}) and {self.atom()}")
        elif len(_listed(row[0])) > 1:
            row[0] = row[0][:-1]
        else:
            row[2] = self.named("initial", self.atom())

    # The whole -------------------------------------------------------------------------

    def control(self) -> Tree:
        """The subsystem."""
        functions = self._functions()
        behaviours = dict(self._behaviours(functions))
        modes = self._modes()
        self._tables(behaviours)
        if self.rows and self.rng.random() < 0.35:
            self._defect()
        states: Tree = {}
        for state in self.forest.states:
            name = self.behaviour_of[state]
            alone = list(self.behaviour_of.values()).count(name) == 1
            states[state] = name
            if (
                alone
                and self.modes
                and IN_STATES
                and not self.errors.get(name)
                and self.rng.random() < 0.5
            ):
                states[state] = behaviours.pop(name)
        used = set(self.behaviour_of.values())
        behaviours = {name: part for name, part in behaviours.items() if name in used}
        every = [
            *behaviours.values(),
            *(part for part in states.values() if isinstance(part, dict)),
        ]
        named = {f for part in every for f in part["functions"]}
        made: Tree = {
            "rate": self.rate,
            "x": {
                "m": {
                    name: {"type": type_, "init": _INIT[type_]} for name, type_ in STEADY.items()
                },
                "v": dict(SPORADIC),
            },
            "y": {"m": {"u": "int"}},
            "memory": self._memory(functions),
            "let": {"late": self.let} if self.let else {},
            "conditions": self.conditions,
            "functions": {name: part for name, part in functions.items() if name in named},
            "behaviours": behaviours,
            "states": states,
            "modes": modes,
            "initial_state": self.initial_state,
            "transitions": self.rows,
        }
        return {key: part for key, part in made.items() if part not in ({}, [])}

    def _memory(self, functions: Tree) -> Tree:
        memory: Tree = {
            "n0": {"type": "int", "init": 0},
            "n1": {"type": "int", "init": 0},
            "flag": {"type": "bool", "init": "False"},
            "held": {"type": "optional[int]", "init": "None"},
            "taken": {"type": "int", "init": 0},
        }
        for name in functions.get("probe", ()):
            is_time = name[0] in "st"
            memory[name] = {"type": "real[s]", "init": 0} if is_time else {**memory["flag"]}
        return memory

    def specification(self) -> Tree:
        """The whole file as a tree of mappings, lists and texts."""
        control = self.control()
        tree: Tree = {
            "specc": 1.3 if self.modes else 1.2,
            "system": "random_modes",
            "types": {"Colour": f"enum[{', '.join(COLOURS)}]"},
            "agents": {"a": {**surroundings(self.rate), "control": control}},
        }
        if requirements := list(self._requirements()):
            tree["require"] = requirements
        return tree

    def _requirements(self) -> Iterator[Tree]:
        rng, states = self.rng, self.forest.states
        for number in range(rng.randrange(4)):
            one, other, soon = rng.choice(states), rng.choice(states), rng.choice(self.times)
            text = rng.choice((
                f"not (state(a.c) == {one} and a.c.n0 >= {rng.randrange(1, 4)})",
                f"a.c.n1 < {rng.randrange(1, 5)}",
                f"state(a.c) == {one} implies within({soon}[s], state(a.c) != {one})",
                f"state(a.c) == {one} implies within({self.times[-1]}[s], state(a.c) == {other})",
                f"state(a.c) != {one}",
                f"state(a.c) == {one} implies once({self.times[-1]}[s], state(a.c) == {other})",
            ))  # fmt: skip
            yield {"name": f"r{number}", "that": f"always({text})", "because": "it is asked for"}


_INIT = {"bool": "False", "int": 0, "real[m]": 0, "Colour": "red"}


def _listed(part: Any) -> list[str]:
    return [part] if isinstance(part, str) else list(part)


def surroundings(rate: str) -> Tree:
    """The devices, the effector that passes everything on, and the receptor that is often quiet."""
    return {
        "real_effectors": {"m": {"x": {"u": "int"}, "y": dict(STEADY)}},
        "real_receptors": {"k": {"y": {**SPORADIC, "on": "bool"}}},
        "virtual_effectors": {
            "m": {
                "rate": rate,
                "x": {"E": dict(STEADY), "c": {"u": {"type": "int", "init": 0}}},
                "y": {"c": dict(STEADY), "E": {"u": "int"}},
                "through": {"y.E.u": "x.c.u", **{f"y.c.{n}": f"x.E.{n}" for n in STEADY}},
            }
        },
        "virtual_receptors": {
            "v": {
                "rate": rate,
                "uses": ["k"],
                "x": {"R": {**SPORADIC, "on": "bool"}},
                "y": {"c": dict(SPORADIC)},
                "conditions": {"initial": {"on": "x.R.on"}},
                "functions": {"send": {f"y.c.{n}": f"x.R.{n}" for n in SPORADIC}},
                "behaviours": {
                    "rest": {"terminal": "always"},
                    "send": {"functions": ["send"], "terminal": "always"},
                },
                "states": {"quiet": "rest", "sending": "send"},
                "initial_state": "quiet",
                "transitions": [
                    [["quiet", "sending"], "terminal", "on", "sending"],
                    [["quiet", "sending"], "terminal", "otherwise", "quiet"],
                ],
            }
        },
    }


def specification(rng: Random, *, modes: bool = True, probes: bool = True) -> Tree:
    """A random specification (see `Author`)."""
    return Author(rng, modes=modes, probes=probes).specification()
