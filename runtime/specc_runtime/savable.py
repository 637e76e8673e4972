"""What plants and judges remember of a run, as plain data: so that runs can go on from a moment."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, Protocol

import numpy as np

from specc_runtime.examination import shortcomings
from specc_runtime.faults import error_text
from specc_runtime.forms import Misshapen, NotRecorded
from specc_runtime.plants.errors import PlantError


class Savable(Protocol):
    """What a plant or a judge has in addition if its state can be kept."""

    def saved(self) -> Any:
        """All that it remembers, between two ticks: numbers, texts, lists, mappings, arrays."""

    def restore(self, saved: Any) -> None:
        """Remember that instead; arrays come as lists.

        A plant has been reset, its scene is set, and devices were given the commands they hold.
        """


def saved_by(what: str, thing: Any, *, is_lenient: bool = False) -> Any:
    """What somebody remembers, None if there is nobody, or he cannot tell and that `is_lenient`.

    Raises NotRecorded, which says `what` it is.
    """
    if thing is None:
        return None
    if lacking := shortcomings(thing, Savable):
        if is_lenient:
            return None
        raise NotRecorded(f"{what}, which {'; '.join(lacking)}")
    try:
        return plain(thing.saved())
    except Exception as error:
        if is_lenient:
            return None
        if isinstance(error, NotRecorded):
            raise NotRecorded(f"{what}, which saves {error}") from None
        raise NotRecorded(f"{what}, which raised {error_text(error)}") from error


def restored(what: str, thing: Any, saved: Any) -> None:
    """Let somebody remember that, unless it is nothing.

    Raises ValueError for what is no plain data, Misshapen, which says `what` it is, or PlantError
    for what he does not take.
    """
    if thing is None or saved is None:
        return
    data = from_plain(saved)
    try:
        thing.restore(data)
    except PlantError:
        raise
    except Exception as error:
        raise Misshapen(f"{what} raised {error_text(error)}") from error


def plain(data: Any) -> Any:
    """Data that JSON has: an infinite number becomes a mapping. Raises NotRecorded for others."""
    if isinstance(data, dict):
        return {str(key): plain(item) for key, item in data.items()}
    if isinstance(data, list | tuple | deque):
        return [plain(item) for item in data]
    if isinstance(data, np.ndarray):
        return data if np.isfinite(data).all() else plain(data.tolist())
    if isinstance(data, np.generic):
        data = data.item()
    if isinstance(data, float) and not math.isfinite(data):
        return {"float": str(data)}
    if not isinstance(data, str | int | float | None):
        raise NotRecorded(f"a {type(data).__name__}, which is no plain data")
    return data


def from_plain(data: Any) -> Any:
    """The data again; raises ValueError for what stands for no number."""
    if isinstance(data, list):
        return [from_plain(item) for item in data]
    if not isinstance(data, dict):
        return data
    if data.keys() == {"float"}:
        return float(data["float"])
    return {key: from_plain(item) for key, item in data.items()}
