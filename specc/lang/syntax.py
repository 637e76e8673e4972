"""Rewriting of syntax trees: temporal operators, and groups of peers.

`p implies q` is read as a call before Python's syntax is. `all(r.ready for r in x.robots)` becomes
`x.robots_1.ready and x.robots_2.ready`, so that proofs, presence and age see plain elements. The
new nodes have the columns of those that they come from.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from specc.diagnostics import nearest
from specc.lang.builtins import BUILTIN_NAMES
from specc.lang.errors import ExprError, did_you_mean, quoted
from specc.lang.parse import nodes_of, parse, span
from specc.limits import MAX_SPREAD_PARTS, OUT_OF_PARTS, spend
from specc.model.expr import LENGTH

TIMED = ("within", "throughout", "once", "historically")
USAGE = MappingProxyType(
    {name: f"{name}(0.2[s], p)" for name in TIMED}
    | {"stays": "stays(v, 0.2[s])"}
    | {"always": "always(p)", "since": "since(p, q)", "implies": "p implies q"}
)
"""The operators of formulas and how each is written."""
_TOKEN = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'(?:[^'\\]|\\.)*'|\b(?:implies|for)\b|[()\[\]{},]")


def parse_formula(text: str) -> ast.expr:
    """A new syntax tree of a formula, which the caller may change; raises `ExprError`."""
    if not re.search(r"\bimplies\b", text):
        return parse(text, own=True)
    written, origins = _implies_as_calls(text)
    try:
        tree = parse(written, own=True)
    except ExprError as error:
        start, end = _original(origins, error.start, error.end)
        raise ExprError(error.message, start, end, error.help, error.code) from None
    for node in nodes_of(tree):
        if isinstance(node, ast.expr | ast.keyword):
            begin, end = node.col_offset, node.end_col_offset or node.col_offset
            node.col_offset, node.end_col_offset = _original(origins, begin, end)
    return tree


def refuse_misspelling(node: ast.expr, operators: Iterable[str]) -> None:
    """Raise `ExprError` for a call of what is meant to be an operator of formulas."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        name, known = node.func.id, {*operators, *BUILTIN_NAMES, "state"}
        close = () if name in known else nearest(name, [*known, *USAGE])
        if not USAGE.keys().isdisjoint(close):
            help = did_you_mean(close)
            error = ExprError(f"unknown operator `{name}`", *span(node.func), help, "E0201")
            raise error.set_repair(name, close)


def _original(origins: list[int], start: int, end: int) -> tuple[int, int]:
    last = len(origins) - 1
    return origins[min(start, last)], origins[min(max(end - 1, 0), last)] + 1


def _implies_as_calls(text: str) -> tuple[str, list[int]]:
    """Write each `p implies q` as `implies(p, q)`, and give each character's original offset.

    It binds weaker than anything else and to the right: `p implies (q implies r)`.
    """
    out: list[tuple[str, int]] = []
    operand_starts = [0]  # by bracket: where the last operand begins
    open_calls = [0]  # by bracket: calls to close

    def close(at: int) -> None:
        out.extend((")", max(at - 1, 0)) for _ in range(open_calls[-1]))
        open_calls[-1] = 0

    done = 0
    for token in _TOKEN.finditer(text):
        offset, word = token.start(), token[0]
        out += [(char, done + i) for i, char in enumerate(text[done:offset])]
        done = token.end()
        if word == "implies" and any(not char.isspace() for char, _ in out[operand_starts[-1] :]):
            first = out[operand_starts[-1]][1]
            out[operand_starts[-1] : operand_starts[-1]] = [(char, first) for char in "implies("]
            out.append((",", offset))
            open_calls[-1] += 1
            operand_starts[-1] = len(out)
            continue
        if word in (")", "]", "}", ",", "for"):  # of a quantifier: what it says is over
            close(offset)
        out += [(char, offset + i) for i, char in enumerate(word)]
        if word in "([{":
            operand_starts.append(len(out))
            open_calls.append(0)
        elif word in ")]}" and len(operand_starts) > 1:
            operand_starts.pop()
            open_calls.pop()
        elif word == ",":
            operand_starts[-1] = len(out)
    out += [(char, done + i) for i, char in enumerate(text[done:])]
    close(len(text))
    return "".join(char for char, _ in out), [origin for _, origin in out]


Members = Mapping[tuple[int, ...], str]
"""Indices of each member of a group -> the peer that it is."""

Root = Literal["x", "plant", ""]
"""What the name of a group stands below: inputs, what is observed, or nothing for agents."""
_ARE = {"x": "peers", "plant": "values", "": "agents"}
_USES = {
    "x": "write e.g. `x.{0}[1].e`, `len(x.{0})` or `all(fresh(r.e) for r in x.{0})`",
    "plant": "write e.g. `plant.{0}[1]`, `len(plant.{0})` or `all(v > 0 for v in plant.{0})`",
    "": "write e.g. `{0}[1].c.n`, `len({0})` or `all(state(r.c) == S0 for r in {0})`",
}


def expand_groups(tree: ast.expr, groups: Mapping[str, Members], root: Root = "x") -> ast.expr:
    """The expression without groups; raises `ExprError` where one is used otherwise."""
    if not groups:
        return tree
    expander = _Expander(groups, root)
    if not any(isinstance(n, ast.expr) and expander.group(n) for n in nodes_of(tree)):
        return tree
    expanded: ast.expr = expander.visit(deepcopy(tree))
    return expanded


@dataclass(eq=False, slots=True)
class _Expander(ast.NodeTransformer):
    groups: Mapping[str, Members]
    root: Root
    parts: int = 0

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Write out `all`, `any`, `argmin` or `argmax` over a group, or the `len` of one."""
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        match node.args:
            case [over] if name == LENGTH and (group := self.group(over)) is not None:
                return ast.copy_location(ast.Constant(len(group)), node)
            case [ast.GeneratorExp(elt=body, generators=[each])] if name in _EXPANSIONS:
                group = self.group(each.iter)
                if group is not None and isinstance(each.target, ast.Name) and not each.ifs:
                    bodies = self._expand(body, each.target.id, group, node)
                    return ast.copy_location(_EXPANSIONS[name](bodies, group, node), node)
        return self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        """Replace one member of a group by its peer: `x.robots[1]`, `x.cells[1][2]`."""
        over: ast.expr = node
        numbers: list[ast.expr] = []
        while isinstance(over, ast.Subscript):
            numbers.insert(0, over.slice)
            over = over.value
        group = self.group(over)
        if group is None:
            return self.generic_visit(node)
        at = tuple(n.value for n in numbers if isinstance(n, ast.Constant) and type(n.value) is int)
        if at not in group or len(at) < len(numbers):
            known = ["][".join(map(str, one)) for one in group][:_MAX_SHOWN]
            shown = quoted(f"[{one}]" for one in known) + (
                ", ..." if len(group) > _MAX_SHOWN else ""
            )
            message = f"`{ast.unparse(over)}` has no such member"
            raise ExprError(message, *span(node), f"there are {shown}", "E0238")
        return _peer(self.root, group[at], node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """Refuse a group of peers where a value or a single peer has to stand."""
        self._refuse(node, node.attr)
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Refuse the name of a group of agents where a value has to stand."""
        self._refuse(node, node.id)
        return node

    def _refuse(self, node: ast.expr, name: str) -> None:
        if (group := self.group(node)) is not None:
            message = f"`{ast.unparse(node)}` are {len(group)} {_ARE[self.root]} and no value"
            raise ExprError(message, *span(node), _USES[self.root].format(name), "E0238")

    def group(self, node: ast.expr) -> Members | None:
        """The group that a node names; None if it names none."""
        match node:
            case ast.Attribute(value=ast.Name(id=self.root), attr=name):
                return self.groups.get(name)
            case ast.Name(id=name) if not self.root:
                return self.groups.get(name)
        return None

    def _expand(
        self, body: ast.expr, variable: str, group: Members, whole: ast.Call
    ) -> list[ast.expr]:
        """Write the body out for each member."""
        name = whole.func.id if isinstance(whole.func, ast.Name) else ""
        is_compared = name in _COMPARED_NAMES and len(group) <= _MAX_COMPARED
        times = len(group) if is_compared else 1
        self._count(len(group) * len(nodes_of(body)), times, whole)
        members = (_Substitution(variable, at, peer, self.root) for at, peer in group.items())
        return [self.visit(member.visit(deepcopy(body))) for member in members]

    def _count(self, parts: int, cost_factor: int, whole: ast.expr) -> None:
        """Count parts about to be written out; raises `ExprError` beyond a bound.

        Each part costs `cost_factor` of the work budget; `MAX_SPREAD_PARTS` bounds their number.
        """
        self.parts += parts
        message = ""
        if not spend("parts", parts * cost_factor * _PART_COST):
            message = OUT_OF_PARTS
        if self.parts > MAX_SPREAD_PARTS:
            message = f"written out for each member, this has more than {MAX_SPREAD_PARTS} parts"
        if message:
            raise ExprError(message, *span(whole), "say it of fewer peers, or of less", "E0017")


_MAX_SHOWN = 8
_PART_COST = 4
"""Parts that one counts for which is written out: checks look at it as if it stood in the text."""


@dataclass(eq=False, slots=True)
class _Substitution(ast.NodeTransformer):
    """Replaces a variable by one member: by its peer, or by its number where it stands alone.

    What is observed is a value where it stands alone.
    """

    variable: str
    at: tuple[int, ...]
    peer: str
    root: Root

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        match node.value:
            case ast.Name(id=self.variable) as name:
                node.value = _peer(self.root, self.peer, name)
                return node
        return self.generic_visit(node)

    def visit_GeneratorExp(self, node: ast.GeneratorExp) -> ast.AST:
        """Substitute in a quantifier, unless its variable hides this one."""
        first = node.generators[0]
        if not isinstance(first.target, ast.Name) or first.target.id != self.variable:
            return self.generic_visit(node)
        first.iter = self.visit(first.iter)
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id != self.variable:
            return node
        is_value = self.root == "plant"
        return _peer(self.root, self.peer, node) if is_value else _member_number(self.at, node)


def _peer(root: Root, name: str, node: ast.expr) -> ast.expr:
    if not root:
        return ast.copy_location(ast.Name(name, ast.Load()), node)
    above = ast.copy_location(ast.Name(root, ast.Load()), node)
    return ast.copy_location(ast.Attribute(above, name, ast.Load()), node)


def _member_number(indices: tuple[int, ...], node: ast.expr) -> ast.expr:
    """The number of a group member as a constant.

    Raises `ExprError` if members have several indices.
    """
    if len(indices) > 1:
        message = f"the members are numbered by {len(indices)} indices, and this is one number"
        raise ExprError(message, *span(node), "say what you need of an element", "E0238")
    return ast.copy_location(ast.Constant(indices[0]), node)


def _as_logic(
    op: Callable[[], ast.boolop],
) -> Callable[[list[ast.expr], Members, ast.Call], ast.expr]:
    def build(bodies: list[ast.expr], group: Members, node: ast.Call) -> ast.expr:
        return bodies[0] if len(bodies) == 1 else ast.BoolOp(op(), bodies)

    return build


_MAX_COMPARED = 32


def _as_choice(
    op: Callable[[], ast.cmpop],
) -> Callable[[list[ast.expr], Members, ast.Call], ast.expr]:
    def build(bodies: list[ast.expr], group: Members, node: ast.Call) -> ast.expr:
        """The number of the first member that no later one is better than."""
        if len(bodies) > _MAX_COMPARED:
            message = f"these are {len(bodies)} peers, and at most {_MAX_COMPARED} are compared"
            help = "compare them in an operator, or in groups"
            raise ExprError(message, *span(node), help, "E0017")
        numbers = [_member_number(at, node) for at in group]
        found = numbers[-1]
        for index in range(len(bodies) - 2, -1, -1):
            better: list[ast.expr] = [
                ast.copy_location(ast.Compare(bodies[index], [op()], [other]), node)
                for other in bodies[index + 1 :]
            ]
            test = better[0] if len(better) == 1 else ast.BoolOp(ast.And(), better)
            found = ast.IfExp(ast.copy_location(test, node), numbers[index], found)
            found = ast.copy_location(found, node)
        return found

    return build


_COMPARED_NAMES = ("argmin", "argmax")
"""What is said of each member is compared with that of each later one."""
_EXPANSIONS = {
    "all": _as_logic(ast.And),
    "any": _as_logic(ast.Or),
    "argmin": _as_choice(ast.LtE),
    "argmax": _as_choice(ast.GtE),
}
