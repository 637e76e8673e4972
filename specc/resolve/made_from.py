"""The texts that definitions follow from: while they are the same, what is kept of them holds.

Values of constants change more often than other definitions do. A value matters to texts with the
name of its constant, and to those with the name of a constant to whose text it matters.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field

from specc.frozen import mutable
from specc.reachable import reachable

_WORD = re.compile(r"\w+")


@mutable
class MadeFrom:
    """The texts that the definitions in force in one file follow from; empty if nothing is kept."""

    others: str = ""
    """Digests of all texts but those of constants, and the names of these."""
    constants: dict[str, str] = field(default_factory=dict)
    """Constant -> the texts of its definitions."""
    words: set[str] = field(default_factory=set)
    """The words of the texts that are not those of constants."""

    def take(self, data: object) -> None:
        """Take in definitions that are no constants."""
        text = repr(data)
        self.others += _digest(text)
        self.words.update(_WORD.findall(text))

    def define(self, name: str, text: str) -> None:
        """Take in a definition of a constant, which texts may name from now on."""
        self.others += f" {name}"
        self.constants[name] = self.constants.get(name, "") + text

    def absorb(self, other: MadeFrom) -> None:
        """Take in the definitions of a file that is used."""
        self.words |= other.words
        for name, text in other.constants.items():
            self.define(name, text)
        self.others += other.others

    def behind(self, data: object) -> str:
        """A digest of the data and of all texts that may say what names in them mean."""
        text = repr(data)
        starts = [*self._named(text), *self.constants.keys() & self.words]
        named = sorted(reachable(starts, lambda name: self._named(self.constants[name])))
        return _digest(repr((text, self.others, [self.constants[name] for name in named])))

    def _named(self, text: str) -> Iterator[str]:
        return (word for word in set(_WORD.findall(text)) if word in self.constants)


def _digest(text: str) -> str:
    from hashlib import sha256  # for editors only

    return sha256(text.encode(errors="backslashreplace")).hexdigest()
