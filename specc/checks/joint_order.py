"""Joints stand in one order wherever bindings of one effector list them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from specc.analysis import Facts
from specc.analysis.plant import BoundElement
from specc.diagnostics import Diagnostic, Related
from specc.mjcf import Model
from specc.mjcf.model import ModelPart
from specc.source import Place

# Within a binding: `through` gets joints and sets actuators.


def joints_like_actuators(facts: Facts) -> Iterator[Diagnostic]:
    """W0513."""
    for bound in facts.bindings:
        if bound.commanded and bound.plant == "model" and isinstance(facts.model, Model):
            yield from _disordered(bound, facts.model)


def _disordered(bound: BoundElement, model: Model) -> Iterator[Diagnostic]:
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
                f"joint `{name}` is listed where actuator `{actuator}` drives `{other}`",
                place.below("joints", listed.index(name)),
                related=(
                    Related(place.below("actuators", driven.index(other)), f"drives `{other}`"),
                ),
                help=f"list both in the same order: `joints: [{', '.join(both)}]`",
            )
            return


# Between bindings: elements of one subsystem are vectors over the same joints.


def elements_in_one_order(facts: Facts) -> Iterator[Diagnostic]:
    """W0513, of the elements of all devices that one subsystem works with."""
    if not isinstance(facts.model, Model):
        return
    joints = {id(b): _joints(b, facts.model) for b in facts.bindings if b.plant == "model"}
    found: set[tuple[Place, Place]] = set()
    for subsystem in facts.subsystems:
        devices = {wire.peer_name for wire in facts.wires.wires_of(subsystem) if wire.peer_device}
        own = [b for b in facts.bindings if b.binding.device in devices and joints.get(id(b))]
        own.sort(key=lambda bound: not bound.commanded)
        for one, other in combinations(own, 2):
            first, second = joints[id(one)], joints[id(other)]
            places = one.binding.place, other.binding.place
            if first != second and sorted(first) == sorted(second) and places not in found:
                found.add(places)
                yield _two_orders(one, first, other, second)


def _joints(bound: BoundElement, model: Model) -> list[str]:
    """The joint of each number; none where they do not map to one joint each."""
    binding = bound.binding
    found = [] if bound.commanded else [*binding.joints]
    for name in () if bound.commanded else binding.sensors:
        part = model.parts.get(("sensor", name), ModelPart(""))
        found.append(part.joint or model.driven(part.actuator))
    found += [model.driven(name) for name in binding.actuators]
    single = all(model.joint_kind(joint) in ("hinge", "slide") for joint in found)
    return found if single and not binding.through and len(set(found)) == len(found) > 1 else []


def _two_orders(
    one: BoundElement, first: list[str], other: BoundElement, second: list[str]
) -> Diagnostic:
    """The element of which another one has the joints in another order."""
    binding = other.binding
    names = [name for kind in _KINDS for name in getattr(binding, kind)]
    kinds = [kind for kind in _KINDS if getattr(binding, kind)]
    if other.commanded:
        names, kinds = [*binding.actuators], ["actuators"]
    help = "list them in one order"
    if len(kinds) == 1:
        wanted = ", ".join(names[second.index(joint)] for joint in first)
        help += f": `{kinds[0]}: [{wanted}]`"
    both = f"`{one.element.name}`", f"`{other.element.name}`"
    return Diagnostic(
        "W0513",
        f"{both[0]} has the joints in the order `{', '.join(first)}`, and {both[1]} has "
        f"them as `{', '.join(second)}`",
        binding.place.below(kinds[0]),
        related=(Related(one.binding.place, f"in the order `{', '.join(first)}`"),),
        help=help,
    )


_KINDS = ("joints", "sensors", "actuators")

CHECKS = (joints_like_actuators, elements_in_one_order)
