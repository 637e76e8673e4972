"""Symbols of the paper: a letter with sub- and superscripts, and frames before it.

`notation_of` reads a symbol as people write it under `symbol:`, `symbol_of` makes one of a name by
rule: `T_d` is T with the subscript d, `alpha` a Greek letter, `arm` a word.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_SMALL = "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau"
_OTHER = "upsilon phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"
GREEK = frozenset((*_SMALL.split(), *_OTHER.split()))
ACCENTS = frozenset(("dot", "ddot", "hat", "bar", "tilde", "vec"))
STYLES = frozenset(("cal", "frak", "bold"))


@dataclass(frozen=True, slots=True)
class MathSymbol:
    """A `base` with what stands around it; `style` is an accent or a style of letters, or empty."""

    base: str
    style: str = ""
    sub: tuple[MathSymbol, ...] = ()
    sup: tuple[MathSymbol, ...] = ()
    before_sub: tuple[MathSymbol, ...] = ()
    before_sup: tuple[MathSymbol, ...] = ()

    @property
    def is_letter(self) -> bool:
        """Whether the base is one letter, which is set in italics."""
        return len(self.base) == 1 or self.base in GREEK


def symbol_of(name: str) -> MathSymbol:
    """The symbol of a name: what follows its first letter is a subscript; else it is a word."""
    first, *rest = name.strip("_").split("_")
    found = re.fullmatch(r"([^\W\d_]+)(\d+)", first)
    if found and _is_letter(found[1]):
        first, rest = found[1], [found[2], *rest]
    if _is_letter(first) and all(rest):
        return MathSymbol(first, sub=tuple(map(MathSymbol, rest)))
    return MathSymbol(name)


def _is_letter(text: str) -> bool:
    return len(text) == 1 or text in GREEK


_TOKEN = re.compile(r"\s*([^\W_]+|[_^{}(),])|\s+$", re.UNICODE)
_LONGEST, _DEEPEST = 60, 3


class NotationError(ValueError):
    """A text that is no symbol."""


def notation_of(text: str) -> MathSymbol:
    """The symbol that a text spells, such as `T_d`, `dot(r)_p` or `^B_{E_g} T_d`.

    Raises:
        NotationError: it spells none.
    """
    if len(text) > _LONGEST:
        raise NotationError
    tokens, at = [], 0
    while at < len(text.rstrip()):
        found = _TOKEN.match(text, at)
        if not found:
            raise NotationError
        tokens.append(found[1])
        at = found.end()
    reader = _Reader(tokens)
    symbol = reader.symbol(0)
    if reader.rest:
        raise NotationError
    return symbol


class _Reader:
    def __init__(self, tokens: list[str]) -> None:
        self.rest = tokens[::-1]

    def symbol(self, depth: int) -> MathSymbol:
        """A symbol with all that stands around it."""
        if depth > _DEEPEST:
            raise NotationError
        before = self._scripts(depth)
        base, style = self._word(), ""
        if self._takes("("):
            style, base = base, self._word()
            if style not in ACCENTS | STYLES or not self._takes(")"):
                raise NotationError
        after = self._scripts(depth)
        return MathSymbol(base, style, *after, *before)

    def _scripts(self, depth: int) -> tuple[tuple[MathSymbol, ...], tuple[MathSymbol, ...]]:
        """A subscript and a superscript, each at most once."""
        found: dict[str, tuple[MathSymbol, ...]] = {}
        while self.rest and self.rest[-1] in "_^":
            sign = self.rest.pop()
            if sign in found:
                raise NotationError
            found[sign] = self._script(depth)
        return found.get("_", ()), found.get("^", ())

    def _script(self, depth: int) -> tuple[MathSymbol, ...]:
        if not self._takes("{"):
            return (MathSymbol(self._word()),)
        items = [self.symbol(depth + 1)]
        while self._takes(","):
            items.append(self.symbol(depth + 1))
        if not self._takes("}"):
            raise NotationError
        return tuple(items)

    def _word(self) -> str:
        if not self.rest or not self.rest[-1].isalnum():
            raise NotationError
        return self.rest.pop()

    def _takes(self, token: str) -> bool:
        if self.rest and self.rest[-1] == token:
            self.rest.pop()
            return True
        return False
