"""Errors of measurement in disturbances fit the numbers that are measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from specc.analysis import Facts
from specc.analysis.plant import BoundElement, raw_numbers, units_of
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import counted
from specc.mjcf import Model
from specc.model.task import Deed, Verb
from specc.model.units import Unit
from specc.resolve.context import suggestion

Units = tuple[Unit | None, ...]
"""Of the numbers that are measured, None where the model does not say."""


def errors_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0503, E0517; scales are known to be without a unit."""
    task = facts.system.task
    for each in task.disturbances if task and facts.system.plant else ():
        for verb, deed in each.of("measurement"):
            yield from _error(verb, deed, facts)


def _error(verb: Verb, deed: Deed, facts: Facts) -> Iterator[Diagnostic]:
    element = deed.name
    if (known := facts.reported.get(element)) is None:
        help = suggestion(element, sorted(facts.reported))
        yield Diagnostic("E0503", f"no device reports `{element}`", deed.place, help=help)
    elif (fault := _no_numbers(known)) is not None:
        related = (Related(known.binding.place, "bound here"),)
        message = f"`{element}` cannot be {verb.done}: {fault}"
        help = "name an element of which numbers are measured"
        yield Diagnostic("E0517", message, deed.place, related=related, help=help)
    elif (units := _units(known, facts)) is not None:
        of = f"`{element}`, before its `through`," if known.binding.through else f"`{element}`"
        yield from _fitting(verb, of, deed, units)


def _no_numbers(bound: BoundElement) -> str | None:
    """Why what is measured is not made of real numbers; None where it is."""
    if bound.binding.camera:
        return "a camera measures it"
    is_raw = bound.plant == "model" and bound.binding.through
    if is_raw or units_of(bound.element.type) is not None:
        return None
    return f"it is `{bound.element.type}`"


def _units(bound: BoundElement, facts: Facts) -> Units | None:
    """Of what is measured, before `through`; None if not even its numbers are counted."""
    if not bound.binding.through:
        return units_of(bound.element.type)
    if not isinstance(facts.model, Model):
        return None
    found: Units = ()
    for raw in raw_numbers(bound, facts.model):
        if raw.units is None:
            return None
        found += raw.units
    return found


def _fitting(verb: Verb, of: str, deed: Deed, units: Units) -> Iterator[Diagnostic]:
    draws = deed.numbers
    if len(draws) not in (1, len(units)):
        message = f"{counted(len(units), 'number')} of {of} cannot be {verb.done} by {len(draws)}"
        help = (
            "give one number for all, or one for each; one that is drawn is `[[least, greatest]]`"
        )
        yield Diagnostic("E0517", message, replace(deed.place, part="value"), help=help)
        return
    several = len(draws) == 1 < len(units)
    for index, wanted in enumerate(() if verb.unit else units):
        draw = draws[0 if several else index]
        if wanted is not None and (given := draw.misfit(wanted)):
            mixed = several and len(set(units)) > 1
            name = f"number {index} of {of}" if len(units) > 1 else of
            help = f"write a number with that unit, e.g. `0.1[{wanted}]`"
            help = "their units differ: give one number for each" if mixed else help
            place = replace(draw.place, part="value")
            yield Diagnostic("E0517", f"{name} is in {wanted}, not in {given}", place, help=help)
            return


CHECKS = (errors_fit,)
