"""Resolves scenarios, and puts a system into one of them for a run."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from specc.lang import ExprError
from specc.limits import MAX_DURATION_S, MAX_SEEDS
from specc.model.requirement import Requirement
from specc.model.scenario import Scenario
from specc.model.system import System
from specc.model.types import Real
from specc.model.units import SECOND
from specc.resolve.context import SetValues, YamlNode
from specc.resolve.expressions import known_number
from specc.resolve.library import Loaded, constant_scope
from specc.resolve.requirements import FormulaResolver
from specc.resolve.simulation import DisturbanceReader, starts_of
from specc.schema.files import ScenarioDef

_SEEDS = re.compile(r"\s*(\d{1,9})\s*(?:\.\.\s*(\d{1,9})\s*)?", re.ASCII)
_SUCCESS = re.compile(r"\s*(\d{1,6})\s+of\s+(\d{1,6})\s*", re.ASCII)


def resolve_scenarios(
    file: Loaded, formulas: FormulaResolver, reader: DisturbanceReader, given: SetValues
) -> tuple[Scenario, ...]:
    """The scenarios of a file; what is wrong in them is reported.

    All that can be set is known by now to the `given` values.
    """
    scenarios = _ScenarioReader(formulas, reader, given, has_task=file.spec.task is not None)
    where = file.top["scenarios"]
    return tuple(
        scenarios.scenario(name, item, where[name]) for name, item in file.spec.scenarios.items()
    )


@dataclass(frozen=True, slots=True)
class _ScenarioReader:
    formulas: FormulaResolver
    reader: DisturbanceReader
    given: SetValues
    has_task: bool

    def scenario(self, name: str, item: ScenarioDef, where: YamlNode) -> Scenario:
        """One scenario, without the parts that have errors."""
        because = " ".join(item.because.split())
        expressions = self.reader.expressions
        for key in ("panel", "disturb", "scene", "cycles", "undisturbed"):
            if key in item.given_keys and not self.has_task:
                message = f"`{key}` of a scenario needs a task"
                way = "add `task:` with the transition that ends a cycle"
                self._report(where[key], message, way, part="key")
                break
        if item.cycles is not None and not 1 <= item.cycles <= _MOST_CYCLES:
            message = f"a scenario has 1 to {_MOST_CYCLES} cycles"
            self._report(where["cycles"], message, "leave `cycles` out for one cycle")
        own = self.reader.disturbances(item.disturb, where["disturb"])
        own += self.reader.disturbances(item.panel, where["panel"], because)
        scene = starts_of(item.scene, where["scene"], expressions, SetValues())
        return Scenario(
            name,
            because,
            tuple(self._settings(item, where["set"])),
            tuple(scene),
            own,
            item.undisturbed,
            self._seeds(item, where["seeds"]),
            self._duration(item, where["duration"]),
            item.cycles,
            tuple(self._expect(item, where["expect"], because)),
            self._success(item, where["success"]),
            where.key,
        )

    def _settings(self, item: ScenarioDef, where: YamlNode) -> Iterator[tuple[str, str]]:
        """What is set; a value is compared with its constant, and later where it is used."""
        expressions, definitions = self.reader.expressions, self.reader.expressions.definitions
        findings = expressions.findings
        for name, text in item.settings.items():
            yield name, text
            constant = definitions.constants.get(name)
            findings.use(definitions.places.get(f"constant {name}"), where, name, part="key")
            if name not in self.given.units and name not in definitions.broken:
                what = "parameter" if "." in name else "constant"
                known = [other for other in self.given.units if ("." in other) == ("." in name)]
                findings.unknown("E0201", what, name, known, where[name].key)
                continue
            at, scope = where[name], constant_scope(definitions)
            if constant is not None:
                expressions.value(at, text, scope, constant.value.type, constant.place)
            else:
                expressions.inside(at, text, scope)

    def _seeds(self, item: ScenarioDef, where: YamlNode) -> tuple[int, ...]:
        found: dict[int, None] = {}
        for index, text in enumerate(item.seeds):
            at = where[index]
            match = _SEEDS.fullmatch(text)
            ends = [int(number) for number in match.groups() if number] if match else []
            if ends and ends[0] > ends[-1]:
                way = f"write the first one first: `{ends[-1]}..{ends[0]}`"
                self._report(at, f"`{text}` is an empty range of seeds", way)
            elif not ends:
                way = "write one or several of up to nine digits, e.g. `3` or `0..9`"
                self._report(at, f"`{text}` is no seed, and no range of seeds", way)
            elif ends[-1] - ends[0] + len(found) >= MAX_SEEDS:
                self._report(at, f"a scenario has at most {MAX_SEEDS} seeds", "name fewer")
            else:
                found |= dict.fromkeys(range(ends[0], ends[-1] + 1))
        return tuple(found)

    def _duration(self, item: ScenarioDef, where: YamlNode) -> float | None:
        if item.duration is None:
            return None
        expressions = self.reader.expressions
        definitions = expressions.definitions
        expr = expressions.value(where, item.duration, constant_scope(definitions), Real(SECOND))
        if expr is None:
            return None
        try:
            duration_s = known_number(expr, definitions.constants, _CODE)
        except ExprError as error:
            expressions.report(where, item.duration, error)
            return None
        if duration_s <= 0:
            self._report(where, "a run takes some time", "write how long it is, e.g. `8[s]`")
            return None
        if duration_s > MAX_DURATION_S:
            message = f"a run of a scenario takes at most {MAX_DURATION_S} s"
            self._report(where, message, "write how long it is, e.g. `8[s]`")
            return None
        return duration_s

    def _expect(self, item: ScenarioDef, where: YamlNode, because: str) -> Iterator[Requirement]:
        first: dict[str, YamlNode] = {}
        for index, text in enumerate(item.expect):
            at = where[index]
            found = self.formulas.requirement(text, because, at)
            if found is None:
                continue
            if first.setdefault(found.that, at) is not at:
                self._report(at, "this is expected already", "delete one of the two")
            yield found

    def _success(self, item: ScenarioDef, where: YamlNode) -> tuple[int, int] | None:
        if item.success is None:
            return None
        match = _SUCCESS.fullmatch(item.success)
        required, of = map(int, match.groups()) if match else (0, 0)
        if not 1 <= required <= of:
            message = f"`{item.success}` is no share of runs"
            self._report(where, message, "write how many of how many pass, e.g. `9 of 10`")
            return None
        return required, of

    def _report(self, at: YamlNode, message: str, help: str, part: str = "value") -> None:
        place = at.key if part == "key" else at.place
        self.reader.expressions.findings.report(_CODE, message, place, help=help)


_CODE = "E0525"
_MOST_CYCLES = 1_000_000


def settings_of(file: Loaded | None, scenario: str) -> Mapping[str, YamlNode]:
    """What a scenario of a file sets, by name, each at its place; nothing if there is none."""
    if file is None or scenario not in file.spec.scenarios:
        return {}
    where = file.top["scenarios"][scenario]["set"]
    return {name: where[name] for name in file.spec.scenarios[scenario].settings}


def in_scenario(system: System, scenario: Scenario) -> System:
    """The system as runs of a scenario have it; what it sets is in the system already.

    What is expected is required of these runs, unless the same is required anyway.
    """
    required = {each.that for each in system.requirements}
    expected = tuple(each for each in scenario.expect if each.that not in required)
    task = system.task
    if task is not None:
        starts = {draw.name: draw for draw in (*task.starts, *scenario.starts)}
        usual = () if scenario.is_undisturbed else task.disturbances
        task = replace(
            task,
            starts=tuple(starts.values()),
            disturbances=usual + scenario.disturbances,
        )
    requirements = (*system.requirements, *expected)
    return replace(system, task=task, requirements=requirements, scenarios=())
