"""What importers write: names, rates and YAML."""

from __future__ import annotations

import keyword
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from specc.lang import RESERVED
from specc.tools.fmt.tree import quoted

# SpecNames of other formats as names of a specification.


_LONGEST = 60
PEERS = frozenset(("c", "E", "R"))
"""Names that no agent can have: these stand for parts of the agent itself (docs/language.md 6)."""


class SpecNames:
    """Gives every foreign name a legal and unique one."""

    def __init__(self, used: Iterable[str] = ()) -> None:
        self._given: dict[str, str] = {}
        self._used = {*RESERVED, *used}
        self._counts: dict[str, int] = {}

    def of(self, foreign: str) -> str:
        """The name for a foreign one, the same whenever it is asked."""
        if foreign not in self._given:
            self._given[foreign] = self.new(foreign)
        return self._given[foreign]

    def new(self, wish: str) -> str:
        """A legal name that was not given before, as close to `wish` as possible."""
        base = re.sub(r"\W+", "_", wish, flags=re.ASCII).strip("_")[:_LONGEST] or "unnamed"
        if base[0].isdigit() or keyword.iskeyword(base):
            base = f"n_{base}"
        name, count = base, self._counts.get(base, 2)
        while name in self._used:
            name, count = f"{base}_{count}", count + 1
        self._used.add(name)
        self._counts[base] = count
        return name

    @property
    def changed(self) -> dict[str, str]:
        """Foreign names that could not be kept, with what they became."""
        return {old: new for old, new in self._given.items() if old != new}


# Periods as the language writes them.


def rate(period: Fraction) -> str:
    """A period as the language writes it: whole hertz where it is a whole number of them."""
    frequency = 1 / period
    if frequency.denominator == 1:
        return f"{frequency.numerator} Hz"
    return f"{float(period * 1000):.12g} ms"


# Specifications as YAML text: block style above, one line for what is small.


@dataclass(frozen=True, slots=True)
class Noted:
    """A value of a mapping with comments above its key, a line each."""

    value: Data
    above: tuple[str, ...]


Data = str | bool | Noted | Sequence["Data"] | Mapping[str, "Data"]

_WIDTH = 100
_PLAIN = re.compile(r"[A-Za-z_][\w.]*(?: (?:[\w.]+|[-+*/<>=]+))*", re.ASCII)
_PLAIN_IN_BLOCK = re.compile(r"[A-Za-z_(][\w.(),]*(?: (?:[\w.(),]+|[-+*/<>=]+))*", re.ASCII)
_SPECIAL = frozenset(("true", "false", "null", "yes", "no", "on", "off"))
_NUMBER = re.compile(r"[0-9]+(?:\.[0-9]+)?(?: [A-Za-z]+)?")


def filled(data: Mapping[str, Data]) -> dict[str, Data]:
    """A mapping without what is empty, which need not be written."""
    return {key: value for key, value in data.items() if value}


def to_yaml(data: Mapping[str, Data], *, fold: bool = False) -> str:
    """The text of a mapping; texts are quoted unless every YAML reader takes them as texts.

    `fold`: texts that are too long for a line, expressions say, take several.
    """
    return "\n".join(_block(data, 0, fold)) + "\n"


def _block(data: Mapping[str, Data], indent: int, fold: bool) -> Iterator[str]:
    for key, value in data.items():
        while isinstance(value, Noted):
            yield from (f"{' ' * indent}# {line}" for line in value.above)
            value = value.value
        lead = f"{' ' * indent}{_scalar(key)}:"
        shown = _scalar(value, _PLAIN_IN_BLOCK) if isinstance(value, str) else _flow(value)
        short = f"{lead} {shown}"
        is_short = bool(indent) and len(short) <= _WIDTH and not _has_notes(value)
        if fold and isinstance(value, str) and len(short) > _WIDTH and " " in value:
            yield f"{lead} >-"
            lines = textwrap.wrap(
                value, _WIDTH - indent - 2, break_long_words=False, break_on_hyphens=False
            )
            yield from (f"{' ' * indent}  {line}" for line in lines)
        elif isinstance(value, (str, bool)) or not value or is_short:
            yield short
        elif isinstance(value, Mapping):
            yield lead
            yield from _block(value, indent + 2, fold)
        else:
            yield lead
            yield from (f"{' ' * indent}  - {_flow(item)}" for item in value)


def _has_notes(value: Data) -> bool:
    if isinstance(value, Mapping):
        return any(isinstance(v, Noted) or _has_notes(v) for v in value.values())
    return False


def _flow(value: Data) -> str:
    if isinstance(value, Noted):
        return _flow(value.value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _scalar(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_scalar(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    return "[" + ", ".join(map(_flow, value)) + "]"


def _scalar(text: str, plain_form: re.Pattern[str] = _PLAIN) -> str:
    plain = plain_form.fullmatch(text) or _NUMBER.fullmatch(text)
    if plain and text.lower() not in _SPECIAL:
        return text
    return quoted(text)
