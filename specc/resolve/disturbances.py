"""What happens to the plant while a run goes on, as the task says it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from specc.diagnostics.phrases import listed
from specc.model.requirement import Formula, Requirement, Temporal
from specc.model.task import VERBS, Deed, Disturbance, Draw, Verb
from specc.model.units import DIMENSIONLESS, SECOND, Unit
from specc.resolve.context import Findings, Where
from specc.resolve.definitions import Definitions
from specc.resolve.scene import draw_of
from specc.schema.files import DisturbanceDef, DrawDef

Condition = Callable[[str, Where], Requirement | None]
"""Reads a formula; None after reporting."""


def disturbances_of(
    items: Sequence[DisturbanceDef],
    where: Where,
    condition: Condition,
    findings: Findings,
    definitions: Definitions,
) -> tuple[Disturbance, ...]:
    """Those without errors; `specc.checks` compares them with model and bindings."""
    reader = _DisturbanceReader(condition, findings, definitions)
    found = (reader.disturbance(item, where[index]) for index, item in enumerate(items))
    return tuple(each for each in found if each is not None)


class _DisturbanceReader:
    def __init__(self, condition: Condition, findings: Findings, definitions: Definitions) -> None:
        self._condition = condition
        self._findings = findings
        self._definitions = definitions

    def disturbance(self, item: DisturbanceDef, at: Where) -> Disturbance | None:
        """One of them; None after reporting."""
        before = len(self._findings.diagnostics)
        found = Disturbance(
            " ".join(item.because.split()),
            self._time("at", item.at, at),
            self._when(item.when, at["when"]),
            self._time("every", item.every, at),
            self._probability(item.probability, at),
            self._time("lasts", item.lasts, at),
            tuple(self._deeds(item, at)),
            at.place,
        )
        self._refuse_idle(found, item, at)
        return found if len(self._findings.diagnostics) == before else None

    def _refuse_idle(self, found: Disturbance, item: DisturbanceDef, at: Where) -> None:
        """Report one that never begins, does nothing or has a time for nothing."""
        lasting = any(verb.lasts for verb, _ in found.of())
        if item.at is None and item.when is None:
            self._report(at, "a disturbance has no beginning", "add `at`, `when` or both")
        if not found.deeds:
            way = f"add {listed((f'`{verb}`' for verb in VERBS), 'or')}"
            self._report(at, "nothing happens in a disturbance", way)
        elif item.lasts is not None and not lasting:
            self._report(at["lasts"], "what is moved stays there", "delete `lasts`")
        if found.every is not None:
            self._refuse_overlap(found.every, found.lasts, lasting, at)

    def _refuse_overlap(self, every: Draw, lasts: Draw | None, lasting: bool, at: Where) -> None:
        """Report repetitions without time between, and those that begin before the last is over."""
        least_s = min(value for value, _ in every.values)
        if least_s <= 0:
            way = "say how much time is from one to the next, e.g. `5[s]`"
            self._report(at["every"], "there is no time between two repetitions", way)
        elif lasting and lasts is None:
            way = f"add `lasts`, of {least_s:g} s at most"
            self._report(at["every"], "what lasts to the end of the run is not repeated", way)
        elif lasts is not None and max(value for value, _ in lasts.values) > least_s:
            way = f"make `lasts` {least_s:g} s at most, or `every` longer"
            message = "a repetition begins before the one before is over"
            self._report(at["lasts"], message, way)

    def _when(self, text: str | None, at: Where) -> Requirement | None:
        found = None if text is None else self._condition(text, at)
        if found is not None and (wrong := untimely(found, "a disturbance", "begin")):
            self._report(at, *wrong)
        return found

    def _deeds(self, item: DisturbanceDef, at: Where) -> Iterator[Deed]:
        """What it does, verb by verb."""
        for verb in VERBS.values():
            given, own = getattr(item, verb.name), at[verb.name]
            for index, name in enumerate(given if verb.numbers == "none" else ()):
                yield Deed(verb.name, name, (), own[index].place)
            for name, numbers in given.items() if verb.numbers != "none" else ():
                drawn = tuple(self._numbers(verb, name, numbers, own[name]))
                yield Deed(verb.name, name, drawn, own[name].key)

    def _numbers(
        self, verb: Verb, name: str, given: DrawDef | Sequence[DrawDef], at: Where
    ) -> Iterator[Draw]:
        """The numbers of a subject, in the unit of the verb if that has one."""
        several = [given] if isinstance(given, DrawDef) else given
        for index, item in enumerate(several):
            part = f".{'xyz'[index]}" if verb.numbers == "force" else f"[{index}]"
            called = name + part if len(several) > 1 else name
            place = at[index] if several is given and isinstance(at.raw, list) else at
            draw = draw_of(called, item, place, self._findings, self._definitions)
            if draw is not None:
                if verb.unit is not None:
                    self._expect(draw, verb.unit, place)
                yield draw

    def _time(self, key: str, item: DrawDef | None, at: Where) -> Draw | None:
        found = self._number(key, item, SECOND, at)
        if found is not None and any(value < 0 for value, _ in found.values):
            self._report(at[key], "a time is not negative", "a run begins at 0[s]")
        return found

    def _number(self, key: str, item: DrawDef | None, unit: Unit, at: Where) -> Draw | None:
        if item is None:
            return None
        found = draw_of(key, item, at[key], self._findings, self._definitions)
        if found is not None:
            self._expect(found, unit, at[key])
        return found

    def _probability(self, item: DrawDef | None, at: Where) -> Draw | None:
        found = self._number("probability", item, DIMENSIONLESS, at)
        if found is not None and not all(0 <= value <= 1 for value, _ in found.values):
            way = "0.5 is every second time, on average"
            self._report(at["probability"], "a probability is a number from 0 to 1", way)
        return found

    def _expect(self, found: Draw, wanted: Unit, at: Where) -> None:
        if unit := found.misfit(wanted):
            way, needed = f"write it with its unit, e.g. `4[{wanted}]`", f"in {wanted}"
            if wanted == DIMENSIONLESS:
                way, needed = "write it without a unit, e.g. `0.5`", "without a unit"
            self._report(at, f"a number {needed} is needed here, not in {unit}", way)

    def _report(self, at: Where, message: str, help: str) -> None:
        self._findings.report("E0517", message, at.place, help=help)


def untimely(trigger: Requirement, what: str, does: str) -> tuple[str, str] | None:
    """Why nothing can be done as soon as a formula holds, and a way out; None where it can."""
    if trigger.lasts:
        return f"{what} cannot {does} when something holds always", "leave out `always`"
    if _looks_ahead(trigger.formula):
        way = "ask what was, with `once`, `historically` or `since`"
        return f"{what} cannot wait for what is to come", way
    return None


def _looks_ahead(formula: Formula) -> bool:
    if isinstance(formula, Temporal) and formula.op in ("within", "throughout"):
        return True
    return any(map(_looks_ahead, getattr(formula, "operands", ())))
