"""Which types the definitions and agents of the main file name in their texts.

Frames are left out: section 3 of the paper has them described before anything is given in them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from specc.model.system import Definition
from specc.resolve.library import Loaded
from specc.schema import SubsystemDef
from specc.schema.files import AgentDef, SpecFile, TypeDef

_WORD = re.compile(r"[A-Za-z_]\w*")


def definitions_of(file: Loaded) -> tuple[Definition, ...]:
    """The definitions in a file, in its order, with the types that each one names."""
    spec, top = file.spec, file.top
    groups: tuple[tuple[str, dict[str, Iterable[str]]], ...] = (
        ("type", {name: _of_type(item) for name, item in spec.types.items()}),
        ("file", dict.fromkeys(spec.files, ())),
        ("constant", dict.fromkeys(spec.constants, ())),
        ("operator", {n: _words(o.signature) for n, o in spec.operators.items()}),
    )
    return tuple(
        Definition(kind, name, top[f"{kind}s"][name].key, _labels(words, spec))
        for kind, members in groups
        for name, words in members.items()
    )


def named_in_agents(spec: SpecFile) -> frozenset[str]:
    """The types that buffers and memory name, e.g. `type Mode`."""
    texts = [text for agent in spec.agents.values() for text in _of_agent(agent)]
    return _labels((word for text in texts for word in _words(text)), spec)


def _labels(words: Iterable[str], spec: SpecFile) -> frozenset[str]:
    return frozenset(f"type {name}" for name in spec.types.keys() & set(words))


def _of_type(definition: TypeDef) -> set[str]:
    texts = [definition.type or "", *(definition.fields or {}).values()]
    return {word for text in texts for word in _words(text)}


def _of_agent(agent: AgentDef) -> Iterator[str]:
    devices = (*agent.real_effectors.values(), *agent.real_receptors.values())
    for device in devices:
        yield from (item.type for side in (device.x, device.y) for item in side.values())
    virtual = (*agent.virtual_effectors.values(), *agent.virtual_receptors.values())
    for subsystem in (agent.control, *virtual):
        if subsystem is not None:
            yield from _of_subsystem(subsystem)


def _of_subsystem(subsystem: SubsystemDef) -> Iterator[str]:
    yield from (item.type for item in subsystem.memory.values())
    for buffers in (subsystem.x, subsystem.y):
        yield from (item.type for elements in buffers.values() for item in elements.values())


def _words(text: str) -> list[str]:
    return _WORD.findall(text)
