"""The shape of a file: its parts, or what is wrong with it, in words, at its place."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Literal, TypeVar

from specc.diagnostics import (
    Diagnostic,
    Faults,
    TooManyFaultsError,
    nearest,
    renaming,
    surely_meant,
)
from specc.schema.keys import (
    OTHERS,
    Named,
    OneOf,
    Optional,
    Part,
    Several,
    Text,
    Truth,
    ValueKind,
    Whole,
)
from specc.schema.making import Unlike, in_full, made, maker, others_apart
from specc.schema.unfold import route_below
from specc.source import Place, Route

_FOUND: tuple[tuple[type, str], ...] = (
    (bool, "{value}"),
    (int, "the number {value}"),
    (float, "the number {value}"),
    (str, "text"),
    (list, "a list"),
    (dict, "a mapping"),
)
_WRITTEN = {
    "a mapping": "a mapping is written `{key: value}`, or `key: value` on lines of its own below",
    "a list": "a list is written `[a, b]`, or `- a` on lines of its own below",
    "text": "text is one value, in quotes if it has brackets, braces or a colon",
    "a whole number": "write digits only, without quotes",
    "true or false": "write `true` or `false`, without quotes",
}
_PLAIN = re.compile(r"[\w./-]+")
_PartOfPlace = Literal["key", "value"]
P = TypeVar("P", bound=Part)
_SHOWN = 60
_LISTED_KEYS = 24
_VERSION: Route = ("specc",)


def shape(part: type[P], data: object, file: str) -> tuple[P | None, list[Diagnostic]]:
    """A mapping made of data, or None and what is wrong with their shape."""
    with suppress(Unlike):
        return made(part, data), []
    check = _Check(file)
    with suppress(TooManyFaultsError):
        check.value(part, data, ())
    unsupported = [finding for finding in check.findings if finding.code == "E0105"]
    return None, list(dict.fromkeys(unsupported or check.findings))


class _Check:
    """Tells why nothing is made of data, by as many findings as there are faults in them."""

    def __init__(self, file: str) -> None:
        self.findings = Faults()
        self._file = file

    def value(self, kind: ValueKind, value: Any, route: Route) -> None:
        """Report what keeps the value at a route from being of a kind."""
        try:
            maker(kind)(value)
        except Unlike:
            told: Callable[..., None] = _TOLD.get(type(kind), _Check._part)
            told(self, kind, value, route)

    def _optional(self, kind: Optional, value: Any, route: Route) -> None:
        self.value(kind.value, value, route)

    def _text(self, kind: Text, value: Any, route: Route) -> None:
        if not isinstance(value, str):
            self._misfit("text", value, route)
            return
        if kind.filled and not value:
            self._refuse(f"{_name(route)}the text is empty", "write a few words", route)
        if kind.fault and (fault := kind.fault(value)):
            self._refuse(f"{_name(route)}{_shown(value)} {fault[0]}", fault[1], route)

    def _named(self, kind: Named, value: Any, route: Route) -> None:
        if not isinstance(value, dict):
            self._misfit("a mapping", value, route)
            return
        for name, one in value.items():
            at = route_below(value, name, route)
            if kind.name.fault and (fault := kind.name.fault(name)):
                words = f"{_shown(name)} {fault[0]}"
                self._tell("E0104", words, at, fault[1], "key")
            self.value(kind.value, one, at)

    def _several(self, kind: Several, value: Any, route: Route) -> None:
        least, most = kind.how.least, kind.how.most
        if type(value) in kind.how.alone:
            value = [value]
        if not isinstance(value, list):
            self._misfit("a list", value, route, kind.how.help or _list_form(kind.item))
        elif most is not None and len(value) > most:
            self._refuse(f"{_name(route)}a list must have at most {most} items", "", route)
        elif len(value) < least:
            words = f"a list must have at least {least} items" if value else "the list is empty"
            help = "write at least one item" if least == 1 else f"write {least} items"
            self._refuse(f"{_name(route)}{words}", help, route)
        else:
            for n, one in enumerate(value):
                self.value(kind.item, one, (*route, n))

    def _choice(self, kind: OneOf, value: Any, route: Route) -> None:
        names = [str(one) for one in kind.values if one != ""]  # which stands for a key left out
        if route == _VERSION:
            words = f"version {value!r} of the specification language is not supported"
            self._tell("E0105", words, route, f"write `specc: {kind.values[-1]}`")
        elif len(names) == 1:
            words = f"{_name(route)}{_shown(value)} is not `{names[0]}`"
            self._refuse(words, f"write `{names[0]}`", route)
        else:
            close = nearest(value, names) if isinstance(value, str) else []
            listed = ", ".join(f"`{name}`" for name in names)
            hint = f"did you mean `{close[0]}`?" if close else "write one of them"
            self._refuse(f"{_name(route)}{_shown(value)} is not one of {listed}", hint, route)

    def _whole(self, _: Whole, value: Any, route: Route) -> None:
        if isinstance(value, float) and not math.isfinite(value):
            self._refuse(f"{_name(route)}{_shown(value)} must be a finite number", "", route)
        else:
            self._misfit("a whole number", value, route)

    def _truth(self, _: Truth, value: Any, route: Route) -> None:
        self._misfit("true or false", value, route)

    def _part(self, part: type[Part], value: Any, route: Route) -> None:
        known = part.keys
        data = in_full(part, value)
        if part.row and isinstance(data, list):
            words = f"{_name(route)}a row has {len(part.row)} items, this one has {len(data)}"
            self._refuse(words, _form(part), route)
            return
        if not isinstance(data, dict):
            hint = _form(part) if route and data is not None else ""
            self._misfit("a mapping", value, route, hint)
            return
        if OTHERS in known:
            data = others_apart(part, data)
        elif not part.needed <= data.keys() <= known.keys():
            self._check_names(part, data, route)
        for name, one in data.items():
            if name in known:
                is_here = name == OTHERS or (name == part.short and data is not value)
                at = route if is_here else route_below(data, name, route)
                self.value(known[name].kind, one, at)

    def _check_names(self, part: type[Part], data: dict[str, Any], route: Route) -> None:
        """Report keys that there are not, and those that are missing, but not as mistyped."""
        known = part.keys
        close = {name: nearest(name, known) for name in data if name not in known}
        mistyped = {one for names in close.values() for one in names}
        if route and part.needed and close and close.keys() == data.keys() and not mistyped:
            name = next(iter(data))
            words = f"unknown key `{name}`{_inside(route)}, which lacks all that it needs"
            self._tell("E0101", words, (*route, name), _form(part), "key")
            return
        for name, key in known.items():
            if key.needed and name not in data and name not in mistyped:
                value = "1" if (*route, name) == _VERSION else "..."
                words = f"missing key `{name}`{_inside(route)}"
                self._tell("E0102", words, route, f"add `{name}: {value}`", "key")
        for name, names in close.items():
            self._unknown(name, names, [*known], route)

    def _unknown(self, name: str, close: list[str], known: list[str], route: Route) -> None:
        hint = f"did you mean {' or '.join(f'`{one}`' for one in close)}?"
        if not close:
            rest = ", ..." if len(known) > _LISTED_KEYS else ""
            hint = f"known keys: {', '.join(f'`{one}`' for one in known[:_LISTED_KEYS])}{rest}"
        place = Place(self._file, (*route, name), "key")
        meant = surely_meant(name, close)
        fix = renaming(place, name, meant)
        words = f"unknown key `{name}`{_inside(route)}"
        self.findings.add(Diagnostic("E0101", words, place, help=hint, fix=fix))

    def _misfit(self, expected: str, value: Any, route: Route, help: str = "") -> None:
        """A value of another kind than expected."""
        words = f"{_name(route)}expected {expected}, found {_kind_of(value)}"
        self._tell("E0103", words, route, help or _way_to(expected, value))

    def _refuse(self, words: str, help: str, route: Route) -> None:
        """A value of the right kind that is not right."""
        self._tell("E0104", words, route, help)

    def _tell(
        self, code: str, words: str, route: Route, help: str, part: _PartOfPlace = "value"
    ) -> None:
        place = Place(self._file, route, part)
        self.findings.add(Diagnostic(code, words, place, help=help))


_TOLD: dict[type, Callable[..., None]] = {
    Text: _Check._text,
    Optional: _Check._optional,
    Named: _Check._named,
    Several: _Check._several,
    OneOf: _Check._choice,
    Whole: _Check._whole,
    Truth: _Check._truth,
}


# Words.


def _kind_of(value: Any) -> str:
    """Words for what stands in the file."""
    for kind, words in _FOUND:
        if isinstance(value, kind):
            return words.format(value=str(value).lower() if kind is bool else value)
    return "nothing"


def _way_to(expected: str, value: Any) -> str:
    """How a value of the expected kind is written; `value` stands there now."""
    if value is None:
        return "write what belongs here, or delete the key"
    if expected == "text" and isinstance(value, (bool, int, float)):
        return f'a value in quotes is text: `"{str(value).lower()}"`'
    if expected == "a list" and isinstance(value, str) and _PLAIN.fullmatch(value):
        return f"write `[{value}]`"
    return _WRITTEN[expected]


def _list_form(item: ValueKind) -> str:
    """How a list of such items is written, if they have rows."""
    row = item.row if isinstance(item, type) else ()
    return f"write a list of rows, each on a line of its own: `- [{', '.join(row)}]`" if row else ""


def _form(part: type[Part]) -> str:
    """How a part is written, with what it needs."""
    if part.row:
        return f"write `[{', '.join(part.row)}]`"
    needed = ", ".join(f"{name}: ..." for name, key in part.keys.items() if key.needed)
    return f"write `{{{needed}}}`" if needed else ""


def _shown(value: Any) -> str:
    if isinstance(value, (dict, list)):
        return _kind_of(value)
    text = str(value)
    return f"`{text}`" if len(text) <= _SHOWN else f"`{text[:_SHOWN]}...`"


def _name(route: Route) -> str:
    return f"`{_spelled(route)}`: " if route else ""


def _inside(route: Route) -> str:
    return f" in `{_spelled(route)}`" if route else ""


def _spelled(route: Route) -> str:
    parts = [f"[{step}]" if isinstance(step, int) else f".{step}" for step in route]
    return "".join(parts).removeprefix(".")
