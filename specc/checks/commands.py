"""Commands that no actuator of the model can obey: the model cuts them in silence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from specc.analysis import Facts
from specc.analysis.machine import Machine
from specc.analysis.plant import BoundElement, Limit, limits_of_control
from specc.analysis.reaching import ScalarDefinition, ScalarExpr, component
from specc.analysis.reads import ExpressionText
from specc.analysis.scalar_ranges import ScalarRanges
from specc.diagnostics import Diagnostic, Related
from specc.lang.ranges import Range
from specc.mjcf import Model
from specc.model.types import Real, Vector
from specc.source import Place

_ROUNDING = 1e-5
"""Of a range: how far beyond it a number is still at its end."""
_LISTED = 4


@dataclass(frozen=True, slots=True)
class _Beyond:
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
    found: dict[Place, list[_Beyond]] = {}
    machines = {machine.subsystem.qualified_name: machine for machine in facts.machines}
    for bound in facts.bindings:
        for beyond in _of_element(bound, facts, machines):
            found.setdefault(beyond.place, []).append(beyond)
    for place, alike in found.items():
        yield _cut(place, alike)


def _of_element(
    bound: BoundElement, facts: Facts, machines: Mapping[str, Machine]
) -> Iterator[_Beyond]:
    binding, type_ = bound.binding, bound.element.type
    is_number = isinstance(type_, Real) or (isinstance(type_, Vector) and type_.is_array)
    if not (bound.commanded and bound.plant == "model" and is_number) or binding.through:
        return
    for index, name in enumerate(binding.actuators):
        limits = [*limits_of_control(name, facts.model)] if isinstance(facts.model, Model) else []
        at = index if isinstance(type_, Vector) else None
        for definition in _sent(bound, at, facts) if limits else ():
            if isinstance(definition, ScalarExpr):
                reaching = ScalarRanges(facts.definitions, machines.__getitem__).of(definition)
                yield from _beyond(bound, index, definition, reaching, limits)


def _sent(bound: BoundElement, index: int | None, facts: Facts) -> Iterator[ScalarDefinition]:
    """What states send to an element, and what is safe for it."""
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


def _beyond(
    bound: BoundElement,
    index: int,
    definition: ScalarExpr,
    reaching: Mapping[ScalarExpr, tuple[Range, ...]],
    limits: list[Limit],
) -> Iterator[_Beyond]:
    sent = definition.text.place(definition.expr)
    for origin, every in reaching.items():
        pairs = ((range_, limit) for range_ in every for limit in limits)
        for range_, limit in pairs:
            if _is_outside(range_, limit[1]):
                yield _Beyond(bound, index, origin, sent, range_, limit)
                break


def _is_outside(range_: Range, limit: Range) -> bool:
    near = _ROUNDING * (limit[1] - limit[0])
    return range_[0] > limit[1] + near or range_[1] < limit[0] - near


def _cut(place: Place, alike: list[_Beyond]) -> Diagnostic:
    first = alike[0]
    name = first.bound.binding.actuators[first.index]
    what, (least, greatest) = first.limit
    units = first.bound.units or ()
    unit = "" if not units or str(units[0]) == "1" else f" {units[0]}"
    low, high = first.values
    is_more = low > greatest
    end = low if is_more else high
    least_said = "" if low == high else "at least " if is_more else "at most "
    related = {first.sent: "sent to the device here"} if first.sent != place else {}
    for each in alike[:_LISTED]:
        at = each.bound.binding.place.below("actuators", each.index)
        related.setdefault(at, "obeys it")
    return Diagnostic(
        "W0525",
        f"{least_said}{end:.6g}{unit} is {'more' if is_more else 'less'} than actuator `{name}` "
        f"can do: {least:.6g} to {greatest:.6g}{unit}, its {what}",
        place,
        related=tuple(Related(at, said) for at, said in related.items()),
        help="the model cuts what is beyond and says nothing: send what it can do, or change it",
    )


CHECKS = (commands_obeyed,)
