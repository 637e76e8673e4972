"""Parameters that stand for the sizes of vectors and images: whole numbers, known before a run."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from functools import partial

from specc.diagnostics import Related
from specc.lang import A_SIZE, Environment, ExprError, evaluate, is_size
from specc.lang.mentioned import names_of_interface, names_of_signature, names_of_type
from specc.limits import take
from specc.model.expr import Call, walk
from specc.model.system import Constant
from specc.resolve.context import Findings, Where
from specc.resolve.definitions import Definitions, OpenSize, inlined
from specc.resolve.library import Loaded
from specc.schema.places import role_of

_READ = {"type": names_of_type, "signature": names_of_signature, "interface": names_of_interface}


@dataclass(slots=True)
class Sizes:
    """Finds the sizes that a description is given by the names in force where it is used."""

    file: Loaded
    outer: Definitions
    findings: Findings
    found: dict[str, int] = field(default_factory=dict)

    def add(self, given: Constant, where: Where) -> bool:
        """Take in a parameter with its argument at `where`; False after reporting it.

        It can be any whole number as long as nothing in the description has it as its size, and as
        long as it is open.
        """
        number = self._number(given)
        if isinstance(number, OpenSize) or (number is not None and is_size(number)):
            self.found[given.name] = number
            return True
        use = next(_uses(self.file.top, given.name, self.file.spec.types), None)
        if use is None:
            return True
        is_told = "a number that only a run can tell" if number is None else str(number)
        message = f"`{given.name}` is a size, {A_SIZE}, and not {is_told}"
        related = (Related(use.place, f"`{given.name}` is the size of this"),)
        help = "write how many components there are, or a constant that no operator computes"
        self.findings.report("E0224", message, where.place, related=related, help=help)
        return False

    def _number(self, given: Constant) -> int | None:
        """The value of a parameter, if it is known; that of an open size is open as well."""
        still = {f"?{n}": s for n, s in self.outer.sizes.items() if isinstance(s, OpenSize)}
        marks = {name: partial(int, size.mark) for name, size in still.items()}
        try:
            value = inlined(given.value, self.outer.constants)
            env = Environment(operators=marks, count=partial(take, "folding"))
            number = int(evaluate(value, env))
        except (LookupError, ArithmeticError, ValueError, ExprError):
            return None
        is_open = any(isinstance(part, Call) for part in walk(value))
        return OpenSize(number, given.name) if is_open else number


def _uses(where: Where, name: str, types: Collection[str]) -> Iterator[Where]:
    """The texts of types that have a name in the place of a size."""
    if isinstance(where.raw, str):
        role = role_of(where.route)
        read = _READ.get(role.form) if role is not None else None
        if read and any(n.kind == "size" and n.name == name for n in read(where.raw, types)):
            yield where
        return
    keys = where.raw if isinstance(where.raw, dict) else range(_length(where.raw))
    for key in keys:
        yield from _uses(where[key], name, types)


def _length(raw: object) -> int:
    return len(raw) if isinstance(raw, list) else 0
