"""What is wrong with an expression, as exceptions that carry the data of a diagnostic."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from specc.diagnostics.nearest import is_slip, surely_meant
from specc.expr.origin import Origin
from specc.model.expr import Expr
from specc.model.types import Type

FOR_WANT_OF_CONTEXT = ("E0231", "E0317", "E0318")
"""Codes of what would not be wrong with an expression where its type is expected."""


_WAYS_OUT = {
    "E0201": "declare it, e.g. under `let:` or `constants:`",
    "E0234": "only records, vectors and spatial vectors have parts",
    "E0302": "write an operator for it",
    "E0310": "write a value of that type, or change the declaration",
    "E0311": "quantities of one unit go together; multiply or divide to get there",
    "E0312": "a pose between the frames takes one to the other: `pose[A, B] @ pose[B, C]`",
    "E0313": "choose components, e.g. `v[0]` or `v.x`, or compute it in an operator",
    "E0315": "pass a value of that type",
    "E0321": "give it to an operator that takes `partial[...]`, or keep the number beside it",
}
"""What helps with a finding of a code where nothing better is known."""


class ExprErrors(Exception):
    """Everything that is wrong with one text; `errors` has at least one entry, in text order.

    `expr` is what it means all the same, if that is clear but for unknown parts.
    """

    def __init__(self, errors: Iterable[ExprError], expr: Expr | None = None) -> None:
        self.expr = expr
        self.errors: tuple[ExprError, ...] = tuple(
            sorted(errors, key=lambda error: (error.start, error.end))
        )
        super().__init__("\n".join(error.message for error in self.errors))


class ExprError(ExprErrors):
    """One finding: `code` of the registry, and character offsets into the text as it was given.

    `repair` is what should surely stand between the offsets, if anything does. `origins` say how
    the types that do not agree came about; `expected` is the type that the text around asked for.
    """

    def __init__(
        self, message: str, start: int, end: int, help: str = "", code: str = "E0310"
    ) -> None:
        self.message = message
        self.start = start
        self.end = end
        self.help = help or _WAYS_OUT.get(code, "")
        self.code = code
        self.repair = ""
        self.origins: tuple[Origin, ...] = ()
        self.expected: Type | None = None
        super().__init__((self,))

    def meant(self, name: str, close: Sequence[str]) -> ExprError:
        """This finding, about a name between the offsets that is like the `close` ones."""
        self.repair = surely_meant(name, close)
        return self

    def because(self, origins: Iterable[Origin], expected: Type | None = None) -> ExprError:
        """This finding, with the places that the types in it come from."""
        self.origins = tuple(dict.fromkeys(origins))
        self.expected = expected
        return self

    def not_there(self, message: str, help: str, name: str, close: Sequence[str]) -> ExprError:
        """This finding, or an open point if the name is no slip: it may be still to come."""
        if not is_slip(name, close):
            self.code, self.message = "O0205", message
            default = self.help in (help, *_WAYS_OUT.values())
            self.help = help if default else or_else(help, self.help)
        return self

    def moved(self, by: int) -> ExprError:
        """The same finding about a text that starts `by` characters earlier."""
        moved = ExprError(self.message, self.start + by, self.end + by, self.help, self.code)
        moved.repair = self.repair
        return moved.because(self.origins, self.expected)


def or_else(way: str, suggestion: str) -> str:
    """How a part is added, and what may be meant in its place."""
    joint = ", or " if suggestion.startswith("did you mean") else "; "
    return f"{way}{joint}{suggestion}" if suggestion else way


def one_of(names: Iterable[object]) -> str:
    """a; a or b; a, b or c, each in backticks: alternatives for a help line."""
    quoted = [f"`{name}`" for name in names]
    return " or ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)


def listed(names: Iterable[object]) -> str:
    """Names in backticks, with commas between."""
    return ", ".join(f"`{name}`" for name in names)
