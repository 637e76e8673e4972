"""What is wrong with an expression, as exceptions that carry the data of a diagnostic."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from specc.diagnostics.nearest import surely_meant
from specc.expr.origin import Origin
from specc.model.expr import Expr
from specc.model.types import Type

FOR_WANT_OF_CONTEXT = ("E0231", "E0317", "E0318")
"""Codes of what would not be wrong with an expression where its type is expected."""


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
        self.help = help
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

    def moved(self, by: int) -> ExprError:
        """The same finding about a text that starts `by` characters earlier."""
        moved = ExprError(self.message, self.start + by, self.end + by, self.help, self.code)
        moved.repair = self.repair
        return moved.because(self.origins, self.expected)


def one_of(names: Iterable[str]) -> str:
    """`a`, `a or b`, `a, b or c`: alternatives for a help line."""
    listed = list(names)
    return " or ".join([", ".join(listed[:-1]), listed[-1]] if len(listed) > 1 else listed)
