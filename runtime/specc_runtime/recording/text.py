"""The texts of messages: JSON, with floats in the shortest exact form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import orjson

from specc_runtime.forms import Misshapen

_NUMBERS = {float, bool, int}
_OPTIONS = orjson.OPT_SERIALIZE_NUMPY


def dumped(data: Any) -> bytes:
    """The text of plain data; raises TypeError for anything else."""
    return orjson.dumps(data, _other, _OPTIONS)


def dumped_each(values: Sequence[Any], *, brief: bool = False) -> list[bytes]:
    """The text of each value; numbers, or arrays of one shape, together. `brief` rounds arrays."""
    kinds = set(map(type, values))
    if kinds == {np.ndarray}:
        rows = np.concatenate(values).reshape(len(values), -1)
        text = dumped(rows.astype(np.float32) if brief else rows)
        return text[1:-1].replace(b"],[", b"]\n[").split(b"\n")
    if kinds and kinds <= _NUMBERS:
        return dumped(values)[1:-1].split(b",")
    return [dumped(value) for value in values]


def loaded(text: bytes) -> Any:
    """The data of a text; raises Misshapen."""
    try:
        return orjson.loads(text)
    except (orjson.JSONDecodeError, RecursionError) as error:
        raise Misshapen(f"no JSON: {error}") from None


def _other(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.dtype != object:  # an array that is not contiguous
        return np.ascontiguousarray(value)
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a value of {type(value).__name__}")
