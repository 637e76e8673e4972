"""`specc/model/wires.py` knows what is at the other end of a buffer, and who sends an input."""

import ast
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
WIRES = "model/wires.py"
OTHERS = {
    "model/system.py": "the name that a port declares; independent oracles follow it themselves",
    "resolve/agents.py": "a port whose peer is unknown is left out",
    "tools/diff/values.py": "two versions are compared by what they declare",
}
"""Who else reads the name at the other end of a port, and what for."""


def reads_other_ends(module: Path) -> bool:
    """Whether a module reads the name of the part at the other end of a port."""
    nodes = ast.walk(ast.parse(module.read_text(encoding="utf-8")))
    return any(isinstance(node, ast.Attribute) and node.attr == "other_end" for node in nodes)


def test_one_module_knows_what_is_at_the_other_end_of_a_buffer() -> None:
    readers = {m.relative_to(SPECC).as_posix() for m in SPECC.rglob("*.py") if reads_other_ends(m)}
    assert readers == {WIRES, *OTHERS}


def test_no_other_module_asks_ports_for_their_sender() -> None:
    """`Wires.sender` has two arguments, `Subsystem.sender` one."""

    def calls(module: Path) -> list[ast.Call]:
        nodes = ast.walk(ast.parse(module.read_text(encoding="utf-8")))
        return [n for n in nodes if isinstance(n, ast.Call) and len(n.args) == 1]

    found = {
        m.relative_to(SPECC).as_posix()
        for m in SPECC.rglob("*.py")
        for call in calls(m)
        if isinstance(call.func, ast.Attribute) and call.func.attr == "sender"
    }
    assert found <= {"analysis/dataflow.py", "lower/ages.py"}, "these ask DataFlow, by a node"
