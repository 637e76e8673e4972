"""Which bodies of a model carry the frames of a specification, as far as it says so."""

from __future__ import annotations

from collections.abc import Mapping

from specc.model.expr import Call, ConstantRef, Expr, TextLiteral
from specc.model.system import System
from specc.model.types import Opaque, complete_type

_LOAD_ARM = "specc_runtime.operators.arms.model:load_arm"


def carriers(system: System) -> dict[str, str]:
    """By frames, the bodies or sites between which arms of the library are loaded.

    Nothing else in a specification says where a frame is in a model. A frame that would be in two
    places is left out.
    """
    loaders = {each.name for each in system.operators if each.python == _LOAD_ARM}
    found: dict[str, set[str]] = {}
    for subsystem in system.subsystems:
        known = {each.name: each.value for each in (*system.constants, *subsystem.constants)}
        for memory in subsystem.memory:
            init = memory.init
            kind = complete_type(memory.type)
            if not isinstance(init, Call) or init.operator not in loaders:
                continue
            if isinstance(kind, Opaque) and len(kind.frames) == 2:
                for frame, place in zip(kind.frames, init.args[1:3], strict=True):
                    found.setdefault(str(frame), set()).add(_text(place, known))
    return {frame: name for frame, (name, *others) in found.items() if name and not others}


def _text(value: Expr, known: Mapping[str, Expr]) -> str:
    """The text of an expression, or nothing."""
    if isinstance(value, ConstantRef):
        value = known.get(value.name, value)
    return value.value if isinstance(value, TextLiteral) else ""
