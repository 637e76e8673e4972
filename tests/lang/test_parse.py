"""Texts to trees: what is in the language, where things stand, and what no text can do."""

import ast
import contextlib
import warnings

import pytest

from specc.lang import ExprError, ExprErrors, expression, parse
from specc.lang.context import Context
from specc.lang.parse import span
from specc.model.expr import walk
from tests.strategies import MODE, SCOPE


def failure(text: str) -> ExprError:
    with pytest.raises(ExprError) as caught:
        parse(text)
    return caught.value


@pytest.mark.parametrize(
    ("text", "code", "message", "marked", "help"),
    [
        ("", "E0301", "the expression is empty", "", "write a value"),
        (" \n ", "E0301", "the expression is empty", " \n ", "write a value"),
        ("a + ", "E0301", "the expression ends too early", "+", "something is missing at the end"),
        (
            "a b",
            "E0301",
            "this is not an expression",
            "b",
            "check brackets, quotes and signs near here",
        ),
        (
            "(a + (b)",
            "E0301",
            "the bracket is not closed",
            "(",
            "check brackets, quotes and signs near here",
        ),
        (
            "a) + (b",
            "E0301",
            "the bracket closes nothing",
            ")",
            "check brackets, quotes and signs near here",
        ),
        (
            "a + [b)",
            "E0301",
            "the bracket does not match the one that was opened",
            ")",
            "check brackets, quotes and signs near here",
        ),
        (
            "1 + x.ﬁle",
            "E0301",
            "this name is read as `file`",
            "x.ﬁle",
            "write it with plain letters",
        ),
        (
            "'abc",
            "E0301",
            "the text is not closed",
            "'",
            "check brackets, quotes and signs near here",
        ),
        (
            "a if b",
            "E0301",
            "a choice has two branches: `a if c else b`",
            "a if b",
            "check brackets, quotes and signs near here",
        ),
        ("a && b", "E0301", "this is not an expression", "&&", "write `and` for `&&`"),
        ("a || b", "E0301", "this is not an expression", "||", "write `or` for `||`"),
        ("!a", "E0301", "this is not an expression", "!", "write `not` for `!`"),
        ("a = b", "E0301", "this is not an expression", "=", "compare with `==`"),
        (
            "n += 1",
            "E0301",
            "this is not an expression",
            "+=",
            "write the new value itself, as `n + 1`",
        ),
        (
            "n++",
            "E0301",
            "this is not an expression",
            "++",
            "write the new value itself, as `n + 1`",
        ),
        (
            "a ≤ b",
            "E0301",
            "this is not an expression",
            "≤",
            "use `<=`, `>=`, `!=`, `and`, `or`, `not`, `in`, `*`",
        ),
        (
            "d > 2 mm",
            "E0301",
            "this is not an expression",
            "2 m",
            "a unit is written in brackets: `0.02[m/s]`",
        ),
        (
            "a # + b",
            "E0301",
            "an expression has no comments",
            "# + b",
            "write it as `title:` beside the expression",
        ),
        (
            "near(a, #b)",
            "E0301",
            "the bracket is not closed",
            "(",
            "`#` begins a comment, which an expression does not have: leave it out",
        ),
        ("a \0", "E0301", "the text has a character that no expression has", "\0", "delete it"),
        (
            "lambda: 1",
            "E0302",
            "a lambda is not in the language",
            "lambda: 1",
            "name the value under `let:` or write an operator",
        ),
        (
            "[v for v in w]",
            "E0302",
            "a list comprehension is not in the language",
            "[v for v in w]",
            "only `all(...)` and `any(...)` go over items",
        ),
        (
            "f'{a}'",
            "E0302",
            "a formatted text is not in the language",
            "f'{a}'",
            "write the text in plain quotes",
        ),
        (
            "(a := 1)",
            "E0302",
            "an assignment is not in the language",
            "a := 1",
            "name the value under `let:`",
        ),
        (
            "a // b",
            "E0302",
            "the operator `//` is not in the language",
            "a // b",
            "divide with `/`",
        ),
        ("c or a & b", "E0302", "the operator `&` is not in the language", "a & b", "write `and`"),
        ("+a", "E0302", "a leading `+` is not in the language", "+a", "leave the `+` out"),
        (
            "(a, b)",
            "E0302",
            "a tuple is not in the language",
            "(a, b)",
            "write a vector or a list in square brackets",
        ),
        ("f(*a)", "E0302", "an unpacking is not in the language", "*a", "write the items out"),
        ("...", "E0302", "ellipsis is not in the language", "...", "write an operator for it"),
        ("2j", "E0302", "complex is not in the language", "2j", "write an operator for it"),
        ("b'a'", "E0302", "bytes is not in the language", "b'a'", "write an operator for it"),
        ("1e999", "E0304", "the number is too large", "1e999", "choose a larger unit"),
        ("1 + " + "9" * 400, "E0304", "the number is too large", "9" * 400, "choose a larger unit"),
    ],
)
def test_what_is_refused(text: str, code: str, message: str, marked: str, help: str) -> None:
    error = failure(text)
    found = (error.code, error.message, text[error.start : error.end], error.help)
    assert found == (code, message, marked, help)


def test_too_long_a_text_is_refused_before_it_is_read() -> None:
    error = failure("a + " * 2500 + "a")
    assert (error.code, error.start, error.end) == ("E0303", 10_000, 10_001)
    assert error.message == "the expression has 10001 characters; at most 10000 are read"


@pytest.mark.parametrize(
    "text",
    [
        "(" * 5000 + "a" + ")" * 4999,
        "[" * 90 + "]" * 90,
        "-" * 9999 + "1",
        "not " * 2499 + "a",
        "x" + ".x" * 4999,
        "a" + "+a" * 4999,
        "a" + "**a" * 3000,
        "f(" * 3000 + ")" * 3000,
        "a if a else " * 800 + "a",
        "all(" * 150 + "a" + " for v in w)" * 150,
    ],
)
def test_deep_nesting_is_an_error_like_others(text: str) -> None:
    assert failure(text).code == "E0303"


@pytest.mark.parametrize(
    ("inner", "step"),
    [
        ("1", "0 < ({}) < 1"),
        ("1[m]", "({}) if entered else 2"),
        ("1[m]", "0 if entered else ({})"),
        ("1[m]", "norm([{}])"),
        ("1[m]", "[{}]"),
        ("1[m]", "norm([[{}], [1[m]]])"),
        ("1[m]", "max(0, {})"),
        ("1[m]", "({} + 0)"),
        ("T_c", "inverse({})"),
        ("1[m]", "abs(2 * [{}][0])"),
    ],
)
def test_every_part_is_typed_once(inner: str, step: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Typing a part twice on every level would take exponential time."""
    infer, count = Context.infer, 0

    def counted(self: Context, *args: object) -> object:
        nonlocal count
        count += 1
        return infer(self, *args)

    monkeypatch.setattr(Context, "infer", counted)
    text = inner
    for _ in range(12):
        text = step.format(text)
    with contextlib.suppress(ExprErrors):
        expression(text, SCOPE)
    assert count <= len(list(ast.walk(parse(text))))


def test_offsets_count_characters_and_line_breaks() -> None:
    text = "  π_1 +\n  (naïve -\r\n 'ü' ) *\t₂x"
    text = text.replace("₂", "")
    names = {n.id: span(n) for n in ast.walk(parse(text)) if isinstance(n, ast.Name)}
    assert {text[slice(*at)] for at in names.values()} == {"π_1", "naïve", "x"}


@pytest.mark.parametrize(
    "text",
    [
        "near(T_c, x.c.T_d, tolerance, 1[deg]) or F_c.z > 2[N] and not entered",
        "all(v in {u, c} for v in x.c.b) if elapsed > 0 else 0 < ratio <= 1",
        "widen(best.d, -ratio ** 2) - 1.5[mm] * (x.c.n + len(seen)) < tolerance",
    ],
)
def test_every_node_marks_its_own_text(text: str) -> None:
    spread = "\n\t" + text.replace(" ", "\n  ")
    inside = SCOPE.binding("v", MODE)
    for node in walk(expression(spread, SCOPE)):
        own = spread[slice(*node.span)]
        scope = SCOPE if own.startswith("all") else inside
        assert expression(own, scope, node.type) == node


def test_python_has_nothing_to_say_about_odd_literals() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert expression(r"'\d' == '\d'", SCOPE)
        assert expression("1[m] > 0[m]", SCOPE)
        assert expression("0x1if entered else 2", SCOPE)


def test_a_text_may_contain_what_else_starts_a_comment() -> None:
    assert isinstance(parse("'#1' == '#2'"), ast.Compare)
