"""Poses: which parts of a model give one, and quaternions in the order of MuJoCo."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.analysis import Facts
from specc.analysis.plant import (
    FRAME_ORIENTATION,
    FRAME_POSITION,
    BoundElement,
    RawNumbers,
    is_orientation,
    is_quaternion,
    raw_numbers,
)
from specc.analysis.reaching import ReportedScalar, ReportedScalars, ScalarExpr, component
from specc.analysis.reads import ExpressionText, texts
from specc.diagnostics import Diagnostic, Related
from specc.lang import show
from specc.lang.builtins import FUNCTIONS
from specc.mjcf import Model
from specc.mjcf.model import ModelObject, ModelPart
from specc.model.expr import Builtin, Expr, walk
from specc.model.requirement import expressions
from specc.model.types import Pose
from specc.source import Place

# A pose is made of the position and the orientation of one thing in one frame.


def poses_measured(facts: Facts) -> Iterator[Diagnostic]:
    """E0524."""
    for bound in facts.bindings:
        if bound.is_pose and isinstance(facts.model, Model) and not bound.binding.camera:
            yield from _of_pose(bound, facts.model)


_WAY = (
    "name a `framepos` and a `framequat` sensor of one thing, in this order, or a free joint: "
    "`sensors: [position, orientation]`"
)


def _of_pose(bound: BoundElement, model: Model) -> Iterator[Diagnostic]:
    binding, name = bound.binding, bound.element.name
    parts = [_part(raw, model) for raw in raw_numbers(bound, model)]
    kinds = [part.kind for part in parts if part is not None]
    if not parts or len(kinds) < len(parts):
        return  # nothing is known of them, or they are not there
    related = (Related(bound.element.place, f"`{bound.element.type}`"),)
    if kinds == ["free"]:
        return
    if kinds != [FRAME_POSITION, FRAME_ORIENTATION]:
        wanted = f"`{FRAME_POSITION}, {FRAME_ORIENTATION}`"
        message = f"`{name}` is a pose, which takes {wanted}, not `{', '.join(kinds)}`"
        yield Diagnostic("E0524", message, binding.place, related=related, help=_WAY)
        return
    position, orientation = (part for part in parts if part is not None)
    place = binding.place.below("sensors", 1)
    one, other = binding.sensors
    for of, told in (("object", "measures"), ("reference", "measures in")):
        first, second = _shown(position, of), _shown(orientation, of)
        if first != second:
            message = f"sensor `{one}` {told} {first}, and `{other}` {told} {second}"
            help = "name the position and the orientation of one thing in one frame"
            yield Diagnostic("E0524", message, place, related=related, help=help)
            return
    type_ = bound.element.type
    if isinstance(type_, Pose) and _is_reversed(type_, position):
        object_, reference = (_shown(position, of) for of in ("object", "reference"))
        message = f"the sensors give the pose of {object_} in {reference}, not the other way round"
        help = f"make the type `pose[{type_.child}, {type_.parent}]`, and `inverse` it in its uses"
        yield Diagnostic("E0524", message, binding.place, related=related, help=help)


def _part(raw: RawNumbers, model: Model) -> ModelPart | None:
    return model.parts.get((raw.kind.removesuffix("s"), raw.name))


def _shown(part: ModelPart, of: str) -> str:
    found: ModelObject | None = getattr(part, of)
    return "the world" if found is None else f"{found[0]} `{found[1]}`"


def _is_reversed(type_: Pose, part: ModelPart) -> bool:
    """Whether the frames have the names of object and reference, the other way round."""
    object_, reference = (each and each[1] for each in (part.object, part.reference))
    same = type_.child == object_ or type_.parent == reference
    return not same and (type_.parent == object_ or type_.child == reference)


# `pose` takes a quaternion as x, y, z, w; MuJoCo gives w, x, y, z.


_ORDER = range(4)


def quaternions_ordered(facts: Facts) -> Iterator[Diagnostic]:
    """E0341."""
    if not isinstance(facts.model, Model):
        return
    raw = {
        name: numbers
        for bound in facts.bindings
        if not bound.binding.through and bound.plant == "model" and not bound.is_commanded
        if any(numbers := [*_numbers(bound, facts.model)])
        for name in (f"{bound.binding.device}.{bound.binding.element}",)
    }
    found: set[Place] = set()
    for subsystem, text, quaternion in _directions(facts) if raw else ():
        place = text.place(quaternion)
        if place in found:
            continue
        every = [_parts_behind(facts, subsystem, text, quaternion, i, raw) for i in _ORDER]
        for element, part in sorted(set.intersection(*every), key=lambda pair: pair[0]):
            found.add(place)
            yield _another_order(facts, place, quaternion, element, part)
            break


_Numbers = list[tuple[RawNumbers, int] | None]
"""For each number of an element the quaternion that it is of and its place there, if it is."""


def _numbers(bound: BoundElement, model: Model) -> Iterator[tuple[RawNumbers, int] | None]:
    if bound.is_pose:
        return
    for raw in raw_numbers(bound, model):
        turned = is_quaternion(raw, model)
        for index in range(len(raw.units or ())):
            yield (raw, index) if turned else None


def _parts_behind(
    facts: Facts,
    subsystem: str,
    text: ExpressionText,
    quaternion: Expr,
    index: int,
    raw: dict[str, _Numbers],
) -> set[tuple[str, RawNumbers]]:
    """The quaternions of the model whose number at an index reaches that of an expression."""
    scalar = ScalarExpr(subsystem, component(quaternion, index), text)
    reported = ReportedScalars(facts.definitions).of(scalar)
    return {
        (each.element, number[0])
        for each in reported
        if (number := _number(each, raw)) is not None and number[1] == index
    }


def _number(scalar: ReportedScalar, raw: dict[str, _Numbers]) -> tuple[RawNumbers, int] | None:
    numbers = raw.get(scalar.element, [])
    return numbers[scalar.index] if scalar.index < len(numbers) else None


def _directions(facts: Facts) -> Iterator[tuple[str, ExpressionText, Expr]]:
    """The quaternions that functions are given, with the subsystem and text that they stand in."""
    for subsystem in facts.subsystems:
        for text in texts(subsystem):
            for each in _directions_in(text.expr):
                yield subsystem.qualified_name, text, each
    for item in facts.system.formulas:
        for part in expressions(item.formula):
            for each in _directions_in(part):
                yield "", ExpressionText(part, item.place, ""), each


def _directions_in(expr: Expr) -> Iterable[Expr]:
    for node in walk(expr):
        if isinstance(node, Builtin) and (place := FUNCTIONS[node.name].direction) is not None:
            yield node.args[place]


def _another_order(
    facts: Facts, place: Place, quaternion: Expr, element: str, raw: RawNumbers
) -> Diagnostic:
    bound = next(b for b in facts.bindings if f"{b.binding.device}.{b.binding.element}" == element)
    binding = bound.binding
    shown = show(quaternion)
    written = f"[{', '.join(f'{shown}[{i}]' for i in (1, 2, 3, 0))}]"
    reorder = f"reorder it: `{written}`" if shown.replace(".", "").isidentifier() else "reorder it"
    bind = f"bind an element of type `pose[...]` to the position and `{raw.name}`, or "
    is_of_frame = isinstance(facts.model, Model) and is_orientation(raw, facts.model)
    return Diagnostic(
        "E0341",
        f"`{shown}` has the order w, x, y, z of {raw.kind.removesuffix('s')} `{raw.name}`, "
        "and x, y, z, w are taken",
        place,
        related=(Related(binding.place.below(raw.kind, raw.place), "gives w, x, y, z"),),
        help=(bind if is_of_frame else "") + reorder,
    )
