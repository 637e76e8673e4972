"""The texts of messages: JSON, with floats in the shortest form that gives them back exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import orjson

from specc_runtime.forms import Misshapen

_OPTIONS = orjson.OPT_SERIALIZE_NUMPY


def dumped(data: Any) -> bytes:
    """The text of plain data; raises TypeError for anything else."""
    return orjson.dumps(data, _other, _OPTIONS)


def loaded(text: bytes) -> Any:
    """The data of a text; raises Misshapen."""
    try:
        return orjson.loads(text)
    except (orjson.JSONDecodeError, RecursionError) as error:
        raise Misshapen(f"no JSON: {error}") from None


def _other(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.dtype != object:  # one that is not in order
        return np.ascontiguousarray(value)
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a value of {type(value).__name__}")
