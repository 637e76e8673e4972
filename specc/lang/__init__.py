"""The expression language: text to syntax, syntax to typed expressions, and back to text.

`parse` and `check` are the way in, `show` the way out, `evaluate` says what an expression means.
Types and operator signatures are read here too. Nothing here executes what a file contains.
"""

from specc.lang.builtins import RESERVED
from specc.lang.errors import (
    FOLLOW_UP,
    NEEDS_CONTEXT,
    Declaration,
    ExprError,
    ExprErrors,
    Scope,
    declarations,
    enums_by_member,
    joined_help,
)
from specc.lang.evaluate import Environment, evaluate
from specc.lang.parse import CUT_SHORT, count_parts, parse, parse_syntax
from specc.lang.show import show
from specc.lang.syntax import Members, expand_groups
from specc.lang.types import (
    A_SIZE,
    TYPE_WORDS,
    TypeNames,
    is_size,
    parse_interface,
    parse_signature,
    parse_type,
)
from specc.lang.typing import check, expression

__all__ = [
    "A_SIZE",
    "CUT_SHORT",
    "FOLLOW_UP",
    "NEEDS_CONTEXT",
    "RESERVED",
    "TYPE_WORDS",
    "Declaration",
    "Environment",
    "ExprError",
    "ExprErrors",
    "Members",
    "Scope",
    "TypeNames",
    "check",
    "count_parts",
    "declarations",
    "enums_by_member",
    "evaluate",
    "expand_groups",
    "expression",
    "is_size",
    "joined_help",
    "parse",
    "parse_interface",
    "parse_signature",
    "parse_syntax",
    "parse_type",
    "show",
]
