"""What of the operator's panel sets elements of devices, within which range."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from specc.diagnostics import Related
from specc.diagnostics.phrases import join_words
from specc.lang import ExprError, show
from specc.lang.kinds import first_value, kind
from specc.lang.values import Value
from specc.model.bindings import PanelKind, Widget
from specc.model.expr import FALSE, Expr, Number, Truth
from specc.model.system import Element
from specc.model.types import Bool, Enum, Int, Real, Type
from specc.resolve.context import YamlNode
from specc.resolve.expressions import Expressions, known_value
from specc.resolve.library import constant_scope
from specc.schema.files import BindingDef

_TYPES: dict[PanelKind, tuple[type[Type], ...]] = {
    "button": (Bool,),
    "switch": (Bool,),
    "slider": (Real,),
    "choice": (Enum,),
    "number": (Real, Int),
}
"""Types of the elements that each kind can set."""
_KINDS: dict[Literal["hold", "range"], tuple[PanelKind, ...]] = {
    "hold": ("button",),
    "range": ("slider", "number"),
}
"""Keys that only some kinds have."""
_OF_MESSAGES = ("topic", "tf", "action", "action_server", "service", "service_server")
"""Keys of bindings whose values come in messages."""


def resolve_panel(
    item: BindingDef, at: YamlNode, element: Element | None, expressions: Expressions
) -> Widget | None:
    """What of the panel sets an element, if a binding says so; what is wrong is reported.

    An element that no device reports is a matter of `specc.checks`.
    """
    kind, findings = item.panel, expressions.findings
    if not kind:
        has_messages = any(getattr(item, name) for name in _OF_MESSAGES)
        for name in ("hold", "range", "init", "key"):
            if name in item.given_keys and not (name == "init" and has_messages):
                others = "topics of ROS 2 and for " if name == "init" else ""
                message = f"`{name}` is for {others}what is on the operator's panel"
                way = f"add `panel:`, or delete `{name}`"
                findings.report("E0505", message, at[name].key, help=way)
                break
        return None
    for name, kinds in _KINDS.items():
        if getattr(item, name) and kind not in kinds:
            message = f"a {kind} has no `{name}`"
            way = f"delete `{name}`, or make it {_one_of(kinds)}"
            findings.report("E0505", message, at[name].key, help=way)
    if item.hold and item.key:
        message = (
            "a button that is held has no `key`: a terminal does not tell when one is released"
        )
        findings.report("E0505", message, at["key"].key, help="delete `key`")
    bounds, initial = None, None
    texts: tuple[Expr, ...] = ()
    if element is not None and _is_suitable(kind, element, at, expressions):
        reader = _Values(element, at, expressions)
        if kind in _KINDS["range"]:
            bounds = reader.bounds(item.range)
        initial = reader.initial(item.init, kind)
        if bounds is not None and isinstance(initial, Number):
            reader.refuse_outside(initial, bounds)
        texts = tuple(reader.texts)
    return Widget(kind, initial, bounds, item.hold, item.key, texts)


def _is_suitable(kind: PanelKind, element: Element, at: YamlNode, expressions: Expressions) -> bool:
    """Whether the panel can set an element by some kind; reports that it cannot."""
    type_ = element.type
    if isinstance(type_, _TYPES[kind]):
        return True
    fitting = [name for name, types in _TYPES.items() if isinstance(type_, types)]
    way = "a panel sets truth values, numbers and enums"
    if fitting:
        way = f"make it {_one_of(fitting)}"
    message = f"a {kind} cannot set `{element.name}`, which is `{type_}`"
    related = (Related(element.place, f"`{type_}`"),)
    expressions.findings.report("E0505", message, at["panel"].place, related=related, help=way)
    return False


def _one_of(kinds: Iterable[PanelKind]) -> str:
    return join_words((f"a {kind}" for kind in kinds), "or")


class _Values:
    """Reads values of an element on the panel; what is wrong with them is reported."""

    def __init__(self, element: Element, at: YamlNode, expressions: Expressions) -> None:
        self._element, self._at, self._expressions = element, at, expressions
        self.texts: list[Expr] = []
        """The expressions that were read."""

    def bounds(self, texts: list[str]) -> tuple[Number, Number] | None:
        """The least and the greatest value; None after reporting."""
        name, where = self._element.name, self._at["range"]
        if not texts:
            message = f"nothing says between which values the operator sets `{name}`"
            ends = ", ".join(self._example(number) for number in (0, 1))
            way = f"add the least and the greatest one, e.g. `range: [{ends}]`"
            self._report(message, self._at["panel"], way)
            return None
        found = [self._value(text, where[index]) for index, text in enumerate(texts)]
        low, high = found
        if not isinstance(low, Number) or not isinstance(high, Number):
            return None
        if low.value >= high.value:
            is_reversed = low.value > high.value
            way = "write the least value first" if is_reversed else "write two different values"
            self._report(f"the range of `{name}` is empty", where, way)
            return None
        return low, high

    def initial(self, text: str | None, kind: PanelKind) -> Expr | None:
        """The value until the operator gives another one; None after reporting."""
        name, where = self._element.name, self._at["init"]
        if text is None:
            if isinstance(self._element.type, Bool):
                return FALSE
            message = f"`{name}` has no value until the operator gives it one"
            way = f"add `init:`, e.g. `init: {self._example(0)}`"
            self._report(message, self._at["panel"], way)
            return None
        value = self._value(text, where)
        if kind == "button" and isinstance(value, Truth) and value.value:
            message = "a button is not pressed until the operator presses it"
            self._report(message, where, "delete `init`, or make it a switch")
        return value

    def refuse_outside(self, value: Number, bounds: tuple[Number, Number]) -> None:
        """Report an initial value beyond the range."""
        low, high = bounds
        if not low.value <= value.value <= high.value:
            name, ends = self._element.name, f"{show(low)} to {show(high)}"
            message = f"`{name}` is {show(value)} at first, outside of its range, {ends}"
            self._report(message, self._at["init"], "correct the value, or make the range wider")

    def _value(self, text: str, at: YamlNode) -> Expr | None:
        """A value of the element; None after reporting."""
        element, expressions = self._element, self._expressions
        scope = constant_scope(expressions.definitions)
        expr = expressions.value(at, text, scope, element.type, element.place)
        if expr is None:
            return None
        self.texts.append(expr)
        try:
            return self._literal(known_value(expr, expressions.definitions.constants, "E0505"))
        except ExprError as error:
            expressions.report(at, text, error)
            return None

    def _example(self, number: float) -> str:
        """A value as YAML has it."""
        text = show(self._literal(first_value(self._element.type, number)))
        return f'"{text}"' if "[" in text else text

    def _literal(self, value: Value) -> Expr:
        type_ = self._element.type
        found = kind(type_).literal(type_, value, lambda part, item: None)
        assert found is not None  # of these types, all values have one
        return found

    def _report(self, message: str, at: YamlNode, help: str) -> None:
        self._expressions.findings.report("E0505", message, at.place, help=help)
