"""An operator is known by its row in `specc/lang/values.py`; others ask how it is used."""

import ast
import re
from collections.abc import Iterator

from specc.lang.values import SIGNS
from tests.house.tree import ROOT

SPECC = ROOT / "specc"
ASKED = {
    "lang/operators.py": "which types may stand at it: its rule of typing",
    "lang/evaluate.py": "the range of the opposite of a number",
    "lang/show.py": "how `-a` and `a ** -b` are written",
    "lower/nodes.py": "how `a ** -b` and motions are written in Python",
    "lower/terms.py": "whether infinity shows in a result, and which results are new arrays",
    "analysis/suspicious_expressions.py": "which parts count, what is added up",
    "analysis/reaching.py": "what it does to each number of vectors",
    "checks/memory.py": "what counts up",
    "checks/expressions.py": "a minus sign before a number",
    "proof/clock.py": "whether a result changes with time only as a multiple of it does",
    "proof/numbering.py": "squares, and opposites of numbers",
    "proof/dependencies.py": "what is added up",
    "proof/solver/terms.py": "arithmetic that the solver has; factors without rounding",
    "proof/translate.py": "a difference as a distance",
    "tools/doc/formulas.py": "how quotients, powers and opposites are set",
    "tools/explore/cuts.py": "where an operand is cut by the other one",
    "tools/explore/ranking.py": "what is added to a number",
}
"""The modules that name an operator, and the question about its place in an expression."""
OPERATOR = {"op", "word", "sign"}
"""How an expression's operator is called where it is compared."""


def named(tree: ast.AST) -> Iterator[ast.AST]:
    """The texts that a module compares the operator of an expression with."""
    for node in ast.walk(tree):
        if isinstance(node, ast.MatchClass):
            of = zip(node.kwd_attrs, node.kwd_patterns, strict=True)
            yield from (pattern for name, pattern in of if name == "op")
            yield from (each for each in node.patterns if isinstance(each, ast.MatchValue))
        elif isinstance(node, ast.Match) and _is_operator(node.subject):
            yield from (case.pattern for case in node.cases)
        elif isinstance(node, ast.Subscript) and _is_operator(node.slice):
            yield node.value
        elif isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            yield from sides if any(map(_is_operator, sides)) else ()


def _is_operator(node: ast.AST) -> bool:
    return getattr(node, "attr", getattr(node, "id", "")) in OPERATOR


def signs(module: str) -> set[str]:
    """The operators that a module names."""
    letters = set("".join(SIGNS))
    if not re.search(rf"""["'][{re.escape("".join(letters))}]+["']""", module):
        return set()
    parts = (part for found in named(ast.parse(module)) for part in ast.walk(found))
    texts = [part.value for part in parts if isinstance(part, ast.Constant)]
    return {text for text in texts if isinstance(text, str) and text and set(text) <= letters}


def test_modules_that_name_an_operator_ask_nothing_that_its_row_says() -> None:
    paths = {path.relative_to(SPECC).as_posix(): path for path in SPECC.rglob("*.py")}
    found = {name for name, path in paths.items() if signs(path.read_text(encoding="utf-8"))}
    assert found == ASKED.keys()


def test_a_module_that_names_an_operator_is_found() -> None:
    assert signs("if expr.op == '+': pass") == {"+"}
    assert signs("if sign in '+-': pass") == {"+-"}
    assert signs("{'+': add}[expr.op]") == {"+"}
    assert signs("match expr.op:\n    case '+': pass") == {"+"}
    assert signs("match expr:\n    case Binary('+', a, b): pass") == {"+"}
    assert signs("match expr:\n    case Binary(op='*' | '/'): pass") == {"*", "/"}
    assert not signs("if name == '+': pass")
