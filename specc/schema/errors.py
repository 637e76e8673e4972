"""From pydantic's errors to diagnostics: one finding for each thing that a person has to mend."""

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Any

from pydantic import BaseModel, ValidationError

from specc.diagnostics import Diagnostic, Edit, Fix, nearest, surely_meant
from specc.schema.location import Location, keys_of, locate, needed_keys_of
from specc.schema.wording import expected_kind, invalid_value, kind_of, way_to
from specc.source import Place, Route

_LISTED_KEYS = 24
_NUMBERED = ("eq", "table", "fig")
_VERSION: Route = ("specc",)


@dataclass(frozen=True, slots=True)
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
