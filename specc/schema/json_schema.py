"""The JSON Schema of a specification file, as editors want it: descriptions and no noise."""

from __future__ import annotations

from typing import Any

from specc.reachable import reachable
from specc.schema.files import SpecFile
from specc.schema.keys import OTHERS, SCALARS, SpecModel

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_EMPTY: tuple[object, ...] = (None, "", [], {})

Schema = dict[str, Any]


def json_schema() -> Schema:
    """JSON Schema (draft 2020-12) of a specification file."""
    schema = _tidied(SpecFile.model_json_schema())
    forms = {}
    for part in reachable([SpecModel], lambda part: part.__subclasses__()):
        if part.__name__ in schema["$defs"]:
            forms[f"#/$defs/{part.__name__}"] = _short_forms(part, schema["$defs"][part.__name__])
    return {"$schema": _DIALECT, "title": "specc specification", **_expanded(schema, forms)}


def _tidied(schema: Any) -> Any:
    """A schema without what pydantic makes up: titles, empty defaults, null for a missing value."""
    if isinstance(schema, list):
        return [_tidied(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {
        name: _tidied(value)
        for name, value in schema.items()
        if not name.startswith("x-")
        and not (name == "title" and isinstance(value, str))
        and not (name == "default" and (value in _EMPTY or isinstance(value, dict)))
    }
    if others := kept.get("properties", {}).pop(OTHERS, None):
        kept["additionalProperties"] = others["additionalProperties"]
    return _without_null(kept) if isinstance(kept.get("anyOf"), list) else kept


def _without_null(schema: Schema) -> Schema:
    """Editors report what is wrong inside a value only if the value has one meaning."""
    members = [member for member in schema["anyOf"] if member != {"type": "null"}]
    rest = {name: value for name, value in schema.items() if name != "anyOf"}
    return {**members[0], **rest} if len(members) == 1 else {**rest, "anyOf": members}


def _short_forms(part: type[SpecModel], schema: Schema) -> list[Schema]:
    """What may stand in place of a mapping."""
    scalars = SCALARS if part.short else []
    if not part.row:
        return scalars
    items = [
        {name: value for name, value in schema["properties"][key].items() if name != "description"}
        for key in part.row
    ]
    size = len(items)
    return [*scalars, {"type": "array", "prefixItems": items, "minItems": size, "maxItems": size}]


def _expanded(schema: Any, forms: dict[str, list[Schema]]) -> Any:
    """A schema where all that is written in several forms may have each of them."""
    if isinstance(schema, list):
        return [_expanded(item, forms) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {name: _expanded(value, forms) for name, value in schema.items()}
    if not (shorter := forms.get(found.get("$ref", ""))):
        return found
    return {"anyOf": [*shorter, {"$ref": found.pop("$ref")}], **found}
