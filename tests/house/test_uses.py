"""Which definition does a name name? `specc/resolve` looks names up; `resolve/uses.py` tells it."""

import ast
from pathlib import Path

import pytest

SPECC = Path(__file__).resolve().parents[2] / "specc"
NOTING = {"resolve/context.py", "resolve/uses.py", "resolve/requirements.py"}
"""Who notes that a place names a definition: in tables, in expressions, in formulas."""
READING = {
    "parse_formula": {"resolve/requirements.py": "lets and requirements"},
    "parse_syntax": {
        "resolve/expansion.py": "the elements that go through",
        "schema/desugar.py": "the indices of a `for`",
        "tools/lsp/index.py": "the members that a type declares",
    },
    "names_of": {
        "resolve/uses.py": "what they name",
        "resolve/reuse.py": "parameters that stand for sizes",
    },
    "names_of_type": {"resolve/definitions.py": "the sizes that make an operator another one"},
    "visible": {"tools/lsp/completion.py": "proposals", "tools/lsp/rename.py": "a name is free"},
}
"""Who reads a text for the names in it, or lists names that are in force, and what for."""


def nodes_with(word: str, folder: str = "") -> dict[str, list[ast.AST]]:
    """The nodes of all modules in whose texts the word is; those of `lang` give the functions."""
    texts = {
        module.relative_to(SPECC).as_posix(): module.read_text(encoding="utf-8")
        for module in (SPECC / folder).rglob("*.py")
    }
    found = {name: text for name, text in texts.items() if word in text}
    return {n: [*ast.walk(ast.parse(t))] for n, t in found.items() if not n.startswith("lang/")}


@pytest.mark.parametrize("function", READING)
def test_names_are_read_where_they_get_their_meaning(function: str) -> None:
    folder = "tools/lsp" if function == "visible" else ""
    readers = {
        name
        for name, nodes in nodes_with(function, folder).items()
        if any(
            function in (getattr(node, "id", ""), getattr(node, "attr", ""))
            and isinstance(node, (ast.Name, ast.Attribute))
            for node in nodes
        )
    }
    assert readers == READING[function].keys(), "ask `specc.resolve.uses` what a name names"


def test_resolving_notes_what_names_name_and_nobody_else() -> None:
    makers = {
        name
        for name, nodes in nodes_with("Use(").items()
        if any(isinstance(n, ast.Call) and getattr(n.func, "id", "") == "Use" for n in nodes)
    }
    assert makers == NOTING
