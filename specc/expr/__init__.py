"""The expression language: text to syntax, syntax to typed expressions, and back to text.

`parse` and `check` are the way in, `show` the way out, `evaluate` says what an expression means.
Types and operator signatures are read here too. Nothing here executes what a file contains.
"""

from specc.expr.errors import FOR_WANT_OF_CONTEXT, ExprError, ExprErrors, or_else
from specc.expr.evaluate import Environment, evaluate
from specc.expr.parse import CUT_SHORT, parse
from specc.expr.parse_types import TYPE_WORDS, TypeNames, parse_type
from specc.expr.scope import RESERVED, Declared, Scope, members_of
from specc.expr.show import show
from specc.expr.signatures import Signature, parse_signature
from specc.expr.typing import check, expression

__all__ = [
    "CUT_SHORT",
    "FOR_WANT_OF_CONTEXT",
    "RESERVED",
    "TYPE_WORDS",
    "Declared",
    "Environment",
    "ExprError",
    "ExprErrors",
    "Scope",
    "Signature",
    "TypeNames",
    "check",
    "evaluate",
    "expression",
    "members_of",
    "or_else",
    "parse",
    "parse_signature",
    "parse_type",
    "show",
]
