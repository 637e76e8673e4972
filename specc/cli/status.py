"""`specc status`: which steps of the procedure of section 3 are done, and what comes next."""

from __future__ import annotations

import json
from collections.abc import Iterable

from specc.cli.procedure import AGENT_STEPS, SUBSYSTEM_STEPS, Progress
from specc.diagnostics.render.visible import visible

VERSION = 1


def as_text(name: str, found: list[Progress]) -> str:
    """Three tables, of the system, its agents and their subsystems, then what comes next."""
    of_system = tuple(step.name for step in found[0].steps)
    groups = (("system", of_system), ("agent", AGENT_STEPS), ("subsystem", SUBSYSTEM_STEPS))
    blocks = []
    for kind, steps in groups:
        members = [item for item in found if tuple(step.name for step in item.steps) == steps]
        if members:
            rows = [(_name(item, name), *(step.state for step in item.steps)) for item in members]
            blocks.append(_table([(kind, *steps), *rows]))
    blocks.append("\n".join(_next(name, found)) + "\n")
    return "\n".join(blocks)


def as_json(name: str, found: list[Progress]) -> str:
    """An object with `version`, `system` and `parts`, each with `of` and `steps`."""
    parts = [
        {
            "of": _name(item, name),
            "steps": [
                {"name": step.name, "state": step.state, "next": step.next} for step in item.steps
            ],
        }
        for item in found
    ]
    return json.dumps({"version": VERSION, "system": name, "parts": parts}, indent=2) + "\n"


def _name(item: Progress, system: str) -> str:
    return system if item.of == "system" else item.of


def _table(rows: Iterable[tuple[str, ...]]) -> str:
    listed = [tuple(map(visible, row)) for row in rows]
    widths = [max(map(len, column)) for column in zip(*listed, strict=True)]
    lines = ("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in listed)
    return "".join(f"{line.rstrip()}\n" for line in lines)


def _next(name: str, found: list[Progress]) -> list[str]:
    left = [(item, step) for item in found if (step := item.next) is not None]
    if not left:
        return ["every step is done"]
    lines = (f"  {_name(item, name)}, {step.name}: {step.next}" for item, step in left)
    return ["next:", *map(visible, lines)]
