"""Schema to model: references become objects, texts become typed expressions."""

from __future__ import annotations

import os
from dataclasses import dataclass

from specc.model.system import Agent, Operator, System
from specc.resolve.agents import AgentResolver, Setting
from specc.resolve.context import Findings
from specc.resolve.definitions import Definitions
from specc.resolve.library import Library, Load, Loaded
from specc.resolve.mentions import definitions_of, named_in_agents
from specc.resolve.plant import resolve_plant, resolve_task

__all__ = ["Findings", "Load", "Loaded", "Resolved", "resolve"]


@dataclass(frozen=True, slots=True)
class Resolved:
    """The system, and the qualified names of subsystems and devices with errors in them.

    What is `broken` lacks parts that others refer to. What is `faulty` is whole, but has
    unknowns in it: conditions, assignments or behaviours with errors in their texts.
    """

    system: System
    broken: frozenset[str]
    faulty: frozenset[str]


def resolve(file: Loaded, load: Load, findings: Findings) -> Resolved:
    """Resolve the system of `file`; other files come through `load`."""
    spec, top = file.spec, file.top
    if spec.system is None:
        findings.report(
            "E0102",
            "the file has no `system:`",
            top.place,
            help="add `system: a_name`; a file with `subsystem:` or `agent:` is used by a system",
        )
    elif not spec.agents:
        findings.report(
            "O0401", "the system has no agents yet", top["system"].key, help="add `agents:`"
        )
    library = Library(load, os.path.dirname(file.path) or ".", findings)
    definitions = library.definitions(file)
    agents, resolver = _agents(file, library, definitions, findings)
    plant = task = None
    if spec.plant is not None:
        path = os.path.relpath(library.beside(file, spec.plant.model), library.base)
        model = path.replace(os.sep, "/")
        plant = resolve_plant(spec.plant, top["plant"], model, findings, definitions)
    if spec.task is not None:
        task = resolve_task(
            spec.task, top["task"], agents, findings, resolver.broken | resolver.faulty
        )
    known = [definitions, *resolver.instances]
    system = System(
        spec.system or "",
        spec.title,
        os.path.basename(file.path),
        tuple(sorted({f: t for d in known for f, t in d.frame_titles.items()}.items())),
        tuple(sorted({n: t for d in known for n, t in d.type_traces.items()}.items())),
        _operators(known),
        tuple(definitions.constants.values()),
        tuple(sorted({n: p for d in known for n, p in d.files.items()}.items())),
        agents,
        plant,
        task,
        definitions_of(file),
        named_in_agents(spec),
    )
    return Resolved(system, frozenset(resolver.broken), frozenset(resolver.faulty))


def _agents(
    file: Loaded, library: Library, definitions: Definitions, findings: Findings
) -> tuple[tuple[Agent, ...], AgentResolver]:
    resolver = AgentResolver(library, findings, tuple(file.spec.agents))
    setting = Setting(file, definitions)
    found = [
        resolver.resolve(name, item, file.top["agents"][name], setting)
        for name, item in file.spec.agents.items()
    ]
    return tuple(a for a in found if a is not None), resolver


def _operators(known: list[Definitions]) -> tuple[Operator, ...]:
    merged: dict[str, Operator] = {}
    for definitions in reversed(known):
        merged |= definitions.operators
    return tuple(merged.values())
