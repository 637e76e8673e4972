"""`specc/lang/evaluate.py` knows what the values of an expression lie between."""

import ast
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
ASKED = {
    "lower/terms.py": "of operands and constants, terms",
    "mjcf/model.py": "of a joint",
    "resolve/library.py": "of a constant",
    "resolve/panel.py": "of what an operator sets",
}
"""Other modules in which something has a range."""


def test_one_module_reads_the_ranges_of_operators_and_functions() -> None:
    readers = set()
    for module in SPECC.rglob("*.py"):
        text, name = module.read_text(encoding="utf-8"), module.relative_to(SPECC).as_posix()
        if (".range" not in text and "CONDITIONS" not in text) or name.startswith("tools/lsp/"):
            continue  # ranges of text
        nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Attribute)]
        if any(node.attr in ("range", "CONDITIONS") for node in nodes):
            readers.add(name)
    assert readers == {"lang/evaluate.py", *ASKED}
