"""Classes of messages that have no wheels, with the structure that rosidl gives to its own."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rosidl_parser.definition import (
    BasicType,
    NamespacedType,
    UnboundedSequence,
    UnboundedString,
)

_DEFAULTS = {"double": 0.0, "float": 0.0, "boolean": False, "string": ""}


def message(module: str, name: str, /, **fields: str) -> type:
    """A class with fields of these types, as `get_fields_and_field_types` of rosidl writes them."""

    def begin(self: Any) -> None:
        for field, type_ in fields.items():
            object.__setattr__(self, field, _first(type_))

    def put(self: Any, field: str, value: Any) -> None:
        type_ = fields[field]
        assert type(value) is type(_first(type_)), f"{field} is {type_}"
        if type_.endswith("[]"):
            assert all(type(item) is type(_first(type_[:-2])) for item in value)
        object.__setattr__(self, field, value)

    members = {
        "__module__": module,
        "__init__": begin,
        "__setattr__": put,
        "SLOT_TYPES": tuple(_parsed(type_) for type_ in fields.values()),
        "get_fields_and_field_types": classmethod(lambda cls: fields),
    }
    return type(name, (), members)


def _first(type_: str) -> Any:
    if type_.endswith("[]"):
        return []
    if "/" in type_:
        package, name = type_.split("/")
        return getattr(import_module(f"{package}.msg"), name)()
    return _DEFAULTS.get(type_, 0)


def _parsed(type_: str) -> Any:
    if type_.endswith("[]"):
        return UnboundedSequence(_parsed(type_[:-2]))
    if "/" in type_:
        package, name = type_.split("/")
        return NamespacedType([package, "msg"], name)
    return UnboundedString() if type_ == "string" else BasicType(type_)
