"""What a binding has to name: what is commanded moves actuators, what is reported is measured."""

from __future__ import annotations

from specc.facts.bindings import Bound
from specc.model.system import Binding
from specc.model.types import Image, Real, Spatial, Type, Vector

_OF_A_MODEL = (
    "joints", "sensors", "actuators", "camera", "image", "noise", "depth_noise", "through",
)  # fmt: skip

_OF_SAMPLES = ("rate_hz", "sporadic", "max_gap_s")


def wrong_kind(bound: Bound) -> tuple[str, str] | None:
    """What is wrong with the kind of a binding, and a way out; None if nothing is."""
    if not bound.plant:
        return None
    if not bound.commanded and (complaint := _sampled(bound.binding)):
        return complaint
    if bound.plant == "python":
        return _in_python(bound)
    return _commanded(bound) if bound.commanded else _reported(bound)


def _sampled(binding: Binding) -> tuple[str, str] | None:
    """Of samples it is said when they come, or that this is not known."""
    if binding.sporadic and binding.rate_hz is not None:
        return (
            "samples of a sporadic device have no rate: its readers ask in each of their periods",
            "delete `rate`; `max_gap` says for how long there may be no new sample",
        )
    if binding.max_gap_s is not None and not binding.sporadic:
        return "`max_gap` is for sporadic devices", "add `sporadic: true`, or delete `max_gap`"
    return None


def _in_python(bound: Bound) -> tuple[str, str] | None:
    """A plant in Python gives and takes the elements themselves."""
    name = bound.element.name
    modelled = _named(bound.binding, _OF_A_MODEL)
    if modelled:
        return (
            f"`{modelled}` is for MuJoCo models; the plant in Python "
            f"{'takes' if bound.commanded else 'gives'} `{name}` itself",
            f"delete `{modelled}`",
        )
    return _command_measured(bound, _OF_SAMPLES)


def _commanded(bound: Bound) -> tuple[str, str] | None:
    binding, name = bound.binding, bound.element.name
    if not binding.actuators:
        return f"`{name}` is commanded, but moves no actuator", "add `actuators: [...]`"
    kinds = ("sensors", "camera", "image", "noise", "depth_noise")
    return _command_measured(bound, (*kinds, *_OF_SAMPLES)) or _type_without_through(bound)


def _command_measured(bound: Bound, kinds: tuple[str, ...]) -> tuple[str, str] | None:
    measured = _named(bound.binding, kinds) if bound.commanded else ""
    if not measured:
        return None
    return (
        f"`{bound.element.name}` is commanded: `{measured}` is for what a device reports",
        f"delete `{measured}`",
    )


def _reported(bound: Bound) -> tuple[str, str] | None:
    binding, name = bound.binding, bound.element.name
    numbers = _named(binding, ("joints", "sensors", "actuators"))
    if binding.camera:
        return _from_camera(bound, numbers)
    if not numbers:
        return (
            f"`{name}` is reported, but comes from nowhere",
            "add `joints:`, `sensors:` or `camera:`",
        )
    if binding.image:
        return f"`image` of `{name}` needs a camera", "add `camera:`"
    return _type_without_through(bound)


def _from_camera(bound: Bound, numbers: str) -> tuple[str, str] | None:
    binding, type_ = bound.binding, bound.element.type
    if numbers:
        return f"a camera stands alone, without `{numbers}`", f"delete `{numbers}` or `camera`"
    if not binding.image:
        return "a camera gives two images", "add `image: rgb` or `image: depth`"
    if binding.through:
        return None
    channels = 3 if binding.image == "rgb" else 1
    if not isinstance(type_, Image):
        return f"a camera gives an image, not {type_}", "add `through:` a function that makes one"
    if type_.channels != channels:
        fitting = f"image[{type_.height}, {type_.width}, {channels}]"
        given = "1 channel" if channels == 1 else f"{channels} channels"
        message = f"an image of kind {binding.image} has {given}, not {type_.channels}"
        return message, f'choose the other kind of image, or make the type "{fitting}"'
    return None


def _type_without_through(bound: Bound) -> tuple[str, str] | None:
    if bound.binding.through or _is_numbers(bound.element.type):
        return None
    message = f"the plant deals in real numbers, not in {bound.element.type}"
    return message, "name a function under `through:` that converts"


def _is_numbers(type_: Type) -> bool:
    if isinstance(type_, Vector):
        return isinstance(type_.element, Real)
    return isinstance(type_, (Real, Spatial))


def _named(binding: Binding, names: tuple[str, ...]) -> str:
    """The first of these keys that the binding has, as the file spells it."""
    found = (name for name in names if getattr(binding, name))
    spelt = {"rate_hz": "rate", "depth_noise": "noise", "max_gap_s": "max_gap"}
    return spelt.get(name := next(found, ""), name)
