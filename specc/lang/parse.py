"""Text to a syntax tree of Python's, restricted to the constructs of the language; never `eval`.

The trees that leave this module have `col_offset` and `end_col_offset` in characters of the text
as it was given, line breaks counted (Python counts bytes of UTF-8 within a line).
"""

from __future__ import annotations

import ast
import re
import warnings
from functools import lru_cache

from specc.lang.errors import FOLLOW_UP, ExprError
from specc.limits import DESCRIBE_LESS, OUT_OF_PARTS, remaining, spend

LONGEST = 10_000
DEEPEST = 64
_LARGEST_NUMBER = 1e300

_LANGUAGE = frozenset({
    ast.Name, ast.Attribute, ast.Constant, ast.Subscript, ast.Slice, ast.Call, ast.List, ast.Set,
    ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.GeneratorExp,
    ast.comprehension, ast.keyword, ast.Load, ast.Store, ast.And, ast.Or, ast.Not, ast.USub,
    ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.MatMult,
    ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq, ast.In, ast.NotIn, ast.Is, ast.IsNot,
})  # fmt: skip
_UNSUPPORTED = {
    ast.Tuple: ("a tuple", "write a vector or a list in square brackets"),
    ast.Dict: ("a dict", "a record comes from an operator"),
    ast.Lambda: ("a lambda", "name the value under `let:` or write an operator"),
    ast.ListComp: ("a list comprehension", "only `all(...)` and `any(...)` go over items"),
    ast.SetComp: ("a set comprehension", "only `all(...)` and `any(...)` go over items"),
    ast.DictComp: ("a dict comprehension", "only `all(...)` and `any(...)` go over items"),
    ast.NamedExpr: ("an assignment", "name the value under `let:`"),
    ast.JoinedStr: ("a formatted text", "write the text in plain quotes"),
    ast.Starred: ("an unpacking", "write the items out"),
    ast.FloorDiv: ("the operator `//`", "divide with `/`"),
    ast.Mod: ("the operator `%`", "write an operator for the remainder"),
    ast.BitAnd: ("the operator `&`", "write `and`"),
    ast.BitOr: ("the operator `|`", "write `or`"),
    ast.BitXor: ("the operator `^`", "powers are written `a**2`"),
    ast.Invert: ("the operator `~`", "write `not`"),
    ast.UAdd: ("a leading `+`", "leave the `+` out"),
}
_NO_EXPRESSION = "this is not an expression"
_NOT_CLOSED = "the bracket is not closed"
_TEXT_OPEN = "the text is not closed"
_TOO_EARLY = "the expression ends too early"
CUT_SHORT = (_NOT_CLOSED, _TEXT_OPEN, _TOO_EARLY)
"""What is said of an expression that lacks its end."""
_COMMENT = "`#` begins a comment, which an expression does not have: leave it out"
_CHECK = "check brackets, quotes and signs near here"
_MESSAGES = (
    ("never closed", _NOT_CLOSED),
    ("unmatched", "the bracket closes nothing"),
    ("does not match", "the bracket does not match the one that was opened"),
    ("unterminated string", _TEXT_OPEN),
    ("expected 'else'", "a choice has two branches: `a if c else b`"),
)
"""Part of what Python says -> what we say, whatever the version of Python."""
_HINTS = (
    (r"&&", "write `and` for `&&`"),
    (r"\|\|", "write `or` for `||`"),
    (r"!(?!=)", "write `not` for `!`"),
    (r"[-+*/]=|\+\+|--", "write the new value itself, as `n + 1`"),
    (r"(?<![<>=!:])=(?!=)", "compare with `==`"),
    (
        r"(?<![\w.])\.?\d[\d.]*(?:e[+-]?\d+)? *[A-Za-z]",
        "a unit is written in brackets: `0.02[m/s]`",
    ),
    (r"[≤≥≠∧∨¬∈×·]", "use `<=`, `>=`, `!=`, `and`, `or`, `not`, `in`, `*`"),
)


_NUMBER = re.compile("0|[1-9][0-9]{0,14}")
"""Texts that need no parser; many are such."""
_MAX_CACHED_TEXT, _CACHED = 200, 1_000
"""Characters of a text whose tree is kept, and how many are: an editor reads most of them again."""

# A byte of the command line that is no UTF-8 arrives as half of a surrogate pair.
_UNENCODABLE = re.compile("[\0\ud800-\udfff]")


def parse(text: str, *, own: bool = False) -> ast.expr:
    """Parse an expression; raises `ExprError` with offsets into `text`.

    Its parts count as parts of the run. It is the caller's `own` to change, or nobody's.
    """
    count_parts(0, 0, len(text))  # where nothing is left, nothing more is read
    tree, nodes = _parse_uncached(text) if own else _read(text)
    count_parts(len(nodes), 0, len(text))
    for node in nodes:
        if type(node) not in _LANGUAGE:
            raise _unsupported_error(node, nodes)
    return tree


def count_parts(parts: int, start: int, end: int) -> None:
    """Count parts that are about to be typed; raises `ExprError` beyond the budget."""
    if not spend("parts", parts):
        is_first = remaining("parts") + parts >= 0
        code = "E0017" if is_first else FOLLOW_UP
        raise ExprError(OUT_OF_PARTS, start, end, DESCRIBE_LESS, code)


def parse_syntax(text: str) -> ast.expr:
    """Parse any expression of Python, within bounds."""
    return _read(text)[0]


def _read(text: str) -> tuple[ast.expr, list[ast.AST]]:
    """The tree and all its nodes, parents first; nobody changes them."""
    return _parsed_cached(text) if len(text) <= _MAX_CACHED_TEXT else _parse_uncached(text)


def _parse_uncached(text: str) -> tuple[ast.expr, list[ast.AST]]:
    if _NUMBER.fullmatch(text):
        constant = ast.Constant(
            int(text), lineno=1, col_offset=0, end_lineno=1, end_col_offset=len(text)
        )
        return constant, [constant]
    if len(text) > LONGEST:
        message = f"the expression has {len(text)} characters; at most {LONGEST} are read"
        raise ExprError(message, LONGEST, len(text), "split it with `let:`", "E0303")
    line = text.replace("\n", " ").replace("\r", " ")
    lead = len(line) - len(line.lstrip(" \t\f"))
    if lead == len(line):
        raise ExprError("the expression is empty", 0, len(text), "write a value", "E0301")
    if foreign := _UNENCODABLE.search(line):
        message = "the text has a character that no expression has"
        raise ExprError(message, *foreign.span(), "delete it", "E0301")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(line[lead:], mode="eval").body
    except SyntaxError as error:
        raise _syntax_error(error, text, lead) from None
    except (ValueError, RecursionError, MemoryError):
        raise _too_deep(text) from None
    nodes = _nodes(tree, text)
    if lead or not line.isascii():
        _count_characters(nodes, line[lead:], lead)
        _refuse_compatibility_characters(nodes, text)
    constants = [node for node in nodes if type(node) is ast.Constant]
    for constant in constants:
        _check_constant(constant)
    if "#" in line:
        _refuse_comment(constants, line)
    return tree, nodes


_parsed_cached = lru_cache(_CACHED)(_parse_uncached)


def _syntax_error(error: SyntaxError, text: str, lead: int) -> ExprError:
    if "nested" in error.msg:
        return _too_deep(text)
    for pattern, hint in _HINTS:
        if found := re.search(pattern, text):
            return ExprError(_NO_EXPRESSION, *found.span(), hint, "E0301")
    if not error.offset:
        last = len(text.rstrip())
        return ExprError(
            _TOO_EARLY,
            last - 1,
            last,
            "something is missing at the end",
            "E0301",
        )
    start = min(error.offset - 1 + lead, len(text) - 1)
    end = min(max((error.end_offset or 0) - 1 + lead, start + 1), len(text))
    message = next((own for part, own in _MESSAGES if part in error.msg), _NO_EXPRESSION)
    comment = message == _NOT_CLOSED and "#" in text[end:]
    return ExprError(message, start, end, _COMMENT if comment else _CHECK, "E0301")


def _too_deep(text: str) -> ExprError:
    message = f"the expression is nested more than {DEEPEST} deep"
    return ExprError(message, 0, len(text), "split it with `let:`", "E0303")


def _nodes(tree: ast.expr, text: str) -> list[ast.AST]:
    nodes: list[ast.AST] = []
    level: list[ast.AST] = [tree]
    for _ in range(DEEPEST):
        nodes += level
        level = [child for node in level for child in _children(node)]
        if not level:
            return nodes
    raise _too_deep(text)


def nodes_of(tree: ast.AST) -> list[ast.AST]:
    """A tree and all below it, as `ast.walk` gives them, in a third of the time."""
    found = [tree]
    for node in found:  # it grows
        found += _children(node)
    return found


def names_in(tree: ast.AST) -> set[str]:
    """All names in a tree."""
    return {node.id for node in nodes_of(tree) if isinstance(node, ast.Name)}


_LEAVES = (ast.Name, ast.Constant)


def _children(node: ast.AST) -> list[ast.AST]:
    """What `ast.iter_child_nodes` gives, without the generator and the markers of loading."""
    if type(node) in _LEAVES:
        return []
    found: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if isinstance(value, list):
            found += [item for item in value if isinstance(item, ast.AST)]
        elif isinstance(value, ast.AST) and type(value) is not ast.Load:
            found.append(value)
    return found


def _count_characters(nodes: list[ast.AST], line: str, lead: int) -> None:
    """Convert offsets in bytes of `line` into offsets in characters of the text around it."""
    offsets = [lead + i for i, char in enumerate(line) for _ in char.encode()]
    offsets.append(lead + len(line))
    for node in nodes:
        if isinstance(node, (ast.expr, ast.keyword)):
            node.col_offset = offsets[node.col_offset]
            node.end_col_offset = offsets[node.end_col_offset or 0]


def _refuse_compatibility_characters(nodes: list[ast.AST], text: str) -> None:
    """Refuse names that Python normalises to other letters, such as ligatures."""
    for node in nodes:
        name = getattr(node, "id", None) or getattr(node, "attr", None)
        if isinstance(node, ast.expr) and name and not text[: span(node)[1]].endswith(name):
            message = f"this name is read as `{name}`"
            raise ExprError(message, *span(node), "write it with plain letters", "E0301")


def _check_constant(node: ast.Constant) -> None:
    value = node.value
    if value is not None and not isinstance(value, (bool, int, float, str)):
        message = f"{type(value).__name__} is not in the language"
        raise ExprError(message, *span(node), code="E0302")
    if isinstance(value, (int, float)) and not abs(value) <= _LARGEST_NUMBER:
        raise ExprError("the number is too large", *span(node), "choose a larger unit", "E0304")


def _refuse_comment(constants: list[ast.Constant], line: str) -> None:
    """Refuse a comment, which would swallow what follows it once line breaks are removed."""
    texts = [span(constant) for constant in constants]
    for offset, char in enumerate(line):
        if char == "#" and not any(start <= offset < end for start, end in texts):
            help = "write it as `title:` beside the expression"
            raise ExprError("an expression has no comments", offset, len(line), help, "E0301")


def _unsupported_error(node: ast.AST, nodes: list[ast.AST]) -> ExprError:
    what, help = _UNSUPPORTED.get(type(node), (type(node).__name__.lower(), ""))
    if isinstance(node, ast.expr):
        return ExprError(f"{what} is not in the language", *span(node), help, "E0302")
    owner = next(n for n in nodes if isinstance(n, ast.expr) and node in _children(n))
    return ExprError(f"{what} is not in the language", *span(owner), help, "E0302")


def span(node: ast.expr | ast.keyword) -> tuple[int, int]:
    """The offsets of a parsed node in its text."""
    return node.col_offset, node.end_col_offset or node.col_offset
