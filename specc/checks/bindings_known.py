"""What the plant binds are elements of devices."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, is_slip, nearest
from specc.expr import or_else
from specc.facts import Facts
from specc.facts.words import listed
from specc.model.system import Binding, System

_LISTED = 8


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0503, and O0205 for what may still come."""
    elements = {d.qualified_name: [e.name for e in (*d.x, *d.y)] for d in system.devices}
    for binding in system.plant.bindings if system.plant else ():
        known = elements.get(binding.device)
        if binding.device in facts.broken:
            continue
        if known is None:
            message = f"there is no device `{binding.device}`"
            yield _unknown(binding, message, binding.device, list(elements))
        elif binding.element not in known:
            message = f"`{binding.device}` has no element `{binding.element}`"
            yield _unknown(binding, message, binding.element, known)


def _unknown(binding: Binding, message: str, name: str, known: list[str]) -> Diagnostic:
    hint = _suggestion(name, known)
    # A real effector called a real receptor, or the other way round, is no other device.
    if is_slip(name, known) or name.split(".")[-1] in {other.split(".")[-1] for other in known}:
        return Diagnostic("E0503", message, binding.place, help=hint)
    absent = f"`{binding.device}.{binding.element}` is not there yet"
    help = or_else("add it to the agent", hint)
    return Diagnostic("O0205", absent, binding.place, message, help=help)


def _suggestion(name: str, known: list[str]) -> str:
    if close := nearest(name, known):
        return f"did you mean {listed(_quoted(close), 'or')}?"
    if known:
        return f"known: {', '.join(_quoted(known[:_LISTED]))}"
    return "an element is named `agent.E.device.element`"


def _quoted(names: list[str]) -> list[str]:
    return [f"`{name}`" for name in names]
