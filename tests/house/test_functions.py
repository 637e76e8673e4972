"""A function of the language is known by its row, in one of two tables, and there alone."""

import ast
from pathlib import Path

from specc.lang.builtins import FUNCTIONS

SPECC = Path(__file__).resolve().parents[2] / "specc"
TABLES, NODES = ("lang/builtins.py", "lang/number_functions.py"), "model/expr.py"
"""The rows, and the names that the compiler itself calls functions by."""
NAMES = {name for name, row in FUNCTIONS.items() if not row.rule or row.value is not NotImplemented}
"""Those whose calls are a `Builtin`; others, `fresh` and `all` say, are nodes of their own."""
OTHER_WORDS = {
    "the type of a pose": {
        "lang/types.py": {"pose"},
    },
    "a kind of number, by other names or in Python": {
        "lang/kinds.py": {"float"},
        "lang/types.py": {"float"},
        "lower/subsystem.py": {"float"},
    },
    "minutes": {"model/units.py": {"min"}},
    "functions of Python, for margins of requirements": {"lower/requirements.py": {"min", "max"}},
    "helpers of a Python test that is written": {
        "tools/witness/__init__.py": {"translation"},
        "tools/witness/text.py": {"translation"},
    },
    "the word of `through`": {
        "schema/desugar.py": {"identity"},
        "schema/subsystem.py": {"identity"},
    },
    "kinds of actuators and sensors of MuJoCo, and where a joint rests": {
        "analysis/plant.py": {"position"},
        "mjcf/reader.py": {"position"},
        "tools/starting/channels.py": {"position", "rest"},
        "tools/starting/facts.py": {"position"},
    },
    "messages of ROS 2 and their fields": {
        "analysis/ros2.py": {"pose"},
        "analysis/ros2_messages.py": {"position", "pose"},
        "lang/kinds.py": {"pose"},
        "tools/starting/ros2.py": {"position", "pose"},
    },
    "fields of other formats and protocols": {
        "tools/page/description.py": {"pose"},
        "tools/importers/fabric_reader.py": {"min"},
        "tools/lsp/server.py": {"position"},
    },
}
"""What the same text means elsewhere: reason -> module -> words."""


def words(module: Path) -> set[str]:
    """The names of functions that are texts in a module."""
    source = module.read_text(encoding="utf-8")
    nodes = ast.walk(ast.parse(source if any(f'"{name}"' in source for name in NAMES) else ""))
    texts = {node.value for node in nodes if isinstance(node, ast.Constant)}
    return {text for text in texts if isinstance(text, str)} & NAMES


def test_no_module_knows_a_function_by_its_name() -> None:
    excused: dict[str, set[str]] = {}
    for modules in OTHER_WORDS.values():
        for module, named in modules.items():
            excused[module] = excused.get(module, set()) | named
    paths = {path.relative_to(SPECC).as_posix(): path for path in SPECC.rglob("*.py")}
    found = {name: words(path) for name, path in paths.items() if name not in (*TABLES, NODES)}
    assert {name: named for name, named in found.items() if named} == excused


def test_a_function_that_typed_calls_have_is_complete() -> None:
    for name, row in FUNCTIONS.items():
        if row.rule and name in NAMES:
            assert row.signature.partition("-> ")[1], name
            assert not (row.term and row.laws), f"{name}: a result is known, or unknown with laws"
            assert not row.term or row.range, f"{name}: what the solver follows has a range"
            assert not row.is_foldable or not row.overflows, f"{name}: what is folded is finite"
