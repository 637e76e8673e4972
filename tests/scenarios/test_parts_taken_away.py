"""Whatever part of the flagship is taken away, an open point names it."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from specc.diagnostics import Diagnostic
from specc.pipeline import compile_spec
from specc.read import read_file
from tests.scenarios.runs import FLAGSHIP, copy_companions
from tests.seeds import short

Route = tuple[str | int, ...]
AGENT: Route = ("agents", "irp")
SUBSYSTEMS: tuple[Route, ...] = (
    (*AGENT, "control"),
    (*AGENT, "virtual_effectors", "m"),
    (*AGENT, "virtual_receptors", "k"),
)
WORDS = {
    "agents": "no agents",
    "control": "no control subsystem",
    "plant": "no plant",
    "task": "no task",
    "rate": "no rate",
    "behaviours": "no behaviours",
    "states": "no states",
    "initial_state": "no initial state",
    "transitions": "no transitions",
}
"""Key -> what is said of it, where the part has no name of its own."""
MANIPULATOR = (*AGENT, "virtual_effectors", "m", "memory")
ALIKE: dict[Route, str] = {
    **{("types", name): name for name in ("Mode", "Modes", "Object", "Objects", "Image")},
    **{(*MANIPULATOR, name): name for name in ("r_p", "R_p")},
}
"""Parts whose names differ from others by a letter or its case: errors, which name both."""


def flagship() -> Any:
    return read_file(str(FLAGSHIP), ("from", "cause", "when", "to")).data


def at(data: Any, route: Route) -> Any:
    for key in route:
        data = data[key]
    return data


def named(data: Any, *route: str) -> Iterator[tuple[Route, str]]:
    """The parts with names of their own at a route."""
    yield from (((*route, name), name) for name in at(data, route))


def parts(data: Any) -> Iterator[tuple[Route, str]]:
    """Routes of all parts of the flagship that section 3 asks for, with what names them."""
    yield from (((key,), WORDS[key]) for key in ("agents", "plant", "task"))
    for group in ("frames", "files", "constants", "operators", "interfaces"):
        yield from named(data, group)
    for interface in data["interfaces"]:
        elements = named(data, "interfaces", interface)
        yield from ((route, name) for route, name in elements if name != "title")
    yield from named(data, "types")
    yield from ((("operators", name, "python"), name) for name in data["operators"])
    yield from named(data, "plant", "bind")
    yield (*AGENT, "control"), WORDS["control"]
    for group in ("real_effectors", "real_receptors", "virtual_effectors", "virtual_receptors"):
        yield from named(data, *AGENT, group)  # type: ignore[arg-type]  # both keys are texts
    yield (*AGENT, "virtual_effectors", "g", "rate"), WORDS["rate"]
    for place in SUBSYSTEMS:
        yield from _of_subsystem(at(data, place), place)


def _of_subsystem(subsystem: Any, here: Route) -> Iterator[tuple[Route, str]]:
    for key in ("rate", "behaviours", "states", "initial_state", "transitions"):
        yield (*here, key), WORDS[key]
    for key in ("memory", "let", "functions", "behaviours", "states"):
        yield from (((*here, key, name), name) for name in subsystem.get(key, {}))
    for kind, conditions in subsystem["conditions"].items():
        yield from (((*here, "conditions", kind, name), name) for name in conditions)
        yield from (((*here, "conditions", kind, name, "when"), name) for name in conditions)
    yield from (((*here, "memory", name, "init"), name) for name in subsystem["memory"])
    yield from (((*here, "behaviours", n, "terminal"), n) for n in subsystem["behaviours"])
    yield from (((*here, "states", name, "behaviour"), name) for name in subsystem["states"])
    for direction in "xy":
        for peer in subsystem[direction]:
            yield (*here, direction, peer), str(here[-1]) if peer in "ER" else peer
    for name, function in subsystem["functions"].items():
        targets = [key for key in function if key not in ("title", "eq", "fig", "table")]
        if len(targets) == 1:
            yield (*here, "functions", name, targets[0]), name


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("specs")
    copy_companions(path)
    return path


DATA = flagship()
PARTS = [found for found in parts(DATA) if found[0] not in ALIKE]
ELEMENTS = [
    ((*place, direction, peer, element), element)
    for place in SUBSYSTEMS
    for direction in "xy"
    for peer, elements in at(DATA, place)[direction].items()
    for element in (elements if isinstance(elements, dict) else ())  # else those of an interface
]


def without(route: Route, folder: Path) -> tuple[Diagnostic, ...]:
    """What is found in the flagship without a part."""
    data = copy.deepcopy(DATA)
    del at(data, route[:-1])[route[-1]]
    path = folder / "spec.yaml"
    path.write_text(json.dumps(data), encoding="utf-8")
    return compile_spec(str(path)).diagnostics


def some(pairs: Sequence[tuple[Route, str]], every: int) -> list[Any]:
    """Parameters in blocks: one for `make test`, half of the others for the long tests."""
    blocks = [[p for i, p in enumerate(pairs) if i % every == k] for k in range(every)]
    return short(blocks, 0, in_ci=2)


@pytest.mark.parametrize("cases", some(PARTS, 40))
def test_an_open_point_names_a_part_that_is_taken_away(
    cases: list[tuple[Route, str]], folder: Path
) -> None:
    for route, name in cases:
        found = [item for item in without(route, folder) if item.severity == "open"]
        assert any(_says(item, name) for item in found), (route, [item.message for item in found])


def _says(found: Diagnostic, name: str) -> bool:
    """Whether the words of a finding have the name as a whole."""
    words = f"{found.message} {found.label}".replace("`", " ").replace(":", " ")
    ends = [word.rsplit(".", 1)[-1] for word in words.split()]
    return f" {name} " in f" {words} " or name in ends


@pytest.mark.parametrize("cases", some([*ALIKE.items()], 4))
def test_a_part_that_is_one_letter_from_another_may_be_a_slip(
    cases: list[tuple[Route, str]], folder: Path
) -> None:
    for route, name in cases:
        wrong = [item for item in without(route, folder) if item.severity == "error"]
        assert any(name in item.message for item in wrong), route


@pytest.mark.parametrize("cases", some(ELEMENTS, 10))
def test_an_element_at_one_end_contradicts_the_other(
    cases: list[tuple[Route, str]], folder: Path
) -> None:
    for route, name in cases:
        found = [item for item in without(route, folder) if item.code == "E0404"]
        assert any(_says(item, name) for item in found), route
