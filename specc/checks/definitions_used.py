"""What the main file defines for all agents is used by one of them."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.references import expressions
from specc.model.expr import Call, ConstantRef, walk
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0240, once there are agents; a library may well define more than one system needs."""
    if not system.subsystems:
        return
    operators: set[str] = set()
    constants: set[str] = set()
    values = [constant.value for constant in system.constants]
    for expression in (*values, *(e for s in system.subsystems for e in expressions(s))):
        for node in walk(expression):
            if isinstance(node, Call):
                operators.add(node.operator)
            elif isinstance(node, ConstantRef):
                constants.add(node.name)
    for what, items, names in (
        ("operator", system.operators, operators),
        ("constant", system.constants, constants),
    ):
        for item in items:
            if item.place.file == system.file and item.name not in names:
                message = f"{what} `{item.name}` is not used"
                yield Diagnostic("W0240", message, item.place, help="use or delete it")
