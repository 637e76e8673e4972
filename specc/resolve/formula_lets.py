"""Names for parts of formulas, `let` beside `require`: each stands for its text."""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Collection, Iterator, Mapping
from graphlib import CycleError, TopologicalSorter

from specc.diagnostics import Related
from specc.lang import FOLLOW_UP, RESERVED, ExprError
from specc.lang.parse import DEEPEST, names_in, nodes_of, span
from specc.lang.temporal import USAGE, parse_formula
from specc.model.expr import Offsets
from specc.model.requirement import FormulaLet
from specc.resolve.context import Cursor, Findings
from specc.resolve.readings import World, formula_error
from specc.schema.files import FormulaLetDef
from specc.source import Place

MOST_NODES = 5000
"""Parts of a formula in which all names are written out."""
ReadLet = Callable[[str, str, Cursor], FormulaLet | None]
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
        self, items: Mapping[str, FormulaLetDef], where: Cursor, findings: Findings, read: ReadLet
    ) -> None:
        """Read them, each after those that it names."""
        for name in items:
            self.places[name] = where[name].key
        for name in self._ordered(items, where, findings):
            text, at = items[name].value, where[name].scalar("is")
            made = read(name, text, at)
            self._trees[name] = None
            if made is not None:
                self.found.append(made)
                try:
                    self._trees[name], self._sizes[name] = self._read(text)
                except ExprError as error:  # nothing more is read in this run
                    findings.expression_error(at, error)

    def written_out(self, tree: ast.expr, uses: dict[Offsets, Place] | None = None) -> ast.expr:
        """A formula with the text of each name in its place; `uses` gets these names.

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
        if _is_deep(found):
            message = f"with its names written out, this is nested more than {DEEPEST} deep"
            raise formula_error(tree, message, "say less in one formula", "E0303")
        return found

    def _read(self, text: str) -> tuple[ast.expr, int]:
        tree = self.written_out(parse_formula(text))
        return tree, len(nodes_of(tree))

    def _ordered(
        self, items: Mapping[str, FormulaLetDef], where: Cursor, findings: Findings
    ) -> tuple[str, ...]:
        numbers = {name: number for number, name in enumerate(items)}
        uses = {
            name: sorted(_named(item.value) & items.keys(), key=numbers.__getitem__)
            for name, item in items.items()
        }
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


def _is_deep(tree: ast.AST) -> bool:
    level = [tree]
    for _ in range(DEEPEST):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
    return bool(level)


def _named(text: str) -> set[str]:
    try:
        return names_in(parse_formula(text))
    except ExprError:
        return set()


class _Writer(ast.NodeTransformer):
    """Writes what names stand for in their place, where no variable of a quantifier has one."""

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
        """A name that stands for something."""
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


# A name means one thing.


def refuse_names(
    lets: Collection[str],
    above: Mapping[str, Place],
    known: Mapping[str, Place],
    members: Collection[str],
    world: World,
) -> Iterator[tuple[str, str, tuple[Related, ...]]]:
    """Lets that may not have their names: each with the message, and what has that name.

    `known` are constants, `members` those of enums.
    """
    agents = {agent.name: agent.place for agent in world.agents}
    states = {s.name: s.place for a in world.agents for m in a.subsystems for s in m.states}
    named = (
        ("another let", above),
        ("a constant", known),
        ("an agent", agents),
        ("a state", states),
    )
    for name in lets:
        if name in RESERVED or name in USAGE or name in ("state", "plant"):
            yield name, f"`{name}` is a word of formulas and cannot name a let", ()
        for kind, others in named:
            if name in others:
                related = (Related(others[name], kind),)
                yield name, f"`{name}` names a let and {kind}", related
        if name in members and name not in states:
            yield name, f"`{name}` names a let and a member of an enum", ()
        if any(name in groups for groups in world.groups.values()):
            yield name, f"`{name}` names a let and a group", ()
