"""Whether runs of two texts count together: their machines and requirements mean the same."""

from __future__ import annotations

from specc.model.system import System
from specc.tools.diff import compare

_CIRCUMSTANCES = frozenset(("task", "start", "disturbance", "scenario"))
"""Parts that say what runs begin with and what happens meanwhile, which each run may do its way."""


def differences(old: System, new: System) -> list[str]:
    """What is not the same in words, but for the circumstances of runs."""
    found = (d for d in compare(old, new).differences if d.part not in _CIRCUMSTANCES)
    words = ((d.where, d.part, d.name and f"`{d.name}`") for d in found)
    return list(dict.fromkeys(" ".join(filter(None, each)) for each in words))
