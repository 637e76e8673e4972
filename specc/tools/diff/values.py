"""Changes of what a subsystem is made of besides its machine: buffers, memory, lets, functions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

from specc.lang import show
from specc.model.expr import Expr
from specc.model.fsm import Assignment, Function
from specc.model.system import Constant, Element, Let, Subsystem
from specc.model.types import Bool
from specc.tools.diff.meaning import Equivalence, type_text
from specc.tools.diff.record import Book, Compared, Guarantee, paired

Same = Callable[[Expr, Expr], bool]
Named = TypeVar("Named", Constant, Let)


def compare_buffers(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """Elements by direction, peer and name; their order says nothing."""
    before, after = _elements(old), _elements(new)
    compare_elements(before.items(), after.items(), meaning.same_value, book)
    ends = [
        {f"{p.direction}.{p.peer}": p.other_end for p in subsystem.ports}
        for subsystem in (old, new)
    ]
    for peer in sorted(ends[0].keys() & ends[1].keys()):
        book.both("buffer", peer).changed("other end", ends[0][peer], ends[1][peer])


def compare_elements(
    old: Iterable[tuple[str, Element]], new: Iterable[tuple[str, Element]], same: Same, book: Book
) -> None:
    """Elements by their names, which come first in each pair."""
    both = book.matched("element", old, new, lambda e: e[0], lambda e: type_text(e[1].type))
    for element, (_, before), (_, after) in both:
        element.changed("type", type_text(before.type), type_text(after.type))
        inits = before.init, after.init
        _optional(element, "initial value", inits, "no initial value", same)
        _guaranteed(element, before, after)
        for aspect, key in (("safe value", "value"), ("safe value if that fails", "otherwise")):
            values = (getattr(before.safe, key, None), getattr(after.safe, key, None))
            if None in values and key == "otherwise" and None in (before.safe, after.safe):
                continue  # told of the safe value
            less, more = values[1] is None, values[0] is None
            _optional(element, aspect, values, "none", same, less, more)
        element.rest(before, after, "max_age_s", "event")


def _guaranteed(element: Compared, old: Element, new: Element) -> None:
    """How old values may be, and whether none of them may be missed."""
    ages = [math.inf if e.max_age_s is None else e.max_age_s for e in (old, new)]
    texts = _age(old), _age(new)
    if ages[0] != ages[1]:
        element.guarded("greatest age", texts, ages[1] > ages[0], ages[1] < ages[0])
    texts = str(old.event), str(new.event)
    element.guarded("event", texts, old.event, new.event)


def _age(element: Element) -> str:
    return "any" if element.max_age_s is None else f"{float(element.max_age_s):g} s"


def _optional(
    element: Compared,
    aspect: str,
    values: tuple[Expr | None, Expr | None],
    absent: str,
    same: Same,
    less: bool = False,
    more: bool = False,
) -> None:
    """Two expressions of an element, either of which may be `absent`."""
    old, new = values
    texts = [absent if value is None else show(value) for value in values]
    equal = (old is None and new is None) or (
        old is not None and new is not None and same(old, new)
    )
    guarantee: Guarantee = "weaker" if less and not more else "stronger" if more else ""
    if texts[0] != texts[1] or not equal:
        # The same text may have another value, by what it refers to.
        note = "" if texts[0] != texts[1] else "; what it refers to has changed"
        element.changed(aspect, texts[0], texts[1] + note, semantic=not equal, guarantee=guarantee)


def _elements(subsystem: Subsystem) -> dict[str, Element]:
    return {
        f"{port.direction}.{port.peer}.{element.name}": element
        for port in subsystem.ports
        for element in port.elements
    }


def compare_memory(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """Memory elements by name."""
    both = book.matched(
        "memory", old.memory, new.memory, lambda m: m.name, lambda m: type_text(m.type)
    )
    for memory, before, after in both:
        memory.changed("type", type_text(before.type), type_text(after.type))
        _values(memory, "initial value", (before.init, after.init), meaning)
        memory.rest(before, after)


def compare_lets(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """A let is a name for an expression; only adding or removing it changes nothing."""
    for let, before, after in named_values("let", old.lets, new.lets, book):
        _values(let, "value", (before.value, after.value), meaning)
        let.rest(before, after)


def named_values(
    part: str, old: Iterable[Named], new: Iterable[Named], book: Book
) -> list[tuple[Compared, Named, Named]]:
    """Names for expressions, which matter where they are used; returns those in both systems."""
    return book.matched(part, old, new, lambda n: n.name, lambda n: show(n.value), semantic=False)


def compare_parameters(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """What a reused description was given."""
    for parameter, before, after in named_values("parameter", old.constants, new.constants, book):
        _values(parameter, "value", (before.value, after.value), meaning)


def compare_functions(old: Subsystem, new: Subsystem, meaning: Equivalence, book: Book) -> None:
    """A function matters in behaviours; adding or removing it shows in what they assign."""
    both = book.matched(
        "function", old.functions, new.functions, lambda f: f.name, _targets, semantic=False
    )
    for function, before, after in both:
        targets = paired(before.assignments, after.assignments, lambda a: a.target)
        unassigned(function, targets.removed.values(), targets.added.values())
        for target, (first, second) in targets.both.items():
            _values(function, target, (first.value, second.value), meaning)
        function.rest(before, after, "is_complete")


def unassigned(thing: Compared, removed: Iterable[Assignment], added: Iterable[Assignment]) -> None:
    """What a thing does not assign any more, and what it did not before."""
    for each in removed:
        thing.changed(each.target, show(each.value), "not assigned")
    for each in added:
        thing.changed(each.target, "not assigned", show(each.value))


def _targets(function: Function) -> str:
    return ", ".join(sorted(a.target for a in function.assignments))


def _values(thing: Compared, aspect: str, values: tuple[Expr, Expr], meaning: Equivalence) -> None:
    """Two expressions of one thing."""
    old, new = values
    texts = show(old), show(new)
    if isinstance(old.type, Bool) and isinstance(new.type, Bool):
        thing.verdict(meaning.compare_values(old, new), texts, aspect)
        return
    thing.equality(aspect, texts, meaning.same_value(old, new))
