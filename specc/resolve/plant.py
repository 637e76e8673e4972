"""The plant section and the task section."""

from __future__ import annotations

from collections.abc import Container

from specc.expr import Scope
from specc.model.expr import Number
from specc.model.system import Agent, Binding, Plant, Task
from specc.model.types import Real
from specc.resolve.context import Findings, Where
from specc.resolve.definitions import Definitions
from specc.resolve.expressions import Expressions, rate_of
from specc.schema.files import BindingDef, PlantDef, TaskDef


def resolve_plant(
    definition: PlantDef, where: Where, model: str, findings: Findings, definitions: Definitions
) -> Plant:
    """The bindings as they are written; `specc.checks` compares them with devices and model."""
    bindings = []
    for name, item in definition.bind.items():
        at = where["bind"][name]
        device, _, element = name.rpartition(".")
        bindings.append(_binding(device, element, item, at, findings, definitions))
    return Plant(model, tuple(bindings), where["model"].place)


def _binding(
    device: str,
    element: str,
    item: BindingDef,
    at: Where,
    findings: Findings,
    definitions: Definitions,
) -> Binding:
    rate = rate_of(item.rate, at["rate"], findings) if item.rate is not None else None
    named = item.noise[0] if len(item.noise) == 1 and item.noise[0].isidentifier() else ""
    noise = () if named else _noise(item, at, findings, definitions)
    return Binding(
        device,
        element,
        tuple(item.joints),
        tuple(item.sensors),
        tuple(item.actuators),
        item.camera,
        item.image,
        rate,
        noise,
        named,
        item.through or "",
        at.key,
    )


def _noise(
    item: BindingDef, at: Where, findings: Findings, definitions: Definitions
) -> tuple[float, ...]:
    expressions = Expressions(findings, definitions)
    sigmas = []
    for index, text in enumerate(item.noise):
        where = at["noise"][index] if isinstance(at["noise"].raw, list) else at["noise"]
        value = expressions.value(where, text, Scope(), None)
        if isinstance(value, Number) and isinstance(value.type, Real) and value.value >= 0:
            sigmas.append(float(value.value))
        elif value is not None:
            findings.report(
                "E0506",
                f"`{text}` is not a standard deviation",
                where.place,
                help="write a number with its unit, e.g. `0.3[N]`",
            )
    return tuple(sigmas) if len(sigmas) == len(item.noise) else ()


def resolve_task(
    definition: TaskDef,
    where: Where,
    agents: tuple[Agent, ...],
    findings: Findings,
    broken: Container[str],
) -> Task:
    """The task; what it names in vain is reported.

    What is not in a subsystem that is `broken` may be missing only because of its errors.
    """
    cycle = definition.cycle
    if cycle.of not in broken:
        _report_names(definition, where, agents, findings)
    return Task(
        cycle.of,
        cycle.source,
        cycle.target,
        definition.scene or "",
        definition.judge or "",
        tuple(definition.watch),
        where.key,
    )


def _report_names(
    definition: TaskDef, where: Where, agents: tuple[Agent, ...], findings: Findings
) -> None:
    subsystems = {s.qualified_name: s for a in agents for s in a.subsystems}
    cycle, at = definition.cycle, where["cycle"]
    subsystem = subsystems.get(cycle.of)
    if subsystem is None:
        if cycle.of in {f"{agent.name}.control" for agent in agents}:
            help = f"it is called `{cycle.of.removesuffix('control')}c`"
            message = f"no subsystem is called `{cycle.of}`"
            findings.report("E0220", message, at["of"].place, help=help)
            return
        findings.unknown("E0220", "subsystem", cycle.of, subsystems, at["of"].place)
        return
    states = [s.name for s in subsystem.states]
    for name, key in ((cycle.source, "from"), (cycle.target, "to")):
        if name not in states:
            findings.unknown("E0217", "state", name, states, at[key].place)
    memory = [m.name for m in subsystem.memory]
    for index, name in enumerate(definition.watch):
        if name not in memory:
            place = where["watch"][index].place
            findings.unknown("E0201", "memory element", name, memory, place)
