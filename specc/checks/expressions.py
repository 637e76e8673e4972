"""Expressions that are well typed and cannot be meant; names and targets of functions."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts
from specc.analysis.reads import nodes, texts
from specc.analysis.suspicious_expressions import SuspiciousExpression
from specc.diagnostics import Diagnostic, Related
from specc.lang import RESERVED, show
from specc.lang.builtins import FUNCTIONS
from specc.model.expr import Binary, Builtin, Choice, Lag, Logic, walk
from specc.model.fsm import Assignment, Behaviour
from specc.model.requirement import expressions
from specc.model.system import Constant, Let, Memory, Outside, Subsystem
from specc.source import Place

# Constants that arithmetic gives have a value.


def constants_have_values(facts: Facts) -> Iterator[Diagnostic]:
    """E0334."""
    for constant, why in facts.valueless:
        message = f"`{show(constant.value)}` has no value: {why}"
        yield Diagnostic("E0334", message, constant.place, help="write another number")


# Who can be late.


def lateness_of_subsystems(facts: Facts) -> Iterator[Diagnostic]:
    """E0339."""
    for subsystem in facts.subsystems:
        lags = any(isinstance(node, Lag) for node in nodes(subsystem))
        for text in texts(subsystem) if lags else ():
            for node in walk(text.expr):
                if not (isinstance(node, Lag) and node.name == "late"):
                    continue
                if facts.wires.measured(subsystem.qualified_name, node.input.peer):
                    message = f"`{show(node.input)}` comes from a device, which has no periods"
                    help = f"ask how old the measurement is: `age({show(node.input)})`"
                    yield Diagnostic("E0339", message, text.place(node), help=help)


# Numbers and expressions make sense.


_CODES = {
    "tolerance": "E0330",
    "angle": "E0330",
    "turn": "W0342",
    "quaternion": "E0331",
    "bounds": "W0332",
    "itself": "W0333",
    "unchanged": "W0338",
    "fails": "W0340",
}


def expressions_meant(facts: Facts) -> Iterator[Diagnostic]:
    """E0330, E0331, W0332, W0333, W0338, W0340, W0342: once where several uses have one origin."""
    found: dict[tuple[str, Place], list[SuspiciousExpression]] = {}
    for misfits in (facts.suspicious, *(machine.suspicious for machine in facts.machines)):
        for misfit in misfits.all:
            found.setdefault((_CODES[misfit.kind], _place(misfit)), []).append(misfit)
    elsewhere = {
        item.place.within(*node.span)
        for item in facts.system.formulas
        if item.names and found
        for part in expressions(item.formula)
        for node in walk(part)
        if item.is_named(node)
    }
    for (code, place), alike in found.items():
        if place in elsewhere:
            continue  # a name for it, which is told where it is defined
        message, help_text = _words(alike[0])
        yield Diagnostic(code, message, place, "", tuple(_uses(place, alike)), help_text)


def _place(misfit: SuspiciousExpression) -> Place:
    if misfit.kind == "bounds":
        return misfit.text.place(misfit.expr)
    text, expr = misfit.origin
    return text.place(expr)


def _uses(place: Place, misfits: list[SuspiciousExpression]) -> Iterator[Related]:
    """Where a number is used that is written down elsewhere, or is written down."""
    for misfit in misfits[:4]:
        text, expr = misfit.origin
        other = text.place(expr) if misfit.kind == "bounds" else misfit.text.place(misfit.causes[0])
        if misfit.kind not in ("itself", "unchanged", "fails") and other.route != place.route:
            yield Related(other, "written here" if misfit.kind == "bounds" else "used here")


def _words(misfit: SuspiciousExpression) -> tuple[str, str]:
    """What is wrong, and a way out."""
    first = show(misfit.causes[0])
    match misfit.kind:
        case "tolerance" | "turn":
            said = (
                "a whole turn or more: angles within it are as good as any"
                if misfit.number > 0
                else "zero: only what is exactly equal is near"
                if misfit.number == 0
                else "negative: nothing is ever near"
            )
            return f"a tolerance that is {said}", "write how close is enough"
        case "angle":
            help_text = (
                "write a smaller angle; `near(position(X), position(Y), distance)` "
                "compares no angle"
            )
            return "every two orientations are within an angle of pi", help_text
        case "quaternion":
            help_text = "write x, y, z, w of a rotation; the sum of their squares is 1"
            return f"the length of this quaternion is {misfit.number:.4g}, not 1", help_text
        case "bounds":
            help_text = "the lower bound goes with `max`, the upper one with `min`"
            if isinstance(misfit.expr, Builtin) and FUNCTIONS[misfit.expr.name].limits:
                help_text = "the lower bound comes before the upper one"
            return f"the bounds are in the wrong order: the result is always `{first}`", help_text
        case "unchanged" if isinstance(misfit.expr, Builtin):
            neutral = FUNCTIONS[misfit.expr.name].neutral
            help_text = neutral[-1] if neutral else ""
            return f"`{show(misfit.expr)}` is all of `{first}`", help_text
        case "fails":
            help_text = "write another number, or a condition under which it is computed"
            return f"`{first}` never has a value: {misfit.why}", help_text
        case "unchanged":
            help_text = "write its new value; memory keeps what no function assigns"
            return f"`{first}` is given the value that it has", help_text
    return _itself(misfit), "replace one of the two by what is meant"


def _itself(misfit: SuspiciousExpression) -> str:
    one, other = map(show, misfit.causes)
    if isinstance(misfit.expr, Choice):
        parts = misfit.expr.then, misfit.expr.otherwise
        nested = any(isinstance(part, Choice) and part not in misfit.causes for part in parts)
        return f"{'two neighbouring' if nested else 'both'} branches are `{one}`"
    if one != other:
        return f"`{one}` and `{other}` are the same"
    match misfit.expr:
        case Builtin(name=name):
            return FUNCTIONS[name].alike.format(one)
        case Logic(op=name):
            return f"`{one}` stands twice beside `{name}`"
        case Binary(op=op):
            return f"`{one}` is {'subtracted from' if op == '-' else 'divided by'} itself"
    return f"`{one}` is compared with itself"


# A bare name in the expressions of a subsystem means one thing.


Named = Memory | Let | Constant | Outside


def names_distinct(facts: Facts) -> Iterator[Diagnostic]:
    """E0221; constants and files hold in the subsystems that their own file describes."""
    for subsystem in facts.subsystems:
        first: dict[str, tuple[str, Named]] = {}
        for kind, part in _named(subsystem):
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


def _named(subsystem: Subsystem) -> Iterator[tuple[str, Named]]:
    yield from ((item.kind, item) for item in subsystem.outside)
    yield from (("parameter", c) for c in subsystem.constants)
    yield from (("memory element", m) for m in subsystem.memory)
    yield from (("let", item) for item in subsystem.lets)


# A target has one writer per behaviour: all functions of a behaviour take effect at once.


def one_writer(facts: Facts) -> Iterator[Diagnostic]:
    """E0608."""
    for subsystem in facts.subsystems:
        for behaviour in subsystem.behaviours:
            first: dict[tuple[str, str], Assignment] = {}
            for assignment in behaviour.assignments:
                target = assignment.peer, assignment.name
                if target in first:
                    yield _twice(behaviour, assignment, first[target])
                first.setdefault(target, assignment)


def _twice(behaviour: Behaviour, assignment: Assignment, earlier: Assignment) -> Diagnostic:
    writers = [Related(earlier.place, "here"), Related(assignment.place, "and here")]
    if earlier is assignment:
        writers = [Related(assignment.place, f"`{behaviour.name}` names the function twice")]
    return Diagnostic(
        "E0608",
        f"behaviour `{behaviour.name}` writes `{assignment.target}` twice",
        behaviour.place.below("functions"),
        related=tuple(writers),
        help="keep one of the two, or give the functions to different behaviours",
    )
