"""What cannot be done as it is asked is raised, and `specc/cli/main.py` tells it."""

import ast
from collections.abc import Iterator
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
TELLS = "cli/main.py"
GOES_ON = {
    "cli/explore.py": "a trace that cannot be recorded is told with its reason",
    "tools/page/description.py": "a picture that cannot be drawn is left out",
    "tools/page/live.py": "a process of its own tells it, and to browsers when a run begins anew",
    "cli/view.py": "a page goes on with what can be read of a recording, and says what cannot",
    "tools/page/recorded.py": "what a message of a stranger does not say is left out",
    "tools/page/raw.py": "what a message of a stranger does not say is left out",
    "cli/report.py": "a report of many runs goes on without one that cannot be read, and says so",
    "cli/recordings.py": "a recorded specification that cannot be run is told with its reason",
}


def _caught(text: str) -> Iterator[str]:
    """Names of exceptions that a module handles, if one may be a refusal."""
    for node in ast.walk(ast.parse(text if "Refused" in text else "")):
        if isinstance(node, ast.ExceptHandler) and node.type is not None:
            parts = list(ast.walk(node.type))
            yield from (part.id for part in parts if isinstance(part, ast.Name))
            yield from (part.attr for part in parts if isinstance(part, ast.Attribute))


def test_one_module_tells_refusals() -> None:
    found = {
        module.relative_to(SPECC).as_posix()
        for module in SPECC.rglob("*.py")
        if "Refused" in _caught(module.read_text(encoding="utf-8"))
    }
    assert found == {TELLS, *GOES_ON}


def test_one_module_says_why_the_system_refuses() -> None:
    found = {
        module.relative_to(SPECC).as_posix()
        for module in SPECC.rglob("*.py")
        if ".strerror or" in module.read_text(encoding="utf-8")
    }
    assert found == {"refusal.py"}
