"""Schema to model: references become objects, texts become typed expressions."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from specc.diagnostics import Diagnostic, Related
from specc.lang import ExprError, parse_type
from specc.lang.packages import PACKAGES
from specc.model.bindings import PLANT
from specc.model.expr import Call
from specc.model.fsm import Trace
from specc.model.requirement import Requirement
from specc.model.system import Agent, Constant, Operator, Plant, System
from specc.model.task import Task
from specc.model.wires import Wires
from specc.read import ANYWHERE, AllowedPaths
from specc.resolve.agents import AgentResolver, OpenAgent, WrittenContract
from specc.resolve.context import Findings, SetValues, YamlNode
from specc.resolve.definitions import Definitions, types_in
from specc.resolve.elements import check_interfaces
from specc.resolve.expansion import groups_of
from specc.resolve.expressions import Expressions
from specc.resolve.library import Library, Load, Loaded
from specc.resolve.plant import resolve_plant
from specc.resolve.readings import World
from specc.resolve.requirements import FormulaResolver, Lets
from specc.resolve.reuse import Setting, is_agent
from specc.resolve.scenarios import resolve_scenarios
from specc.resolve.simulation import (
    DisturbanceReader,
    disturbance_reader,
    resolve_task,
    why_untimely,
)
from specc.resolve.uses import definitions_of, named_in_agents, types_named
from specc.schema.files import AgentDef
from specc.source import beside, relative_path

__all__ = ["Findings", "Load", "Loaded", "Resolved", "is_certain", "resolve", "resolve_alone"]


_NO_NAME = "the file has no `system:`", "add `system: a_name`"
_NOT_A_SYSTEM = (
    "the file describes no system, only parts for a system to use",
    "name a file with `system:` that uses it; only `specc validate` accepts it by itself",
)


@dataclass(frozen=True, slots=True)
class Resolved:
    """The system, and the qualified names of subsystems and devices with errors in them.

    What is `broken` lacks parts that others refer to. What is `faulty` is whole, but has
    unknowns in it: conditions, assignments or behaviours with errors in their texts.
    `units` has everything that can be set, each with the unit of a number without one.
    """

    system: System
    broken: frozenset[str]
    faulty: frozenset[str]
    units: Mapping[str, str]


def resolve(
    file: Loaded,
    load: Load,
    findings: Findings,
    reach: AllowedPaths = ANYWHERE,
    instead: Mapping[str, YamlNode] | None = None,
    stop_when: YamlNode | None = None,
) -> Resolved:
    """Resolve the system of `file`; other files come through `load`.

    Texts of `instead` take the place of those that files have, by the names of what they are of.
    `stop_when` is the formula that ends a run.
    """
    spec = file.spec
    _report_lacking(file, findings)
    groups = groups_of(spec.agents, file.top["agents"])
    copies = {agent: group for group, of in groups.items() for agent in of.values()}
    given = SetValues(instead or {}, copies)
    library = Library(load, os.path.dirname(file.path) or ".", findings, reach, given)
    library.agents, library.groups = tuple(spec.agents), groups
    definitions = replace(library, shared=True).definitions(file)
    agents, resolver = _agents(file, library, definitions, findings)
    plant = _plant(file, library, definitions, agents)
    observed = {item.name for item in plant.observed} if plant else set()
    faulty = set(spec.plant.observe) - observed if spec.plant else set()
    expressions = Expressions(findings, definitions, broken=faulty)
    lost = set(spec.agents) - {agent.name for agent in agents}
    uncertain = frozenset({*resolver.broken, *resolver.faulty, *lost})
    values = groups_of(spec.plant.observe, file.top["plant"]["observe"]) if spec.plant else {}
    world = World(agents, Wires(agents), plant, {"": groups, PLANT: values}, uncertain)
    formulas = FormulaResolver(world, expressions, Lets()).with_lets(spec.let, file.top["let"])
    known = [definitions, *resolver.instances]
    check_interfaces(known, findings)
    requirements = formulas.requirements(spec.require, file.top["require"])
    contracts = _contracts(resolver.contracts, world, findings)
    named = types_named(findings, file.path)
    reader = disturbance_reader(
        lambda text, at: formulas.requirement(text, "", at),
        Expressions(findings, definitions),
        agents,
        plant,
    )
    operators: dict[str, Operator] = {}
    for operator in (each for used in known for each in used.operators.values()):
        operators.setdefault(operator.name, operator)
    system = System(
        spec.system or "",
        spec.title,
        os.path.basename(file.path),
        tuple(sorted({f: t for d in known for f, t in d.frame_titles.items()}.items())),
        types_in(known),
        tuple(operators.values()),
        tuple(definitions.constants.values()),
        tuple(sorted({f for d in known for f in d.files.values()})),
        agents,
        plant,
        _task(file, formulas, reader, resolver),
        definitions_of(spec, file.top, named),
        named_in_agents(named, findings, file.path),
        reach.folders,
        requirements,
        tuple(tuple(used.constants.values()) for used in resolver.instances),
        tuple(formulas.lets.found),
        None if stop_when is None else _stop(formulas, stop_when),
        resolve_scenarios(file, formulas, reader, given),
        contracts,
    )
    given.report_unknown(findings)
    broken, faulty_names = frozenset(resolver.broken), frozenset(resolver.faulty)
    return Resolved(system, broken, faulty_names, given.units)


def _report_lacking(file: Loaded, findings: Findings) -> None:
    """Report a file without a system, or a system without agents."""
    if file.spec.system in PACKAGES:
        message = f"`{file.spec.system}` names a Python module already, so it cannot name a system"
        hint = f"choose another name, e.g. `{file.spec.system}_system`"
        findings.report("E0221", message, file.top["system"].place, help=hint)
    if file.spec.system is None:
        message, hint = _NOT_A_SYSTEM if file.spec.is_part else _NO_NAME
        findings.report("E0102", message, file.top.place, help=hint)
    elif not file.spec.agents:
        message, place = "the system has no agents yet", file.top["system"].key
        findings.report("O0401", message, place, help="add `agents:`")


def _plant(
    file: Loaded, library: Library, definitions: Definitions, agents: tuple[Agent, ...]
) -> Plant | None:
    """Resolve the plant, if there is one; observed values and agents cannot share a name."""
    definition, top, findings = file.spec.plant, file.top, library.findings
    if definition is None:
        return None
    model = definition.model
    if model:
        model = relative_path(beside(file.path, model), library.base)
    plant = resolve_plant(
        definition, top["plant"], model, agents, Expressions(findings, definitions)
    )
    if plant.observed and PLANT in file.spec.agents:
        findings.report(
            "E0205",
            "`plant` is defined twice: as what is observed, and as an agent",
            top["agents"][PLANT].key,
            related=(Related(top["plant"]["observe"].key, "`plant.NAME` is one of these"),),
            help="give the agent another name",
        )
    return plant


def _task(
    file: Loaded, formulas: FormulaResolver, reader: DisturbanceReader, resolver: AgentResolver
) -> Task | None:
    """Resolve the task, if there is one, with its disturbances."""
    definition = file.spec.task
    if definition is None:
        return None
    return resolve_task(
        definition,
        file.top["task"],
        tuple(formulas.world.agents),
        resolver.broken | resolver.faulty,
        reader,
        resolver.library.set_values,
    )


def _contracts(
    written: Sequence[WrittenContract], world: World, findings: Findings
) -> tuple[Requirement, ...]:
    """Resolve the contracts of devices; those with errors are reported and left out.

    A contract is called after its device, with the agent where several devices have that name.
    """
    short = Counter(f"{each.device.name}.{each.name}" for each in written)
    found = []
    for each in written:
        name, device = f"{each.device.name}.{each.name}", each.device
        if short[name] > 1:
            name = f"{device.qualified_name}.{each.name}"
        formulas = FormulaResolver(world, Expressions(findings, each.inside), Lets(), device)
        at, definition = each.where["that"], each.definition
        if not isinstance(each.where.raw, dict):
            at = each.where
        found.append(formulas.requirement(definition.that, definition.because, at, name))
    return tuple(contract for contract in found if contract is not None)


def _stop(formulas: FormulaResolver, at: YamlNode) -> Requirement | None:
    """Resolve the formula that ends a run; None after reporting an error."""
    found = formulas.requirement(str(at.raw), "", at)
    if found is not None and (wrong := why_untimely(found, "a run", "end")):
        message, way = wrong
        formulas.expressions.findings.report("E0335", message, at.place, help=way)
    return found


def _agents(
    file: Loaded, library: Library, definitions: Definitions, findings: Findings
) -> tuple[tuple[Agent, ...], AgentResolver]:
    resolver = AgentResolver(library, findings, library.agents)
    setting = Setting(file, definitions)
    places = {f"agent {name}": file.top["agents"][name].key for name in file.spec.agents}
    places |= {
        f"agent {group}": places[f"agent {next(iter(of.values()))}"]
        for group, of in library.groups.items()
    }
    definitions.places |= places
    opened = [
        resolver.open(name, item, file.top["agents"][name], setting)
        for name, item in file.spec.agents.items()
    ]
    return tuple(resolver.close(agent) for agent in opened if agent is not None), resolver


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
    """Resolve a description without a user; files of definitions need none.

    The system that is returned holds the described part alone. Findings that only a user could mend
    are left out.
    """
    library = Library(load, os.path.dirname(file.path) or ".", findings, reach)
    frames = {name: name for name, kind in file.spec.parameters.items() if kind == "frame"}
    definitions = library.start(file, frames)
    given = _parameters(file, definitions, findings)
    library.complete(definitions, file, given)
    agent, resolver = _described(file, library, Setting(file, definitions, given), findings)
    check_interfaces((definitions, *resolver.instances), findings)
    found = findings.diagnostics
    found[:] = [d for d in found if not d.code.startswith(_NEEDS_USER)]
    # Functions that nobody knows give the parameters their values.
    parameters = [
        Operator(c.value.operator, (), c.value.type, "", "", Trace(), c.place)
        for subsystem in agent.subsystems
        for c in subsystem.constants
        if isinstance(c.value, Call)
    ]
    system = System(
        name="",
        title="",
        file="",
        frames=tuple(sorted(definitions.frame_titles.items())),
        types=types_in((definitions,)),
        operators=(*definitions.operators.values(), *parameters),
        constants=tuple(definitions.constants.values()),
        files=tuple(sorted(definitions.files.values())),
        agents=(agent,),
        plant=None,
        task=None,
    )
    return system, resolver


def is_certain(diagnostic: Diagnostic, path: str) -> bool:
    """Whether a finding in the part of a file holds for all of its users."""
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
    """The agent of the file, or one that is made of the subsystem of the file."""
    spec, top = file.spec, file.top
    control = spec.agent.control if spec.agent else spec.subsystem
    user, where = file, top["agent"]["control"] if spec.agent else top["subsystem"]
    seen: set[str] = set()
    while control and control.use and user.path not in seen:
        seen.add(user.path)
        used = library.load(beside(user.path, control.use), where["use"])
        control = used.spec.subsystem if used else None
        user, where = (used, used.top["subsystem"]) if used else (user, where)
    peers = tuple(dict.fromkeys((*control.x, *control.y))) if control else ()
    resolver = AgentResolver(library, findings, ("", *peers))
    nobody = Agent("", "", "", (), (), top.key)
    if spec.agent is not None:
        agent = resolver.open("", spec.agent, top["agent"], setting)
        return resolver.close(agent) if agent is not None else nobody, resolver
    if spec.subsystem is None:
        return nobody, resolver
    around = AgentDef()
    ends = {peer: f"{peer}.c" for peer in peers}
    where = top["subsystem"]
    subsystem = resolver.open_subsystem(
        "", "c", "control", around, spec.subsystem, where, ends, setting
    )
    alone = OpenAgent("", "", "", (subsystem,) if subsystem else (), (), top.key)
    return resolver.close(alone), resolver
