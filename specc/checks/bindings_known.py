"""What the plant binds are elements of devices."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, is_slip, nearest
from specc.facts import Facts
from specc.model.system import Binding, System


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
    close = nearest(name, known) or known[:8]
    words = "did you mean" if nearest(name, known) else "there are"
    listed = ", ".join(f"`{n}`" for n in close)
    mark = "?" if words == "did you mean" else ""
    hint = f"{words} {listed}{mark}" if close else "an element is named `agent.E.device.element`"
    # A real effector called a real receptor, or the other way round, is no other device.
    if is_slip(name, known) or name.split(".")[-1] in {other.split(".")[-1] for other in known}:
        return Diagnostic("E0503", message, binding.place, help=hint)
    absent = f"`{binding.device}.{binding.element}` is not there yet"
    return Diagnostic("O0205", absent, binding.place, message, help=f"add it; {hint}")
