"""The plant: what stands behind the devices, and each binding."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction

from specc.diagnostics.phrases import with_article
from specc.lang import ExprError, Scope
from specc.model.bindings import PLANT, Binding, Initial, Published, Ros2
from specc.model.expr import FALSE, Nothing, Number
from specc.model.fsm import Trace
from specc.model.system import Agent, Element, Plant
from specc.model.types import OptionalOf, Real
from specc.model.units import Unit
from specc.resolve.context import YamlNode, duration_in
from specc.resolve.expressions import Expressions, known_value, rate_of
from specc.resolve.library import constant_scope
from specc.resolve.panel import resolve_panel
from specc.schema.files import (
    BindingDef,
    PlantDef,
    Ros2Def,
)


def reported_elements(agents: Iterable[Agent]) -> dict[str, Element]:
    """What devices report, by its name: `irp.R.k.I`."""
    devices = (device for agent in agents for device in agent.devices)
    return {f"{d.qualified_name}.{element.name}": element for d in devices for element in d.y}


def resolve_plant(
    definition: PlantDef,
    where: YamlNode,
    model: str,
    agents: tuple[Agent, ...],
    expressions: Expressions,
) -> Plant:
    """The bindings, and what is observed; `specc.checks` compares them with devices and model."""
    bindings, reported = [], reported_elements(agents)
    for name, item in definition.bind.items():
        at = where["bind"][name]
        device, _, element = name.rpartition(".")
        binding = _binding(device, element, item, at, expressions, definition.frame)
        panel = resolve_panel(item, at, reported.get(name), expressions)
        initial = None if item.panel else _initial(name, binding, item, at, agents, expressions)
        on_loss = None
        if item.on_loss is not None:
            on_loss = _of_reported("on_loss", item.on_loss, name, at, agents, expressions)
        binding = replace(binding, panel=panel, initial=initial, on_loss=on_loss)
        # A message comes when its sender sends one.
        always = definition.ros2 is not None and binding.is_of_ros and item.rate is None
        bindings.append(replace(binding, sporadic=True) if always else binding)
    observed = []
    for name, seen in definition.observe.items():
        at = where["observe"][name]
        type_ = expressions.type(at["type"], seen.type)
        if type_ is not None:
            read = tuple(seen.joints), tuple(seen.sensors), tuple(seen.actuators)
            observed.append(Element(name, type_, None, "", Trace(), at.key))
            bindings.append(Binding(PLANT, name, at.key, *read, through=seen.through or ""))
    simulated = [kind for kind in ("model", "python") if getattr(definition, kind)]
    kinds, ros2 = simulated, None
    if definition.ros2 is not None:
        kinds = [*simulated, "ros2"]
        ros2 = _ros2(definition.ros2, where["ros2"], expressions)
    place = where[kinds[0] if kinds else "model"].place
    python = definition.python or ""
    published = tuple(
        Published(name, where["publish"][index].place)
        for index, name in enumerate(definition.publish)
    )
    plant = Plant(model, python, tuple(bindings), place, tuple(observed), ros2, published)
    if not kinds and not plant.is_panel:
        message = "missing key `model` in `plant`"
        expressions.findings.report("E0102", message, where.key, help=_KINDS)
    elif len(simulated) > 1:
        message = "a plant is made by `model` or by `python`, not by both"
        help = "keep the one that this system runs with"
        expressions.findings.report("E0104", message, where["python"].key, help=help)
    elif simulated and ros2 is not None and ros2.use_sim_time:
        message = f"the time of the run is that of `{simulated[0]}`, and of `/clock` as well"
        help = "delete `use_sim_time`: a simulated cell goes on as the clock of its machine does"
        place = where["ros2"]["use_sim_time"].key
        expressions.findings.report("E0104", message, place, help=help)
    return plant


_KINDS = (
    "add `model: FILE.xml` for MuJoCo, `python: package.module:factory` for a plant of your own, "
    "or `ros2: {node: NAME}` for topics of ROS 2"
)
_WAIT_S = Fraction(5)


def _ros2(definition: Ros2Def, where: YamlNode, expressions: Expressions) -> Ros2:
    """The node; frames that the system does not have are reported."""
    findings, known = expressions.findings, expressions.definitions.frames
    wait_s = duration_in(definition, where, "wait", findings) or _WAIT_S
    for name in definition.frames:
        if name not in known:
            findings.unknown("E0201", "frame", name, known, where["frames"][name].key)
    frames = tuple((name, ros.removeprefix("/")) for name, ros in definition.frames.items())
    simulated = definition.use_sim_time
    return Ros2(definition.node, definition.python, wait_s, simulated, frames, where.place)


def _binding(
    device: str,
    element: str,
    item: BindingDef,
    at: YamlNode,
    expressions: Expressions,
    frame_of: Callable[[str], str],
) -> Binding:
    findings = expressions.findings
    rate = rate_of(item.rate, at["rate"], findings) if item.rate is not None else None
    gap = duration_in(item, at, "max_gap", findings)
    named = item.noise[0] if len(item.noise) == 1 and item.noise[0].isidentifier() else ""
    noise = [] if named else _noise(item, at["noise"], expressions)
    options = {name: getattr(item.qos, name) for name in ("reliability", "durability", "depth")}
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
        tuple((name, value) for name, value in options.items() if value not in ("", None)),
        tuple(map(frame_of, (item.tf.parent, item.tf.child))) if item.tf else (),
        item.action,
        item.part,
        action_server=item.action_server,
        service=item.service,
        service_server=item.service_server,
        field=item.field,
        when_busy=item.when_busy,
        answer_within_s=duration_in(item, at, "answer_within", findings),
    )


def _initial(
    name: str,
    binding: Binding,
    item: BindingDef,
    at: YamlNode,
    agents: tuple[Agent, ...],
    expressions: Expressions,
) -> Initial | None:
    """What an element is until its first message, if it need not have one; reports what is wrong.

    An element that no device has is a matter of `specc.checks`.
    """
    call, _ = binding.call
    if not (item.topic or item.tf or call):
        return None
    if call in ("action", "service"):
        if item.init is not None:
            short = name.rpartition(".")[2]
            message = (
                f"`{short}` is a part of {with_article(call)}, and `init` is for what others send"
            )
            expressions.findings.report("E0505", message, at["init"].key, help="delete `init`")
        return None
    if item.init is not None:
        return _of_reported("init", item.init, name, at, agents, expressions)
    element = reported_elements(agents).get(name)
    if element is not None and item.part == "cancel":
        return Initial(FALSE, False)
    if element is None or not isinstance(element.type, OptionalOf):
        return None
    return Initial(Nothing(type=element.type), None)


def _of_reported(
    key: str,
    text: str,
    name: str,
    at: YamlNode,
    agents: tuple[Agent, ...],
    expressions: Expressions,
) -> Initial | None:
    """The value that a key gives to an element that a device reports; reports what is wrong.

    An element that no device has is a matter of `specc.checks`.
    """
    element = reported_elements(agents).get(name)
    if element is None:
        commanded = {f"{d.qualified_name}.{e.name}" for a in agents for d in a.devices for e in d.x}
        if name in commanded:
            short = name.rpartition(".")[2]
            message = f"`{short}` is commanded: `{key}` is for what a device reports"
            expressions.findings.report("E0505", message, at[key].key, help=f"delete `{key}`")
        return None
    scope, constants = constant_scope(expressions.definitions), expressions.definitions.constants
    expr = expressions.value(at[key], text, scope, element.type, element.place)
    if expr is None:
        return None
    try:
        return Initial(expr, known_value(expr, constants, "E0505"))
    except ExprError as error:
        expressions.report(at[key], text, error)
        return None


def _noise(item: BindingDef, at: YamlNode, expressions: Expressions) -> list[tuple[float, Unit]]:
    """Standard deviations, each with its unit; none where one is not."""
    sigmas = []
    for index, text in enumerate(item.noise):
        where = at[index]
        value = expressions.value(where, text, Scope(), None)
        if isinstance(value, Number) and isinstance(value.type, Real) and value.value >= 0:
            sigmas.append((float(value.value), value.type.unit))
        elif value is not None:
            expressions.findings.report(
                "E0505",
                f"`{text}` is not a standard deviation",
                where.place,
                help="write a number with its unit, e.g. `0.3[N]`",
            )
    return sigmas if len(sigmas) == len(item.noise) else []
