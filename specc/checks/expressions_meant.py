"""Numbers and expressions are such as can be meant."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.expr import show
from specc.facts import Facts
from specc.facts.misfits import Misfit
from specc.model.expr import Binary, Builtin
from specc.model.system import Subsystem, System
from specc.source import Place

_CODES = {
    "tolerance": "E0330",
    "angle": "E0330",
    "quaternion": "E0331",
    "clamp": "W0332",
    "itself": "W0333",
}


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0330, E0331, W0332 and W0333, once where several uses have one origin."""
    found: dict[tuple[str, Place], list[Misfit]] = {}
    owners: list[Subsystem | System] = [system, *facts.subsystems]
    for owner in owners:
        for misfit in facts.misfits(owner).found:
            found.setdefault((_CODES[misfit.kind], _place(misfit)), []).append(misfit)
    for (code, place), misfits in found.items():
        message, help_text = _words(misfits[0])
        yield Diagnostic(code, message, place, "", tuple(_uses(place, misfits)), help_text)


def _place(misfit: Misfit) -> Place:
    if misfit.kind == "clamp":
        return misfit.text.place(misfit.expr)
    text, expr = misfit.origin
    return text.place(expr)


def _uses(place: Place, misfits: list[Misfit]) -> Iterator[Related]:
    """Where a number is used that is written down elsewhere, or is written down."""
    for misfit in misfits[:4]:
        text, expr = misfit.origin
        other = text.place(expr) if misfit.kind == "clamp" else misfit.text.place(misfit.because[0])
        if misfit.kind != "itself" and other.route != place.route:
            yield Related(other, "written here" if misfit.kind == "clamp" else "used here")


def _words(misfit: Misfit) -> tuple[str, str]:
    """What is wrong, and a way out."""
    first = show(misfit.because[0])
    match misfit.kind:
        case "tolerance":
            size = "zero" if misfit.number == 0 else "negative"
            return f"a tolerance that is {size}: nothing is ever near", "write how close is enough"
        case "angle":
            help_text = (
                "write a smaller angle; `near(position(X), position(Y), distance)` asks none"
            )
            return "every two orientations are within an angle of pi", help_text
        case "quaternion":
            help_text = "write x, y, z, w of a rotation, whose squares have the sum 1"
            return f"the length of this quaternion is {misfit.number:.4g}, not 1", help_text
        case "clamp":
            help_text = "the lower bound goes with `max`, the upper one with `min`"
            return f"the bounds are the wrong way round: the result is always `{first}`", help_text
    return _itself(misfit), "name what is meant in the place of one of the two"


def _itself(misfit: Misfit) -> str:
    one, other = map(show, misfit.because)
    if one != other:
        return f"`{one}` and `{other}` are the same"
    match misfit.expr:
        case Builtin(name="min" | "max" as name):
            return f"`{one}` stands twice in `{name}`"
        case Binary():
            return f"`{one}` is subtracted from itself"
    return f"`{one}` is compared with itself"
