"""The sections on runs: the task, and disturbances."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from specc.diagnostics.phrases import join_words
from specc.lang import ExprError
from specc.lang.kinds import kind
from specc.model.bindings import Widget
from specc.model.expr import Expr, Truth
from specc.model.requirement import Requirement, has_future
from specc.model.system import Agent, Element, Plant, Subsystem
from specc.model.task import VERBS, Disturbance, DisturbanceAction, Draw, Subject, Task, Verb
from specc.model.types import Int, Real
from specc.model.units import DIMENSIONLESS, SECOND, Unit
from specc.resolve.context import Findings, SetValues, YamlNode
from specc.resolve.expressions import Expressions, known_value
from specc.resolve.library import constant_scope
from specc.resolve.plant import reported_elements
from specc.schema.desugar import Desugared
from specc.schema.files import (
    DrawDef,
    MomentDef,
    SceneDef,
    TaskDef,
)

ReadFormula = Callable[[str, YamlNode], Requirement | None]
"""Reads a formula; None after reporting."""


def resolve_task(
    definition: TaskDef,
    where: YamlNode,
    agents: tuple[Agent, ...],
    broken: Container[str],
    reader: DisturbanceReader,
    given: SetValues,
) -> Task:
    """Resolve the task with its disturbances; unknown names in it are reported.

    What is not in a subsystem that is `broken` may be missing only because of its errors.
    """
    cycle, expressions = definition.cycle, reader.expressions
    if cycle.of not in broken:
        _look_up(definition, where, agents, expressions.findings)
    scene = definition.scene or SceneDef()
    starts = tuple(starts_of(scene.starts, where["scene"], expressions, given))
    return Task(
        cycle.of,
        cycle.source,
        cycle.target,
        scene.scene_class or "",
        definition.judge or "",
        tuple(definition.watch),
        where.key,
        starts,
        reader.disturbances(definition.disturb, where["disturb"]),
    )


def _look_up(
    definition: TaskDef, where: YamlNode, agents: tuple[Agent, ...], findings: Findings
) -> None:
    """Note agent and subsystem, states and memory that the task names; report unknown names."""
    subsystems = {s.qualified_name: s for a in agents for s in a.subsystems}
    cycle, at = definition.cycle, where["cycle"]
    subsystem = subsystems.get(cycle.of)
    if subsystem is None:
        if cycle.of in {f"{agent.name}.control" for agent in agents}:
            help = f"it is called `{cycle.of.removesuffix('control')}c`"
            message = f"no subsystem is called `{cycle.of}`"
            findings.report("E0201", message, at["of"].place, help=help)
            return
        findings.unknown("E0201", "subsystem", cycle.of, subsystems, at["of"].place)
        return
    size = len(subsystem.agent)
    agent = next(agent for agent in agents if agent.name == subsystem.agent)
    findings.use(agent.place, at, "of", start=0, end=size)
    findings.use(subsystem.place, at, "of", start=size + 1, end=len(cycle.of))
    states = {s.name: s.place for s in subsystem.states}
    for name, key in ((cycle.source, "from"), (cycle.target, "to")):
        findings.use(states.get(name), at, key)
        if name not in states:
            findings.unknown("E0201", "state", name, states, at[key].place)
    if cycle.source in states and cycle.target in states:
        _report_no_row(subsystem, definition, at, findings)
    memory = {m.name: m.place for m in subsystem.memory}
    for index, name in enumerate(definition.watch):
        findings.use(memory.get(name), where, "watch", index)
        if name not in memory:
            place = where["watch"][index].place
            findings.unknown("E0201", "memory element", name, memory, place)


def _report_no_row(
    subsystem: Subsystem, definition: TaskDef, at: YamlNode, findings: Findings
) -> None:
    """Report E0514; a state without any row that can end is reported as unfinished."""
    source, target = definition.cycle.source, definition.cycle.target
    targets = dict.fromkeys(row.target for row in subsystem.transitions if row.source == source)
    when = subsystem.state(source).behaviour.terminal.when
    if target in targets or not (targets or (isinstance(when, Truth) and not when.value)):
        return
    known = ", ".join(f"`{name}`" for name in targets)
    findings.report(
        "E0514",
        f"no row leads from `{source}` to `{target}`: no cycle would ever be counted",
        at["to"].place,
        help=f"from `{source}` rows lead to {known}"
        if known
        else f"no row leads out of `{source}`",
    )


# Numbers that are drawn from the seed of a run, and what the scene of a task says of joints.


_FORMS = "write a number with its unit, `[least, greatest]` or `{one_of: [...]}`"


def starts_of(
    starts: Mapping[str, DrawDef], where: YamlNode, expressions: Expressions, given: SetValues
) -> Iterator[Draw]:
    """Where joints are when a run begins; `specc.checks` compares them with the model."""
    for name, item in starts.items():
        at = where[name]
        written = next((text for text, _ in _texts(item, at) if "[" in text), "")
        if other := given.of(f"scene.{name}", written):
            item = DrawDef.model_construct(fixed=str(other.raw))
            at = replace(other, raw=Desugared({"is": other.raw}, {"is": other.route}))
        start = draw_of(name, item, at, expressions)
        if start is not None:
            yield start


def draw_of(
    name: str,
    item: DrawDef,
    at: YamlNode,
    expressions: Expressions,
    element: Element | None = None,
) -> Draw | None:
    """Resolve a number that is drawn, with its unit; None after reporting.

    Values that an element gets may be truth values and members of enums.
    """
    findings, texts = expressions.findings, list(_texts(item, at))
    if not texts or item.given_keys - {"for"} not in _GIVEN:
        findings.report("E0516", f"it is not clear what `{name}` is", at.place, help=_FORMS)
        return None
    found = [_number(text, place, expressions, element) for text, place in texts]
    known = [number for number in found if number is not None]
    if len(known) < len(found):
        return None
    between = item.least is not None
    if between and known[0][1] > known[1][1]:
        message = f"the least value of `{name}` is greater than the greatest"
        findings.report("E0516", message, at.place, help="write the least one first")
        return None
    values = tuple((value, unit) for _, value, unit in known)
    return Draw(name, values, tuple(expr for expr, _, _ in known), between, at.key)


_GIVEN = ({"is"}, {"from", "to"}, {"one_of"})


def _texts(item: DrawDef, at: YamlNode) -> Iterator[tuple[str, YamlNode]]:
    """Yield the texts of the numbers from which a draw is made, each with its node."""
    if item.fixed is not None:
        yield item.fixed, at["is"]
    for text, key in ((item.least, "from"), (item.greatest, "to")):
        if text is not None:
            yield text, at[key]
    for index, text in enumerate(item.one_of):
        yield text, at["one_of"][index]


def _number(
    text: str, at: YamlNode, expressions: Expressions, element: Element | None
) -> tuple[Expr, float, Unit] | None:
    """An expression with its value and unit; None after reporting."""
    definitions = expressions.definitions
    declared = (None, None) if element is None else (element.type, element.place)
    expr = expressions.value(at, text, constant_scope(definitions), *declared)
    if expr is None:
        return None
    if element is None and not isinstance(expr.type, Real | Int):
        help = "write a number with its unit, e.g. `0.3[m]`"
        expressions.findings.report("E0516", f"`{text}` is not a number", at.place, help=help)
        return None
    try:
        value = known_value(expr, definitions.constants, "E0516")
    except ExprError as error:
        expressions.report(at, text, error)
        return None
    words = kind(expr.type).words(expr.type)
    number = float(words.index(str(value)) if words else value)
    return expr, number, expr.type.unit if isinstance(expr.type, Real) else DIMENSIONLESS


# What happens to the plant while a run goes on.


@dataclass(frozen=True, slots=True)
class DisturbanceReader:
    """Resolves disturbances; `specc.checks` compares them with model and bindings."""

    condition: ReadFormula
    expressions: Expressions
    panel: Mapping[str, tuple[Widget, Element]]
    """What is on the panel, with the elements that it sets, by their names."""

    def disturbances(
        self, items: Sequence[MomentDef], at: YamlNode, because: str = ""
    ) -> tuple[Disturbance, ...]:
        """Those without errors; `because` is the reason of one that gives none."""
        found = [self._disturbance(item, at[i], because) for i, item in enumerate(items)]
        return tuple(disturbance for disturbance in found if disturbance is not None)

    def _disturbance(self, item: MomentDef, at: YamlNode, because: str) -> Disturbance | None:
        """The resolved disturbance, or None after reporting."""
        diagnostics = self.expressions.findings.diagnostics
        before = len(diagnostics)
        found = Disturbance(
            " ".join((getattr(item, "because", "") or because).split()),
            self._time("at", item.at, at),
            self._trigger(item.when, at["when"]),
            self._time("every", item.every, at),
            self._probability(item.probability, at),
            self._time("lasts", item.lasts, at),
            tuple(self._actions(item, at)),
            at.place,
            self._time("delay", item.delay, at),
        )
        self._refuse_idle(found, item, at)
        return found if len(diagnostics) == before else None

    def _refuse_idle(self, found: Disturbance, item: MomentDef, at: YamlNode) -> None:
        """Report a disturbance that never begins, does nothing or has a useless duration."""
        has_duration = any(action.has_duration for action in found.actions)
        if item.at is None and item.when is None:
            self._report(at, "a disturbance has no beginning", "add `at`, `when` or both")
        if item.delay is not None and item.when is None:
            way = "add `when`, or let it begin later by `at`"
            self._report(at["delay"], "a delay is counted from when something holds", way)
        if not found.actions:
            verbs = (f"`{verb}`" for verb in VERBS if hasattr(item, verb))
            way = f"add {join_words(verbs, 'or')}"
            self._report(at, "nothing happens in a disturbance", way)
        elif item.lasts is not None and not has_duration:
            last = [verb for verb, _ in found.actions_on()][-1]
            words = _STAYS.get(last.subject, f"what is {last.participle} stays so")
            self._report(at["lasts"], words, "delete `lasts`")
        if found.every is not None:
            self._refuse_overlap(found.every, found.duration, has_duration, at)

    def _refuse_overlap(
        self, every: Draw, lasts: Draw | None, has_duration: bool, at: YamlNode
    ) -> None:
        """Report repetitions without time between, and those that begin before the last is over."""
        least_s = min(value for value, _ in every.values)
        if least_s <= 0:
            way = "say how much time is from one to the next, e.g. `5[s]`"
            self._report(at["every"], "there is no time between two repetitions", way)
        elif has_duration and lasts is None:
            way = f"add `lasts`, of {least_s:g} s at most"
            self._report(at["every"], "what lasts to the end of the run is not repeated", way)
        elif lasts is not None and max(value for value, _ in lasts.values) > least_s:
            way = f"make `lasts` {least_s:g} s at most, or `every` longer"
            message = "a repetition begins before the one before is over"
            self._report(at["lasts"], message, way)

    def _trigger(self, text: str | None, at: YamlNode) -> Requirement | None:
        found = None if text is None else self.condition(text, at)
        if found is not None and (wrong := why_untimely(found, "a disturbance", "begin")):
            self._report(at, *wrong)
        return found

    def _actions(self, item: MomentDef, at: YamlNode) -> Iterator[DisturbanceAction]:
        """The actions of a disturbance, verb by verb."""
        for verb in VERBS.values():
            given, own = getattr(item, verb.name, ()), at[verb.name]
            for index, written in enumerate(given if verb.numbers == "none" else ()):
                place, lasts, name = own[index].place, verb.has_duration, written
                if verb.subject == "button":
                    name = self._element(written)
                    lasts = self.panel[name][0].hold if name in self.panel else lasts
                yield DisturbanceAction(verb.name, name, (), place, lasts)
            for written, numbers in given.items() if given and verb.numbers != "none" else ():
                name = self._element(written) if verb.subject == "control" else written
                drawn = tuple(self._numbers(verb, name, numbers, own[written]))
                if verb.subject == "constant":
                    self._note_constant(name, own)
                yield DisturbanceAction(
                    verb.name, name, drawn, own[written].key, has_duration=verb.has_duration
                )

    def _element(self, name: str) -> str:
        """The whole name of an element of the panel, of which the last word is enough if no other
        one has it.
        """
        found = [each for each in self.panel if each.rpartition(".")[2] == name]
        return found[0] if len(found) == 1 else name

    def _note_constant(self, name: str, at: YamlNode) -> None:
        """Note the constant of that name; one that there is not is reported."""
        definitions, findings = self.expressions.definitions, self.expressions.findings
        findings.use(definitions.places.get(f"constant {name}"), at, name, part="key")
        if name not in definitions.constants and name not in definitions.broken:
            live = [known.name for known in definitions.constants.values() if known.initial]
            findings.unknown("E0201", "constant", name, live, at[name].key)

    def _numbers(
        self, verb: Verb, name: str, given: DrawDef | Sequence[DrawDef], at: YamlNode
    ) -> Iterator[Draw]:
        """The numbers of a subject, in the unit of the verb if that has one."""
        if verb.subject == "control":
            yield from self._turned(name, given, at)
            return
        several = [given] if isinstance(given, DrawDef) else given
        for index, item in enumerate(several):
            part = f".{'xyz'[index]}" if verb.numbers == "force" else f"[{index}]"
            called = name + part if len(several) > 1 else name
            place = at[index] if several is given else at
            draw = self._draw(called, item, verb.unit, place)
            if draw is not None:
                yield draw

    def _turned(
        self, name: str, given: DrawDef | Sequence[DrawDef], at: YamlNode
    ) -> Iterator[Draw]:
        """The value that an element of the panel gets; none of what is not there, as checks say."""
        if name in self.panel and isinstance(given, DrawDef):
            draw = draw_of(name, given, at, self.expressions, self.panel[name][1])
            if draw is not None:
                yield draw

    def _time(self, key: str, item: DrawDef | None, at: YamlNode) -> Draw | None:
        found = self._draw(key, item, SECOND, at[key])
        if found is not None and any(value < 0 for value, _ in found.values):
            self._report(at[key], "a time is not negative", "a run begins at 0[s]")
        return found

    def _probability(self, item: DrawDef | None, at: YamlNode) -> Draw | None:
        found = self._draw("probability", item, DIMENSIONLESS, at["probability"])
        if found is not None and not all(0 <= value <= 1 for value, _ in found.values):
            way = "0.5 is every second time, on average"
            self._report(at["probability"], "a probability is a number from 0 to 1", way)
        return found

    def _draw(
        self, name: str, item: DrawDef | None, wanted: Unit | None, at: YamlNode
    ) -> Draw | None:
        """A number in the wanted unit, if there is one; None after reporting."""
        found = None if item is None else draw_of(name, item, at, self.expressions)
        if found is not None and wanted is not None and (unit := found.first_other_unit(wanted)):
            way, needed = f"write it with its unit, e.g. `4[{wanted}]`", f"in {wanted}"
            if wanted == DIMENSIONLESS:
                way, needed = "write it without a unit, e.g. `0.5`", "without a unit"
            self._report(at, f"a number {needed} is needed here, not in {unit}", way)
        return found

    def _report(self, at: YamlNode, message: str, help: str) -> None:
        self.expressions.findings.report("E0517", message, at.place, help=help)


def disturbance_reader(
    condition: ReadFormula,
    expressions: Expressions,
    agents: Iterable[Agent],
    plant: Plant | None,
) -> DisturbanceReader:
    """What resolves the disturbances of a system; `condition` reads what they wait for."""
    reported, bindings = reported_elements(agents), plant.bindings if plant else ()
    panel = {
        b.name: (b.panel, reported[b.name]) for b in bindings if b.panel and b.name in reported
    }
    return DisturbanceReader(condition, expressions, panel)


_STAYS: dict[Subject, str] = {
    "coordinate": "what is moved stays there",
    "distance": "what is moved stays there",
    "button": "a button without `hold` is pressed once",
}
"""Why what is done to a subject has no duration."""


def why_untimely(trigger: Requirement, what: str, does: str) -> tuple[str, str] | None:
    """Why no action can follow a formula at once, and a help text; None if one can."""
    if trigger.holds_always:
        return f"{what} cannot {does} when something holds always", "leave out `always`"
    if has_future(trigger.formula):
        way = "ask what was, with `once`, `historically` or `since`"
        return f"{what} cannot wait for what is to come", way
    return None
