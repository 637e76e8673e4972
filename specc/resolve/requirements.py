"""Resolves requirements: formulas whose names are values of all subsystems of a system."""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from graphlib import CycleError, TopologicalSorter
from typing import Any, cast

from specc.diagnostics import Related
from specc.lang import (
    FOLLOW_UP,
    RESERVED,
    Declaration,
    ExprError,
    ExprErrors,
    Scope,
    check,
    expand_groups,
)
from specc.lang.errors import collect
from specc.lang.parse import DEEPEST, names_in, nodes_of, span
from specc.lang.syntax import TIMED, USAGE, parse_formula, refuse_misspelling
from specc.limits import MAX_SPAN_S
from specc.model.expr import Expr, Logic, Offsets, has_unknown
from specc.model.requirement import (
    BoolOp,
    FormulaLet,
    Reading,
    Requirement,
    Stays,
    Temporal,
    TemporalFormula,
    TickCondition,
    horizon_s,
    span_of,
)
from specc.model.requirement import expressions_in as expressions_in
from specc.model.system import Device
from specc.model.types import Bool, Opaque, Real, nested_types
from specc.model.units import SECOND
from specc.resolve.context import Findings, Meaning, Use, YamlNode
from specc.resolve.expressions import Expressions, known_number
from specc.resolve.library import constant_scope
from specc.resolve.readings import Names, World, formula_error
from specc.schema.files import FormulaLetDef, RequirementDef
from specc.source import Place

MOST_NODES = 5000
"""Parts of a formula in which all names are written out."""
ReadLet = Callable[[str, str, YamlNode], FormulaLet | None]
"""Resolves a let by its name and text, or None after reporting."""


class Lets:
    """The names that formulas may use; what one stands for is counted before it is written out."""

    def __init__(self, above: Lets | None = None) -> None:
        """Those `above` hold as well."""
        self._trees: dict[str, ast.expr | None] = dict(above._trees) if above else {}
        self._sizes: dict[str, int] = dict(above._sizes) if above else {}
        self.places: dict[str, Place] = dict(above.places) if above else {}
        self.found: list[FormulaLet] = above.found if above else []
        """Those without errors, in order of dependence."""

    def define(
        self, items: Mapping[str, FormulaLetDef], where: YamlNode, findings: Findings, read: ReadLet
    ) -> None:
        """Resolve lets in order of dependence."""
        for name in items:
            self.places[name] = where[name].key
        for name in self._ordered(items, where, findings):
            text, at = items[name].value, where[name]["is"]
            let = read(name, text, at)
            self._trees[name] = None
            if let is not None:
                self.found.append(let)
                try:
                    tree = self.written_out(parse_formula(text))
                    self._trees[name], self._sizes[name] = tree, len(nodes_of(tree))
                except ExprError as error:  # nothing more is read in this run
                    findings.expression_error(at, error)

    def written_out(self, tree: ast.expr, uses: dict[Offsets, Place] | None = None) -> ast.expr:
        """Replace each name in a formula by its text; `uses` gets these names.

        Raises:
            ExprError: a name has errors, means something else there, or too much is written out.
        """
        nodes = nodes_of(tree)
        size = len(nodes)
        for node in nodes:
            if isinstance(node, ast.Name):
                size += self._sizes.get(node.id, 0)
                if size > MOST_NODES:
                    message = f"a formula has at most {MOST_NODES} parts, its names written out"
                    raise formula_error(node, message, "say less in one formula", "E0017")
        if not self._trees:
            return tree
        writer = _Writer(self._trees, self.places, {} if uses is None else uses)
        found: ast.expr = writer.visit(tree)
        level: list[ast.AST] = [found]
        for _ in range(DEEPEST):
            level = [child for node in level for child in ast.iter_child_nodes(node)]
        if level:
            message = f"with its names written out, this is nested more than {DEEPEST} deep"
            raise formula_error(tree, message, "say less in one formula", "E0303")
        return found

    def _ordered(
        self, items: Mapping[str, FormulaLetDef], where: YamlNode, findings: Findings
    ) -> tuple[str, ...]:
        uses: dict[str, list[str]] = {name: [] for name in items}
        for name, item in items.items():
            with suppress(ExprError):
                names = names_in(parse_formula(item.value))
                uses[name] = [other for other in items if other in names]
        while True:
            try:
                return tuple(TopologicalSorter(uses).static_order())
            except CycleError as error:
                cycle: list[str] = error.args[1][::-1]
                path = " -> ".join(f"`{name}`" for name in cycle)
                message = f"`{cycle[0]}` is defined by itself: {path}"
                help = "say what it stands for without its own name"
                findings.report("E0206", message, where[cycle[0]].key, help=help)
                self._trees |= dict.fromkeys(cycle)
                rest = [name for name in uses if name not in cycle]
                uses = {name: [n for n in uses[name] if n in rest] for name in rest}


class _Writer(ast.NodeTransformer):
    """Replaces names by the texts that they stand for, unless a variable hides them."""

    def __init__(
        self,
        trees: Mapping[str, ast.expr | None],
        places: Mapping[str, Place],
        uses: dict[Offsets, Place],
    ) -> None:
        self._trees, self._places, self._uses = trees, places, uses
        self._bound: frozenset[str] = frozenset()

    def visit_GeneratorExp(self, node: ast.GeneratorExp) -> ast.expr:
        """The variable of a quantifier hides a name."""
        outer = self._bound
        for part in node.generators:
            part.iter = self.visit(part.iter)
            if isinstance(part.target, ast.Name):
                self._bound |= {part.target.id}
        node.elt = self.visit(node.elt)
        self._bound = outer
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace a name that stands for something."""
        if node.id in self._bound or node.id not in self._trees:
            return node
        self._uses[span(node)] = self._places[node.id]
        tree = self._trees[node.id]
        if tree is None:
            raise ExprError("", *span(node), code=FOLLOW_UP)
        written = copy.deepcopy(tree)
        for part in nodes_of(written):
            if isinstance(part, ast.Name) and part.id in self._bound:
                message = f"`{node.id}` names `{part.id}`, which is a variable here"
                raise formula_error(node, message, "give the variable another name")
            if isinstance(part, ast.expr | ast.keyword):
                ast.copy_location(part, node)
        return written


@dataclass(frozen=True, slots=True)
class FormulaResolver:
    """Resolves formulas in a world; `lets` are the names that all formulas may use.

    In the contracts of a `device` `x.E.arm.q` and `y.E.arm.q_d` are what it reports and accepts.
    """

    world: World
    expressions: Expressions
    lets: Lets
    device: Device | None = None

    def requirements(
        self, definitions: Sequence[RequirementDef], where: YamlNode
    ) -> tuple[Requirement, ...]:
        """Resolve requirements; returns those without errors and reports the others."""
        findings, first = self.expressions.findings, dict[str, YamlNode]()
        for item, at in [(item, where[i]["name"]) for i, item in enumerate(definitions)]:
            if item.name is not None and first.setdefault(item.name, at) is not at:
                message = f"requirement `{item.name}` is defined twice"
                related = (Related(first[item.name].place, "the other one"),)
                help = "give one of the two another name"
                findings.report("E0205", message, at.place, related=related, help=help)
        found = []
        for i, item in enumerate(definitions):
            inside = self.with_lets(item.let, where[i]["let"]) if item.let else self
            that = where[i]["that"]
            found.append(inside.requirement(item.that, item.because, that, item.name or ""))
        return tuple(each for each in found if each is not None)

    def with_lets(self, items: Mapping[str, FormulaLetDef], where: YamlNode) -> FormulaResolver:
        """A copy that knows these names as well."""
        lets, findings = Lets(self.lets), self.expressions.findings
        definitions, refused = self.expressions.definitions, set[str]()
        subsystems = [s for agent in self.world.agents for s in agent.subsystems]
        states = {state.name: state.place for s in subsystems for state in s.states}
        modes = {mode.name: mode.place for s in subsystems for mode in s.modes}
        defined: tuple[tuple[str, Mapping[str, Place]], ...] = (
            ("another let", self.lets.places),
            ("a constant", {c.name: c.place for c in definitions.constants.values()}),
            ("an agent", {agent.name: agent.place for agent in self.world.agents}),
            ("a state", states),
            ("a mode", modes),
        )
        members = constant_scope(definitions).enums

        def refuse(name: str, message: str, related: tuple[Related, ...] = ()) -> None:
            refused.add(name)
            place, help = where[name].key, "choose another name"
            findings.report("E0221", message, place, related=related, help=help)

        for name in items:
            if name in RESERVED or name in USAGE or name in ("state", "plant"):
                refuse(name, f"`{name}` is a word of formulas and cannot name a let")
            for kind, others in defined:
                if name in others:
                    related = (Related(others[name], kind),)
                    refuse(name, f"`{name}` names a let and {kind}", related)
            if name in members and name not in states:
                refuse(name, f"`{name}` names a let and a member of an enum")
            if any(name in groups for groups in self.world.groups.values()):
                refuse(name, f"`{name}` names a let and a group")
        known = {name: item for name, item in items.items() if name not in refused}
        inside = FormulaResolver(self.world, self.expressions, lets)
        lets.define(known, where, findings, inside._named)
        return inside

    def requirement(
        self, text: str, because: str, at: YamlNode, name: str = ""
    ) -> Requirement | None:
        """Resolve a requirement; None after reporting an error."""
        reader = _RequirementReader(text, self)
        found = self._read(reader, at, reader.requirement)
        if not isinstance(found, TemporalFormula):
            return None
        readings, names = tuple(reader.readings.values()), reader.names
        of = self.device.qualified_name if self.device else ""
        return Requirement(text, because, found, reader.lasts, readings, at.place, name, names, of)

    def _named(self, name: str, text: str, at: YamlNode) -> FormulaLet | None:
        """What a let stands for; None after reporting an error."""
        reader = _RequirementReader(text, self)
        found = self._read(reader, at, reader.named)
        if found is None:
            return None
        names, place = reader.names, self.lets.places[name]
        if not isinstance(found, TemporalFormula):
            return FormulaLet(name, None, found, names, place)
        readings = tuple(reader.readings.values())
        formula = Requirement(text, "", found, True, readings, at.place, name, names)
        return FormulaLet(name, formula, None, names, place)

    def _read(
        self,
        reader: _RequirementReader,
        at: YamlNode,
        read: Callable[[], TemporalFormula | Expr],
    ) -> TemporalFormula | Expr | None:
        """Read a text and note its meaning for editors; None after reporting."""
        found, expr = None, None
        try:
            found = read()
        except ExprErrors as failure:
            reader.note_others()
            for error in failure.errors:
                self.expressions.report(at, reader.text, error)
        else:
            if isinstance(found, TemporalFormula):
                parts = tuple(dict.fromkeys(expressions_in(found)))
            else:
                parts = (found,)
            expr = Logic("and", parts, type=Bool(), span=(0, len(reader.text)))
        findings, places = self.expressions.findings, self.expressions.definitions.places
        findings.meanings.append(Meaning(at, reader.text, reader.scope, expr, places))
        findings.uses += [Use(at.place.within(*s), of) for s, of in reader.uses.items()]
        return found


class _RequirementReader:
    """Resolves one requirement: `readings` are values of agents, `scope` all other names."""

    def __init__(self, text: str, known: FormulaResolver) -> None:
        world, expressions = known.world, known.expressions
        self.readings: dict[str, Reading] = {}
        self.text = text
        self.lasts = False
        self._lets = known.lets
        self._many = world.groups
        self._read: list[ast.expr] = []
        self._definitions = expressions.definitions
        self.scope = constant_scope(expressions.definitions)
        self._device = known.device
        self._names = Names(text, world, self.readings, self.scope.names())
        self.uses = self._names.uses

    def requirement(self) -> TemporalFormula:
        """The formula, without an outer `always(...)`; `lasts` is whether there was one.

        Raises:
            ExprErrors: the errors in the text.
        """
        tree = self._tree()
        self.lasts = _operator(tree) == "always"
        inner = self._arguments(tree, 1)[0] if self.lasts else tree
        formula = self._formula(inner)
        if (reach := horizon_s(formula)) > MAX_SPAN_S:
            message = f"it is known {float(reach):g} s later what this formula says of a moment"
            help = f"let it look ahead over at most {MAX_SPAN_S} s, all in all"
            raise formula_error(inner, message, help)
        return formula

    def named(self) -> TemporalFormula | Expr:
        """The meaning of a `let`: a formula, or a value.

        Raises:
            ExprErrors: the errors in the text.
        """
        tree = self._tree()
        is_negation = isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.Not)
        if isinstance(tree, ast.BoolOp) or _operator(tree) or is_negation:
            return self._formula(tree)
        refuse_misspelling(tree, self.scope.operators)
        expr = self._condition(tree, None)
        return TickCondition(expr) if isinstance(expr.type, Bool) else expr

    @property
    def names(self) -> frozenset[str]:
        """The lets that the text names."""
        found = ((self.text[slice(*at)], of) for at, of in self.uses.items())
        return frozenset(name for name, of in found if self._lets.places.get(name) == of)

    def note_others(self) -> None:
        """Note what names name beside an error, which may be in the first part of the text."""
        for tree in self._read:
            self._names.note_others(tree)

    def _tree(self) -> ast.expr:
        self._read = [parse_formula(self.text)]
        tree = self._lets.written_out(self._read[0], self.uses)
        self._names.note_groups(tree)
        for root, groups in self._many.items():
            tree = expand_groups(tree, groups, root)
        self._read = [tree]
        self._names.refuse_unknown_groups(tree)
        return tree if self._device is None else _ContractNames(self._device).visit(tree)

    def _formula(self, node: ast.expr) -> TemporalFormula:
        match node:
            case ast.BoolOp():
                both = isinstance(node.op, ast.And)
                return BoolOp("and" if both else "or", self._all(node.values), span(node))
            case ast.UnaryOp(op=ast.Not()):
                return BoolOp("not", self._all([node.operand]), span(node))
        op = _operator(node)
        if op == "implies":
            premise, conclusion = self._all(self._arguments(node, 2))
            opposite = BoolOp("not", (premise,), span_of(premise))
            return BoolOp("or", (opposite, conclusion), span(node), premise)
        if op == "since":
            return Temporal("since", self._all(self._arguments(node, 2)), at=span(node))
        if op == "stays":
            value, span_node = self._arguments(node, 2)
            span_s, reach = self._span(span_node)
            watched = self._condition(value, None)
            if any(isinstance(type_, Opaque) for type_ in nested_types([watched.type])):
                help = "name a part of it that is a number, a vector, a pose, a text or a record"
                raise formula_error(value, f"values of {watched.type} cannot be compared", help)
            return Stays(watched, span_s, reach, span(node))
        if op in TIMED:
            span_node, operand = self._arguments(node, 2)
            span_s, reach = self._span(span_node)
            return Temporal(cast(Any, op), self._all([operand]), span_s, reach, span(node))
        if op == "always":
            help = "what holds for some time is `throughout(0.2[s], p)`"
            raise formula_error(node, "`always` stands only around a whole requirement", help)
        refuse_misspelling(node, self.scope.operators)
        return TickCondition(self._condition(node, Bool()))

    def _all(self, nodes: Sequence[ast.expr]) -> tuple[TemporalFormula, ...]:
        """The formulas of some operands; raises the errors of all of them together."""
        return tuple(collect(*(partial(self._formula, node) for node in nodes)))

    def _condition(self, node: ast.expr, expected: Bool | None) -> Expr:
        for inner in nodes_of(node)[1:]:
            if isinstance(inner, ast.Call) and (op := _operator(inner)):
                message = f"`{op}` stands inside a value"
                help = "join formulas with `and`, `or`, `not` and `implies` only"
                raise formula_error(inner, message, help)
        named = self._names.visit(node)
        if self._device is not None:
            self._refuse_others(self._device, named)
        read = {r.name: Declaration(r.type, r.place) for r in self.readings.values()}
        return self._typed(named, replace(self.scope, memory=read), expected)

    def _refuse_others(self, device: Device, tree: ast.expr) -> None:
        """Report a value in a contract that is none of its device."""
        for node in nodes_of(tree):
            if not isinstance(node, ast.Name) or node.id not in self.readings:
                continue
            reading = self.readings[node.id]
            name = reading.name.removeprefix("present(").removesuffix(")")
            if not name.startswith(f"{device.qualified_name}."):
                message = f"`{name}` is no value of the device `{device.qualified_name}`"
                help = "a contract is about one device; say the rest in `require:`"
                raise formula_error(node, message, help)

    def _typed(self, node: ast.expr, scope: Scope, expected: Bool | Real | None) -> Expr:
        expr = check(node, self.text, scope, expected)
        if has_unknown(expr):
            raise ExprError("", *span(node), code=FOLLOW_UP)
        return self._definitions.inlined(expr)

    def _span(self, node: ast.expr) -> tuple[Fraction, Expr]:
        expr = self._typed(node, self.scope, Real(SECOND))
        value = known_number(expr, self._definitions.constants, "E0335")
        if not 0 <= value <= MAX_SPAN_S:
            message = f"a formula reaches over 0 to {MAX_SPAN_S} s, not over {value:g} s"
            help = "give the bound of the time within which it is decided"
            raise formula_error(node, message, help)
        return Fraction(str(value)), expr

    def _arguments(self, node: ast.expr, count: int) -> list[ast.expr]:
        op = _operator(node)
        if isinstance(node, ast.Call) and len(node.args) == count and not node.keywords:
            return node.args
        help = f"it is written `{USAGE[op]}`"
        if op in TIMED:
            help += ": a run remembers only so much, so every operator but `always` has a bound"
        raise formula_error(node, f"`{op}` takes {count} argument{'s' * (count > 1)}", help)


class _ContractNames(ast.NodeTransformer):
    """Writes `agent.E.arm.q` for `x.E.arm.q` and `y.E.arm.q` in a contract of a device."""

    def __init__(self, device: Device) -> None:
        self._device = device
        letter = "E" if device.kind == "real_effector" else "R"
        self._prefixes = {side: f"{side}.{letter}.{device.name}" for side in ("x", "y")}

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Write out the name of an element, or report one of the other direction."""
        match node.value:
            case ast.Attribute(ast.Attribute(ast.Name("x" | "y" as side) as first, "E" | "R"), _):
                of_device = self._device.x if side == "y" else self._device.y
                others = self._device.y if side == "y" else self._device.x
                is_own = ast.unparse(node.value) == self._prefixes[side]
                is_swapped = node.attr in {item.name for item in others}
                if is_own and is_swapped and node.attr not in {item.name for item in of_device}:
                    other = self._prefixes["x" if side == "y" else "y"]
                    does = "reports" if side == "y" else "accepts"
                    message = f"`{node.attr}` is what the device {does}"
                    raise formula_error(node, message, f"write `{other}.{node.attr}`")
                first.id = self._device.agent
                return node
        return self.generic_visit(node)  # type: ignore[return-value]  # an expression stays one


def _operator(node: ast.expr) -> str:
    """The temporal operator that a node applies, else an empty text."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in USAGE:
        return node.func.id
    return ""
