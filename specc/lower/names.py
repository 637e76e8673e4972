"""Identifiers: any name of a specification becomes a safe and unique name of Python."""

from __future__ import annotations

import builtins
import keyword
import re
from collections.abc import Iterable

_AMBIGUOUS = frozenset("lOI")
"""Letters that fonts do not tell from digits; linters refuse them as names."""
BUILTINS = frozenset(dir(builtins))
"""Names that a module and its functions must not hide."""
_WORD = re.compile(r"[A-Za-z0-9]+")
_TITLE_WORDS = 4


def identifier(text: str) -> str:
    """`text` as an ASCII identifier that is no keyword and does not start with an underscore.

    Names with a leading underscore are private to classes, with two they are mangled.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    stripped = name.lstrip("_")
    name = stripped + "_" * (len(name) - len(stripped)) if stripped else "unnamed"
    if name[0].isdigit():
        name = f"n{name}"
    if keyword.iskeyword(name) or name in _AMBIGUOUS:
        name = f"{name}_"
    return name


class Names:
    """Hands out names that differ from each other and from those already taken."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)

    def new(self, wanted: str) -> str:
        """`wanted` made safe, with a number behind it if that name is taken."""
        base = identifier(wanted)
        name, count = base, 1
        while name in self._taken:
            count += 1
            name = f"{base}_{count}"
        self._taken.add(name)
        return name

    def inner(self) -> Names:
        """Names of an inner scope, which must not hide those of this one."""
        return Names(self._taken)


def joined(
    pairs: Iterable[tuple[str, str]], taken: Iterable[str] = ()
) -> dict[tuple[str, str], str]:
    """A name for every pair, `<first>_<second>`.

    Pairs that would share a name (`a, b_c` and `a_b, c`) get two underscores in the middle instead,
    so that the name of a pair does not depend on the order of the pairs.
    """
    short = {pair: identifier("_".join(pair)) for pair in pairs}
    uses = list(short.values())
    names = Names(taken)
    return {
        pair: names.new(name if uses.count(name) == 1 else "__".join(pair))
        for pair, name in short.items()
    }


def class_name(title: str, otherwise: str) -> str:
    """`Object recognition` -> `ObjectRecognition`; `otherwise` where the title is no short name."""
    words = _WORD.findall(title)
    plain = re.fullmatch(r"[A-Za-z][A-Za-z0-9 -]*", title) is not None
    if not (plain and 0 < len(words) <= _TITLE_WORDS):
        words = _WORD.findall(otherwise)
    return identifier("".join(word[0].upper() + word[1:] for word in words) or "Unnamed")
