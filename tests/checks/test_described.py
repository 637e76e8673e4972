"""A description that is checked alone has the findings that it has where it is used."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from specc.pipeline import Result, check_spec, compile_spec
from specc.read import read_file
from tests.seeds import short

CASES = Path(__file__).parents[1] / "cases"
FILES = [
    path for of in ("expressions", "machines", "open") for path in sorted((CASES / of).glob("*"))
]
DEFINITIONS = ("frames", "types", "operators", "constants", "interfaces")
OF_THE_USER = ("E04", "O04", "E07", "W04", "E0201", "E0339", "O0205", "O0601")
ONLY_CLEAN = ("W0615", "W0620", "W0623")
"""What depends on senders or devices, and what is asked of a whole system without errors."""


def effectors(case: Any) -> Iterator[tuple[str, str, Any]]:
    """The virtual effectors of a case that can stand in a file of their own."""
    agents = case.get("agents") if isinstance(case, dict) else None
    for name, agent in agents.items() if isinstance(agents, dict) else ():
        found = agent.get("virtual_effectors") if isinstance(agent, dict) else None
        for effector, described in found.items() if isinstance(found, dict) else ():
            if isinstance(described, dict) and "states" in described and "for" not in described:
                yield name, effector, described


def written(folder: Path, case: Any, agent: str, name: str, described: Any) -> tuple[str, str]:
    """A file that describes the effector, and the case that uses it."""
    shared = {key: case[key] for key in DEFINITIONS if key in case}
    lib, user = folder / "lib.yaml", folder / "user.yaml"
    lib.write_text(json.dumps({"specc": 1.2, **shared, "subsystem": described}))
    case["agents"][agent]["virtual_effectors"][name] = {"use": "lib.yaml"}
    user.write_text(json.dumps({**case, "specc": 1.2}))
    return str(lib), str(user)


def found(result: Result) -> set[tuple[str, str]]:
    return {
        (finding.code, finding.message)
        for finding in result.diagnostics
        if finding.primary.file.endswith("lib.yaml")
        and not finding.code.startswith(OF_THE_USER + ONLY_CLEAN)
    }


@pytest.mark.parametrize("files", short([FILES[::12], FILES], 0), ids=len)
def test_it_finds_alone_what_it_finds_in_use(files: list[Path], tmp_path: Path) -> None:
    compared = 0
    for path in files:
        for agent, name, described in effectors(read_file(str(path)).data):
            case = read_file(str(path)).data
            lib, user = written(tmp_path, case, agent, name, described)
            alone, used = found(check_spec(lib)), found(compile_spec(user))
            assert used <= alone, path
            compared += len(used)
    assert compared
