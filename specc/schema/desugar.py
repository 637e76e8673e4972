"""Short ways to write parts, written out before anything is read: `for`, short forms, rows,
`through` of devices.

A part with `for` becomes one part for each value of its indices. In its names and texts braces hold
arithmetic on indices: `left_{i}`, `robot_{i % 5 + 1}`. A text in place of a mapping becomes the
mapping, and so does a row of a table; a single item becomes a list. A behaviour that stands in its
state becomes a declared one with the name of the state. All that is made knows the
route of the text that it comes from. In expressions blanks fill the room of the braces, so that
columns stay right.

A device that says `through: 50 Hz` gets a virtual effector or receptor of its name that passes
everything on, and both ends at the control subsystem, where these are not written.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Set
from dataclasses import dataclass, field
from itertools import product
from keyword import iskeyword
from typing import Any

from specc.diagnostics import Diagnostic, Related
from specc.lang import ExprError, parse_syntax
from specc.lang.parse import names_in
from specc.lang.types import SAME
from specc.limits import MAX_COPIES, MAX_VALUES
from specc.schema.files import AgentDef, SpecFile
from specc.schema.keys import ListKind, SpecModel, Text, Traced, ValueKind, is_model
from specc.schema.places import SchemaNode
from specc.schema.subsystem import BehaviourDef, SubsystemDef
from specc.source import Place, Route

FOR, THROUGH = "for", "through"
Indices = Mapping[str, int]


class Desugared(dict[Any, Any]):
    """A mapping in which some values come from elsewhere; `routes` has where they stand."""

    def __init__(self, values: Mapping[Any, Any], routes: Mapping[Any, Route]) -> None:
        super().__init__(values)
        self.routes = dict(routes)


class SingleItem(list[Any]):
    """A list that the file writes as its only item; that stands at `routes[0]`."""

    def __init__(self, item: Any, route: Route) -> None:
        super().__init__([item])
        self.routes: dict[Any, Route] = {0: route}


def route_below(value: object, key: str | int, route: Route) -> Route:
    """The route of the value at `key` of a mapping or list, which stands at `route` itself."""
    routes = value.routes if isinstance(value, (Desugared, SingleItem)) else {}
    return routes.get(key, (*route, key))


def desugar(
    data: Any, file: str, model: type[SpecModel] = SpecFile, route: Route = ()
) -> tuple[Any, list[Diagnostic]]:
    """The data of a part at `route` written in full, and what is wrong with each `for` in it."""
    desugaring = _Desugaring(file)
    try:
        full = desugaring.desugared(SchemaNode(model), data, route, {})
    except _TooManyError as error:
        message, at = error.args
        desugaring.report("E0017", message, at, _FEWER)
        full = data
    return full, list(dict.fromkeys(desugaring.findings))


def _in_full(kind: ValueKind | None, value: Any, route: Route) -> Any:
    """Expand a short form or a row to the mapping or list that it stands for."""
    if isinstance(kind, ListKind) and type(value) in kind.form.single:
        return SingleItem(value, route)
    if not is_model(kind):
        return value
    if kind.short and isinstance(value, (str, int, float)):
        return Desugared({kind.short: value}, {kind.short: route})
    if kind.row and isinstance(value, list) and len(value) == len(kind.row):
        routes = {key: (*route, index) for index, key in enumerate(kind.row)}
        return Desugared(dict(zip(kind.row, value, strict=True)), routes)
    return value


def _mapping_in(part: Mapping[Any, Any], key: str) -> dict[Any, Any]:
    """The mapping at a key; empty if there is none."""
    found = part.get(key)
    return found if isinstance(found, dict) else {}


def _with(part: Mapping[Any, Any], key: str, value: Any, at: Route | None = None) -> Desugared:
    """A mapping with another value, which stands at a route of its own or below the mapping."""
    routes = part.routes if isinstance(part, Desugared) else {}
    return Desugared({**part, key: value}, routes if at is None else {**routes, key: at})


def _with_entry(
    part: Mapping[Any, Any], key: str, name: Any, value: Any, at: Route | None = None
) -> Desugared:
    """A mapping with one more entry in the mapping at a key."""
    return _with(part, key, _with(_mapping_in(part, key), name, value, at))


class _TooManyError(Exception):
    """Message and route: more values than are read."""


class _IndexFault(Exception):
    """Why braces have no value."""


_FEWER = "give the indices smaller ranges, or split the system"
_LONG = 100
"""Characters of a text that count as much as a value."""
_RANGE = re.compile(r"\s*(-?\d{1,18})\s*(?:\.\.\s*(-?\d{1,18})\s*)?", re.ASCII)
_A_RANGE = "write the first and the last value, e.g. `for: {i: 1..5}`"
_NO_NEGATIVE = "begin the range at 0, or lift the index in the name, e.g. `robot_{i + 5}`"
_BRACES = re.compile(r"\{([^{}]*)\}")
_EXPRESSIONS = ("constant", "initial", "full", "argument")


@dataclass(eq=False, slots=True)
class _Desugaring:
    file: str
    findings: list[Diagnostic] = field(default_factory=list)
    values: int = 0
    has_copies: bool = False

    def desugared(self, node: SchemaNode, value: Any, route: Route, indices: Indices) -> Any:
        """The value with short forms and `for` written out, under the given indices."""
        self.values += 1 + (len(value) // _LONG if isinstance(value, str) else 0)
        if self.has_copies and self.values > MAX_VALUES:
            message = f"with its parts unfolded, the file has more than {MAX_VALUES} values"
            raise _TooManyError(message, route[:2])
        value = _in_full(node.kind, value, route)
        if node.kind is AgentDef and isinstance(value, dict):
            value = self._with_passed_devices(value, route)
        if isinstance(value, dict):
            full = self._mapping(node, value, route, indices)
            return self._with_named_behaviours(full, route) if node.kind is SubsystemDef else full
        if isinstance(value, SingleItem):
            return SingleItem(self.desugared(node.below(0), value[0], route, indices), route)
        if isinstance(value, list):
            for index, one in enumerate(value):
                if isinstance(one, dict) and FOR in one and node.below(index).has_key(FOR):
                    words = "an item of a list has no name, so there is nothing for `for` to count"
                    at = (*route, index, FOR)
                    self.report("E0108", words, at, "write `for` below a name", is_key=True)
            items = enumerate(value)
            return [self.desugared(node.below(i), one, (*route, i), indices) for i, one in items]
        if isinstance(value, str) and indices:
            kind = node.kind
            form = kind.role.form if isinstance(kind, Text) and kind.role else ""
            return self._substituted(value, indices, route, padded=form in _EXPRESSIONS)
        return value

    def _with_passed_devices(self, agent: dict[Any, Any], route: Route) -> dict[Any, Any]:
        """An agent with what `through` of its devices stands for."""
        for word in ("effector", "receptor"):
            key, virtual = f"real_{word}s", f"virtual_{word}s"
            for name, device in _mapping_in(agent, key).items():
                at = *route, key, name
                if not isinstance(device, dict) or THROUGH not in device:
                    continue
                if name in _mapping_in(agent, virtual):
                    words = (
                        f"`{name}` is defined twice: `{THROUGH}` of the device makes one as well"
                    )
                    help = f"delete `{THROUGH}` of the device, or this one"
                    self.report("E0205", words, (*route, virtual, name), help, is_key=True)
                    continue
                part = {"rate": device[THROUGH], THROUGH: "identity"}
                routes = dict.fromkeys(part, (*at, THROUGH))
                part |= {each: device[each] for each in (FOR, "title") if each in device}
                agent = _with_entry(agent, virtual, name, Desugared(part, routes), at)
                control = agent.get("control")
                if not isinstance(control, dict) or "use" in control:
                    continue
                is_many = FOR in device and _BRACES.search(str(name))
                end = {FOR: device[FOR], "is": SAME} if is_many else SAME
                for side, far in (("x", "y"), ("y", "x")):
                    if device.get(far) and name not in _mapping_in(control, side):
                        control = _with_entry(control, side, name, end)
                agent = _with(agent, "control", control)
        return agent

    def _mapping(
        self, node: SchemaNode, value: dict[Any, Any], route: Route, indices: Indices
    ) -> Any:
        copied: dict[Any, Any] = {}
        routes: dict[Any, Route] = {}
        for key, one in value.items():
            inner = node.below(key, one)
            at = route_below(value, key, route)
            kind = inner.kind
            is_single = isinstance(kind, ListKind) and type(one) in kind.form.single
            item = inner.below(0) if is_single else inner
            copies: Iterator[tuple[Any, Any]]
            is_many = isinstance(one, dict) and FOR in one and item.has_key(FOR)
            if is_many and not inner.is_chosen:
                words = f"there is only one `{key}`, so there is nothing for `for` to count"
                self.report("E0108", words, (*at, FOR), "write `for` below a name", is_key=True)
            if is_many and inner.is_chosen:
                copies = self._copies(inner, str(key), one, at, indices)
            else:
                name = self._name(key, indices, at) if indices and inner.is_chosen else key
                copies = iter([(name, self.desugared(inner, one, at, indices))])
            for name, copy in copies:
                if name in copied and not _BRACES.search(str(name)):
                    help = "let the name have all indices in braces, or choose another one"
                    self.report("E0205", f"`{name}` is defined twice", at, help)
                copied[name] = copy
                if at != (*route, name):
                    routes[name] = at
        return Desugared(copied, routes) if routes else copied

    def _with_named_behaviours(self, subsystem: Any, route: Route) -> Any:
        """Give each behaviour that stands in a state the name of the state."""
        written = subsystem.get("states")
        states = written if isinstance(written, dict) else {}
        has_own = [name for name, state in states.items() if _IN_PLACE & _keys(state)]
        if not has_own:
            return subsystem
        declared = subsystem.get("behaviours", {})
        behaviours, found = _copy(declared), _copy(states)
        for name in has_own:
            state, at = states[name], route_below(states, name, (*route, "states"))
            if "behaviour" in state:
                self.report("E0104", _TWO_BEHAVIOURS, (*at, "behaviour"), _ONE_BEHAVIOUR, True)
                continue
            if name in _keys(declared):
                message = f"behaviour `{name}` is defined twice: a state of this name has its own"
                first = route_below(declared, name, (*route, "behaviours"))
                related = (Related(Place(self.file, first, "key"), "first defined here"),)
                place = Place(self.file, at, "key")
                help = "rename the state or the declared behaviour, or write `behaviour:` here"
                self.findings.append(Diagnostic("E0205", message, place, "", related, help))
                continue
            own = {key: value for key, value in state.items() if key in _OF_BEHAVIOUR}
            rest = {key: value for key, value in state.items() if key not in _IN_PLACE}
            routes = state.routes if isinstance(state, Desugared) else {}
            behaviours[name] = Desugared(own, routes)
            behaviours.routes[name] = at
            found[name] = Desugared(rest | {"behaviour": name}, routes | {"behaviour": at})
        full = _copy(subsystem)
        full |= {"behaviours": behaviours, "states": found}
        return full

    def _copies(
        self, node: SchemaNode, name: str, value: dict[Any, Any], at: Route, around: Indices
    ) -> Iterator[tuple[str, Any]]:
        """Yield name and value of each copy of a part; without braces, indices are appended."""
        self.has_copies = True
        ranges = self._ranges(value[FOR], (*at, FOR), around)
        if ranges is None:
            return
        for chosen in product(*ranges.values()):
            own = dict(zip(ranges, chosen, strict=True))
            indices = {**around, **own}
            if _BRACES.search(name):
                copy = self._name(name, indices, at)
            else:
                copy = "_".join((name, *map(str, chosen)))
            if "-" in str(copy) and "-" not in name:
                words = f"`{copy}` is no name: an index in it is negative"
                self.report("E0108", words, (*at, FOR), _NO_NEGATIVE)
                return
            yield copy, self.desugared(node, {**value, FOR: own}, at, indices)

    def _ranges(self, value: Any, route: Route, around: Indices) -> dict[str, range] | None:
        """The values of each index, or None after reporting."""
        if not isinstance(value, dict) or not value:
            self.report("E0108", "`for` has no index", route, _A_RANGE)
            return None
        found: dict[str, range] = {}
        total = 1
        for name, text in value.items():
            at = (*route, name)
            written = self._substituted(str(text), around, at) if around else str(text)
            limits = _RANGE.fullmatch(written)
            if not str(name).isidentifier() or iskeyword(name) or name in around:
                why = "is an index already" if name in around else "is not a name"
                self.report("E0108", f"`{name}` {why}", at, "choose another name", is_key=True)
                return None
            if limits is None or isinstance(text, bool):
                self.report("E0108", f"`{written}` is not a range", at, _A_RANGE)
                return None
            first = int(limits[1])
            found[str(name)] = range(first, int(limits[2] or first) + 1)
            total *= len(found[str(name)])
        if total == 0:
            message = "there is nothing between the ends of the range"
            self.report("E0108", message, route, _A_RANGE)
            return None
        if total > MAX_COPIES:
            message = f"these are {total:,} copies, and at most {MAX_COPIES} are made"
            self.report("E0017", message, route, _FEWER)
            return None
        return found

    def _name(self, name: Any, indices: Indices, at: Route) -> Any:
        """A name without braces."""
        if not isinstance(name, str):
            return name
        before = len(self.findings)
        filled = self._substituted(name, indices, at, is_key=True)
        unknown = _BRACES.search(filled) if len(self.findings) == before else None
        if unknown:
            known = ", ".join(f"`{index}`" for index in indices)
            message = f"`{unknown[0]}` has no value: the indices are {known}"
            self.report("E0108", message, at, "write e.g. `left_{i}` or `robot_{i % 5 + 1}`", True)
        return filled

    def _substituted(
        self, text: str, indices: Indices, route: Route, padded: bool = False, is_key: bool = False
    ) -> str:
        """The text with each `{...}` that is arithmetic on indices replaced by its value.

        If `padded`, blanks after the word keep later columns in place.
        """
        written, end, missing_blanks = "", 0, 0
        padded = padded and '"' not in text and "'" not in text
        for braces in _BRACES.finditer(text):
            try:
                number = _number(braces[1], indices)
            except _IndexFault as fault:
                self.report("E0108", f"`{braces[0]}` {fault}", route, _ARITHMETIC, is_key)
                number = None
            if number is None:
                continue
            between, missing_blanks = _padded(
                text[end : braces.start()], missing_blanks, is_last=False
            )
            written, end = f"{written}{between}{number}", braces.end()
            missing_blanks += len(braces[0]) - len(str(number)) if padded else 0
        if end == len(text):
            return written
        return written + _padded(text[end:], missing_blanks, is_last=True)[0]

    def report(self, code: str, words: str, route: Route, help: str, is_key: bool = False) -> None:
        """Report a fault."""
        place = Place(self.file, route, "key" if is_key else "value")
        self.findings.append(Diagnostic(code, words, place, help=help))


_OF_BEHAVIOUR = BehaviourDef.keys.keys()
_IN_PLACE = _OF_BEHAVIOUR - Traced.keys.keys()
_TWO_BEHAVIOURS = "the state has a behaviour of its own already"
_ONE_BEHAVIOUR = (
    "delete `behaviour`, or declare what stands here under `behaviours:` and write its name"
)


def _keys(value: object) -> Set[Any]:
    return value.keys() if isinstance(value, dict) else frozenset()


def _copy(value: object) -> Desugared:
    """A mapping that may be changed; an empty one for anything else."""
    routes = value.routes if isinstance(value, Desugared) else {}
    return Desugared(value if isinstance(value, dict) else {}, routes)


_ARITHMETIC = "indices take `+`, `-`, `*`, `//` and `%`"
_WORD = re.compile(r"\A\w*")


def _padded(text: str, room: int, *, is_last: bool) -> tuple[str, int]:
    """Insert `room` blanks after the word with which a text begins.

    Returns the text and the blanks not yet inserted.
    """
    end = len(text) - len(_WORD.sub("", text, count=1))
    if room <= 0 or (end == len(text) and not is_last):
        return text, room
    return text[:end] + " " * room + text[end:], 0


def _number(text: str, indices: Indices) -> int | None:
    """The value of arithmetic on indices; None for any other text, as that of a set."""
    try:
        tree = parse_syntax(text)
    except ExprError:
        return None
    names = names_in(tree)
    return _value(tree, indices) if names and names <= indices.keys() else None


def _value(node: ast.expr, indices: Indices) -> int:
    match node:
        case ast.Name(id=name):
            return indices[name]
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            return number
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, indices)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
            values = _value(left, indices), _value(right, indices)
            if isinstance(op, (ast.FloorDiv, ast.Mod)) and values[1] == 0:
                raise _IndexFault("divides by zero")
            found = _OPERATIONS[type(op)](*values)
            if abs(found) > _LARGEST:
                raise _IndexFault("is too large a number")
            return found
    raise _IndexFault("is not arithmetic on indices")


_LARGEST = 10**18
_OPERATIONS: dict[type[ast.operator], Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
