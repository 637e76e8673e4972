"""The plant section: what stands behind the elements of devices, and what is observed."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from specc.lang import Scope
from specc.model.binding import PLANT, Binding, Published, Ros2
from specc.model.expr import Number
from specc.model.system import Element, Plant
from specc.model.trace import Trace
from specc.model.types import Real
from specc.model.units import Unit
from specc.resolve.context import Cursor, Findings, duration_in
from specc.resolve.definitions import Definitions
from specc.resolve.expressions import Expressions, rate_of
from specc.schema.files import BindingDef, PlantDef, QosDef, Ros2Def


def resolve_plant(
    definition: PlantDef, where: Cursor, model: str, findings: Findings, definitions: Definitions
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


def _report_kind(kinds: list[str], where: Cursor, findings: Findings) -> None:
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


def _ros2(definition: Ros2Def, where: Cursor, findings: Findings, definitions: Definitions) -> Ros2:
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
    at: Cursor,
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
    item: BindingDef, at: Cursor, findings: Findings, definitions: Definitions
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
