"""A comparison for programs. The keys stay; new ones may come."""

from __future__ import annotations

import json
from typing import Any

from specc.proof.verdict import Facts
from specc.tools.diff.record import Comparison, Difference


def render(comparison: Comparison, old: str, new: str) -> str:
    """One object: both files, `equal`, and all changes; see docs/diff.md."""
    document = {
        "version": 1,
        "old": old,
        "new": new,
        "equal": not comparison.differences,
        "differences": [_change(change) for change in comparison.differences],
        "remarks": [_change(change) for change in comparison.remarks],
    }
    return json.dumps(document, indent=2) + "\n"


def _change(change: Difference) -> dict[str, Any]:
    return {
        "where": change.where,
        "part": change.part,
        "name": change.name,
        "change": change.change,
        "aspect": change.aspect,
        "old": change.old,
        "new": change.new,
        "note": change.note,
        "only_old": _facts(change.only_old),
        "only_new": _facts(change.only_new),
    }


def _facts(found: Facts) -> list[dict[str, str]]:
    return [{"fact": fact, "value": answer} for fact, answer in found]
