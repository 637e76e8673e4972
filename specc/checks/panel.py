"""The operator's panel sets elements of real receptors, and disturbances operate it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from specc.analysis import Facts
from specc.analysis.plant import BoundElement, first_key
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.lang import show
from specc.model.system import Widget
from specc.model.task import DisturbanceAction, Verb
from specc.model.types import Real, Type
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


# What the operator does in disturbances.


def operation_fits(facts: Facts) -> Iterator[Diagnostic]:
    """E0502 for elements that are not on the panel, E0517 for what cannot be done to them."""
    task = facts.system.task
    for each in task.disturbances if task and facts.system.plant else ():
        for verb, action in each.actions_on("button", "control"):
            yield from _operation_faults(verb, action, facts)


def _operation_faults(verb: Verb, action: DisturbanceAction, facts: Facts) -> Iterator[Diagnostic]:
    name, bound = action.name, facts.reported.get(action.name)
    panel = bound.binding.panel if bound else None
    if bound is None or panel is None:
        every = {key: b.binding.panel for key, b in facts.reported.items() if b.binding.panel}
        is_button = verb.subject == "button"
        known = [key for key, panel in every.items() if is_button == (panel.kind == "button")]
        message = f"`{name}` is not on the operator's panel"
        related = (Related(bound.binding.place, "bound here"),) if bound else ()
        help = suggest(name, sorted(known)) if known else "bind it with `panel:`"
        code = "E0517" if bound else "E0502"
        yield Diagnostic(code, message, action.place, related=related, help=help)
        return
    related = (Related(bound.binding.place, "bound here"),)
    if (verb.subject == "button") != (panel.kind == "button"):
        is_button = panel.kind == "button"
        message = f"`{name}` is a {panel.kind}, which is not {verb.participle}"
        help = "press it: `press: [...]`" if is_button else "turn it: `turn: {NAME: VALUE}`"
        yield Diagnostic("E0517", message, action.place, related=related, help=help)
    elif fault := _fault(panel, bound.element.type, action):
        message, help = fault
        place = replace(action.place, part="value")
        yield Diagnostic("E0517", f"`{name}` {message}", place, related=related, help=help)


def _fault(panel: Widget, type_: Type, action: DisturbanceAction) -> tuple[str, str] | None:
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
