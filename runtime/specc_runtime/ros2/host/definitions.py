"""The definitions of types of messages, as texts of `.msg` files, from their classes."""

from __future__ import annotations

import re
from typing import Any

from specc_runtime.ros2.host.plain import interface, interface_name

_NAMES = {"double": "float64", "float": "float32", "boolean": "bool", "octet": "byte"}
_SEQUENCE, _ARRAY = re.compile(r"sequence<(.+?)(?:, (\d+))?>\Z"), re.compile(r"(.+)\[(\d+)\]\Z")
_TEXT = re.compile(r"(w?string)<(\d+)>")
_RULE = "=" * 80
_FILLER = "structure_needs_at_least_one_member"


def definition(name: str) -> str:
    """The text of `package/Type`, with the types in it, as bags have it. Raises DeviceError."""
    found: dict[str, str] = {}
    _add(interface(name), found)
    (first, text), *others = found.items()
    assert first == interface_name(interface(name))
    return text + "".join(f"{_RULE}\nMSG: {n.replace('/msg/', '/')}\n{t}" for n, t in others)


def _add(cls: Any, found: dict[str, str]) -> None:
    name = interface_name(cls)
    if name in found:
        return
    fields = {n: t for n, t in cls.get_fields_and_field_types().items() if n != _FILLER}
    types = {field: _type_of(declared) for field, declared in fields.items()}
    found[name] = "".join(f"{''.join(types[field])} {field}\n" for field in fields)
    for inner, _ in types.values():
        if "/" in inner:
            _add(interface(inner), found)


def _type_of(declared: str) -> tuple[str, str]:
    """The name of a type in a `.msg` file, and what stands behind it: `[]`, `[<=3]`, `[9]`."""
    behind = ""
    if sequence := _SEQUENCE.match(declared):
        declared, most = sequence.groups()
        behind = f"[<={most}]" if most else "[]"
    elif array := _ARRAY.match(declared):
        declared, behind = array[1], f"[{array[2]}]"
    return _TEXT.sub(r"\1<=\2", _NAMES.get(declared, declared)), behind
