"""Behaviours and functions with parameters: their signatures, calls, and what each call stands for.

A call has the arguments in place of the parameters, so that every later pass sees what runs.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import count
from keyword import iskeyword
from typing import Literal, TypeVar

from specc.diagnostics import Related
from specc.lang import RESERVED, Declaration, ExprError, Scope, count_parts
from specc.lang.calls import CallText, parse_call, usage
from specc.lang.types import parameter_parts, parse_parameters
from specc.model.expr import (
    BoundVariable,
    Call,
    Expr,
    ParameterRef,
    Quantifier,
    Unknown,
    map_children,
    walk,
)
from specc.model.fsm import Behaviour, Condition, Function, Generic, Parameter
from specc.model.types import Bool
from specc.resolve.context import Meaning, TypeText, YamlNode
from specc.resolve.expressions import Expressions
from specc.schema.subsystem import SubsystemDef
from specc.source import Place

# Signatures.


_OF_A_PARAMETER = 4
"""Parts that a parameter counts for, as a declaration does."""
_EXAMPLE = "for example `(to: pose[B, E], speed: real[m/s])`"


def parameters_at(
    at: YamlNode, text: str, scope: Scope, expressions: Expressions
) -> tuple[Parameter, ...] | None:
    """The parameters of a signature; None after reporting."""
    findings, definitions = expressions.findings, expressions.definitions
    names = definitions.names()
    findings.types.append(TypeText(at, "parameters", text, names, definitions.places))
    try:
        types = parse_parameters(text, names)
        count_parts(_OF_A_PARAMETER * len(types), 0, len(text))
    except ExprError as error:
        error.help = _EXAMPLE if "->" in error.help and "->" not in text else error.help
        expressions.report(at, text, error)
        return None
    starts = (first for first, _ in parameter_parts(text)[0])
    found = []
    for (name, type_), first in zip(types.items(), starts, strict=True):
        start = text.index(name, first)
        place = at.place.within(start, start + len(name))
        findings.use(place, at, start=start, end=start + len(name), type=type_)
        found.append(Parameter(name, type_, place))
        _check_name(name, place, scope, expressions)
    return tuple(found)


def _check_name(name: str, place: Place, scope: Scope, expressions: Expressions) -> None:
    """Report a parameter with the name of something else that expressions may name."""
    kinds = (("memory element", scope.memory), ("let", scope.lets), ("constant", scope.constants))
    own = next(((kind, known[name]) for kind, known in kinds if name in known), None)
    message, related = "", tuple[Related, ...]()
    if name in RESERVED or iskeyword(name):
        message = f"`{name}` is a word of the language and cannot name a parameter"
    elif own:
        message = f"`{name}` names a parameter and a {own[0]}"
        related = (Related(own[1].place, f"the {own[0]}"),) if own[1].place else ()
    elif name in scope.files:
        message = f"`{name}` names a parameter and a file"
    if message:
        help = "choose another name for the parameter"
        expressions.findings.report("E0221", message, place, related=related, help=help)


def with_parameters(scope: Scope, parameters: tuple[Parameter, ...]) -> Scope:
    """The scope of what is declared with parameters."""
    return replace(scope, parameters={p.name: Declaration(p.type, p.place) for p in parameters})


# Calls.


@dataclass(frozen=True, slots=True)
class Arguments:
    """What a call gives to parameters: values and, for readers, their texts."""

    values: Mapping[str, Expr]
    texts: Mapping[str, str]
    at: CallText

    def name_of_call(self) -> str:
        """The call as reports and recordings show it: all arguments by name."""
        given = ", ".join(f"{name}: {text}" for name, text in self.texts.items())
        return f"{self.at.name}({given})"

    def shown_in(self, name: str) -> str:
        """The name of a call inside of what is called, with arguments for its parameters."""
        for parameter, text in self.texts.items():
            shown = text if _SIMPLE.fullmatch(text) else f"({text})"
            own = rf"(?<![\w.]){re.escape(parameter)}(?!\w|\s*:)"
            name = re.sub(own, shown.replace("\\", r"\\"), name)
        return name


_SIMPLE = re.compile(r"[\w.]+(\[[^\[\]]*\])?")


def called_at(where: YamlNode, text: str, expressions: Expressions) -> CallText | None:
    """The call that a text is; None for a plain name, and after reporting."""
    try:
        return parse_call(text)
    except ExprError as error:
        expressions.report(where, text, error)
        return None


def arguments_at(
    where: YamlNode,
    call: CallText,
    parameters: tuple[Parameter, ...],
    scope: Scope,
    expressions: Expressions,
) -> Arguments:
    """The arguments of a call; those that are wrong or missing are unknown, after reporting."""
    findings = expressions.findings
    unknown = {p.name: _unknown(where, p) for p in parameters}
    try:
        given = call.by_parameter([p.name for p in parameters])
    except ExprError as error:
        expressions.report(where, call.text, error)
        return Arguments(unknown, dict.fromkeys(unknown, "..."), call)
    earlier = len(findings.meanings)
    values: dict[str, Expr] = {}
    for parameter in parameters:
        argument = given[parameter.name]
        if argument.name[0] < argument.name[1]:
            start, end = argument.name
            findings.use(parameter.place, where, start=start, end=end, type=parameter.type)
        # Its offsets are those in the whole text.
        text = " " * argument.start + call.text[argument.start : argument.end]
        value = expressions.value(where, text, scope, parameter.type, parameter.place)
        if value is not None:
            values[parameter.name] = value
    if len(values) == len(parameters):
        # Editors find the names in all arguments in one expression, which nothing evaluates.
        joint = Call("", tuple(values.values()), type=Bool())
        last = Meaning(
            where, call.text, scope, joint, expressions.definitions.places, expressions.home
        )
        findings.meanings[earlier:] = [last]
    texts = {name: " ".join(call.text[a.start : a.end].split()) for name, a in given.items()}
    return Arguments(unknown | values, texts, call)


def _unknown(where: YamlNode, parameter: Parameter) -> Expr:
    return Unknown("/".join(map(str, (*where.route, parameter.name))), type=parameter.type)


def report_no_arguments(
    name: str, parameters: tuple[Parameter, ...], where: YamlNode, expressions: Expressions
) -> None:
    """Report something with parameters that is named without arguments."""
    help = f"it is called as `{usage(name, [p.name for p in parameters])}`"
    related = tuple(Related(p.place, f"its parameter `{p.name}`") for p in parameters[:1])
    message = f"`{name}` has parameters and is used without arguments"
    expressions.findings.report("E0315", message, where.place, related=related, help=help)


# What a call stands for.


P = TypeVar("P", Function, Condition)


def with_arguments(generic: Generic, arguments: Arguments) -> Function | Behaviour:
    """The part that a call stands for; raises `ExprError` if it is too large."""
    part, name = generic.part, arguments.name_of_call()
    if isinstance(part, Function):
        return replace(_function(part, arguments), name=name, generic=generic)
    functions = tuple(
        _renamed(_function(function, arguments), part.name, arguments)
        for function in part.functions
    )
    terminal, *errors = (
        _renamed(_condition(end, arguments), part.name, arguments)
        for end in (part.terminal, *(error for _, error in part.errors))
    )
    causes = [cause for cause, _ in part.errors]
    return replace(
        part,
        name=name,
        functions=functions,
        terminal=terminal,
        errors=tuple(zip(causes, errors, strict=True)),
        generic=generic,
        arguments=tuple(arguments.values.values()),
    )


def _renamed(part: P, owner: str, arguments: Arguments) -> P:
    """Name what stands in place in a behaviour after the call; name calls in it by arguments."""
    name = part.name
    if name.startswith(f"{owner}."):
        name = arguments.name_of_call() + name.removeprefix(owner)
    elif "(" in name:
        name = arguments.shown_in(name)
    return part if name == part.name else replace(part, name=name)


def _function(function: Function, arguments: Arguments) -> Function:
    changed = tuple(
        replace(item, value=value) if value is not item.value else item
        for item in function.assignments
        for value in (_substituted(item.value, arguments),)
    )
    is_same = all(a is b for a, b in zip(changed, function.assignments, strict=True))
    return function if is_same else replace(function, assignments=changed)


def _condition(condition: Condition, arguments: Arguments) -> Condition:
    when = _substituted(condition.when, arguments)
    return condition if when is condition.when else replace(condition, when=when)


def _substituted(expr: Expr, arguments: Arguments, around: frozenset[str] = frozenset()) -> Expr:
    """The expression with arguments in place of parameters; each part of it counts as written.

    `around` are the variables of the quantifiers around it.
    """

    def moved(part: Expr, span: tuple[int, int]) -> Expr:
        count_parts(1, *arguments.at.span)
        return replace(map_children(part, lambda inner: moved(inner, span)), span=span)

    count_parts(1, *arguments.at.span)
    if isinstance(expr, ParameterRef):
        return moved(_with_other_variables(arguments.values[expr.name], around), expr.span)
    inside = around | {expr.variable} if isinstance(expr, Quantifier) else around
    return map_children(expr, lambda part: _substituted(part, arguments, inside))


def _with_other_variables(argument: Expr, around: frozenset[str]) -> Expr:
    """An argument whose quantifiers hide none of the variables around its parameter."""
    own = {node.variable for node in walk(argument) if isinstance(node, Quantifier)}
    if own.isdisjoint(around):
        return argument
    names = {
        name: next(new for n in count(2) if (new := f"{name}_{n}") not in own | around)
        for name in own & around
    }

    def renamed(part: Expr) -> Expr:
        part = map_children(part, renamed)
        if isinstance(part, BoundVariable):
            return replace(part, name=names.get(part.name, part.name))
        if isinstance(part, Quantifier):
            return replace(part, variable=names.get(part.variable, part.variable))
        return part

    return renamed(argument)


# The behaviours and functions of one subsystem that have parameters.


PartKind = Literal["behaviour", "function"]
"""What may have parameters."""


@dataclass(eq=False, slots=True)
class Generics:
    """What is `known` of those with a signature, by kind and name; None if that has an error."""

    definition: SubsystemDef
    where: YamlNode
    scope: Scope
    expressions: Expressions
    known: dict[tuple[PartKind, str], Generic | None] = field(default_factory=dict)

    def parameters(
        self, kind: PartKind, name: str, signature: str, at: YamlNode
    ) -> tuple[Parameter, ...] | None:
        """The parameters of a behaviour or function; None after reporting."""
        findings = self.expressions.findings
        self.known[kind, name] = None
        found = parameters_at(at["signature"], signature, self.scope, self.expressions)
        if found == ():
            message, help = "a signature without parameters says nothing", "delete it"
            findings.report("E0104", message, at["signature"].place, help=help)
        return found or None

    def called(
        self, kind: PartKind, where: YamlNode, text: str, scope: Scope
    ) -> Function | Behaviour | None:
        """The behaviour or function that a call stands for; None after reporting."""
        findings = self.expressions.findings
        call = called_at(where, text, self.expressions)
        if call is None:
            return None
        name, place = call.name, where.place.within(*call.span)
        declared = getattr(self.definition, f"{kind}s")
        if name not in declared:
            if kind == "function" and name in self.definition.behaviours:
                message = f"`{name}` is a behaviour, which only a state runs"
                findings.report("E0201", message, place, help="name functions here")
            else:
                findings.unknown("E0201", kind, name, declared, place)
            return None
        start, end = call.span
        findings.use(self.where[f"{kind}s"][name].key, where, start=start, end=end)
        if (kind, name) not in self.known:
            message = f"{kind} `{name}` has no parameters"
            help = f"write `{name}`, or say what it takes: `signature: ...`"
            findings.report("E0315", message, place, help=help)
            return None
        generic = self.known[kind, name]
        if generic is None:
            findings.suppressed += 1
            return None
        arguments = arguments_at(where, call, generic.parameters, scope, self.expressions)
        try:
            return with_arguments(generic, arguments)
        except ExprError as error:
            self.expressions.report(where, text, error)
            return None

    def report_bare(self, kind: PartKind, name: str, where: YamlNode) -> None:
        """Report the name of no behaviour or function, or of one that takes arguments."""
        findings, declared = self.expressions.findings, getattr(self.definition, f"{kind}s")
        if name not in declared:
            findings.unknown("E0201", kind, name, declared, where.place)
        elif generic := self.known.get((kind, name)):
            report_no_arguments(name, generic.parameters, where, self.expressions)
            findings.use(generic.part.place, where)
        elif (kind, name) in self.known:
            findings.suppressed += 1
