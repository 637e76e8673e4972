"""`specc/model/wires.py` knows what is at the other end of a buffer, and who sends an input."""

import ast
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
WIRES = "model/wires.py"
OTHERS = {
    "model/system.py": "the name that a port declares; independent oracles follow it themselves",
    "resolve/agents.py": "a port whose peer is unknown is left out",
    "resolve/ends.py": "elements that are written at the other end come before there are wires",
    "tools/diff/systems.py": "two versions are compared by what they declare",
}
"""Who else reads the name at the other end of a port, and what for."""


def naming(word: str) -> dict[str, list[ast.AST]]:
    """The nodes of all modules in whose texts the word is."""
    texts = {
        module.relative_to(SPECC).as_posix(): module.read_text(encoding="utf-8")
        for module in SPECC.rglob("*.py")
    }
    return {name: [*ast.walk(ast.parse(text))] for name, text in texts.items() if word in text}


def test_one_module_knows_what_is_at_the_other_end_of_a_buffer() -> None:
    readers = {
        name
        for name, nodes in naming("other_end").items()
        if any(isinstance(node, ast.Attribute) and node.attr == "other_end" for node in nodes)
    }
    assert readers == {WIRES, *OTHERS}


def test_no_other_module_asks_ports_for_their_sender() -> None:
    """`Wires.sender` has two arguments, `Subsystem.sender` one."""
    found = {
        name
        for name, nodes in naming(".sender(").items()
        for call in nodes
        if isinstance(call, ast.Call) and len(call.args) == 1
        if isinstance(call.func, ast.Attribute) and call.func.attr == "sender"
    }
    assert found <= {"analysis/dataflow.py", "lower/requirements.py"}, (
        "these ask DataFlow, by a node"
    )
