"""Every example of docs/language.md means what the text beside it says."""

import ast
import re
from pathlib import Path

import pytest

from specc import pipeline
from specc.lang.builtins import BUILTIN_NAMES
from specc.model.units import UNITS
from specc.schema import SpecFile
from tests.docs.examples import HERE, Example, examples, put
from tests.seeds import every

DOCUMENT = HERE.parents[1] / "docs" / "language.md"
EXAMPLES = examples(DOCUMENT)
FILES = [example for example in EXAMPLES if example.file]
ACCEPTED = [example for example in EXAMPLES if not example.file and not example.error]
REFUSED = [example for example in EXAMPLES if example.error]
TYPED_LET = re.compile(r"^(\w+): .*\S +# (\S.*)$", re.MULTILINE)


def section(title: str) -> str:
    """The text under a heading of the document."""
    text = DOCUMENT.read_text(encoding="utf-8")
    return text.split(f" {title}\n", 1)[1].split("\n## ", 1)[0]


def errors(path: Path) -> list[str]:
    found = pipeline.compile_spec(str(path)).diagnostics
    return [f"{item.code} {item.message}" for item in found if item.severity == "error"]


@pytest.mark.parametrize("example", every(2, ACCEPTED), ids=str)
def test_example_compiles(example: Example, tmp_path: Path) -> None:
    path = put(example, FILES, tmp_path)
    assert errors(path) == []
    files = pipeline.build(str(path)).files
    assert files
    for text in files.values():
        ast.parse(text)


@pytest.mark.parametrize("example", REFUSED, ids=str)
def test_example_is_refused(example: Example, tmp_path: Path) -> None:
    found = errors(put(example, FILES, tmp_path))
    assert {item.split()[0] for item in found} == {example.error}, found


@pytest.mark.parametrize("example", [e for e in ACCEPTED if e.context == "let"], ids=str)
def test_expressions_have_the_types_beside_them(example: Example, tmp_path: Path) -> None:
    system = pipeline.compile_spec(str(put(example, FILES, tmp_path))).system
    assert system is not None
    arm = next(s for s in system.subsystems if s.qualified_name == "arm.m")
    stated = dict(TYPED_LET.findall(example.text))
    assert len(stated) == len(example.text.splitlines()) - 1
    assert {name: str(arm.let(name).value.type) for name in stated} == stated


def test_every_context_is_used() -> None:
    assert {example.context for example in EXAMPLES} == {"", "top", "control", "subsystem", "let"}


def test_the_table_of_units_is_complete() -> None:
    rows = [row for row in section("3. Types and units").splitlines() if row.startswith("| `")]
    table = rows[-3:]
    assert {name for row in table for name in re.findall(r"`(\w+)`", row)} == set(UNITS)


def test_the_table_of_functions_is_complete() -> None:
    rows = [row for row in section("5. Expressions").splitlines() if row.startswith("| `")]
    named = {name for row in rows for name in re.findall(r"`(\w+)\(", row.split("|")[1])}
    assert named - {"DK"} == set(BUILTIN_NAMES)


def test_the_table_of_keys_is_complete() -> None:
    rows = [row for row in section("1. File").splitlines() if row.startswith("| `")]
    named = {key for row in rows for key in re.findall(r"`(\w+)`", row.split("|")[1])}
    traces = {"eq", "table", "fig"}
    assert named == SpecFile.keys.keys() - traces
