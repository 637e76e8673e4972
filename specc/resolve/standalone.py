"""A file that no known system uses: what can be checked of it by itself.

Its parameters have types but no values, and its peers are not known. The meaning of texts, and what
holds of the tables and of expressions, is certain even so; what depends on the other ends is left
out, and so is whether inputs have values and memory is watched.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace

from specc.diagnostics import Diagnostic
from specc.lang import ExprError, parse_type
from specc.model.expr import Call
from specc.model.system import Agent, Constant, Operator, System
from specc.model.trace import Trace
from specc.read import AllowedPaths
from specc.resolve.agents import AgentResolver
from specc.resolve.context import Findings
from specc.resolve.definitions import Definitions, types_in
from specc.resolve.interfaces import check_interfaces
from specc.resolve.library import Library, Load, Loaded
from specc.resolve.reuse import Setting, is_agent
from specc.schema.files import AgentDef

_NEEDS_USER = ("E04", "E05", "O04", "O05", "O0601", "W04", "W05")
_OF_ITSELF = (
    "E0221", "E033", "E06", "E0705", "O0602", "O0603", "O0604", "O0605", "O0606", "O0607", "W033",
    "W034", "W06",
)  # fmt: skip
"""What follows from the description alone: its tables, its expressions, and what it lacks itself;
its user can give nothing but values of parameters, the rate and the title.
"""


def resolve_alone(
    file: Loaded, load: Load, findings: Findings, reach: AllowedPaths
) -> tuple[System, AgentResolver]:
    """Resolve a description with its user left open; definitions have no user to leave open.

    The system that is returned holds the described part alone. Findings that only a user could mend
    are left out.
    """
    library = Library(load, os.path.dirname(file.path) or ".", findings, reach)
    frames = {name: name for name, kind in file.spec.parameters.items() if kind == "frame"}
    definitions = library.start(file, frames)
    given = _parameters(file, definitions, findings)
    library.complete(definitions, file, given)
    setting = Setting(file, definitions, given)
    agent, resolver = _described(file, library, setting, findings)
    check_interfaces((setting.definitions, *resolver.instances), findings)
    found = findings.diagnostics
    found[:] = [d for d in found if not d.code.startswith(_NEEDS_USER)]
    return _system(agent, setting.definitions), resolver


def is_certain(diagnostic: Diagnostic, path: str) -> bool:
    """Whether what a check found in the part of a file holds whoever uses it."""
    return diagnostic.code.startswith(_OF_ITSELF) and diagnostic.primary.file == path


def _parameters(file: Loaded, known: Definitions, findings: Findings) -> tuple[Constant, ...]:
    """The value parameters as constants with values that only an unknown function knows."""
    given = []
    for name, text in file.spec.parameters.items():
        where = file.top["parameters"][name]
        if text == "frame" or is_agent(text, known):
            continue
        try:
            type_ = parse_type(text, known.names())
        except ExprError as error:
            findings.expression_error(where, error)
        else:
            given.append(Constant(name, Call(f"?{name}", (), type=type_), "", where.key))
    return tuple(given)


def _described(
    file: Loaded, library: Library, setting: Setting, findings: Findings
) -> tuple[Agent, AgentResolver]:
    """The agent of the file, or one that consists of the subsystem of the file."""
    spec, top = file.spec, file.top
    control = spec.agent.control if spec.agent else spec.subsystem
    user, where = file, top["agent"]["control"] if spec.agent else top["subsystem"]
    seen: set[str] = set()
    while control and control.use and user.path not in seen:
        seen.add(user.path)
        used = library.load(library.beside(user, control.use), where["use"])
        control = used.spec.subsystem if used else None
        user, where = (used, used.top["subsystem"]) if used else (user, where)
    peers = tuple(dict.fromkeys((*control.x, *control.y))) if control else ()
    resolver = AgentResolver(library, findings, ("", *peers))
    nobody = Agent("", "", "", (), (), top.key)
    if spec.agent is not None:
        return resolver.resolve("", spec.agent, top["agent"], setting) or nobody, resolver
    if spec.subsystem is None:
        return nobody, resolver
    around = AgentDef()
    ends = {peer: f"{peer}.c" for peer in peers}
    where = top["subsystem"]
    subsystem = resolver.subsystem("", "c", "control", around, spec.subsystem, where, ends, setting)
    return replace(nobody, subsystems=(subsystem,) if subsystem else ()), resolver


def _system(agent: Agent, known: Definitions) -> System:
    return System(
        name="",
        title="",
        file="",
        frames=tuple(sorted(known.frame_titles.items())),
        types=types_in((known,)),
        operators=(*known.operators.values(), *_unknown(agent)),
        constants=tuple(known.constants.values()),
        files=tuple(sorted(known.files.values())),
        agents=(agent,),
        plant=None,
        task=None,
    )


def _unknown(agent: Agent) -> Iterator[Operator]:
    """The functions that give the parameters their values."""
    for constant in (c for subsystem in agent.subsystems for c in subsystem.constants):
        if isinstance(constant.value, Call):
            yield Operator(
                constant.value.operator, (), constant.value.type, "", "", Trace(), constant.place
            )
