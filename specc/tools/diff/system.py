"""Differences between two systems: agents, buffers, definitions, plant and task."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Literal, TypeVar

from specc.lang import show
from specc.model.binding import PLANT
from specc.model.requirement import FormulaLet, Requirement
from specc.model.system import Agent, Device, Operator, Plant, Subsystem, System
from specc.model.task import Disturbance, Draw
from specc.tools.diff.machine import (
    compare_axioms,
    compare_behaviours,
    compare_conditions,
    compare_rows,
    compare_states,
)
from specc.tools.diff.meaning import Constants, Equivalence, Version, compare_types, type_text
from specc.tools.diff.record import Book, Compared, Comparison, Difference, Thing, paired, shown
from specc.tools.diff.values import (
    compare_buffers,
    compare_elements,
    compare_functions,
    compare_lets,
    compare_memory,
    compare_parameters,
    named_values,
)

# Changes of the plant and of the task: what surrounds the agents.


Part = TypeVar("Part", Device, Subsystem)


def compare_plants(old: System, new: System, book: Book) -> None:
    """The model and what stands behind the devices."""
    for whole, one, other in _single("plant", old.plant, new.plant, _made, book):
        whole.rest(one, other)
        for ros2, node, again in _single("ros2", one.ros2, other.ros2, lambda r: r.node, book):
            ros2.rest(node, again)
        names = [shown(tuple(p.name for p in plant.published)) for plant in (one, other)]
        whole.changed("publish", *names)
        both = book.matched(
            "binding",
            one.bindings,
            other.bindings,
            lambda b: f"{b.device}.{b.element}",
            lambda _: "",
        )
        for binding, before, after in both:
            binding.rest(before, after)
        types = [{item.name: item.type for item in plant.observed} for plant in (one, other)]
        for name in types[0].keys() & types[1].keys():
            texts = [type_text(of[name]) for of in types]
            book.both("binding", f"{PLANT}.{name}").changed("type", *texts)


def _made(plant: Plant) -> str:
    return plant.model or plant.python or (plant.ros2.node if plant.ros2 else "")


def compare_tasks(old: System, new: System, book: Book) -> None:
    """What a run counts and judges."""
    values = Constants(old.constants, new.constants)
    for task, before, after in _single(
        "task", old.task, new.task, lambda t: f"{t.subsystem}: {t.source} to {t.target}", book
    ):
        task.rest(before, after)
        starts = book.matched("start", before.starts, after.starts, lambda s: s.name, _drawn)
        for joint, start, now_at in starts:
            _equality(joint, "", _draw(start), _draw(now_at))
        one, other = _counted(before.disturbances), _counted(after.disturbances)
        both = book.matched("disturbance", one, other, lambda c: c[0], lambda c: c[1].because)
        for each, (_, old_one), (_, new_one) in both:
            was, now = _said(old_one, values, 0), _said(new_one, values, 1)
            for aspect in sorted({*was, *now}):
                _equality(each, aspect, was.get(aspect), now.get(aspect))
            each.remark("because", old_one.because, new_one.because)


_Said = tuple[object, str, frozenset[str]]
"""A meaning, its text, and the names for parts of formulas in the text."""


def _equality(each: Compared, aspect: str, old: _Said | None, new: _Said | None) -> None:
    """Constants that are used have their own changes: what is written in the same way is equal."""
    nothing = None, "none", frozenset[str]()
    (meant, *text), (now, *written) = old or nothing, new or nothing
    same = meant == now or text == written
    each.equality(aspect, (str(text[0]), str(written[0])), same)


def _counted(disturbances: Iterable[Disturbance]) -> list[tuple[str, Disturbance]]:
    """Each with what it does; those that do the same are counted, as for what is drawn in runs."""
    count: Counter[str] = Counter()
    found = []
    for each in disturbances:
        count[each.subject] += 1
        times = count[each.subject]
        found.append((each.subject if times == 1 else f"{each.subject} ({times})", each))
    return found


def _said(each: Disturbance, values: Constants, version: Literal[0, 1]) -> dict[str, _Said]:
    """All of a disturbance but its reason."""
    said: dict[str, _Said] = {}
    if each.when:
        said["when"] = values.canonical_form(each.when, version), each.when.that, each.when.names
    of = [("", each.times), *((f"{deed.verb} ", deed.numbers) for deed in each.actions)]
    return said | {f"{verb}{draw.name}": _draw(draw) for verb, draws in of for draw in draws}


def _draw(draw: Draw) -> _Said:
    return (draw.values, draw.is_range), _drawn(draw), frozenset()


def _drawn(draw: Draw) -> str:
    texts = [show(text) for text in draw.texts]
    return f"{texts[0]} to {texts[1]}" if draw.is_range else " or ".join(texts)


def compare_requirements(old: System, new: System, book: Book) -> None:
    """What every run is watched for; what has another text and another meaning now, by its name."""
    values = Constants(old.constants, new.constants)
    again = _again(old.requirements, new.requirements, values)
    kept = {again.get(r.that, r.that) for r in new.requirements}
    kept &= {r.that for r in old.requirements}

    def called(item: Requirement) -> str:
        that = again.get(item.that, item.that)
        return item.name if item.name and that not in kept else that

    pairs = paired(old.requirements, new.requirements, called)
    for name, before in pairs.removed.items():
        note = "runs are no longer watched for it"
        book.alone("removed", "requirement", name, before.because, guarantee="weaker", note=note)
    for name, after in pairs.added.items():
        book.alone("added", "requirement", name, after.because, guarantee="stronger")
    for name, (before, after) in pairs.both.items():
        requirement = book.both("requirement", name)
        if before.that == after.that:
            # Constants, and what names for parts stand for, have their own changes.
            same = before.names == after.names or values.canonical_form(
                before, 0
            ) == values.canonical_form(after, 1)
            requirement.equality("formula", (before.that, after.that), same)
        else:
            requirement.changed("formula", before.that, again.get(after.that, after.that))
        requirement.remark("name", before.name, after.name)
        requirement.remark("because", before.because, after.because)
    _formula_lets(old, new, values, book)


def _again(
    before: Iterable[Requirement], after: Iterable[Requirement], values: Constants
) -> dict[str, str]:
    """New texts of requirements that say what an old one said, each with the old text."""
    texts = {r.that for r in before}
    meant = {values.canonical_form(r, 0): r.that for r in before}
    said = {r.that: values.canonical_form(r, 1) for r in after if r.that not in texts}
    return {that: meant[form] for that, form in said.items() if form in meant}


def _formula_lets(old: System, new: System, values: Constants, book: Book) -> None:
    """Names for parts of formulas; what becomes of formulas without one is said of these."""
    lets = old.formula_lets, new.formula_lets
    for let, one, other in book.matched(
        "let", *lets, lambda item: item.name, _stands_for, semantic=False
    ):
        if one.formula and other.formula:
            same = values.canonical_form(one.formula, 0) == values.canonical_form(other.formula, 1)
        else:
            same = bool(one.value and other.value and values.same(one.value, other.value))
        let.equality("formula", (_stands_for(one), _stands_for(other)), same)


def _stands_for(item: FormulaLet) -> str:
    return item.formula.that if item.formula else show(item.value) if item.value else ""


def _single(
    part: str, old: Thing | None, new: Thing | None, text: Callable[[Thing], str], book: Book
) -> list[tuple[Compared, Thing, Thing]]:
    """The part of both systems, of which each has at most one."""
    before, after = ([thing] if thing else [] for thing in (old, new))
    return book.matched(part, before, after, lambda _: "", text)


# Changes between two systems, agent by agent.


def compare(old: System, new: System) -> Comparison:
    """All changes from `old` to `new`; neither has errors in it."""
    book = Book()
    book.both("system", "").rest(old, new, "file", "frames", "files", "folders")
    _texts("frame", old.frames, new.frames, book, semantic=False)
    _texts("file", old.files, new.files, book, semantic=True)
    _constants(old, new, book)
    compare_types(old, new, book)
    _operators(old.operators, new.operators, book)
    changes = book.changes
    both = book.matched("agent", old.agents, new.agents, lambda a: a.name, lambda a: a.title)
    for agent, before, after in both:
        changes += _agent(agent.name, (old, before), (new, after))
    plant = Book()
    compare_plants(old, new, plant)
    compare_tasks(old, new, plant)
    compare_requirements(old, new, plant)
    return Comparison((*changes, *plant.changes))


def _texts(
    part: str,
    old: Iterable[tuple[str, str]],
    new: Iterable[tuple[str, str]],
    book: Book,
    *,
    semantic: bool,
) -> None:
    both = book.matched(part, old, new, lambda t: _told(t[0]), lambda t: t[1], semantic=False)
    for text, (_, before), (_, after) in both:
        text.changed("", before, after, semantic=semantic)


def _told(name: str) -> str:
    """A name in the system for a reader: `F of lib/arm.yaml` for `F@lib/arm.yaml`."""
    return name.replace("@", " of ", 1).replace("#", " with ", 1)


def _constants(old: System, new: System, book: Book) -> None:
    values = Constants(old.constants, new.constants)
    for constant, before, after in named_values("constant", old.constants, new.constants, book):
        texts = show(before.value), show(after.value)
        constant.equality("value", texts, values.same(before.value, after.value))
        constant.rest(before, after)


def _operators(old: Iterable[Operator], new: Iterable[Operator], book: Book) -> None:
    both = book.matched("operator", old, new, lambda o: _told(o.name), _signature, semantic=False)
    for operator, before, after in both:
        operator.changed("signature", _signature(before), _signature(after))
        operator.changed("function", before.python, after.python)
        operator.rest(before, after, "name", "python")


def _signature(operator: Operator) -> str:
    """Without the names of parameters, which only their reader needs."""
    parameters = ", ".join(type_text(type) for _, type in operator.parameters)
    return f"({parameters}) -> {type_text(operator.result)}"


def _agent(name: str, old: tuple[System, Agent], new: tuple[System, Agent]) -> list[Difference]:
    book = Book(name)
    (old_system, before), (new_system, after) = old, new
    agent = book.both("agent", name)
    agent.remark("kind", before.kind, after.kind)
    agent.rest(before, after, "kind")
    changes = book.changes
    for _, first, second in _parts("device", before.devices, after.devices, book):
        changes += _device((old_system, first), (new_system, second))
    for _, one, other in _parts("subsystem", before.subsystems, after.subsystems, book):
        changes += _subsystem(Version(old_system, one), Version(new_system, other))
    return changes


def _parts(
    part: str, old: Iterable[Part], new: Iterable[Part], book: Book
) -> list[tuple[Compared, Part, Part]]:
    return book.matched(
        part, old, new, lambda p: p.qualified_name, lambda p: p.kind.replace("_", " ")
    )


def _device(one: tuple[System, Device], other: tuple[System, Device]) -> list[Difference]:
    (old_system, old), (new_system, new) = one, other
    name = old.qualified_name
    book = Book(name)
    values = Constants(
        (*old_system.constants, *old.constants), (*new_system.constants, *new.constants)
    )
    device = book.both("device", name)
    device.rest(old, new, "silence_s")
    for parameter, was, now in named_values("parameter", old.constants, new.constants, book):
        texts = show(was.value), show(now.value)
        same = values.same(was.value, now.value)
        parameter.equality("value", texts, same)
    before, after = (
        [(f"{side}.{e.name}", e) for side in ("x", "y") for e in getattr(device, side)]
        for device in (old, new)
    )
    compare_elements(before, after, values.same, book)
    _silence(device, old, new)
    return book.changes


def _silence(device: Compared, old: Device, new: Device) -> None:
    """For how long the agent may be silent; nobody knows whether the default is longer or not."""
    first, second = old.silence_s, new.silence_s
    was, now = ("the default" if s is None else f"{float(s):g} s" for s in (first, second))
    if first is None or second is None:
        device.changed("silence", was, now)
    elif first != second:
        device.guarded("silence", (was, now), second > first, second < first)


def _subsystem(old: Version, new: Version) -> list[Difference]:
    before, after = old.subsystem, new.subsystem
    name = before.qualified_name
    book, meaning = Book(name), Equivalence(old, new)
    rates = (f"{s.rate_hz} Hz" if s.has_rate else "not known" for s in (before, after))
    subsystem = book.both("subsystem", name)
    subsystem.changed("rate", *rates)
    subsystem.rest(before, after, "rate_hz", "has_rate", "has_initial_state", "initial_state")
    for part in (
        compare_buffers, compare_parameters, compare_memory, compare_lets, compare_conditions,
        compare_functions, compare_behaviours, compare_states, compare_rows, compare_axioms,
    ):  # fmt: skip
        part(before, after, meaning, book)
    return book.changes
