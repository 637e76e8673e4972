"""The operator's panel sets elements of real receptors, and disturbances operate it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from specc.analysis import Facts
from specc.analysis.plant import BoundElement, first_key
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import in_ms, join_words
from specc.lang import show
from specc.model.bindings import Widget
from specc.model.system import Subsystem
from specc.model.task import DisturbanceAction, Verb
from specc.model.types import Real, Type
from specc.proof import InputName
from specc.resolve.context import suggest
from specc.source import Place

# What is bound to the panel.


def panel_fits(facts: Facts) -> Iterator[Diagnostic]:
    """E0505, for what the panel cannot set, or not so; values are checked where they are read."""
    receptors = {d.qualified_name for d in facts.system.devices if d.kind == "real_receptor"}
    for bound in facts.bindings:
        if bound.plant == "panel":
            is_set = bound.binding.device in receptors and not bound.is_commanded
            if not is_set:
                message = (
                    f"the panel cannot set `{bound.element.name}`: no real receptor reports it"
                )
                help = "add a real receptor for the operator, with such an element in its `y`"
                yield Diagnostic("E0505", message, bound.binding.place, help=help)
            elif other := first_key(bound.binding, _OTHER_SOURCES):
                message = f"the operator sets `{bound.element.name}`: it has no `{other}`"
                place = bound.binding.place.below(other)
                yield Diagnostic("E0505", message, place, help=f"delete `{other}`")
            else:
                yield from _several_readers(bound, facts)
    yield from _keys_given_twice(facts)


_OTHER_SOURCES = (
    "joints", "sensors", "actuators", "camera", "image", "noise", "depth_noise", "through",
    "topic", "message", "qos", "tf", "action", "part", "rate_hz", "sporadic", "max_gap_s",
    "on_loss",
)  # fmt: skip


def _several_readers(bound: BoundElement, facts: Facts) -> Iterator[Diagnostic]:
    """A press is for one reader."""
    panel = bound.binding.panel
    if panel is None or panel.kind != "button" or panel.hold:
        return
    wires = facts.wires.wires_of_element(bound.binding.device, "x", bound.element.name)
    readers = {wire.subsystem.qualified_name: wire.subsystem.place for wire in wires}
    if len(readers) > 1:
        names = join_words((f"`{name}`" for name in readers), "and")
        related = tuple(Related(place, "reads it") for place in readers.values())
        help = "let one of them read it and tell the others, or make it a switch"
        message = f"`{bound.element.name}` is a button, which {names} read"
        note = "a press is one sample: who asks for it first has it, and nobody else"
        yield Diagnostic("E0505", message, bound.binding.place, note, related, help)


def _keys_given_twice(facts: Facts) -> Iterator[Diagnostic]:
    first: dict[str, Place] = {}
    for binding in facts.system.plant.bindings if facts.system.plant else ():
        if binding.panel is None or not binding.panel.key:
            continue
        place = binding.place.below("key")
        if (earlier := first.setdefault(binding.panel.key, place)) is not place:
            message = f"key `{binding.panel.key}` operates something else already"
            copies = earlier == place
            related = () if copies else (Related(earlier, "here"),)
            help = "give each copy its own, or none" if copies else "choose another one"
            yield Diagnostic("E0505", message, place, "", related, help)


# A press is one sample, which a slower reader misses where it is passed on as it is.


def presses_arrive(facts: Facts) -> Iterator[Diagnostic]:
    """W0414, for a button that is passed on to a slower subsystem in every period."""
    for bound in facts.bindings:
        panel, element = bound.binding.panel, bound.element.name
        if panel is None or panel.kind != "button" or panel.hold:
            continue
        for wire in facts.wires.wires_of_element(bound.binding.device, "x", element):
            reader, pressed = wire.subsystem, (wire.port.peer, element)
            for output in reader.outputs if reader in facts.rates.timed else ():
                if pressed in _passed_on(reader, output, facts):
                    yield from _slower_readers(bound, reader, output, facts)


def _passed_on(sender: Subsystem, output: InputName, facts: Facts) -> Iterator[InputName]:
    """The inputs from which, and from no memory, an output follows."""
    dependences = facts.of(sender).dependences
    for values in sender.assigned_values.get(output, {}).values():
        for dependence in map(dependences.of, values):
            yield from () if dependence.memory else dependence.values


def _slower_readers(
    bound: BoundElement, sender: Subsystem, output: tuple[str, str], facts: Facts
) -> Iterator[Diagnostic]:
    for wire in facts.wires.wires_of(sender):
        reader, end = wire.peer_subsystem, wire.peer_port
        if wire.port.direction != "y" or wire.port.peer != output[0] or not (reader and end):
            continue
        received = end.element(output[1])
        if received is None or received.event or reader.rate_hz >= sender.rate_hz:
            continue
        own, other = in_ms(1 / sender.rate_hz), in_ms(1 / reader.rate_hz)
        yield Diagnostic(
            "W0414",
            f"`{reader.qualified_name}` can miss presses of `{bound.element.name}`",
            end.place_of(received),
            f"a press is passed on for {own}, and is read every {other}",
            (
                Related(bound.binding.place, "the button"),
                Related(sender.place.below("rate"), "passes it on at this rate"),
                Related(reader.place.below("rate"), "reads at this rate"),
            ),
            f"give both one rate, or let `{sender.qualified_name}` send it on until it is answered",
        )


# What the operator does in disturbances.


def operation_fits(facts: Facts) -> Iterator[Diagnostic]:
    """E0502 for elements that are not on the panel, E0517 for what cannot be done to them."""
    for each in facts.system.disturbances if facts.system.plant else ():
        for verb, action in each.actions_on("button", "control"):
            yield from _operation_faults(verb, action, facts)


def _operation_faults(verb: Verb, action: DisturbanceAction, facts: Facts) -> Iterator[Diagnostic]:
    name, bound = action.name, facts.reported.get(action.name)
    if bound is None:
        message = f"`{name}` is not on the operator's panel"
        known = [key for key, other in facts.reported.items() if other.binding.panel]
        help = suggest(name, sorted(known))
        yield Diagnostic("E0502", message, action.place, help=help)
        return
    panel, is_button = bound.binding.panel, verb.subject == "button"
    place, fault = action.place, None
    if panel is None:
        help = "bind it with `panel:`, or name an element that is bound so"
        fault = "is not on the operator's panel", help
    elif is_button != (panel.kind == "button"):
        help = "turn it: `turn: {NAME: VALUE}`" if is_button else "press it: `press: [NAME]`"
        fault = f"is a {panel.kind}, which cannot be {verb.participle}", help
    elif fault := _value_fault(panel, bound.element.type, action):
        place = replace(place, part="value")
    if fault:
        related = (Related(bound.binding.place, "bound here"),)
        yield Diagnostic("E0517", f"`{name}` {fault[0]}", place, "", related, fault[1])


def _value_fault(panel: Widget, type_: Type, action: DisturbanceAction) -> tuple[str, str] | None:
    """Why the operator cannot give an element the numbers of an action, and a way out."""
    numbers = [value for draw in action.numbers for value, _ in draw.values]
    if any(draw.is_range for draw in action.numbers) and not isinstance(type_, Real):
        return "has no values in between", "write one value, or `{one_of: [...]}`"
    if panel.bounds is None:
        return None
    low, high = panel.bounds
    if any(not low.value <= value <= high.value for value in numbers):
        message = f"does not get this value: its range is {show(low)} to {show(high)}"
        return message, "write a value within its range"
    return None
