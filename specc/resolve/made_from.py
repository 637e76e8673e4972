"""The texts that definitions follow from: while they are the same, what is kept of them holds.

Values of constants change more often than other definitions do. A text follows from the constants
that it names, and from those that their texts name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

_WORD = re.compile(r"\w+")


@dataclass(eq=False, slots=True)
class MadeFrom:
    """The texts that the definitions in force in one file follow from; empty if nothing is kept."""

    others: str = ""
    """Digests of all texts but those of constants, and the names of these."""
    constants: dict[str, str] = field(default_factory=dict)
    """Constant -> a digest of its text and of those that it names, in order of definition."""
    words: set[str] = field(default_factory=set)
    """The words of the texts that are not those of constants."""

    def take(self, data: object) -> None:
        """Take in definitions that are no constants."""
        self.others += _digest(data)
        self.words.update(_words(data))

    def define(self, name: str, data: object) -> None:
        """Take in the definition of a constant, which may name those before it."""
        self._add(name, _digest((data, self._named(set(_words(data))))))

    def absorb(self, other: MadeFrom) -> None:
        """Take in the definitions of a file that is used."""
        self.others += other.others
        self.words |= other.words
        for name, digest in other.constants.items():
            self._add(name, digest)

    def behind(self, data: object) -> str:
        """A digest of the data and of all texts that may say what names in them mean."""
        return _digest((data, self.others, self._named(self.words.union(_words(data)))))

    def _add(self, name: str, digest: str) -> None:
        # Of a name that is defined twice both definitions count for everything.
        self.others += f" {name}" + (
            self.constants[name] + digest if name in self.constants else ""
        )
        self.constants.setdefault(name, digest)

    def _named(self, words: set[str]) -> list[str]:
        return [self.constants[name] for name in sorted(words & self.constants.keys())]


def _words(data: object) -> Iterator[str]:
    """The words of all texts in data of a file; of anything else, those that show it."""
    if isinstance(data, dict):
        data = [*data, *data.values()]
    if isinstance(data, (list, tuple)):
        for each in data:
            yield from _words(each)
    else:
        yield from _WORD.findall(data if isinstance(data, str) else repr(data))


def _digest(data: object) -> str:
    from hashlib import sha256  # for editors only

    return sha256(repr(data).encode(errors="backslashreplace")).hexdigest()
