"""Specifications as YAML text: block style above, one line for what is small."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence

Data = str | bool | Sequence["Data"] | Mapping[str, "Data"]

_WIDTH = 100
_PLAIN = re.compile(r"[A-Za-z_][\w.]*(?: (?:[\w.]+|[-+*/<>=]+))*", re.ASCII)
_PLAIN_IN_BLOCK = re.compile(r"[A-Za-z_(][\w.(),]*(?: (?:[\w.(),]+|[-+*/<>=]+))*", re.ASCII)
_SPECIAL = frozenset(("true", "false", "null", "yes", "no", "on", "off"))
_NUMBER = re.compile(r"[0-9]+(?: [A-Za-z]+)?")


def to_yaml(data: Mapping[str, Data]) -> str:
    """The text of a mapping; texts are quoted unless every YAML reader takes them as texts."""
    return "\n".join(_block(data, 0)) + "\n"


def _block(data: Mapping[str, Data], indent: int) -> Iterator[str]:
    for key, value in data.items():
        lead = f"{' ' * indent}{_scalar(key)}:"
        shown = _scalar(value, _PLAIN_IN_BLOCK) if isinstance(value, str) else _flow(value)
        short = f"{lead} {shown}"
        if isinstance(value, (str, bool)) or not value or (indent and len(short) <= _WIDTH):
            yield short
        elif isinstance(value, Mapping):
            yield lead
            yield from _block(value, indent + 2)
        else:
            yield lead
            yield from (f"{' ' * indent}  - {_flow(item)}" for item in value)


def _flow(value: Data) -> str:
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
    return json.dumps(text, ensure_ascii=True)
