"""Compares two systems: pairs their parts by name and compares all fields of each pair."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from math import inf
from typing import Any, Literal

from specc.analysis.plant import widget_text
from specc.diagnostics.phrases import in_ms
from specc.lang import show
from specc.model.bindings import PLANT, Binding
from specc.model.expr import Node
from specc.model.fsm import Behaviour, Condition, Function, State, Trace
from specc.model.requirement import FormulaLet, Requirement
from specc.model.scenario import Scenario
from specc.model.system import (
    Agent,
    Constant,
    Device,
    Element,
    Let,
    Memory,
    Operator,
    Plant,
    Subsystem,
    System,
)
from specc.model.task import Disturbance, Draw, Task
from specc.model.types import Type
from specc.tools.diff.changes import ChangeLog, Comparison, Guarantee, PartLog, Verdict
from specc.tools.diff.equivalence import (
    Constants,
    Equivalence,
    Version,
    compare_constants,
    compare_types,
    type_text,
)
from specc.tools.diff.machines import MachineDiff


def compare(old: System, new: System) -> Comparison:
    """All changes from `old` to `new`; neither has errors in it."""
    log = ChangeLog()
    diff = SystemDiff((old, new), log, Constants(old.constants, new.constants))
    diff.fields(log.part("system"), old, new)
    return Comparison(tuple(log.changes))


@dataclass(frozen=True, slots=True)
class SystemDiff:
    """Compares the parts of two systems, or of an agent, device or subsystem of both."""

    systems: tuple[System, System]
    log: ChangeLog
    values: Constants | Equivalence
    """Compares expressions: those of the system or a device, or those of a subsystem."""

    def fields(self, part: PartLog, old: Any, new: Any) -> None:
        """Compare all fields of two parts, by their types or as `_FIELDS` says."""
        rules = _FIELDS.get(type(old), {})
        for item in fields(old):
            if item.name in rules:
                continue
            stem, _, unit = item.name.rpartition("_")
            aspect = stem if unit in ("hz", "s") else _ASPECTS.get(item.name, item.name)
            both = getattr(old, item.name), getattr(new, item.name)
            if any(isinstance(value, Node) for value in both):
                part.compare_expressions(aspect, *both, self.values.compare, f"no {aspect}")
            elif isinstance(both[0], Type):
                part.changed(aspect, *map(type_text, both))
            elif all(map(_is_plain, both)):
                if item.name in _REMARKS:
                    part.remark(aspect, *both)
                else:
                    part.changed(aspect, *(_plain_text(value, unit) for value in both))
        for rule in rules.values():
            if rule is not None:
                rule(self, part, old, new)

    @property
    def constants(self) -> Constants:
        """Compares expressions of the whole system."""
        return Constants(*(system.constants for system in self.systems))

    @property
    def machine(self) -> MachineDiff:
        """Compares the machine of a subsystem."""
        assert isinstance(self.values, Equivalence)
        return MachineDiff(self.log, self.values, self.fields)

    def parts(self, label: str, versions: Iterable[Mapping[str, Any]]) -> None:
        """Compare parts of one kind by their names."""
        text, semantic = _PARTS[label]
        for part, one, other in self.log.pair(label, versions, text, semantic=semantic):
            diff = self._diff_of_part(part.name, one, other)
            diff.fields(diff.log.part(label, part.name), one, other)

    def _diff_of_part(self, name: str, old: object, new: object) -> SystemDiff:
        """The diff of an agent, device or subsystem, whose changes are reported under its name."""
        (one, other), values = self.systems, self.values
        if isinstance(old, Device) and isinstance(new, Device):
            values = Constants((*one.constants, *old.constants), (*other.constants, *new.constants))
        elif isinstance(old, Subsystem) and isinstance(new, Subsystem):
            values = Equivalence(Version(one, old), Version(other, new))
        elif not isinstance(old, Agent):
            return self
        return replace(self, log=self.log.at(name), values=values)


_REMARKS = ("title", "symbol", "trace")
"""Fields that have no influence on what an agent does."""
_ASPECTS = {"message": "type", "init": "initial value"}
"""How fields are named in messages, unless by their own name without the unit."""


def _is_plain(value: object) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_plain, value))
    return value is None or isinstance(value, (str, int, float, Fraction, Trace))


def _plain_text(value: object, unit: str = "") -> str:
    """A plain value; a number of `s` in ms, one of `hz` in Hz."""
    if isinstance(value, Fraction):
        return in_ms(value) if unit == "s" else f"{float(value):g} Hz"
    if isinstance(value, tuple):
        parts = (": ".join(map(str, v)) if isinstance(v, tuple) else str(v) for v in value)
        return ", ".join(parts) or "none"
    return "none" if value is None or value == "" else str(value)


# The system, its agents and their devices.

_FieldRule = Callable[[SystemDiff, PartLog, Any, Any], None]
"""Compares something of two parts."""


def _readable(name: str) -> str:
    """A name in the system for a reader: `F of lib/arm.yaml` for `F@lib/arm.yaml`."""
    return name.replace("@", " of ", 1).replace("#", " with ", 1)


def _name(part: Any) -> str:
    return _readable(getattr(part, "qualified_name", "") or part.name)


def _parts(label: str, field: str, name: Callable[[Any], str] = _name) -> _FieldRule:
    """Compares the parts in a field by their names, or the one that is in it."""

    def named(owner: object) -> dict[str, Any]:
        found = getattr(owner, field)
        if isinstance(found, tuple):
            return {name(part): part for part in found if _is_written(part)}
        return {} if found is None else {"": found}

    return lambda diff, _, old, new: diff.parts(label, map(named, (old, new)))


def _is_written(part: object) -> bool:
    """Whether a part stands in a file: what modes remember follows from what asks for it."""
    return not isinstance(part, (Memory, Let)) or part.name.isidentifier()


def _texts(label: str, field: str) -> _FieldRule:
    """Compares texts by their names."""

    def compare_texts(diff: SystemDiff, _: PartLog, old: System, new: System) -> None:
        both = ({_readable(name): text for name, text in getattr(s, field)} for s in (old, new))
        for part, before, after in diff.log.pair(label, both, str, semantic=False):
            part.changed("", before, after, semantic=label == "file")

    return compare_texts


def _text(aspect: str, read: Callable[[Any], object], *, semantic: bool = True) -> _FieldRule:
    return lambda _, part, old, new: part.changed(aspect, read(old), read(new), semantic=semantic)


def _signature(operator: Operator) -> str:
    """Without the names of parameters, which only their reader needs."""
    parameters = ", ".join(type_text(type) for _, type in operator.parameters)
    return f"({parameters}) -> {type_text(operator.result)}"


def _compare_silence(_: SystemDiff, device: PartLog, old: Device, new: Device) -> None:
    """For how long the agent may be silent; nobody knows whether the default is longer or not."""
    one, other = old.silence_s, new.silence_s
    texts = ("the default" if s is None else f"{float(s):g} s" for s in (one, other))
    is_known = one is not None and other is not None
    device.changed(
        "silence", *texts, guarantee=_effect_on_guarantee(one, other) if is_known else ""
    )


def _effect_on_guarantee(old: Any, new: Any) -> Guarantee:
    """`weaker` if the value has grown, `stronger` if it has shrunk.

    Where more is better, callers swap the arguments.
    """
    return "weaker" if new > old else "stronger" if new < old else ""


# Buffers and functions of subsystems.


def _compare_ports(diff: SystemDiff, _: PartLog, old: Subsystem, new: Subsystem) -> None:
    elements = (
        {f"{port.direction}.{port.peer}.{e.name}": e for port in s.ports for e in port.elements}
        for s in (old, new)
    )
    diff.parts("element", elements)
    before, after = ({f"{p.direction}.{p.peer}": p.other_end for p in s.ports} for s in (old, new))
    for name in sorted(before.keys() & after.keys()):
        diff.log.part("buffer", name).changed("other end", before[name], after[name])


def _compare_guarantees(diff: SystemDiff, part: PartLog, old: Element, new: Element) -> None:
    """How old values may be, whether none may be missed, and what a device gets at the end."""
    ages = [inf if e.max_age_s is None else e.max_age_s for e in (old, new)]
    texts = ("any" if age == inf else f"{float(age):g} s" for age in ages)
    part.changed("greatest age", *texts, guarantee=_effect_on_guarantee(*ages))
    part.changed(
        "event", old.event, new.event, guarantee=_effect_on_guarantee(new.event, old.event)
    )
    safe = old.safe, new.safe
    for aspect, key in (("safe value", "value"), ("safe value if that fails", "otherwise")):
        if key == "value" or None not in safe:
            both = [getattr(each, key, None) for each in safe]
            guarantee = _effect_on_guarantee(both[0] is None, both[1] is None)
            compare = diff.values.compare
            part.compare_expressions(aspect, both[0], both[1], compare, guarantee=guarantee)


def _compare_assignments(diff: SystemDiff, part: PartLog, old: Function, new: Function) -> None:
    before, after = ({a.target: a.value for a in f.assignments} for f in (old, new))
    for target in sorted(before.keys() | after.keys()):
        both = before.get(target), after.get(target)
        part.compare_expressions(target, *both, diff.values.compare, "not assigned")


def _compare_functions(diff: SystemDiff, _: PartLog, old: Subsystem, new: Subsystem) -> None:
    """Functions by their names; calls that only one has are those of its behaviours."""
    before, after = ({f.name: f for f in s.functions} for s in (old, new))
    both = before.keys() & after.keys()
    named = ({n: f for n, f in of.items() if "(" not in n or n in both} for of in (before, after))
    diff.parts("function", named)


# The plant, the task and the requirements.


def _compare_observed(diff: SystemDiff, _: PartLog, old: Plant, new: Plant) -> None:
    before, after = ({e.name: type_text(e.type) for e in plant.observed} for plant in (old, new))
    for name in sorted(before.keys() & after.keys()):
        diff.log.part("binding", f"{PLANT}.{name}").changed("type", before[name], after[name])


def _compare_panel(_: SystemDiff, part: PartLog, old: Binding, new: Binding) -> None:
    texts = ("none" if each.panel is None else widget_text(each.panel) for each in (old, new))
    part.changed("panel", *texts)


def _compare_given(key: str, field: str) -> _FieldRule:
    """Compare the value that a binding gives to its element."""

    def compare(_: SystemDiff, part: PartLog, old: Binding, new: Binding) -> None:
        before, after = (getattr(each, field) for each in (old, new))
        if before is None or after is None:
            part.changed(key, *("none" if i is None else show(i.expr) for i in (before, after)))
        else:
            part.changed(key, before.value, after.value)

    return compare


_Meaning = tuple[object, str, frozenset[str]]
"""A meaning, its text, and the names for parts of formulas in the text."""
_NONE: _Meaning = None, "none", frozenset()


def _compare_task(diff: SystemDiff, _: PartLog, old: Task, new: Task) -> None:
    _compare_circumstances(diff, old, new)


def _compare_circumstances(diff: SystemDiff, old: Task | Scenario, new: Task | Scenario) -> None:
    """What a run begins with and what happens meanwhile."""
    values = diff.constants
    starts = ({draw.name: draw for draw in one.starts} for one in (old, new))
    for part, *draws in diff.log.pair("start", starts, _draw_text):
        _compare_meanings(part, "", *map(_draw, draws))
    disturbances = (_by_effect(one.disturbances) for one in (old, new))
    for part, one, other in diff.log.pair("disturbance", disturbances, lambda d: d.because):
        before, after = _aspects(one, values, 0), _aspects(other, values, 1)
        for aspect in sorted({*before, *after}):
            _compare_meanings(part, aspect, before.get(aspect, _NONE), after.get(aspect, _NONE))
        part.remark("because", one.because, other.because)


def _compare_meanings(part: PartLog, aspect: str, old: _Meaning, new: _Meaning) -> None:
    """Constants that are used have their own changes: the same text is equal."""
    same = old[0] == new[0] or old[1:] == new[1:]
    part.verdict(Verdict(same), (old[1], new[1]), aspect)


def _by_effect(disturbances: Iterable[Disturbance]) -> dict[str, Disturbance]:
    """Multiset of disturbances by effect."""
    count: Counter[str] = Counter()
    found = {}
    for each in disturbances:
        count[each.subject] += 1
        times = count[each.subject]
        found[each.subject if times == 1 else f"{each.subject} ({times})"] = each
    return found


def _aspects(
    disturbance: Disturbance, values: Constants, version: Literal[0, 1]
) -> dict[str, _Meaning]:
    """The condition and the drawn numbers of a disturbance, by aspect; not its reason."""
    found: dict[str, _Meaning] = {}
    if disturbance.when:
        form = values.canonical_form(disturbance.when, version)
        found["when"] = form, disturbance.when.that, disturbance.when.names
    draws = [
        ("", disturbance.times),
        *((f"{action.verb} ", action.numbers) for action in disturbance.actions),
    ]
    return found | {f"{verb}{d.name}": _draw(d) for verb, numbers in draws for d in numbers}


def _draw(draw: Draw) -> _Meaning:
    return (draw.values, draw.is_range), _draw_text(draw), frozenset()


def _draw_text(draw: Draw) -> str:
    texts = [show(text) for text in draw.texts]
    return f"{texts[0]} to {texts[1]}" if draw.is_range else " or ".join(texts)


def _compare_requirements(diff: SystemDiff, _: PartLog, old: System, new: System) -> None:
    """Requirements by their texts; one with another text and another meaning by its name."""
    values = diff.constants
    texts = {r.that for r in old.requirements}
    forms = {values.canonical_form(r, 0): r.that for r in old.requirements}
    old_texts = {r.that: r.that for r in new.requirements}
    for item in new.requirements:
        if item.that not in texts:
            old_texts[item.that] = forms.get(values.canonical_form(item, 1), item.that)
    common = texts & {*old_texts.values()}

    def named(system: System) -> dict[str, Requirement]:
        found = {}
        for item in system.requirements:
            that = old_texts.get(item.that, item.that)
            found[item.name if item.name and that not in common else that] = item
        return found

    lost: dict[str, Any] = {"guarantee": "weaker", "note": "runs are no longer watched for it"}
    pairs = diff.log.pair(
        "requirement",
        map(named, (old, new)),
        lambda item: item.because,
        removed=lost,
        added={"guarantee": "stronger"},
    )
    for requirement, one, other in pairs:
        if one.that == other.that:
            # Constants, and what names for parts stand for, have their own changes.
            same = one.names == other.names or values.is_same_formula(one, other)
            requirement.verdict(Verdict(same), (one.that, other.that), "formula")
        else:
            requirement.changed("formula", one.that, old_texts[other.that])
        requirement.remark("name", one.name, other.name)
        requirement.remark("because", one.because, other.because)


def _compare_contracts(diff: SystemDiff, _: PartLog, old: System, new: System) -> None:
    """Contracts of devices by their names; proofs rest on them, and runs are watched for them."""
    pairs = diff.log.pair(
        "contract",
        tuple({item.name: item for item in system.contracts} for system in (old, new)),
        lambda item: " ".join(item.text.split()),
    )
    for contract, one, other in pairs:
        same = diff.constants.is_same_formula(one, other)
        contract.verdict(Verdict(same), (one.that, other.that), "formula")
        contract.remark("because", one.because, other.because)


def _compare_scenarios(diff: SystemDiff, _: PartLog, old: System, new: System) -> None:
    both = ({scenario.name: scenario for scenario in system.scenarios} for system in (old, new))
    lost: dict[str, Any] = {"guarantee": "weaker", "note": "nobody tries it any more"}
    pairs = diff.log.pair(
        "scenario",
        both,
        lambda scenario: scenario.because,
        removed=lost,
        added={"guarantee": "stronger"},
    )
    for part, one, other in pairs:
        for aspect, text in _OF_SCENARIOS.items():
            part.changed(aspect, text(one), text(other))
        part.remark("because", one.because, other.because)
        _compare_circumstances(replace(diff, log=diff.log.at(part.name)), one, other)


_OF_SCENARIOS: dict[str, Callable[[Scenario], str]] = {
    "set": lambda scenario: _plain_text(tuple(sorted(scenario.settings))),
    "undisturbed": lambda scenario: str(scenario.is_undisturbed),
    "seeds": lambda scenario: _plain_text(scenario.seeds),
    "duration": lambda scenario: _plain_text(scenario.duration_s),
    "cycles": lambda scenario: _plain_text(scenario.cycles),
    "expect": lambda scenario: "; ".join(formula.that for formula in scenario.expect),
    "success": lambda scenario: _plain_text(scenario.success),
}
"""What is compared of two scenarios by its text, by aspect."""


def _compare_formula(diff: SystemDiff, part: PartLog, old: FormulaLet, new: FormulaLet) -> None:
    """What a name for a part of formulas stands for; formulas with that name change by it."""
    if old.formula and new.formula:
        same = diff.constants.is_same_formula(old.formula, new.formula)
    else:
        same = bool(old.value and new.value and diff.values.compare(old.value, new.value).same)
    part.verdict(Verdict(same), (_let_text(old), _let_text(new)), "formula")


def _let_text(item: FormulaLet | Let | Constant) -> str:
    if isinstance(item, FormulaLet) and item.formula:
        return item.formula.that
    value = getattr(item, "initial", None) or item.value
    return show(value) if value else ""


# The tables: how parts are shown, and which of their fields are not compared by their types.

_PARTS: dict[str, tuple[Callable[[Any], str], bool]] = {
    "agent": (lambda agent: agent.title, True),
    "device": (lambda device: device.kind.replace("_", " "), True),
    "subsystem": (lambda subsystem: subsystem.kind.replace("_", " "), True),
    "constant": (_let_text, False),
    "parameter": (_let_text, False),
    "let": (_let_text, False),
    "operator": (_signature, False),
    "element": (lambda element: type_text(element.type), True),
    "memory": (lambda memory: type_text(memory.type), True),
    "function": (lambda f: ", ".join(sorted(a.target for a in f.assignments)), False),
    "state": (lambda state: state.behaviour.name, True),
    "plant": (lambda p: p.model or p.python or (p.ros2.node if p.ros2 else ""), True),
    "ros2": (lambda ros2: ros2.node, True),
    "binding": (lambda _: "", True),
    "task": (lambda task: f"{task.subsystem}: {task.source} to {task.target}", True),
}
"""By the name in messages: the text of a part that only one system has, and whether adding or
removing it changes the meaning; if not, its uses tell."""
_FIELDS: dict[type, dict[str, _FieldRule | None]] = {
    System: {
        **dict.fromkeys(("file", "folders", "description_uses")),
        "frames": _texts("frame", "frames"),
        "files": _texts("file", "files"),
        "constants": _parts("constant", "constants"),
        "types": lambda diff, _, old, new: compare_types(old, new, diff.log),
        "operators": _parts("operator", "operators"),
        "agents": _parts("agent", "agents"),
        "plant": _parts("plant", "plant"),
        "task": _parts("task", "task"),
        "requirements": _compare_requirements,
        "contracts": _compare_contracts,
        "formula_lets": _parts("let", "formula_lets"),
        "scenarios": _compare_scenarios,
    },
    Constant: {
        "value": lambda diff, part, old, new: compare_constants(old, new, part, diff.values),
        **dict.fromkeys(("bounds", "initial")),
    },
    Operator: {
        "name": None,
        "parameters": _text("signature", _signature),
        "result": None,
        "python": _text("function", lambda operator: operator.python),
    },
    Agent: {
        "kind": _text("kind", lambda agent: agent.kind, semantic=False),
        "devices": _parts("device", "devices"),
        "subsystems": _parts("subsystem", "subsystems"),
    },
    Device: {
        "constants": _parts("parameter", "constants"),
        "x": _parts("element", "x", lambda element: f"x.{element.name}"),
        "y": _parts("element", "y", lambda element: f"y.{element.name}"),
        "silence_s": _compare_silence,
    },
    Element: {"max_age_s": _compare_guarantees, "safe": None, "event": None},
    Subsystem: {
        **dict.fromkeys(("has_rate", "has_initial_state", "generics")),
        "rate_hz": _text("rate", lambda s: f"{s.rate_hz} Hz" if s.has_rate else "not known"),
        "ports": _compare_ports,
        "constants": _parts("parameter", "constants"),
        "memory": _parts("memory", "memory"),
        "lets": _parts("let", "lets"),
        "conditions": lambda diff, _, old, new: diff.machine.conditions(old, new),
        "functions": _compare_functions,
        "behaviours": lambda diff, _, old, new: diff.machine.behaviours(old, new),
        "states": _parts("state", "states"),
        "modes": lambda diff, _, old, new: diff.machine.modes(old, new),
        "initial_state": lambda diff, _, old, new: diff.machine.initial_states(old, new),
        "transitions": lambda diff, _, old, new: diff.machine.rows(old, new),
        "axioms": lambda diff, _, old, new: diff.machine.assumptions(old, new),
    },
    Condition: {"when": lambda diff, *parts: diff.machine.when(*parts)},
    Function: {"assignments": _compare_assignments, **dict.fromkeys(("is_complete", "generic"))},
    Behaviour: {
        "functions": lambda diff, *parts: diff.machine.effects(*parts),
        **dict.fromkeys(("is_complete", "generic", "arguments")),
    },
    State: {
        **dict.fromkeys(("ignores", "holds", "modes")),
        "behaviour": lambda diff, *parts: diff.machine.behaviour(*parts),
    },
    Plant: {
        "ros2": _parts("ros2", "ros2"),
        "published": _text("publish", lambda p: _plain_text(tuple(e.name for e in p.published))),
        "bindings": _parts("binding", "bindings", lambda b: f"{b.device}.{b.element}"),
        "observed": _compare_observed,
    },
    Binding: {
        "panel": _compare_panel,
        "initial": _compare_given("init", "initial"),
        "on_loss": _compare_given("on_loss", "on_loss"),
    },
    Task: {"disturbances": _compare_task},
    FormulaLet: {"formula": _compare_formula, "value": None},
}
