"""The plant is there, and something stands behind each element of the devices, of its size."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from specc.analysis import Facts
from specc.analysis.machine import Machine
from specc.analysis.plant import BoundElement, Limit, bindable, limits_of_control, raw_numbers
from specc.analysis.reaching import ScalarDefinition, ScalarExpr, ScalarRanges, component
from specc.analysis.reads import ExpressionText
from specc.diagnostics import Diagnostic, Related, is_typo, nearest
from specc.diagnostics.phrases import counted
from specc.lang import joined_help
from specc.lang.ranges import Range
from specc.mjcf import Model, ModelError
from specc.model.bindings import PLANT, Binding
from specc.model.system import System
from specc.model.types import Image, Real, Record, Type, Vector, nested_types
from specc.resolve.context import suggest
from specc.source import Place

# The model of the plant is there and is MJCF.


def model_readable(facts: Facts) -> Iterator[Diagnostic]:
    """E0501, for a model that cannot be read or lacks one of its files."""
    system = facts.system
    if system.plant is not None and isinstance(facts.model, ModelError):
        why, _, way_out = str(facts.model).partition("; ")
        yield Diagnostic(
            "E0501",
            f"the model of the plant cannot be used: {why}",
            system.plant.place,
            help=way_out
            or "a model is an MJCF file; its path is relative to the file that names it",
        )
    elif system.plant is not None and isinstance(facts.model, Model):
        for name in facts.model.missing:
            yield Diagnostic(
                "E0501",
                f"the model of the plant cannot be used: {name} is not there",
                system.plant.place,
                help="put the file where the model looks for it, or correct its name in the model",
            )


# What the plant binds are elements of devices.


_MOST_LISTED = 8


def bindings_known(facts: Facts) -> Iterator[Diagnostic]:
    """E0502, and O0205 for what may still come."""
    elements = {d.qualified_name: [e.name for e in (*d.x, *d.y)] for d in facts.system.devices}
    plant = facts.system.plant
    for binding in plant.bindings if plant else ():
        if binding.device == PLANT:
            continue
        known = elements.get(binding.device)
        if not facts.broken.isdisjoint((binding.device, binding.device.partition(".")[0])):
            continue
        if known is None:
            message = f"there is no device `{binding.device}`"
            yield _unknown_element(binding, message, binding.device, list(elements))
        elif binding.element not in known:
            message = f"`{binding.device}` has no element `{binding.element}`"
            yield _unknown_element(binding, message, binding.element, known)


def _unknown_element(binding: Binding, message: str, name: str, known: list[str]) -> Diagnostic:
    hint = suggest(name, known) if known else "an element is named `agent.E.device.element`"
    # A real effector called a real receptor, or vice versa, is still the same device.
    if is_typo(name, known) or name.split(".")[-1] in {other.split(".")[-1] for other in known}:
        return Diagnostic("E0502", message, binding.place, help=hint)
    absent = f"`{binding.device}.{binding.element}` is not there yet"
    help = joined_help("add it to the agent", hint)
    return Diagnostic("O0205", absent, binding.place, message, help=help)


# Records that Python code makes have a class that it can import.


def records_have_classes(facts: Facts) -> Iterator[Diagnostic]:
    """O0201, for each record without a class whose values Python code has to create."""
    makers: dict[str, list[Related]] = {}
    for type_, given, maker in _python_results(facts):
        for name in _records_without_class(type_) - {
            name for one in given for name in _records_without_class(one)
        }:
            makers.setdefault(name, []).append(maker)
    for name, (first, *others) in makers.items():
        yield Diagnostic(
            "O0201",
            f"record `{name}` has no Python class, but Python code has to create its values",
            first.place,
            first.message,
            related=tuple(others[:_MOST_LISTED]),
            help="add `python: package.module:Class`, a frozen dataclass or a `NamedTuple` with "
            "these fields",
        )


def _python_results(facts: Facts) -> Iterator[tuple[Type, Sequence[Type], Related]]:
    """The type of each result of Python code, with the types that it gets and may pass on."""
    for operator in facts.system.operators:
        given = [type_ for _, type_ in operator.parameters]
        if operator.python:
            yield operator.result, given, Related(operator.place, f"gives `{operator.result}`")
    for bound in facts.bindings:
        if not bound.is_commanded:
            type_ = bound.element.type
            yield type_, (), Related(bound.binding.place, f"gives `{type_}`")


def _records_without_class(type_: Type) -> set[str]:
    """The names of records in a type that name no Python class."""
    found = nested_types([type_])
    return {part.name for part in found if isinstance(part, Record) and not part.python}


# What is to be simulated has a plant behind its devices and a task to count.


def devices_simulated(facts: Facts) -> Iterator[Diagnostic]:
    """O0501 and O0503; a specification with neither plant nor task is not meant to be simulated."""
    system = facts.system
    if system.plant is None and system.task is not None:
        yield from without_plant(system, system.task.place)
    if system.plant is not None and system.task is None and system.devices:
        yield Diagnostic(
            "O0503",
            "nothing says what a run counts: there is no task",
            system.plant.place,
            help="add `task:` with the transition that ends a cycle",
        )


def without_plant(system: System, place: Place) -> Iterator[Diagnostic]:
    """O0501 at a place, if there are devices."""
    if system.devices:
        names = ", ".join(f"`{device.qualified_name}`" for device in system.devices)
        yield Diagnostic(
            "O0501",
            "there is no plant behind the devices",
            place,
            f"nothing stands behind {names}",
            help="add `plant:` with what makes it, `model` or `python`, and what it binds",
        )


# If there is a plant, something stands behind every element of every device.


def devices_bound(facts: Facts) -> Iterator[Diagnostic]:
    """O0502; not for an element that `bindings_known` suggests for an unknown one."""
    plant = facts.system.plant
    if plant is None:
        return
    every = bindable(facts.system)
    elements = [(f"{device}.{e.name}", e) for device, e, _ in every if device != PLANT]
    bound = {f"{b.device}.{b.element}" for b in plant.bindings if b.device != PLANT}
    open_ = [name for name, _ in elements if name not in bound]
    strange = bound - {name for name, _ in elements}
    misnamed = {name for other in strange for name in nearest(other, open_)[:1]}
    for name, element in elements:
        if name not in bound | misnamed:
            yield Diagnostic(
                "O0502",
                f"nothing in the plant stands behind `{name}`",
                element.place,
                related=(Related(plant.place, "the plant"),),
                help=f"add `{name}: {{...}}` under `bind:`",
            )


# Without a function in between, an element has as many numbers as what stands behind it.


_DEFAULT_CAMERA = (640, 480)
"""Width and height of images of a camera whose resolution the model does not say."""


def sizes_match(facts: Facts) -> Iterator[Diagnostic]:
    """E0507, for an element that has another number of numbers or pixels than the plant."""
    model = facts.model
    if not isinstance(model, Model):
        return
    for bound in facts.bindings:
        if bound.binding.through or bound.is_pose:
            continue
        sizes, type_ = _number_sizes(bound, model), bound.element.type
        if isinstance(type_, Image) and bound.binding.camera in model.cameras:
            width, height = model.cameras[bound.binding.camera] or _DEFAULT_CAMERA
            sizes = f"{type_.width} x {type_.height} pixels", f"{width} x {height} pixels"
        if sizes and sizes[0] != sizes[1]:
            yield Diagnostic(
                "E0507",
                f"`{bound.element.name}` has {sizes[0]}, the plant has {sizes[1]}",
                bound.binding.place,
                related=(Related(bound.element.place, f"`{bound.element.type}`"),),
                help="make both the same, or name a function under `through:` that converts",
            )


def _number_sizes(bound: BoundElement, model: Model) -> tuple[str, str] | None:
    """Numbers of the element and of the plant, in words; None where one is not known."""
    wanted, parts = bound.units, list(raw_numbers(bound, model))
    sizes = [len(part.units) for part in parts if part.units is not None]
    known = len(sizes) == len(parts) and model.actuators.keys() >= set(bound.binding.actuators)
    if wanted is None or not parts or not known:
        return None
    return counted(len(wanted), "number"), counted(sum(sizes), "number")


# An actuator of the plant obeys one element.


def actuators_driven_once(facts: Facts) -> Iterator[Diagnostic]:
    """E0508, for an actuator that two elements command."""
    first: dict[str, Place] = {}
    for bound in facts.bindings:
        for index, name in enumerate(bound.binding.actuators if bound.is_commanded else ()):
            place = bound.binding.place.below("actuators", index)
            if name in first and _may_exist("actuators", name, facts):
                other = (Related(first[name], "driven by this already"),)
                copies = first[name] == place
                yield Diagnostic(
                    "E0508",
                    f"actuator `{name}` is driven twice",
                    place,
                    related=() if copies else other,
                    help=_AN_INDEX if copies else "let one element of a device command it",
                )
            first.setdefault(name, place)


def _may_exist(kind: str, name: str, facts: Facts) -> bool:
    """Whether the model has a part, or may have it; of any other E0502 is told."""
    model = facts.model
    return not (isinstance(model, Model) and model.complete) or name in getattr(model, kind)


_AN_INDEX = "give each copy an actuator of its own: name it with the index, e.g. `drive_{i}`"


# What two effectors report comes from different parts of the plant.


def effectors_measured_apart(facts: Facts) -> Iterator[Diagnostic]:
    """W0520; of sensors, which may be shared, where all copies of one description name the same."""
    effectors = {d.qualified_name for d in facts.system.devices if d.kind == "real_effector"}
    first: dict[tuple[str, str], tuple[str, Place]] = {}
    reported: set[Place] = set()
    for binding in (bound.binding for bound in facts.bindings if not bound.is_commanded):
        for kind in ("joints", "sensors") if binding.device in effectors else ():
            for index, name in enumerate(getattr(binding, kind)):
                place = binding.place.below(kind, index)
                device, earlier = first.setdefault((kind, name), (binding.device, place))
                copies = earlier == place
                is_shared = kind == "sensors" and not copies
                if device == binding.device or is_shared or place in reported:
                    continue
                if not _may_exist(kind, name, facts):
                    continue
                reported.add(place)
                part = kind.removesuffix("s")
                yield Diagnostic(
                    "W0520",
                    f"{part} `{name}` stands behind `{device}` and `{binding.device}`",
                    place,
                    related=() if copies else (Related(earlier, "the other one"),),
                    help=f"give each copy its own: name it with the index, e.g. `{part}_{{i}}`"
                    if copies
                    else "name what this effector moves",
                )


# Two elements do not have the same numbers.


def sensors_read_once(facts: Facts) -> Iterator[Diagnostic]:
    """W0526; of one agent, of effectors, or of what is observed. Agents may see one thing."""
    effectors = {d.qualified_name for d in facts.system.devices if d.kind == "real_effector"}
    first: dict[tuple[str, str, str, bool], tuple[str, Place]] = {}
    for bound in facts.bindings:
        binding, conversion = bound.binding, (bound.binding.through, bound.is_pose)
        owner = binding.device.partition(".")[0]  # of what is observed, the plant
        owners = [owner, "effectors"] if binding.device in effectors else [owner]
        for index, name in enumerate(() if bound.is_commanded else binding.sensors):
            place = binding.place.below("sensors", index)
            element = f"{binding.device}.{binding.element}"
            known = [first.setdefault((o, name, *conversion), (element, place)) for o in owners]
            twin = next(((e, p) for e, p in known if e != element), None)
            if twin is None or twin[1] == place:  # copies of effectors are told of above
                continue
            if not _may_exist("sensors", name, facts):
                continue
            yield Diagnostic(
                "W0526",
                f"sensor `{name}` stands behind `{twin[0]}` and `{element}`",
                place,
                related=(Related(twin[1], "the other one"),),
                help="name the sensor of this one, or let both readers read one element",
            )


_ROUNDING = 1e-5
"""Of a range: how far beyond it a number is still at its end."""
_LISTED = 4


@dataclass(frozen=True, slots=True)
class _CommandOutOfRange:
    """A number that is surely beyond a limit of an actuator, and where it is sent from."""

    bound: BoundElement
    index: int
    origin: ScalarExpr
    sent: Place
    values: Range
    limit: Limit

    @property
    def place(self) -> Place:
        return self.origin.text.place(self.origin.expr)


def commands_obeyed(facts: Facts) -> Iterator[Diagnostic]:
    """W0525, once for each place that such a number comes from."""
    found: dict[Place, list[_CommandOutOfRange]] = {}
    machines = {machine.subsystem.qualified_name: machine for machine in facts.machines}
    for element in facts.bindings:
        for beyond in _of_element(element, facts, machines):
            found.setdefault(beyond.place, []).append(beyond)
    for place, alike in found.items():
        first = alike[0]
        name = first.bound.binding.actuators[first.index]
        what, (least, greatest) = first.limit
        units = first.bound.units or ()
        unit = "" if not units or str(units[0]) == "1" else f" {units[0]}"
        low, high = first.values
        is_more = low > greatest
        end = low if is_more else high
        bound = "" if low == high else "at least " if is_more else "at most "
        word = "more" if is_more else "less"
        related = {first.sent: "sent to the device here"} if first.sent != place else {}
        for each in alike[:_LISTED]:
            at = each.bound.binding.place.below("actuators", each.index)
            related.setdefault(at, "obeys it")
        yield Diagnostic(
            "W0525",
            f"{bound}{end:.6g}{unit} is {word} than actuator `{name}` can do: "
            f"{least:.6g} to {greatest:.6g}{unit}, its {what}",
            place,
            related=tuple(Related(at, words) for at, words in related.items()),
            help="the model cuts what is beyond and says nothing: "
            "send what it can do, or change it",
        )


def _of_element(
    bound: BoundElement, facts: Facts, machines: Mapping[str, Machine]
) -> Iterator[_CommandOutOfRange]:
    binding, type_ = bound.binding, bound.element.type
    is_number = isinstance(type_, Real) or (isinstance(type_, Vector) and type_.is_array)
    if not (bound.is_commanded and bound.plant == "model" and is_number) or binding.through:
        return
    for index, name in enumerate(binding.actuators):
        model = facts.model
        limits = [*limits_of_control(name, model)] if isinstance(model, Model) else []
        at = index if isinstance(type_, Vector) else None
        for definition in _command_definitions(bound, at, facts) if limits else ():
            if isinstance(definition, ScalarExpr):
                reaching = ScalarRanges(facts.definitions, machines.__getitem__).of(definition)
                sent = definition.text.place(definition.expr)
                for origin, ranges in reaching.items():
                    outside = ((r, li) for r in ranges for li in limits if _is_outside(r, li[1]))
                    for range_, limit in islice(outside, 1):
                        yield _CommandOutOfRange(bound, index, origin, sent, range_, limit)


def _command_definitions(
    bound: BoundElement, index: int | None, facts: Facts
) -> Iterator[ScalarDefinition]:
    """Definitions of what states send to an element, and of its safe value."""
    element = bound.element
    for wire in facts.wires.wires_of_element(bound.binding.device, "y", element.name):
        if wire.subsystem.qualified_name not in facts.broken:
            target = wire.port.peer, element.name
            yield from facts.definitions.sent(wire.subsystem, target, index)
    if safe := element.safe:
        for value, key in ((safe.value, "is"), (safe.otherwise, "otherwise")):
            if value is not None:
                text = ExpressionText(value, safe.place, key)
                yield ScalarExpr("", value if index is None else component(value, index), text)


def _is_outside(range_: Range, limit: Range) -> bool:
    near = _ROUNDING * (limit[1] - limit[0])
    return range_[0] > limit[1] + near or range_[1] < limit[0] - near
