"""The safe outputs of one device to the plan of their module."""

from __future__ import annotations

from fractions import Fraction

from specc.lower.annotations import TypeNames
from specc.lower.module import Module
from specc.lower.names import comment, docstring, in_docstring, literal
from specc.lower.nodes import Nodes
from specc.lower.plan import AttributePlan, DevicePlan, SafePlan
from specc.lower.terms import TermTable
from specc.model.expr import Expr, Unknown
from specc.model.system import Device, Element, Memory, Subsystem, System
from specc.model.trace import Trace

KINDS = {"real_effector": "real effector", "real_receptor": "real receptor"}


def device_plan(
    system: System,
    device: Device,
    spec: str,
    types: TypeNames,
    class_name: str,
    *,
    stand_ins: bool,
) -> DevicePlan:
    """What the module of a device with safe outputs contains."""
    module = Module(system, _as_subsystem(device), types, stand_ins=stand_ins)
    declared = (*system.constants, *device.constants)
    known = {c.name: c.value for c in declared if c.name not in module.computed}
    parameters = {o.name: tuple(t for _, t in o.parameters) for o in system.operators}
    table = TermTable((), module.computed, (), known, parameters)
    values = []
    for element, safe in device.safe:
        said = docstring(f"What `{element.name}` gets when a run ends")
        values.append(_safe(module, table, f"safe_{element.name}", element, safe.value, said))
        if safe.otherwise is not None:
            said = docstring("The same if that fails")
            name = f"otherwise_{element.name}"
            values.append(_safe(module, table, name, element, safe.otherwise, said))
    samples = tuple(
        AttributePlan(module.memory[e.name], module.annotations.of(e.type), comment(str(e.type)))
        for e in device.y
    )
    return DevicePlan(
        title=in_docstring(device.title or device.name),
        about=in_docstring(f"{KINDS[device.kind]} {device.name} of agent {device.agent}"),
        spec=spec,
        module=module.plan(),
        class_name=class_name,
        name=literal(device.qualified_name),
        samples=samples,
        samples_slots=literal(tuple(item.name for item in samples)),
        elements=literal(tuple(element.name for element, _ in device.safe)),
        reports=tuple((literal(e.name), literal(module.memory[e.name])) for e in device.y),
        values=tuple(values),
    )


def _safe(
    module: Module, table: TermTable, name: str, element: Element, value: Expr, doc: str
) -> SafePlan:
    nodes = Nodes(module, table)
    nodes.hint = name
    return SafePlan(
        name=name,
        annotation=module.annotations.of(element.type),
        doc=doc,
        value=nodes.value(table.of(value)).text,
        reads_samples="memory" in nodes.touched,
    )


def _as_subsystem(device: Device) -> Subsystem:
    """What the device reported last, as the memory of a subsystem that does nothing else."""
    reported = tuple(
        Memory(e.name, e.type, Unknown(e.name, type=e.type), e.title, e.trace, e.place)
        for e in device.y
    )
    return Subsystem(
        agent=device.agent,
        name=device.name,
        kind="virtual_effector",
        title=device.title,
        rate_hz=Fraction(1),
        ports=(),
        constants=device.constants,
        memory=reported,
        lets=(),
        conditions=(),
        functions=(),
        behaviours=(),
        states=(),
        initial_state="",
        transitions=(),
        axioms=(),
        trace=Trace(),
        place=device.place,
    )
