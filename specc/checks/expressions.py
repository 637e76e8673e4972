"""Expressions that are well typed and cannot be meant; names and targets of functions."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts
from specc.analysis.reads import texts
from specc.analysis.suspicious_expressions import SuspiciousExpression
from specc.diagnostics import Diagnostic, Related
from specc.lang import RESERVED, show
from specc.lang.builtins import FUNCTIONS
from specc.model.expr import Binary, Builtin, Choice, Lag, Logic, walk
from specc.model.fsm import Assignment
from specc.model.requirement import expressions_in
from specc.model.system import Constant, Let, Memory, OuterName
from specc.source import Place

# Constants that arithmetic gives have a value.


def constants_have_values(facts: Facts) -> Iterator[Diagnostic]:
    """E0334, for a constant whose arithmetic has no result."""
    for constant, why in facts.constants_without_value:
        message = f"`{show(constant.value)}` has no value: {why}"
        yield Diagnostic("E0334", message, constant.place, help="write another number")


# Who can be late.


def lateness_of_subsystems(facts: Facts) -> Iterator[Diagnostic]:
    """E0339, for `late(...)` of a measurement: a device has no periods."""
    for subsystem in facts.subsystems:
        for text in texts(subsystem):
            for node in walk(text.expr):
                if not isinstance(node, Lag) or node.name != "late":
                    continue
                if facts.wires.measuring_device(subsystem.qualified_name, node.input.peer):
                    message = f"`{show(node.input)}` comes from a device, which has no periods"
                    help = f"ask how old the measurement is: `age({show(node.input)})`"
                    yield Diagnostic("E0339", message, text.place(node), help=help)


# Numbers and expressions make sense.


_CODES = {
    "tolerance": "E0330",
    "angle": "E0330",
    "turn": "W0342",
    "quaternion": "E0331",
    "axis": "E0331",
    "bounds": "W0332",
    "itself": "W0333",
    "unchanged": "W0338",
    "fails": "W0340",
    "fails in range": "W0340",
}


def expressions_meant(facts: Facts) -> Iterator[Diagnostic]:
    """E0330, E0331, W0332, W0333, W0338, W0340, W0342: once where several uses have one origin."""
    every = (facts.suspicious, *(machine.suspicious for machine in facts.machines))
    found: dict[tuple[str, Place], list[SuspiciousExpression]] = {}
    for each in (each for suspicious in every for each in suspicious.all):
        text, expr = (each.text, each.expr) if each.kind == "bounds" else each.origin
        found.setdefault((_CODES[each.kind], text.place(expr)), []).append(each)
    elsewhere = {
        item.place.within(*node.span)
        for item in facts.system.formulas
        if item.names and found
        for part in expressions_in(item.formula)
        for node in walk(part)
        if item.is_named(node)
    }
    for (code, place), alike in found.items():
        if place in elsewhere:
            continue  # a name for it, which is reported where it is defined
        # Where a number is used that is written down elsewhere, or is written down.
        related = []
        for each in alike[:4]:
            text, expr = each.origin if each.kind == "bounds" else (each.text, each.causes[0])
            other, word = text.place(expr), "written" if each.kind == "bounds" else "used"
            if (
                each.kind not in ("itself", "unchanged", "fails", "fails in range")
                and other.route != place.route
            ):
                related.append(Related(other, f"{word} here"))
        message, help = _words(alike[0])
        yield Diagnostic(code, message, place, "", tuple(related), help)


def _words(found: SuspiciousExpression) -> tuple[str, str]:
    """What is wrong, and a way out."""
    first, expr = show(found.causes[0]), found.expr
    match found.kind:
        case "tolerance" | "turn":
            words = "a whole turn or more: angles within it are as good as any"
            if found.number <= 0:
                words = "zero: only what is exactly equal is near"
            if found.number < 0:
                words = "negative: nothing is ever near"
            return f"a tolerance that is {words}", "write how close is enough"
        case "angle":
            help = "write a smaller angle; `near(position(X), position(Y), distance)` "
            help += "compares no angle"
            return "every two orientations are within an angle of pi", help
        case "quaternion":
            help = "write x, y, z, w of a rotation; the sum of their squares is 1"
            return f"the length of this quaternion is {found.number:.4g}, not 1", help
        case "axis":
            help = "write a vector along the axis, e.g. `[0, 0, 1]`; its length does not matter"
            return "an axis of length zero has no direction", help
        case "bounds":
            help = "the lower bound goes with `max`, the upper one with `min`"
            if isinstance(expr, Builtin) and FUNCTIONS[expr.name].limits:
                help = "the lower bound comes before the upper one"
            return f"the bounds are in the wrong order: the result is always `{first}`", help
        case "unchanged" if isinstance(expr, Builtin):
            neutral = FUNCTIONS[expr.name].neutral
            return f"`{show(expr)}` is all of `{first}`", neutral[-1] if neutral else ""
        case "unchanged":
            help = "write its new value; memory keeps what no function assigns"
            return f"`{first}` is given the value that it has", help
        case "fails":
            help = "write another number, or a condition under which it is computed"
            return f"`{first}` never has a value: {found.why}", help
        case "fails in range":
            help = "make the range smaller, or say under which condition it is computed"
            return f"`{first}` has no value somewhere in the range: {found.why}", help
    return _same(found), "replace one of the two by what is meant"


def _same(found: SuspiciousExpression) -> str:
    """What is wrong with an expression of which two parts are the same."""
    one, other = map(show, found.causes)
    match found.expr:
        case Choice(then=then, otherwise=otherwise):
            nested = [p for p in (then, otherwise) if isinstance(p, Choice)]
            is_inside = any(part not in found.causes for part in nested)
            return f"{'two neighbouring' if is_inside else 'both'} branches are `{one}`"
        case _ if one != other:
            return f"`{one}` and `{other}` are the same"
        case Builtin(name=name):
            return FUNCTIONS[name].same_arguments.format(one)
        case Logic(op=name):
            return f"`{one}` stands twice beside `{name}`"
        case Binary(op=op):
            return f"`{one}` is {'subtracted from' if op == '-' else 'divided by'} itself"
    return f"`{one}` is compared with itself"


# A bare name in the expressions of a subsystem means one thing.


Named = Memory | Let | Constant | OuterName


def names_distinct(facts: Facts) -> Iterator[Diagnostic]:
    """E0221, for names with two meanings.

    Outer names count in the subsystems that their own file describes.
    """
    for subsystem in facts.subsystems:
        first: dict[str, tuple[str, Named]] = {}
        named: list[tuple[str, Named]] = [(item.kind, item) for item in subsystem.outside]
        named += [("parameter", c) for c in subsystem.constants]
        named += [("memory element", m) for m in subsystem.memory]
        named += [("let", item) for item in subsystem.lets]
        for kind, part in named:
            earlier = first.setdefault(part.name, (kind, part))
            if part.name in RESERVED:
                yield Diagnostic(
                    "E0221",
                    f"`{part.name}` is a word of the language and cannot name a {kind}",
                    part.place,
                    help="choose another name",
                )
            elif earlier[1] is not part:
                yield Diagnostic(
                    "E0221",
                    f"`{part.name}` names a {kind} and a {earlier[0]}",
                    part.place,
                    related=(Related(earlier[1].place, f"the {earlier[0]}"),),
                    help="choose another name for one of the two",
                )


# A target has one writer per behaviour: all functions of a behaviour take effect at once.


def one_writer(facts: Facts) -> Iterator[Diagnostic]:
    """E0608, for a behaviour that writes a target twice."""
    for subsystem in facts.subsystems:
        # Calls of one behaviour write alike.
        declared = {b.place: b.generic.part if b.generic else b for b in subsystem.behaviours}
        for behaviour in declared.values():
            first: dict[tuple[str, str], Assignment] = {}
            for assignment in behaviour.assignments:
                target = assignment.peer, assignment.name
                if target in first:
                    earlier = first[target]
                    writers = [
                        Related(earlier.place, "here"),
                        Related(assignment.place, "and here"),
                    ]
                    if earlier.place == assignment.place:
                        writers = [
                            Related(
                                assignment.place, f"`{behaviour.name}` names the function twice"
                            )
                        ]
                    yield Diagnostic(
                        "E0608",
                        f"behaviour `{behaviour.name}` writes `{assignment.target}` twice",
                        behaviour.place.below("functions"),
                        related=tuple(writers),
                        help="keep one of the two, or give the functions to different behaviours",
                    )
                first.setdefault(target, assignment)
