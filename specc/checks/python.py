"""Python that a specification names is there, as far as it can be told without running any."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.machinery import ModuleSpec

from specc.analysis import Facts
from specc.analysis.python import lacks
from specc.diagnostics import Diagnostic
from specc.model.system import System, types_used
from specc.model.types import Opaque, Record
from specc.source import Place


def names_defined(facts: Facts) -> Iterator[Diagnostic]:
    """W0241, once for each object that is named."""
    folder = os.path.dirname(facts.system.file)
    known: dict[str, ModuleSpec | None] = {}
    for python, place in dict(_named(facts.system)).items():
        if lacks(python, folder, known):
            module, _, name = python.partition(":")
            yield Diagnostic(
                "W0241",
                f"the module `{module}` does not define `{name}`",
                place,
                help="correct the name, or define it in the module",
            )


def _named(system: System) -> Iterator[tuple[str, Place]]:
    """What is named, and where."""
    for operator in system.operators:
        yield operator.python, operator.place.below("python")
    places = {named.name: named.place for named in system.types}
    for type_ in types_used(system):
        if isinstance(type_, Record | Opaque) and type_.name in places:
            place = places[type_.name]
            yield type_.python, place.below("python")
            if isinstance(type_, Opaque):
                verbs = zip(("encode", "decode"), type_.codec, strict=False)
                yield from ((codec, place.below("codec", verb)) for verb, codec in verbs)
    if system.plant is not None:
        yield system.plant.python, system.plant.place.below("python")
        for binding in system.plant.bindings:
            yield binding.through, binding.place.below("through")
    if system.task is not None:
        yield system.task.scene, system.task.place.below("scene")
        yield system.task.judge, system.task.place.below("judge")


CHECKS = (names_defined,)
