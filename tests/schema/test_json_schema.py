"""What `specc schema` prints accepts what the compiler accepts, and explains every key."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from specc.read import read_file
from specc.schema.files import json_schema
from tests.house.tree import ROOT

schema = cache(json_schema)
SUBSYSTEM = """
specc: 1
subsystem:
  rate: 10 Hz
  memory: {d: {type: "real[m]", init: 0}}
  states: {S0: idle}
  transitions: [[S0, terminal, always, S0]]
"""


def data_of(text: str, path: Path) -> Any:
    path.write_text(text)
    return read_file(str(path)).data


def refusals(data: Any) -> list[str]:
    found = jsonschema.Draft202012Validator(schema()).iter_errors(data)
    return ["/".join(map(str, error.absolute_path)) for error in found]


def objects(part: Any) -> list[dict[str, Any]]:
    """Every part of a schema that describes a mapping with known keys."""
    if isinstance(part, list):
        return [found for item in part for found in objects(item)]
    if not isinstance(part, dict):
        return []
    below = [found for item in part.values() for found in objects(item)]
    return [part, *below] if isinstance(part.get("properties"), dict) else below


def test_schema_is_one() -> None:
    jsonschema.Draft202012Validator.check_schema(schema())


@pytest.mark.parametrize(
    ("old", "new", "refused"),
    [
        ("memory: {d: {", "memory: {d: {tpye: bool, ", "subsystem/memory/d"),
        (", init: 0", ", int: 0", "subsystem/memory/d"),
        ("rate: 10 Hz", "rats: 10 Hz", "subsystem"),
        ("specc: 1", "specc: 2", "specc"),
        ("S0: idle", "S0: {behavior: idle}", "subsystem/states/S0"),
        ("[S0, terminal,", "[S0, 1,", "subsystem/transitions/0"),
    ],
)
def test_schema_refuses(old: str, new: str, refused: str, tmp_path: Path) -> None:
    assert refusals(data_of(SUBSYSTEM, tmp_path / "good.yaml")) == []
    assert old in SUBSYSTEM
    assert refusals(data_of(SUBSYSTEM.replace(old, new), tmp_path / "bad.yaml")) == [refused]


def test_every_key_is_described() -> None:
    silent = [
        key
        for mapping in objects(schema())
        for key, value in mapping["properties"].items()
        if not _described(value)
    ]
    assert silent == []


def _described(value: dict[str, Any]) -> bool:
    if "$ref" in value:
        value = schema()["$defs"][value["$ref"].rpartition("/")[2]]
    parts = [value, *value.get("anyOf", ())]
    return any("description" in part or "$ref" in part for part in parts)


def test_command_prints_the_schema() -> None:
    printed = subprocess.run(
        [sys.executable, "-m", "specc", "schema"], cwd=ROOT, capture_output=True, check=True
    ).stdout
    assert json.loads(printed) == schema()
