"""A binding names what measures or takes the element's quantity, each once and in one order."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.bindings import Bound
from specc.facts.kinds import wrong_kind
from specc.facts.places import below
from specc.facts.plant_units import Raw, differs, raw_numbers, units_of
from specc.mjcf import Model
from specc.model.system import System
from specc.model.units import Unit

_LISTS = ("joints", "sensors", "actuators")


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0511, E0512, W0513; a binding of the wrong kind is `bindings_fit`'s matter."""
    model = facts.model
    for bound in facts.bindings:
        if wrong_kind(bound):
            continue
        yield from _named_twice(bound)
        if isinstance(model, Model):
            yield from _units_differ(bound, model)
            yield from _disordered(bound, model)


def _named_twice(bound: Bound) -> Iterator[Diagnostic]:
    """An actuator that is commanded twice is `actuators_driven_once`'s matter."""
    for kind in _LISTS[:2] if bound.commanded else _LISTS:
        names = getattr(bound.binding, kind)
        for index, name in enumerate(names):
            if name in names[:index]:
                first = below(bound.binding.place, kind, names.index(name))
                yield Diagnostic(
                    "E0512",
                    f"{kind.removesuffix('s')} `{name}` is listed twice",
                    below(bound.binding.place, kind, index),
                    related=(Related(first, "listed here already"),),
                    help="name another one, or delete it",
                )


def _units_differ(bound: Bound, model: Model) -> Iterator[Diagnostic]:
    wanted = units_of(bound.element.type)
    if bound.binding.through or wanted is None:
        return
    start = 0
    for raw in raw_numbers(bound, model):
        if raw.units is None:
            return
        for unit, other in zip(wanted[start:], raw.units, strict=False):
            if other is not None and differs(raw, other, unit):
                yield _another_unit(bound, raw, unit, other)
                break
        start += len(raw.units)


def _another_unit(bound: Bound, raw: Raw, unit: Unit, other: Unit) -> Diagnostic:
    verb = "takes" if bound.commanded else "gives"
    kind = raw.kind.removesuffix("s")
    return Diagnostic(
        "E0511",
        f"`{bound.element.name}` is in {unit}, and {kind} `{raw.name}` {verb} {other}",
        below(bound.binding.place, raw.kind, raw.place),
        related=(Related(bound.element.place, f"`{bound.element.type}`"),),
        help="name another one, or a function under `through:` that converts",
    )


def _disordered(bound: Bound, model: Model) -> Iterator[Diagnostic]:
    """W0513, of the joints that are listed and driven too."""
    listed = bound.binding.joints
    driven = [model.driven(name) for name in bound.binding.actuators]
    both = [name for name in driven if name in listed]
    wanted, found = iter(both), [name for name in listed if name in driven]
    if len(set(both)) < len(both) or len(set(found)) < len(found):
        return
    for name in found:
        if name != (other := next(wanted)):
            place = bound.binding.place
            actuator = bound.binding.actuators[driven.index(other)]
            yield Diagnostic(
                "W0513",
                f"joint `{name}` stands where actuator `{actuator}` has `{other}`",
                below(place, "joints", listed.index(name)),
                related=(
                    Related(below(place, "actuators", driven.index(other)), f"drives `{other}`"),
                ),
                help=f"list both in one order: `joints: [{', '.join(both)}]`",
            )
            return
