"""Text of Typst: nothing of a specification gets into it but as a string.

Formulas are `Math`: text of Typst's mathematics, with the number of characters that it is about as
wide as.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from specc.diagnostics.visible import visible
from specc.lang.notation import ACCENTS, GREEK, MathSymbol


def string(text: str) -> str:
    """A string of Typst; what cannot be seen is in it as an escape that can."""
    shown = visible(" ".join(text.split()))
    return '"' + shown.replace("\\", "\\\\").replace('"', '\\"') + '"'


def verbatim(text: str) -> str:
    """A string of Typst with all spaces of the text."""
    return '"' + visible(text).replace("\\", "\\\\").replace('"', '\\"') + '"'


def array(items: Iterable[str]) -> str:
    """An array of Typst."""
    return "(" + "".join(f"{item}, " for item in items) + ")"


def call(function: str, *arguments: str, **named: str) -> str:
    """A call in code of Typst."""
    given = (*arguments, *(f"{name.replace('_', '-')}: {value}" for name, value in named.items()))
    return f"{function}({', '.join(given)})"


@dataclass(frozen=True, slots=True)
class Math:
    """A formula; `width` is about how many letters it is as wide as."""

    text: str
    width: float

    def __add__(self, other: Math) -> Math:
        """One after the other, with no space but what their signs have."""
        between = "/**/" if self.text and other.text else ""
        return Math(f"{self.text}{between}{other.text}", self.width + other.width)

    @property
    def inline(self) -> str:
        """As content of Typst within a line."""
        return f"${self.text}$"


EMPTY = Math("", 0)


def sign(text: str, width: float = 1.6) -> Math:
    """A sign of Typst by its name, such as `and` or `eq.delta`."""
    return Math(text, width)


def word(text: str, width: float | None = None) -> Math:
    """Upright text."""
    return Math(string(text), 0.9 * len(text) if width is None else width)


def joined(parts: Iterable[Math], between: Math) -> Math:
    """FormulaWriter with a sign between them."""
    found = EMPTY
    for number, part in enumerate(parts):
        found = found + between + part if number else part
    return found


COMMA = Math("#sym.comma", 0.6)


def listed(parts: Iterable[Math]) -> Math:
    """FormulaWriter with commas between them."""
    return joined(parts, COMMA)


def bracketed(inside: Math, left: str = "(", right: str = ")") -> Math:
    """A formula in brackets that are as high as it is."""
    return Math(f"lr({left} {inside.text} {right})", inside.width + 1)


def root(inside: Math) -> Math:
    """The square root of a formula."""
    return Math(f"sqrt({inside.text})", inside.width + 1)


def attached(base: Math, **places: Math) -> Math:
    """A formula with others around it: `tl`, `bl`, `tr`, `br`, `t`, `b`."""
    given = {place: part for place, part in places.items() if part.text}
    if not given:
        return base
    text = ", ".join(f"{place}: {part.text}" for place, part in given.items())
    pairs = (("tl", "bl"), ("tr", "br"), ("t", "b"))
    empty = EMPTY
    width = sum(max(given.get(p, empty).width for p in pair) for pair in pairs)
    return Math(f"attach({base.text}, {text})", base.width + 0.7 * width)


def linked(target: str, shown: Math) -> Math:
    """A formula that leads to a definition, if the document has it."""
    return Math(f"#u({string(target)}, ${shown.text}$)", shown.width)


def unlinked(formula: Math, target: str) -> Math:
    """A formula without its links to the place at which it stands itself."""
    link = rf"#u\({re.escape(string(target))}, \$([^$]*)\$\)"
    return Math(re.sub(link, r"\1", formula.text), formula.width)


def drawn(
    symbol: MathSymbol, sub: tuple[MathSymbol, ...] = (), tilde: bool = False, **before: Math
) -> Math:
    """A symbol; `before` is what stands before it, unless it says so itself."""
    base = _base(symbol, tilde)
    own = {
        "br": _scripts(symbol.sub),
        "tr": _scripts(symbol.sup),
        "tl": _scripts(symbol.before_sup),
        "bl": _scripts(symbol.before_sub),
    }
    if not (symbol.before_sub or symbol.before_sup):
        own |= before
    return attached(base, **own)


def _base(symbol: MathSymbol, tilde: bool = False) -> Math:
    name = symbol.base
    if symbol.style in ("cal", "frak", "bold"):
        base = Math(f"{symbol.style}({string(name)})", len(name))
    elif name in GREEK or (len(name) == 1 and name.isascii() and name.isalpha()):
        base = sign(name, 1)
    elif len(name) == 1:
        base = Math(f"italic({string(name)})", 1)
    else:
        base = word(name.replace("_", "\u202f"))
    if symbol.style in ACCENTS:
        accent = {"vec": "arrow", "bar": "macron", "ddot": "dot.double"}
        base = Math(f"accent({base.text}, {accent.get(symbol.style, symbol.style)})", base.width)
    return Math(f"accent({base.text}, tilde)", base.width) if tilde else base


def _scripts(symbols: tuple[MathSymbol, ...]) -> Math:
    return listed(map(_script, symbols))


def _script(symbol: MathSymbol) -> Math:
    if symbol.base.isdecimal():
        return word(symbol.base)
    return drawn(symbol)
