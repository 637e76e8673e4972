"""The shape of a file checked; the JSON Schema for editors."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from specc.diagnostics import Diagnostic
from specc.schema.files import SpecFile

# Data of a file to its shape, or to findings about what does not fit.


def shape(data: object, file: str) -> tuple[SpecFile | None, list[Diagnostic]]:
    """The shaped file, or None and what is wrong with its shape."""
    try:
        return SpecFile.model_validate(data), []
    except ValidationError as error:
        from specc.schema.errors import shape_diagnostics

        return None, shape_diagnostics(error, file, SpecFile)


# The JSON Schema of a specification file, as editors want it: descriptions and no noise.


_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_EMPTY: tuple[object, ...] = (None, "", [], {})


def json_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a specification file."""
    schema = SpecFile.model_json_schema(by_alias=True)
    return {
        "$schema": _DIALECT,
        "title": "specc specification",
        **_without_noise(schema),
    }


def _without_noise(schema: Any) -> Any:
    """A schema without what pydantic makes up: titles, empty defaults, null for a missing value."""
    if isinstance(schema, list):
        return [_without_noise(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {
        key: _without_noise(value)
        for key, value in schema.items()
        if not (key == "title" and isinstance(value, str))
        and not (key == "default" and (value in _EMPTY or isinstance(value, dict)))
    }
    return _without_null(kept) if isinstance(kept.get("anyOf"), list) else kept


def _without_null(schema: dict[str, Any]) -> dict[str, Any]:
    """Editors report what is wrong inside a value only if the value has one meaning."""
    members = [member for member in schema["anyOf"] if member != {"type": "null"}]
    rest = {key: value for key, value in schema.items() if key != "anyOf"}
    return {**members[0], **rest} if len(members) == 1 else {**rest, "anyOf": members}
