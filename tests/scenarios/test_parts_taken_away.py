"""Whatever part of the flagship is taken away, specc says that it is missing, by its name."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from specc.pipeline import compile_spec
from specc.read import read_file
from tests.scenarios.runs import FLAGSHIP, copy_companions

Route = tuple[str | int, ...]
SUBSYSTEMS = (
    ("control",),
    ("virtual_effectors", "m"),
    ("virtual_receptors", "k"),
)
WHOLE = ("rate", "behaviours", "states", "initial_state", "transitions", "functions")
MEMBERS = ("memory", "let", "functions", "behaviours", "states")


def flagship() -> Any:
    return read_file(str(FLAGSHIP), ("from", "cause", "when", "to")).data


def at(data: Any, route: Route) -> Any:
    for key in route:
        data = data[key]
    return data


def parts(data: Any) -> Iterator[Route]:
    """Routes of all parts of the flagship that section 3 asks for."""
    yield from (("agents",), ("plant",), ("task",), ("agents", "irp", "control"))
    yield from (("operators", name) for name in data["operators"])
    yield from (("operators", name, "python") for name in data["operators"])
    yield from (("constants", name) for name in data["constants"])
    yield from (("plant", "bind", name) for name in data["plant"]["bind"])
    agent = ("agents", "irp")
    for group in ("real_effectors", "real_receptors", "virtual_effectors", "virtual_receptors"):
        yield from ((*agent, group, name) for name in at(data, (*agent, group)))
    for place in SUBSYSTEMS:
        yield from _of_subsystem(at(data, (*agent, *place)), (*agent, *place))


def _of_subsystem(subsystem: Any, here: Route) -> Iterator[Route]:
    yield from ((*here, key) for key in WHOLE)
    for key in MEMBERS:
        yield from ((*here, key, name) for name in subsystem.get(key, {}))
    for direction in ("x", "y"):
        yield from ((*here, direction, peer) for peer in subsystem[direction])
    for kind, conditions in subsystem["conditions"].items():
        yield from ((*here, "conditions", kind, name) for name in conditions)
    for name in subsystem["memory"]:
        yield (*here, "memory", name, "init")
    for name in subsystem["behaviours"]:
        yield (*here, "behaviours", name, "terminal")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("specs")
    copy_companions(path)
    return path


DATA = flagship()


@pytest.mark.parametrize("route", list(parts(DATA)), ids=lambda route: "/".join(map(str, route)))
def test_a_part_that_is_taken_away_is_missed(route: Route, folder: Path) -> None:
    data = copy.deepcopy(DATA)
    del at(data, route[:-1])[route[-1]]
    path = folder / "spec.yaml"
    path.write_text(json.dumps(data), encoding="utf-8")
    result = compile_spec(str(path))
    missed = [found for found in result.diagnostics if found.severity != "warning"]
    assert missed
    assert any(_names(found, route) for found in missed), [f.message for f in missed]


def _names(found: Any, route: Route) -> bool:
    """Whether a finding says the name of the part, or is about the key that is gone."""
    names = [str(key).removesuffix("s") for key in route[-2:]]
    told = f"{found.message} {found.label} {found.help}"
    return any(name.replace("_", " ") in told or name in told for name in names)
