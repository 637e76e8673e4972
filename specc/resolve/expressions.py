"""Texts of expressions and types resolved in their scope; comments in them."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from typing import Any

from specc.diagnostics import Diagnostic, Related
from specc.lang import (
    CUT_SHORT,
    FOLLOW_UP,
    NEEDS_CONTEXT,
    Declaration,
    Environment,
    ExprError,
    ExprErrors,
    Members,
    Scope,
    check,
    count_parts,
    evaluate,
    expand_groups,
    parse,
    parse_type,
)
from specc.lang.calls import names_of_parameters
from specc.lang.values import Value
from specc.limits import spend_or_raise
from specc.model.expr import Expr, constant_names, has_unknown, is_live
from specc.model.system import Constant
from specc.model.types import Bool, Type
from specc.model.units import HERTZ, UnitError, parse_unit
from specc.resolve.context import Findings, Meaning, TypeText, YamlNode
from specc.resolve.definitions import Definitions, indices_of, inlined, report_clash
from specc.source import Place, Sources

# Expressions that a YAML comment cuts short.


_COMMENT = re.compile(r"[ \t]+#")
_HELP = "` #` begins a comment in YAML: leave it out, or put the whole text in quotes"


def add_comment_hints(found: Iterable[Diagnostic], sources: Sources) -> Iterator[Diagnostic]:
    """The findings; those of expressions that end too early and before a comment say so."""
    for finding in found:
        place = finding.primary
        source = sources.get(place.file)
        is_cut = finding.code == "E0301" and finding.message in CUT_SHORT and place.part == "value"
        if source is not None and is_cut:
            end = source.offsets(Place(place.file, place.route))[1]
            is_cut = _COMMENT.match(source.text, end) is not None
        yield replace(finding, help=_HELP) if source is not None and is_cut else finding


_OF_A_DECLARATION = 4
"""Parts that an element or memory counts for: so much work is done about it."""

# Turns the texts of expressions, types and units into their meaning, reporting what is wrong.


FIXED_INSTEAD = "write a number, or a constant without `live`"


def known_number(expr: Expr, constants: Mapping[str, Constant], code: str) -> float:
    """Evaluate an expression over constants; raises ExprError if only a run can."""
    number: float = _known(expr, constants, code, float)
    return number


def known_value(expr: Expr, constants: Mapping[str, Constant], code: str) -> Value:
    """The value of an expression of any type, likewise."""
    return _known(expr, constants, code, lambda value: value)


def _known(
    expr: Expr, constants: Mapping[str, Constant], code: str, convert: Callable[[Any], Any]
) -> Any:
    if is_live(expr):
        message = "this is needed before a run, and depends on a constant that may change in one"
        raise ExprError(message, *expr.span, FIXED_INSTEAD, "E0344")
    try:
        count = partial(spend_or_raise, "folding")
        value = convert(evaluate(inlined(expr, constants), Environment(count=count)))
    except (LookupError, ArithmeticError, ValueError) as error:
        if constant_names(expr) and not isinstance(error, LookupError):
            raise ExprError("", *expr.span, code=FOLLOW_UP) from None  # they have no value
        value = math.nan
    if not isinstance(value, float) or math.isfinite(value):
        return value
    help = "write a number, or a constant that no operator computes"
    raise ExprError("the value is not known before a run", *expr.span, help, code)


@dataclass(eq=False, slots=True)
class Expressions:
    """Reads texts in one scope. `broken` holds names whose own definition has an error.

    An error that only says that such a name is unknown would be a follow-up, and is dropped.
    `unresolved` holds the buffers, `x.peer` and `y.peer`, that are declared with a misspelt peer,
    or with an interface that is not known.
    `home` is the subsystem whose buffers the texts speak of.
    """

    findings: Findings
    definitions: Definitions
    broken: set[str] = field(default_factory=set)
    unresolved: set[str] = field(default_factory=set)
    home: YamlNode | None = None
    groups: Mapping[str, Members] = field(default_factory=dict)
    """Names of many peers, with the peers."""

    def type(self, where: YamlNode, text: str) -> Type | None:
        """Parse a type; None after reporting."""
        names = self.definitions.names()
        self.findings.types.append(TypeText(where, "type", text, names, self.definitions.places))
        try:
            count_parts(_OF_A_DECLARATION, 0, len(text))
            return parse_type(text, names)
        except ExprError as error:
            self.report(where, text, error)
            return None

    def tree(self, where: YamlNode, text: str) -> ast.expr | None:
        """Parse an expression into its syntax tree; None after reporting."""
        try:
            return expand_groups(parse(text), self.groups)
        except ExprError as error:
            self.report(where, text, error)
            return None

    def value(
        self,
        where: YamlNode,
        text: str,
        scope: Scope,
        expected: Type | None,
        declared: Place | None = None,
    ) -> Expr | None:
        """Type an expression; None after reporting if its meaning is not clear.

        What it is assigned to is declared as of the expected type at `declared`.
        """
        expr = self._parsed(where, text, scope, expected, declared)
        return None if expr is None or has_unknown(expr) else expr

    def condition(self, where: YamlNode, text: str, scope: Scope) -> Expr | None:
        """Type a condition, whose wrong parts are unknown; None after reporting."""
        return self._parsed(where, text, scope, Bool(), None)

    def inside(self, where: YamlNode, text: str, scope: Scope) -> None:
        """Report errors in an expression, whatever type is expected of it."""
        self._note(where, text, scope, None)
        tree = self.tree(where, text)
        if tree is None:
            return
        try:
            check(tree, text, scope)
        except ExprErrors as errors:
            for error in errors.errors:
                if error.code not in NEEDS_CONTEXT:
                    self.report(where, text, error)

    def _parsed(
        self,
        where: YamlNode,
        text: str,
        scope: Scope,
        expected: Type | None,
        declared: Place | None,
    ) -> Expr | None:
        expr = self._typed(where, text, scope, expected, declared)
        self._note(where, text, scope, expr)
        try:
            return expr and self.definitions.inlined(expr)
        except ExprError as error:
            self.report(where, text, error)
            return None

    def _note(self, where: YamlNode, text: str, scope: Scope, expr: Expr | None) -> None:
        """Record the meaning of a text for editors and `resolve.uses`."""
        known = None if expr is None or has_unknown(expr) else expr
        places = self.definitions.places
        self.findings.meanings.append(Meaning(where, text, scope, known, places, self.home))

    def _typed(
        self,
        where: YamlNode,
        text: str,
        scope: Scope,
        expected: Type | None,
        declared: Place | None,
    ) -> Expr | None:
        tree = self.tree(where, text)
        if tree is None:
            return None
        try:
            return check(tree, text, scope, expected)
        except ExprErrors as errors:
            for error in errors.errors:
                target = None
                if declared is not None and error.expected == expected:
                    target = Related(declared, f"declared as `{expected}`")
                self.report(where, text, error, target)
            return errors.expr

    def report(
        self, where: YamlNode, text: str, error: ExprError, target: Related | None = None
    ) -> None:
        """Report an error in a text, unless it only follows from a broken definition."""
        named = text[error.start : error.end].rsplit(".", 1)[-1]
        known = named in self.broken or named in self.definitions.broken
        buffer = _ELEMENT.search(text[: error.end])
        named_buffer = re.sub(r"\s", "", buffer[0]) if buffer else ""
        known |= not self.unresolved.isdisjoint((named_buffer, named_buffer.rpartition(".")[0]))
        # Of many peers an expression says `r.element`, and all of them have one buffer.
        known |= error.code == "E0230" and any(name.startswith("x.") for name in self.unresolved)
        called = next((what for what in _CALLED if named in self._own_names(f"{what}s")), None)
        if called and error.message.startswith(("unknown operator", "operator")):
            help = _CALLED[called].format(named)
            message = f"`{named}` is a {called}, which no expression calls"
            error = ExprError(message, error.start, error.end, help, "E0201")
        if error.code in ("E0201", "O0205") and (owner := self._owner_of_parameter(named)):
            message = f"`{named}` is a parameter of {owner}, which has no value here"
            help = "write the expression in place there, or pass the value on as an argument"
            error = ExprError(message, error.start, error.end, help, "E0201")
        if error.code.startswith(("E02", "O02")) and known:
            self.findings.suppressed += 1
            return
        lacks = None
        if buffer and error.code in ("E0201", "O0205"):
            lacks = self.element(*named_buffer.split("."))
        self.findings.expression_error(where, error, target, lacks)

    @property
    def uninitialized_names(self) -> frozenset[str]:
        """The names of memory and lets, which have no value while initial values are computed."""
        return frozenset(name for key in _LATER for name in self._own_names(key))

    def _owner_of_parameter(self, name: str) -> str:
        """The behaviour or function with a parameter of that name; empty if there is none."""
        home = self.home.mapping if self.home else {}
        for what in _CALLED:
            for owner, part in (home.get(f"{what}s") or {}).items():
                signature = part.get("signature") if isinstance(part, dict) else None
                if name in names_of_parameters(str(signature or "")):
                    return f"{what} `{owner}`"
        return ""

    def _own_names(self, key: str) -> Collection[str]:
        """The names in a mapping of the subsystem."""
        home = self.home
        return home.raw.get(key) or () if home and isinstance(home.raw, dict) else ()

    def indexed(
        self, each: Mapping[str, str], where: YamlNode, scope: Scope
    ) -> tuple[dict[str, Constant], Scope]:
        """The indices of the `for` of a part at `where`, and the scope of its expressions.

        One with the name of a constant, of memory or of a let is reported.
        """
        if not each:
            return {}, scope
        indices = indices_of(each, where)
        for index in indices.values():
            constant = self.definitions.constants.get(index.name)
            key = next((key for key in _LATER if index.name in self._own_names(key)), None)
            if self.home is not None and key:
                report_clash(index, _LATER[key], self.home[key][index.name].key, self.findings)
            elif constant:
                report_clash(index, "a constant", constant.place, self.findings)
        known = {n: Declaration(i.value.type, i.place, i.value) for n, i in indices.items()}
        return indices, replace(scope, constants={**scope.constants, **known})

    def element(self, *steps: str) -> Place | None:
        """Where an element of a buffer is declared: direction, peer and element."""
        home = self.home
        return Place(home.file, (*home.route, *steps)) if home else None


_CALLED = {
    "function": "behaviours call it, in their lists: `functions: [{}(...)]`",
    "behaviour": "states call it: `S0: {}(...)`",
}
"""What has parameters and no value, and who calls it."""
_LATER = {"memory": "a memory element", "let": "a let"}
_ELEMENT = re.compile(r"\bx(?:\s*\.\s*\w+){1,2}$")
# A Fraction of `1e999999999` is computed digit by digit.
_NUMBER = re.compile(r"\d{1,12}(?:\.\d{0,12}|/\d{1,12})?(?:[eE][+-]?\d{1,2})?", re.ASCII)
_RATE_SLIP = re.compile(r"(\d{1,12}(?:\.\d{1,12})?)\s*(?:hz)?", re.ASCII | re.IGNORECASE)


def rate_of(text: str, where: YamlNode, findings: Findings) -> Fraction | None:
    """Periods per second from `500 Hz`, `2 kHz` or `10 ms`; None after reporting."""
    number, _, unit_text = text.strip().partition(" ")
    value, unit = Fraction(0), None
    with suppress(ZeroDivisionError, UnitError):
        if _NUMBER.fullmatch(number):
            value, unit = Fraction(number), parse_unit(unit_text.strip() or "1")
    scaled = value * Fraction(unit.scale).limit_denominator(10**9) if unit else Fraction(0)
    if unit and unit.same_kind(HERTZ) and scaled > 0:
        return scaled
    if unit and unit.same_kind(parse_unit("s")) and scaled > 0:
        return 1 / scaled
    plain = _RATE_SLIP.fullmatch(text.strip())
    example = f"`{plain[1]} Hz`" if plain and float(plain[1]) > 0 else "`500 Hz`"
    findings.report(
        "E0104",
        f"`{text}` is not a rate",
        where.place,
        help=f"write periods per second, e.g. {example}, or the period, e.g. `10 ms`",
    )
    return None
