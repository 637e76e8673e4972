"""Adding an agent to a specification that exists: its text, with the new entries in place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from specc.model.system import System
from specc.tools.fmt import format_text
from specc.tools.fmt.tree import Collection, Entry
from specc.tools.importers.writing import PEERS, Data, SpecNames, filled, to_yaml
from specc.tools.starting.channels import noted
from specc.tools.starting.document import AgentSections, Robot, wrapped

_NAMED = ("types", "interfaces", "constants", "operators", "files", "frames", "parameters")


def bound(system: System) -> set[str]:
    """Actuators, sensors and cameras that a system has devices for."""
    bindings = system.plant.bindings if system.plant else ()
    each = ((*one.actuators, *one.sensors, one.camera) for one in bindings)
    return {name for names in each for name in names if name}


def added(text: str, data: Mapping[str, Any], robot: Robot, plant: str, command: str) -> str:
    """The text of a specification, which is YAML without faults, with one more agent.

    All of it comes in the canonical layout. Whether the agent is in it shows when it is read.

    Raises:
        LayoutError: what is there would not survive.
    """
    taken = {name for key in _NAMED for name in _mapping(data, key)}
    named = _mapping(data, "constants"), _mapping(data, "frames")
    parts = AgentSections(robot, SpecNames({*taken, *PEERS}), *named)
    remarks = wrapped(f"Made by `{command}`.", *parts.remarks())
    has_task = "task" in data
    written_scene = _mapping(_mapping(data, "task"), "scene")
    scene = {k: v for k, v in parts.scene().items() if k not in written_scene}
    new: dict[str, Data] = {
        **parts.definitions(),
        "agents": {robot.name: noted(parts.agent(), remarks)},
        "plant": {"model": plant, "bind": parts.bind()},
        "task": {"scene": scene} if has_task and scene else "" if has_task else parts.task(),
    }
    written = to_yaml(filled(new), fold=True)
    return format_text(text.rstrip("\n") + "\n" + written, _merge)


def _merge(root: Collection) -> None:
    """Put entries of a mapping that has keys twice into those that came first."""
    first: dict[str, Entry] = {}
    for entry in root.entries:
        earlier = first.setdefault(entry.name, entry)
        if earlier is entry:
            continue
        one, other = earlier.value, entry.value
        if isinstance(one, Collection) and isinstance(other, Collection):
            if other.entries:
                other.entries[0].above[:0] = entry.above
            one.entries += other.entries
            one.below += other.below
            one.flow &= not any(each.above for each in one.entries)
            _merge(one)
    root.entries = list(first.values())


def _mapping(data: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = data.get(key)
    return found if isinstance(found, Mapping) else {}
