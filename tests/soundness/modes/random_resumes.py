"""Random machines whose states rely on something that was asked before a mode was left.

A state in the mode uses an input that may be absent, or memory that may hold nothing. It is entered
behind a test, or by `resume`; in between, states outside may write that memory, or may not.
"""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Any

from tests.soundness.modes.random_machines import COLOURS, SPORADIC, STEADY, Tree, surroundings

INIT = {"bool": "False", "int": 0, "real[m]": 0, "Colour": "red"}
FUNCTIONS: Tree = {
    "make": {"held": "x.m.n if x.m.go else None"},
    "fill": {"held": "x.m.n"},
    "drop": {"held": "None"},
    "more": {"held": "held + 1 if held < 3 else 0"},
    "use": {"taken": "held + 1"},
    "read": {"taken": "x.v.e"},
}


class Author:
    """Writes one specification."""

    def __init__(self, rng: Random) -> None:
        self.rng = rng
        self.is_memory = rng.random() < 0.7
        self.gate = "there" if self.is_memory else "came"
        self.users = [f"U{i}" for i in range(rng.randrange(1, 4))]
        self.others = [f"A{i}" for i in range(rng.randrange(1, 4))]
        inside = rng.sample(self.others, rng.randrange(len(self.others)))
        self.outside = [s for s in self.others if s not in inside]
        self.modes = {"W": [*self.users, *inside]}
        if rng.random() < 0.5:
            around = self.outside.pop(0) if len(self.outside) > 1 and rng.random() < 0.5 else ""
            self.modes["V"] = ["W", *([around] if around else [])]

    def behaviours(self) -> Tree:
        """Of the states; those of users rely on what the others may take away."""
        using = ["use", "more"] if self.is_memory else ["read"]
        of: Tree = {"S0": ["make"]}
        of |= {s: using[: self.rng.randrange(1, 3)] for s in self.users}
        of |= {
            s: [f] if (f := self.rng.choice(("", "", "drop", "fill"))) else [] for s in self.others
        }
        return {s: {"functions": used, "terminal": "always"} for s, used in of.items()}

    def rows(self) -> Iterator[list[str]]:
        """For each state, either behind the test, or by colours."""
        yield [
            "S0",
            "terminal",
            self.gate,
            self.rng.choice([*self.users, *self._named(self.users)]),
        ]
        yield ["S0", "terminal", "otherwise", self.rng.choice(["S0", *self._free()])]
        for state in self.users:
            yield from self._by_colour(state, [*self.users, *self.users, *self.others])
        for state in self.others:
            inside = state not in self.outside
            resumes = [f"resume({m})" for m in self.modes if not self._is_in(state, m)]
            if inside or self.rng.random() < 0.3:
                yield [state, "terminal", self.gate, self.rng.choice(self.users)]
                yield [
                    state,
                    "terminal",
                    "otherwise",
                    self.rng.choice(["S0", *self._free(), *resumes]),
                ]
            else:
                yield from self._by_colour(state, ["S0", *self._free(), *resumes * 4])

    def _by_colour(self, state: str, targets: list[str]) -> Iterator[list[str]]:
        for colour in COLOURS:
            yield [state, "terminal", colour, self.rng.choice(targets)]

    def _is_in(self, state: str, mode: str) -> bool:
        members = self.modes[mode]
        return state in members or any(self._is_in(state, m) for m in members if m in self.modes)

    def _named(self, states: list[str]) -> list[str]:
        """Modes that begin in one of the states."""
        return [mode for mode in self.modes if self.first(mode) in states]

    def _free(self) -> list[str]:
        """States and modes that rely on nothing when they are entered."""
        return [*self.others, *self._named(self.others)]

    def first(self, mode: str) -> str:
        """Where a mode begins; the first of its members, and seldom one that relies."""
        members = self.modes[mode]
        careful = [m for m in members if m in self.others] or members
        found = careful[0] if len(members) % 3 else members[-1]
        return self.first(found) if found in self.modes else found

    def specification(self) -> Tree:
        """The whole file."""
        behaviours = self.behaviours()
        used = {f for part in behaviours.values() for f in part["functions"]}
        conditions = {colour: f"x.m.k == {colour}" for colour in COLOURS}
        conditions[self.gate] = "held is not None" if self.is_memory else "present(x.v.e)"
        control: Tree = {
            "rate": "10 Hz",
            "x": {
                "m": {name: {"type": type_, "init": INIT[type_]} for name, type_ in STEADY.items()},
                "v": dict(SPORADIC),
            },
            "y": {"m": {"u": "int"}},
            "memory": {
                "held": {"type": "optional[int]", "init": "None"},
                "taken": {"type": "int", "init": 0},
            },
            "conditions": {"initial": conditions},
            "functions": {name: part for name, part in FUNCTIONS.items() if name in used},
            "states": behaviours,
            "modes": {m: {"states": s, "initial": self.first(m)} for m, s in self.modes.items()},
            "initial_state": "S0",
            "transitions": [*self.rows()],
        }
        return {
            "specc": 1.3,
            "system": "random_resumes",
            "types": {"Colour": f"enum[{', '.join(COLOURS)}]"},
            "agents": {"a": {**surroundings("10 Hz"), "control": control}},
        }


def specification(rng: Random) -> Any:
    """A random specification (see `Author`)."""
    return Author(rng).specification()
