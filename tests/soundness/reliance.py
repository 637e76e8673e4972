"""Memory that may hold nothing: rows ask whether there is something, and behaviours rely on it."""

from __future__ import annotations

from random import Random
from typing import Any


class Held:
    """An optional length, or a list of lengths, for the machine of one subsystem."""

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._is_list = rng.randrange(2) == 0
        self.type = "list[real[m]]" if self._is_list else "optional[real[m]]"
        self._there = "len(held) > 0" if self._is_list else "held is not None"
        self._absent = "len(held) == 0" if self._is_list else "held is None"
        self._value = f"{self._one('argmax', 'argmin')}(v for v in held)" * self._is_list or "held"

    def memory(self) -> dict[str, Any]:
        """What may hold nothing, and what is made of it."""
        return {
            "held": {"type": self.type, "init": "[]" if self._is_list else "None"},
            "taken": {"type": "real[m]", "init": 0},
            "kept": {"type": "nonempty[real[m]]", "init": "[0.5[m], limit]"},
        }

    def rows(self) -> list[str]:
        """Conditions of which one holds."""
        between = f"0[m] < {self._value} < 1[m]"
        ways = [
            [self._there, self._absent],
            [
                f"{self._there} and {self._value} > 0.5[m]",
                f"{self._absent} or {self._value} <= 0.5[m]",
            ],
            [f"{self._there} and {between}", f"{self._there} and not {between}", self._absent],
        ]
        if self._is_list:
            some = "any(v > 0.5[m] for v in held)"
            ways += [
                [some, f"not {some}"],
                ["not all(v > 1[m] for v in held)", "all(v > 1[m] for v in held)"],
            ]
        return self._rng.choice(ways)

    def is_asked(self, row: str) -> bool:
        """Whether there is something where a row holds."""
        return row.startswith((self._there, "any(", "not all("))

    def targets(self) -> dict[str, str]:
        """Assignments that rely on it, at least in some periods of a state."""
        value = self._value
        found = {
            "taken": self._one(
                value, value, f"max({value}, 0.25[m])", f"({value} if entered else 0)",
                f"(0 if entered else {value})", f"({value} if elapsed < 0.1[s] else taken)",
            )
        }  # fmt: skip
        if self._is_list and self._rng.randrange(2):
            found["kept"] = "held"
        return found

    def _one(self, *options: str) -> str:
        return self._rng.choice(options)
