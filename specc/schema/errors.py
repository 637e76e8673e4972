"""What is wrong with the shape of a file, in words, at its place."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from pydantic import BaseModel, ValidationError

from specc.diagnostics import Diagnostic, Edit, Fix, nearest, surely_meant
from specc.frozen import frozen
from specc.schema.base import PYTHON_PATH
from specc.schema.location import Location, keys_of, locate, needed_keys_of
from specc.source import Place, Route

# Words for pydantic's types of error, in terms of YAML instead of Python.


_KINDS = {
    "a mapping": ("model_type", "model_attributes_type", "dict_type", "mapping_type"),
    "a list": ("list_type", "tuple_type", "set_type", "frozen_set_type", "iterable_type"),
    "text": ("string_type",),
    "a whole number": ("int_type", "int_parsing", "int_from_float"),
    "a number": ("float_type", "float_parsing", "decimal_type", "decimal_parsing"),
    "true or false": ("bool_type", "bool_parsing"),
    "nothing": ("none_required",),
}
_EXPECTED = {error: kind for kind, errors in _KINDS.items() for error in errors}
_FOUND: tuple[tuple[type, str], ...] = (
    (bool, "{value}"),
    (int, "the number {value}"),
    (float, "the number {value}"),
    (str, "text"),
    (list, "a list"),
    (tuple, "a list"),
    (dict, "a mapping"),
)
_RULES = {
    "greater_than": "must be greater than {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be less than {lt}",
    "less_than_equal": "must be at most {le}",
    "multiple_of": "must be a multiple of {multiple_of}",
    "string_too_short": "must have at least {min_length} characters",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "does not have the form {form}",
    "too_short": "must have at least {min_length} items",
    "too_long": "must have at most {max_length} items",
    "finite_number": "must be a finite number",
}
_FORMS = {PYTHON_PATH: "`package.module:name`"}
_WRITTEN = {
    "a mapping": "a mapping is written `{key: value}`, or `key: value` on lines of its own below",
    "a list": "a list is written `[a, b]`, or `- a` on lines of its own below",
    "text": "text is one value, in quotes if it has brackets, braces or a colon",
    "a whole number": "write digits only, without quotes",
    "a number": "write digits, without quotes",
    "true or false": "write `true` or `false`, without quotes",
}
_NAMES = {
    "not_a_name": (
        "{} is not a valid name",
        "use letters, digits and `_`; the first character is not a digit",
    ),
    "private_name": (
        "{} begins with two underscores, which makes it private in Python",
        "choose another name",
    ),
    "keyword_in_path": (
        "{} contains a keyword of Python and cannot be imported",
        "write `package.module:name`",
    ),
    "word_of_expressions": ("{} is a word of the expression language", "choose another name"),
}
_PLAIN = re.compile(r"[\w./-]+")
_SHOWN = 60


def expected_kind(error_type: str) -> str | None:
    """The kind of value that an error misses; None if the error is not about the kind."""
    return _EXPECTED.get(error_type)


def kind_of(value: Any) -> str:
    """Words for what stands in the file."""
    for kind, words in _FOUND:
        if isinstance(value, kind):
            return words.format(value=str(value).lower() if kind is bool else value)
    return "nothing"


def way_to(expected: str, value: Any, needed: Sequence[str] = ()) -> str:
    """How a value of the expected kind is written; `value` stands there now.

    `needed` are the keys that an expected mapping cannot do without.
    """
    if value is None:
        return "write what belongs here, or delete the key"
    kind = expected.partition(" or ")[0]
    if kind == "text" and isinstance(value, (bool, int, float)):
        return f'a value in quotes is text: `"{str(value).lower()}"`'
    if kind == "a mapping" and needed:
        return f"write `{{{', '.join(f'{key}: ...' for key in needed)}}}`"
    if kind == "a list" and isinstance(value, str) and _PLAIN.fullmatch(value):
        return f"write `[{value}]`"
    return _WRITTEN.get(kind, "")


def invalid_value(
    error_type: str, message: str, context: dict[str, Any], value: Any
) -> tuple[str, str]:
    """What is wrong with a value of the right kind, and a way out if there is one."""
    if error_type in ("literal_error", "enum", "union_tag_invalid"):
        return _one_of(context, value)
    if error_type in _NAMES:
        return _no_name(error_type, context["meant"], value)
    if error_type == "value_error":
        return message.removeprefix("Value error, "), ""
    if error_type == "assertion_error":
        return message.removeprefix("Assertion failed, "), ""
    if error_type == "row_length":
        return message, f"write `[{context['keys']}]`"
    rule = _RULES.get(error_type)
    if rule is None:
        return message[:1].lower() + message[1:], ""
    if error_type == "string_too_short" and not value:
        return "the text is empty", "write a few words"
    pattern = context.get("pattern", "")
    form = _FORMS.get(pattern, f"`{pattern}`")
    words = rule.format(**context, form=form)
    return f"{_shown(value)} {words}", f"write {form}" if pattern else ""


def _no_name(error_type: str, meant: str, value: Any) -> tuple[str, str]:
    message, hint = _NAMES[error_type]
    return message.format(_shown(value)), f"{hint}, e.g. `{meant}`" if meant else hint


def _one_of(context: dict[str, Any], value: Any) -> tuple[str, str]:
    expected = str(context.get("expected") or context.get("expected_tags") or context.get("tag"))
    names = [name.strip(" '") for name in expected.replace(" or ", ", ").split(",")]
    close = nearest(value, names) if isinstance(value, str) else []
    hint = f"did you mean `{close[0]}`?" if close else "write one of them"
    return f"{_shown(value)} is not one of {', '.join(f'`{name}`' for name in names)}", hint


def _shown(value: Any) -> str:
    if isinstance(value, (dict, list, tuple)):
        return kind_of(value)
    text = str(value)
    return f"`{text}`" if len(text) <= _SHOWN else f"`{text[:_SHOWN]}...`"


# From pydantic's errors to diagnostics: one finding for each thing that a person has to correct.


_LISTED_KEYS = 24
_NUMBERED = ("eq", "table", "fig")
_VERSION: Route = ("specc",)


@frozen
class _Error:
    type: str
    where: Location
    value: Any
    context: dict[str, Any]
    message: str
    expected: str | None

    @property
    def route(self) -> Route:
        return self.where.route


def shape_diagnostics(
    error: ValidationError, file: str, model: type[BaseModel]
) -> list[Diagnostic]:
    """Findings for a file that does not have the shape of `model`, in pydantic's order.

    Of the members of a union, only the one that was meant is reported.
    """
    errors = _meant([_error(details, model) for details in error.errors(include_url=False)])
    for item in errors:
        if item.route == _VERSION and item.type == "literal_error":
            return [_unsupported_version(item, file)]
    renamed = _renamed_keys(errors)
    return [_diagnostic(item, file) for item in errors if item.route not in renamed]


def _renamed_keys(errors: list[_Error]) -> set[Route]:
    """Missing keys that stand in the file under a mistyped name, which is reported already."""
    return {
        (*item.route[:-1], close)
        for item in errors
        if item.type == "extra_forbidden" and item.where.owner
        for close in nearest(str(item.route[-1]), keys_of(item.where.owner))
        if any(
            other.type == "missing" and other.route == (*item.route[:-1], close) for other in errors
        )
    }


def _error(details: Any, model: type[BaseModel]) -> _Error:
    return _Error(
        details["type"],
        locate(details["loc"], model),
        details["input"],
        details.get("ctx", {}),
        details["msg"],
        expected_kind(details["type"]),
    )


def _meant(errors: list[_Error]) -> list[_Error]:
    """The errors without those of union members that were not meant."""
    kept: list[_Error] = []
    unions: dict[Route, list[_Error]] = defaultdict(list)
    for item in errors:
        if item.where.choices:
            union = item.where.choices[0][0]
            if union not in unions:
                kept.append(item)
            unions[union].append(item)
        else:
            kept.append(item)
    if not unions:
        return errors
    resolved = {route: _choose(route, items) for route, items in unions.items()}
    result: list[_Error] = []
    for item in kept:
        result += resolved[item.where.choices[0][0]] if item.where.choices else [item]
    return result


def _choose(union: Route, errors: list[_Error]) -> list[_Error]:
    """Errors of the member that fits best: of the right kind, then with the fewest errors."""
    branches: dict[str, list[_Error]] = defaultdict(list)
    for item in errors:
        label = item.where.choices[0][1]
        where = replace(item.where, choices=item.where.choices[1:])
        branches[label].append(replace(item, where=where))
    fitting = [branch for branch in branches.values() if not _wrong_kind(union, branch)]
    if fitting:
        return _meant(min(fitting, key=len))
    kinds = dict.fromkeys(item.expected or "" for branch in branches.values() for item in branch)
    first = next(iter(branches.values()))[0]
    where = replace(first.where, choices=())
    return [replace(first, where=where, expected=" or ".join(kinds))]


def _wrong_kind(union: Route, branch: list[_Error]) -> bool:
    return any(item.route == union and item.expected is not None for item in branch)


def _diagnostic(item: _Error, file: str) -> Diagnostic:
    if item.type == "extra_forbidden":
        return _unknown_key(item, file)
    if item.type == "missing":
        return _missing_key(item, file)
    place = Place(file, item.route, "key" if item.where.is_key else "value")
    if item.expected is not None:
        message = f"expected {item.expected}, found {kind_of(item.value)}"
        wanted = item.where.wanted if item.route else None
        needed = needed_keys_of(wanted) if wanted else []
        hint = way_to(item.expected, item.value, needed)
        if item.route and item.route[-1] in _NUMBERED:
            hint = "write a number or a list of numbers, e.g. `[4, 5]`"
        return Diagnostic("E0103", f"{_name(item.route)}{message}", place, help=hint)
    message, hint = invalid_value(item.type, item.message, item.context, item.value)
    where = "" if item.where.is_key else _name(item.route)
    return Diagnostic("E0104", f"{where}{message}", place, help=hint)


def _unknown_key(item: _Error, file: str) -> Diagnostic:
    key = str(item.route[-1])
    known = keys_of(item.where.owner) if item.where.owner else []
    close = nearest(key, known)
    hint = f"did you mean {' or '.join(f'`{name}`' for name in close)}?" if close else ""
    if not close and known:
        rest = ", ..." if len(known) > _LISTED_KEYS else ""
        listed = ", ".join(f"`{name}`" for name in known[:_LISTED_KEYS])
        hint = f"known keys: {listed}{rest}"
    message = f"unknown key `{key}`{_inside(item.route)}"
    place = Place(file, item.route, "key")
    meant = surely_meant(key, close)
    fix = Fix(f"write `{meant}`", (Edit(place, meant),)) if meant else None
    return Diagnostic("E0101", message, place, help=hint, fix=fix)


def _missing_key(item: _Error, file: str) -> Diagnostic:
    key, parent = item.route[-1], item.route[:-1]
    message = f"missing key `{key}`{_inside(item.route)}"
    value = "1" if item.route == _VERSION else "..."
    return Diagnostic("E0102", message, Place(file, parent, "key"), help=f"add `{key}: {value}`")


def _unsupported_version(item: _Error, file: str) -> Diagnostic:
    message = f"version {item.value!r} of the specification language is not supported"
    return Diagnostic("E0105", message, Place(file, item.route), help="write `specc: 1`")


def _inside(route: Route) -> str:
    return f" in `{_spelled(route[:-1])}`" if len(route) > 1 else ""


def _name(route: Route) -> str:
    return f"`{_spelled(route)}`: " if route else ""


def _spelled(route: Route) -> str:
    parts = [f"[{step}]" if isinstance(step, int) else f".{step}" for step in route]
    return "".join(parts).removeprefix(".")
