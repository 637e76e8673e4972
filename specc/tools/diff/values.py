"""Changes of what a subsystem is made of besides its machine: buffers, memory, lets, functions."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from specc.lang import show
from specc.model.expr import Expr
from specc.model.fsm import Function
from specc.model.system import Element, Safe, Subsystem
from specc.model.types import Bool
from specc.tools.diff.meaning import Meaning, type_text
from specc.tools.diff.record import Book, paired

Same = Callable[[Expr, Expr], bool]


def compare_buffers(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """Elements by direction, peer and name; their order says nothing."""
    before, after = _elements(old), _elements(new)
    compare_elements(before.items(), after.items(), meaning.same_value, book)
    ends = [
        {f"{p.direction}.{p.peer}": p.other_end for p in subsystem.ports}
        for subsystem in (old, new)
    ]
    for peer in sorted(ends[0].keys() & ends[1].keys()):
        book.changed("buffer", peer, "other end", ends[0][peer], ends[1][peer])


def compare_elements(
    old: Iterable[tuple[str, Element]], new: Iterable[tuple[str, Element]], same: Same, book: Book
) -> None:
    """Elements by their names, which come first in each pair."""
    pairs = paired(old, new, lambda item: item[0])
    for name, (_, element) in pairs.removed.items():
        book.removed("element", name, type_text(element.type))
    for name, (_, element) in pairs.added.items():
        book.added("element", name, type_text(element.type))
    for name, ((_, before), (_, after)) in pairs.both.items():
        book.changed("element", name, "type", type_text(before.type), type_text(after.type))
        _inits(name, before.init, after.init, same, book)
        ages = [_age(element) for element in (before, after)]
        book.changed("element", name, "greatest age", *ages, semantic=False)
        _safes(name, before.safe, after.safe, same, book)
        book.words("element", name, before, after)


def _age(element: Element) -> str:
    return "any" if element.max_age_s is None else f"{float(element.max_age_s):g} s"


def _inits(name: str, old: Expr | None, new: Expr | None, same: Same, book: Book) -> None:
    texts = [show(init) if init is not None else "no initial value" for init in (old, new)]
    equal = old is not None and new is not None and same(old, new)
    book.changed("element", name, "initial value", *texts, semantic=not equal)


def _safes(name: str, old: Safe | None, new: Safe | None, same: Same, book: Book) -> None:
    """What an element gets when a run ends, and if that fails."""
    for aspect, values in (
        ("safe value", [safe.value if safe else None for safe in (old, new)]),
        ("safe value if that fails", [safe.otherwise if safe else None for safe in (old, new)]),
    ):
        before, after = values
        texts = [show(value) if value is not None else "none" for value in values]
        equal = before is not None and after is not None and same(before, after)
        book.changed("element", name, aspect, *texts, semantic=not equal)


def _elements(subsystem: Subsystem) -> dict[str, Element]:
    return {
        f"{port.direction}.{port.peer}.{element.name}": element
        for port in subsystem.ports
        for element in port.elements
    }


def compare_memory(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """Memory elements by name."""
    pairs = paired(old.memory, new.memory, lambda m: m.name)
    for name, memory in pairs.removed.items():
        book.removed("memory", name, type_text(memory.type))
    for name, memory in pairs.added.items():
        book.added("memory", name, type_text(memory.type))
    for name, (before, after) in pairs.both.items():
        book.changed("memory", name, "type", type_text(before.type), type_text(after.type))
        _values("memory", name, "initial value", (before.init, after.init), meaning, book)
        book.words("memory", name, before, after)


def compare_lets(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """A let is a name for an expression; only adding or removing it changes nothing."""
    pairs = paired(old.lets, new.lets, lambda item: item.name)
    for name, item in pairs.removed.items():
        book.removed("let", name, show(item.value), semantic=False)
    for name, item in pairs.added.items():
        book.added("let", name, show(item.value), semantic=False)
    for name, (before, after) in pairs.both.items():
        _values("let", name, "value", (before.value, after.value), meaning, book)
        book.words("let", name, before, after)


def compare_parameters(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """What a reused description was given."""
    pairs = paired(old.constants, new.constants, lambda c: c.name)
    for name, constant in pairs.removed.items():
        book.removed("parameter", name, show(constant.value), semantic=False)
    for name, constant in pairs.added.items():
        book.added("parameter", name, show(constant.value), semantic=False)
    for name, (before, after) in pairs.both.items():
        _values("parameter", name, "value", (before.value, after.value), meaning, book)


def compare_functions(old: Subsystem, new: Subsystem, meaning: Meaning, book: Book) -> None:
    """A function matters in behaviours; adding or removing it shows in what they assign."""
    pairs = paired(old.functions, new.functions, lambda f: f.name)
    for name, function in pairs.removed.items():
        book.removed("function", name, _targets(function), semantic=False)
    for name, function in pairs.added.items():
        book.added("function", name, _targets(function), semantic=False)
    for name, (before, after) in pairs.both.items():
        targets = paired(before.assignments, after.assignments, lambda a: a.target)
        for target, assignment in targets.removed.items():
            book.changed("function", name, target, show(assignment.value), "not assigned")
        for target, assignment in targets.added.items():
            book.changed("function", name, target, "not assigned", show(assignment.value))
        for target, (first, second) in targets.both.items():
            _values("function", name, target, (first.value, second.value), meaning, book)
        book.words("function", name, before, after)


def _targets(function: Function) -> str:
    return ", ".join(sorted(a.target for a in function.assignments))


def _values(
    part: str, name: str, aspect: str, values: tuple[Expr, Expr], meaning: Meaning, book: Book
) -> None:
    """Two expressions of one thing."""
    old, new = values
    texts = show(old), show(new)
    if isinstance(old.type, Bool) and isinstance(new.type, Bool):
        book.verdict(part, name, meaning.compare([old], [new]), texts, aspect)
        return
    book.equality(part, name, aspect, texts, meaning.same_value(old, new))
