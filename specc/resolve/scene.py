"""Numbers that are drawn from the seed of a run, and what the scene of a task says of joints."""

from __future__ import annotations

from collections.abc import Iterator

from specc.lang import ExprError
from specc.model.expr import Expr
from specc.model.task import Draw
from specc.model.types import Int, Real
from specc.model.units import DIMENSIONLESS, Unit
from specc.resolve.command_line import Given
from specc.resolve.context import Findings, Where
from specc.resolve.definitions import Definitions
from specc.resolve.expressions import Expressions, known_number
from specc.resolve.library import constant_scope
from specc.schema.files import DrawDef, SceneDef

_FORMS = "write a number with its unit, `[least, greatest]` or `{one_of: [...]}`"


def starts_of(
    scene: SceneDef, where: Where, findings: Findings, definitions: Definitions, given: Given
) -> Iterator[Draw]:
    """Where joints are when a run begins; `specc.checks` compares them with the model."""
    for name, item in scene.starts.items():
        at = where[name]
        texts = [text for text, _ in _texts(item, at)]
        written = next((text for text in texts if "[" in text), "")
        if other := given.instead(f"scene.{name}", written):
            item, at = DrawDef(fixed=str(other.raw), given=frozenset({"is"})), other
        start = draw_of(name, item, at, findings, definitions)
        if start is not None:
            yield start


def draw_of(
    name: str,
    item: DrawDef,
    at: Where,
    findings: Findings,
    definitions: Definitions,
) -> Draw | None:
    """A number that is drawn, with what it is of; None after reporting."""
    texts = list(_texts(item, at))
    between = item.least is not None and item.greatest is not None
    if not texts or item.given - {"for"} not in _GIVEN:
        findings.report("E0516", f"it is not clear what `{name}` is", at.place, help=_FORMS)
        return None
    found = [number_of(text, place, findings, definitions) for text, place in texts]
    known = [position for position in found if position is not None]
    if len(known) < len(found):
        return None
    if between and known[0][1] > known[1][1]:
        message = f"the least value of `{name}` is greater than the greatest"
        findings.report("E0516", message, at.place, help="write the least one first")
        return None
    values = tuple((value, unit) for _, value, unit in known)
    return Draw(name, values, tuple(expr for expr, _, _ in known), between, at.key)


_GIVEN = ({"is"}, {"from", "to"}, {"one_of"})


def _texts(item: DrawDef, at: Where) -> Iterator[tuple[str, Where]]:
    """The texts of the positions, each with its place."""
    if item.fixed is not None:
        yield item.fixed, at.scalar("is")
    for text, key, index in ((item.least, "from", 0), (item.greatest, "to", 1)):
        if text is not None:
            yield text, at.cell(key, index)
    for index, text in enumerate(item.one_of):
        yield text, at["one_of"][index]


def number_of(
    text: str, at: Where, findings: Findings, definitions: Definitions
) -> tuple[Expr, float, Unit] | None:
    """An expression with its value and unit; None after reporting."""
    expressions = Expressions(findings, definitions)
    expr = expressions.value(at, text, constant_scope(definitions), None)
    if expr is None:
        return None
    if not isinstance(expr.type, Real | Int):
        help = "write a number with its unit, e.g. `0.3[m]`"
        findings.report("E0516", f"`{text}` is not a number", at.place, help=help)
        return None
    try:
        value = known_number(expr, definitions.constants, "E0516")
    except ExprError as error:
        expressions.report(at, text, error)
        return None
    return expr, value, expr.type.unit if isinstance(expr.type, Real) else DIMENSIONLESS
