"""The shape of a file: its parts, or what is wrong with it, in words, at its place."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from typing import Any, Literal, TypeVar

from pydantic import ValidationError

from specc.diagnostics import (
    Diagnostic,
    Faults,
    TooManyFaultsError,
    nearest,
    rename_fix,
    sole_correction,
)
from specc.schema.desugar import route_below
from specc.schema.keys import (
    OTHERS,
    ListKind,
    LiteralKind,
    MappingKind,
    SpecModel,
    Text,
    ValueKind,
    is_model,
)
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
M = TypeVar("M", bound=SpecModel)
_SHOWN = 60
_LISTED_KEYS = 24
_VERSION: Route = ("specc",)


def shape(model: type[M], data: object, file: str) -> tuple[M | None, list[Diagnostic]]:
    """Validate data as a model; returns None and the findings if their shape is wrong."""
    try:
        return model.model_validate(data), []
    except ValidationError as error:
        translation = _Translation(model, data, file)
        with suppress(TooManyFaultsError):
            for found in error.errors(include_url=False, include_context=False):
                translation.add(found["loc"], found["type"], found["input"])
        findings = translation.findings
    unsupported = [finding for finding in findings if finding.code == "E0105"]
    return None, list(dict.fromkeys(unsupported or findings))


class _Translation:
    """Findings, with their places in the file, for the errors of pydantic."""

    def __init__(self, model: type[SpecModel], data: object, file: str) -> None:
        self.findings = Faults()
        self._model = model
        self._data = data
        self._file = file
        self._compared: set[tuple[str | int, ...]] = set()

    def add(self, loc: tuple[str | int, ...], type_: str, value: Any) -> None:
        """Add the findings for an error; keys of a mapping are compared once for all of them."""
        if type_ in ("missing", "extra_forbidden"):
            above = loc[:-1]
            if above not in self._compared:
                self._compared.add(above)
                kind, data, route = self._walk(above)
                assert is_model(kind)
                self._compare_keys(kind, kind.with_others(data), route)
            return
        if loc[-1:] == ("[key]",) and type_ == "value_error":
            mapping, _, _ = self._walk(loc[:-2])
            assert isinstance(mapping, MappingKind) and mapping.name.fault
            fault = mapping.name.fault(value) or ("", "")
            route = self._walk(loc[:-1])[2]
            self._report("E0104", f"{_shown(value)} {fault[0]}", route, fault[1], "key")
            return
        kind, data, route = self._walk(loc)
        if isinstance(kind, Text):
            self._text(kind, value, route)
        elif isinstance(kind, LiteralKind):
            self._literal(kind, value, route)
        elif isinstance(kind, ListKind):
            self._list(kind, value, route)
        elif isinstance(kind, MappingKind):
            self._mismatch("a mapping", value, route)
        elif is_model(kind) and kind.row and isinstance(data, list):
            words = f"a row has {len(kind.row)} items, this one has {len(data)}"
            self._refuse(f"{_name(route)}{words}", _form(kind), route)
        elif is_model(kind):
            hint = _form(kind) if route and data is not None else ""
            self._mismatch("a mapping", data, route, hint)
        elif kind is bool:
            self._mismatch("true or false", value, route)
        elif isinstance(value, float) and not math.isfinite(value):
            self._refuse(f"{_name(route)}{_shown(value)} must be a finite number", "", route)
        else:
            self._mismatch("a whole number", value, route)

    def _walk(self, loc: tuple[str | int, ...]) -> tuple[ValueKind, Any, Route]:
        """The kind, the value and the route of what pydantic has at a location."""
        kind: ValueKind = self._model
        value: Any = self._data
        route: Route = ()
        for step in loc:
            if isinstance(kind, ListKind):
                route, value, kind = route_below(value, step, route), value[step], kind.item
            elif isinstance(kind, MappingKind):
                route, value, kind = route_below(value, step, route), value[step], kind.value
            elif is_model(kind):
                kind = kind.keys[str(step)].kind
                if step != OTHERS:  # what is below it stands in the mapping itself
                    below, value = route_below(value, step, route), value[step]
                    is_in_row = len(below) > len(route) and isinstance(below[-1], int)
                    route = (*route, step) if is_in_row else below
        return kind, value, route

    def _text(self, kind: Text, value: Any, route: Route) -> None:
        if not isinstance(value, str):
            self._mismatch("text", value, route)
        elif kind.filled and not value:
            self._refuse(f"{_name(route)}the text is empty", "write a few words", route)
        elif kind.fault and (fault := kind.fault(value)):
            self._refuse(f"{_name(route)}{_shown(value)} {fault[0]}", fault[1], route)

    def _list(self, kind: ListKind, value: Any, route: Route) -> None:
        least, most = kind.form.min_length, kind.form.max_length
        if not isinstance(value, list):
            row = kind.item.row if is_model(kind.item) else ()
            rows = f"write a list of rows, each on a line of its own: `- [{', '.join(row)}]`"
            self._mismatch("a list", value, route, kind.form.help or (rows if row else ""))
        elif most is not None and len(value) > most:
            self._refuse(f"{_name(route)}a list must have at most {most} items", "", route)
        else:
            words = f"a list must have at least {least} items" if value else "the list is empty"
            help = "write at least one item" if least == 1 else f"write {least} items"
            self._refuse(f"{_name(route)}{words}", help, route)

    def _literal(self, kind: LiteralKind, value: Any, route: Route) -> None:
        names = [str(one) for one in kind.values if one != ""]  # which stands for a key left out
        if route == _VERSION:
            words = f"version {value!r} of the specification language is not supported"
            self._report("E0105", words, route, f"write `specc: {kind.values[-1]}`")
        elif len(names) == 1:
            words = f"{_name(route)}{_shown(value)} is not `{names[0]}`"
            self._refuse(words, f"write `{names[0]}`", route)
        else:
            close = nearest(value, names) if isinstance(value, str) else []
            listed = ", ".join(f"`{name}`" for name in names)
            hint = f"did you mean `{close[0]}`?" if close else "write one of them"
            self._refuse(f"{_name(route)}{_shown(value)} is not one of {listed}", hint, route)

    def _compare_keys(self, model: type[SpecModel], data: dict[str, Any], route: Route) -> None:
        """Report keys that there are not, and those that are missing, but not as mistyped."""
        known = model.keys
        close = {name: nearest(name, known) for name in data if name not in known}
        mistyped = {one for names in close.values() for one in names}
        if (
            route
            and any(key.needed for key in known.values())
            and close
            and close.keys() == data.keys()
            and not mistyped
        ):
            name = next(iter(data))
            words = f"unknown key `{name}`{_inside(route)}, which lacks all that it needs"
            self._report("E0101", words, (*route, name), _form(model), "key")
            return
        for name, key in known.items():
            if key.needed and name not in data and name not in mistyped:
                value = "1" if (*route, name) == _VERSION else "..."
                words = f"missing key `{name}`{_inside(route)}"
                self._report("E0102", words, route, f"add `{name}: {value}`", "key")
        for name, names in close.items():
            hint = f"did you mean {' or '.join(f'`{one}`' for one in names)}?"
            if not names:
                rest = ", ..." if len(known) > _LISTED_KEYS else ""
                hint = (
                    f"known keys: {', '.join(f'`{one}`' for one in [*known][:_LISTED_KEYS])}{rest}"
                )
            place = Place(self._file, (*route, name), "key")
            fix = rename_fix(place, name, sole_correction(name, names))
            words = f"unknown key `{name}`{_inside(route)}"
            self.findings.add(Diagnostic("E0101", words, place, help=hint, fix=fix))

    def _mismatch(self, expected: str, value: Any, route: Route, help: str = "") -> None:
        """Report a value of a kind other than expected."""
        words = f"{_name(route)}expected {expected}, found {_kind_of(value)}"
        self._report("E0103", words, route, help or _way_to(expected, value))

    def _refuse(self, words: str, help: str, route: Route) -> None:
        """Report a value of the expected kind that is not accepted."""
        self._report("E0104", words, route, help)

    def _report(
        self, code: str, words: str, route: Route, help: str, part: _PartOfPlace = "value"
    ) -> None:
        place = Place(self._file, route, part)
        self.findings.add(Diagnostic(code, words, place, help=help))


# Words.


def _kind_of(value: Any) -> str:
    """The kind of a value of the file, in words."""
    for kind, words in _FOUND:
        if isinstance(value, kind):
            return words.format(value=str(value).lower() if kind is bool else value)
    return "nothing"


def _way_to(expected: str, value: Any) -> str:
    """A help text on how to write a value of the expected kind in place of `value`."""
    if value is None:
        return "write what belongs here, or delete the key"
    if expected == "text" and isinstance(value, (bool, int, float)):
        return f'a value in quotes is text: `"{str(value).lower()}"`'
    if expected == "a list" and isinstance(value, str) and _PLAIN.fullmatch(value):
        return f"write `[{value}]`"
    return _WRITTEN[expected]


def _form(model: type[SpecModel]) -> str:
    """How a part is written, with what it needs."""
    if model.row:
        return f"write `[{', '.join(model.row)}]`"
    needed = ", ".join(f"{name}: ..." for name, key in model.keys.items() if key.needed)
    return f"write `{{{needed}}}`" if needed else ""


def _shown(value: Any) -> str:
    if isinstance(value, (dict, list)):
        return _kind_of(value)
    text = str(value)
    return f"`{text}`" if len(text) <= _SHOWN else f"`{text[:_SHOWN]}...`"


def _name(route: Route) -> str:
    return f"`{_dotted(route)}`: " if route else ""


def _inside(route: Route) -> str:
    return f" in `{_dotted(route)}`" if route else ""


def _dotted(route: Route) -> str:
    parts = [f"[{step}]" if isinstance(step, int) else f".{step}" for step in route]
    return "".join(parts).removeprefix(".")
