"""The plant section and the task section."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from fractions import Fraction

from specc.lang import Scope
from specc.model.binding import PLANT, Binding, Published, Ros2
from specc.model.expr import Number, Truth
from specc.model.system import Agent, Element, Plant, Subsystem
from specc.model.task import Task
from specc.model.trace import Trace
from specc.model.types import Real
from specc.model.units import Unit
from specc.resolve.command_line import Given
from specc.resolve.context import Findings, Where, duration_in
from specc.resolve.definitions import Definitions
from specc.resolve.expressions import Expressions, rate_of
from specc.resolve.scene import starts_of
from specc.schema.files import BindingDef, PlantDef, QosDef, Ros2Def, SceneDef, TaskDef


def resolve_plant(
    definition: PlantDef, where: Where, model: str, findings: Findings, definitions: Definitions
) -> Plant:
    """The bindings, and what is observed; `specc.checks` compares them with devices and model."""
    bindings = []
    for name, item in definition.bind.items():
        at = where["bind"][name]
        device, _, element = name.rpartition(".")
        binding = _binding(device, element, item, at, findings, definitions)
        # A message comes when its sender sends one.
        always = (
            definition.ros2 is not None
            and bool(item.topic or item.action or item.tf)
            and item.rate is None
        )
        bindings.append(replace(binding, sporadic=True) if always else binding)
    observed = []
    expressions = Expressions(findings, definitions)
    for name, seen in definition.observe.items():
        at = where["observe"][name]
        type_ = expressions.type(at["type"], seen.type)
        if type_ is not None:
            read = tuple(seen.joints), tuple(seen.sensors), tuple(seen.actuators)
            observed.append(Element(name, type_, None, "", Trace(), at.key))
            bindings.append(Binding(PLANT, name, at.key, *read, through=seen.through or ""))
    kinds = [kind for kind in ("model", "python", "ros2") if getattr(definition, kind)]
    if len(kinds) != 1:
        _report_kind(kinds, where, findings)
    ros2 = None
    if definition.ros2 is not None:
        ros2 = _ros2(definition.ros2, where["ros2"], findings, definitions)
    place = where[kinds[0] if kinds else "model"].place
    python = definition.python or ""
    published = tuple(
        Published(name, where["publish"][index].place)
        for index, name in enumerate(definition.publish)
    )
    return Plant(model, python, tuple(bindings), place, tuple(observed), ros2, published)


def _report_kind(kinds: list[str], where: Where, findings: Findings) -> None:
    """A plant that nothing makes, or more than one of `kinds`."""
    if kinds:
        findings.report(
            "E0104",
            f"a plant is made by `{kinds[0]}` or by `{kinds[1]}`, not by both",
            where[kinds[1]].key,
            help="keep the one that this system runs with",
        )
        return
    findings.report(
        "E0102",
        "missing key `model` in `plant`",
        where.key,
        help="add `model: FILE.xml` for MuJoCo, `python: package.module:factory` for a plant "
        "of your own, or `ros2: {node: NAME}` for topics of ROS 2",
    )


_WAIT_S = Fraction(5)


def _ros2(definition: Ros2Def, where: Where, findings: Findings, definitions: Definitions) -> Ros2:
    """The node; frames that the system does not have are reported."""
    wait_s = duration_in(definition, where, "wait", findings)
    for name in definition.frames:
        if name not in definitions.frames:
            place = where["frames"][name].key
            findings.unknown("E0209", "frame", name, definitions.frames, place)
    frames = tuple((name, ros.removeprefix("/")) for name, ros in definition.frames.items())
    simulated = definition.use_sim_time
    node, python = definition.node, definition.python
    return Ros2(node, python, wait_s or _WAIT_S, simulated, frames, where.place)


def _qos(definition: QosDef) -> tuple[tuple[str, str | int], ...]:
    """The options that are given, in their order."""
    options = {name: getattr(definition, name) for name in ("reliability", "durability", "depth")}
    return tuple((name, value) for name, value in options.items() if value not in ("", None))


def _binding(
    device: str,
    element: str,
    item: BindingDef,
    at: Where,
    findings: Findings,
    definitions: Definitions,
) -> Binding:
    rate = rate_of(item.rate, at["rate"], findings) if item.rate is not None else None
    gap = duration_in(item, at, "max_gap", findings)
    named = item.noise[0] if len(item.noise) == 1 and item.noise[0].isidentifier() else ""
    noise = [] if named else _noise(item, at, findings, definitions)
    return Binding(
        device,
        element,
        at.key,
        tuple(item.joints),
        tuple(item.sensors),
        tuple(item.actuators),
        item.camera,
        item.image,
        rate,
        tuple(sigma for sigma, _ in noise),
        named,
        item.through or "",
        tuple(unit for _, unit in noise),
        item.sporadic,
        gap,
        item.topic,
        item.type,
        _qos(item.qos),
        (item.tf.parent, item.tf.child) if item.tf else (),
        item.action,
        item.part,
    )


def _noise(
    item: BindingDef, at: Where, findings: Findings, definitions: Definitions
) -> list[tuple[float, Unit]]:
    """Standard deviations, each with its unit; none where one is not."""
    expressions = Expressions(findings, definitions)
    sigmas = []
    for index, text in enumerate(item.noise):
        where = at["noise"][index] if isinstance(at["noise"].raw, list) else at["noise"]
        value = expressions.value(where, text, Scope(), None)
        if isinstance(value, Number) and isinstance(value.type, Real) and value.value >= 0:
            sigmas.append((float(value.value), value.type.unit))
        elif value is not None:
            findings.report(
                "E0506",
                f"`{text}` is not a standard deviation",
                where.place,
                help="write a number with its unit, e.g. `0.3[N]`",
            )
    return sigmas if len(sigmas) == len(item.noise) else []


def resolve_task(
    definition: TaskDef,
    where: Where,
    agents: tuple[Agent, ...],
    findings: Findings,
    broken: Container[str],
    definitions: Definitions,
    given: Given,
) -> Task:
    """The task; unknown names in it are reported.

    What is not in a subsystem that is `broken` may be missing only because of its errors.
    """
    cycle = definition.cycle
    if cycle.of not in broken:
        _report_names(definition, where, agents, findings)
    scene = definition.scene or SceneDef()
    return Task(
        cycle.of,
        cycle.source,
        cycle.target,
        scene.made or "",
        definition.judge or "",
        tuple(definition.watch),
        where.key,
        tuple(starts_of(scene, where["scene"], findings, definitions, given)),
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
    _note_names(definition, subsystem, where, agents, findings)
    states = [s.name for s in subsystem.states]
    for name, key in ((cycle.source, "from"), (cycle.target, "to")):
        if name not in states:
            findings.unknown("E0217", "state", name, states, at[key].place)
    if cycle.source in states and cycle.target in states:
        _report_no_row(subsystem, definition, at, findings)
    memory = [m.name for m in subsystem.memory]
    for index, name in enumerate(definition.watch):
        if name not in memory:
            place = where["watch"][index].place
            findings.unknown("E0201", "memory element", name, memory, place)


def _note_names(
    definition: TaskDef,
    subsystem: Subsystem,
    where: Where,
    agents: tuple[Agent, ...],
    findings: Findings,
) -> None:
    """Note agent and subsystem, states and memory that the task names, for editors."""
    cycle, at, size = definition.cycle, where["cycle"], len(subsystem.agent)
    agent = next(agent for agent in agents if agent.name == subsystem.agent)
    findings.use(agent.place, at, "of", start=0, end=size)
    findings.use(subsystem.place, at, "of", start=size + 1, end=len(cycle.of))
    states = {s.name: s.place for s in subsystem.states}
    for name, key in ((cycle.source, "from"), (cycle.target, "to")):
        findings.use(states.get(name), at, key)
    memory = {m.name: m.place for m in subsystem.memory}
    for index, name in enumerate(definition.watch):
        findings.use(memory.get(name), where, "watch", index)


def _report_no_row(
    subsystem: Subsystem, definition: TaskDef, at: Where, findings: Findings
) -> None:
    """E0514; a state without any row that can end is not finished, which is said of it."""
    source, target = definition.cycle.source, definition.cycle.target
    targets = dict.fromkeys(row.target for row in subsystem.transitions if row.source == source)
    when = subsystem.state(source).behaviour.terminal.when
    if target in targets or not (targets or (isinstance(when, Truth) and not when.value)):
        return
    known = ", ".join(f"`{name}`" for name in targets)
    findings.report(
        "E0514",
        f"no row leads from `{source}` to `{target}`: no cycle would ever be counted",
        at["to"].place,
        help=f"from `{source}` rows lead to {known}"
        if known
        else f"no row leads out of `{source}`",
    )
