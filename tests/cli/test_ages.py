"""`specc ages`: how old values are where they are read."""

import json
from pathlib import Path

import pytest

from specc.cli import main

FLAGSHIP = str(Path(__file__).resolve().parents[2] / "specs/irp_picking.yaml")


def test_ages_of_the_flagship(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ages", FLAGSHIP, "--format", "json"]) == 0
    data = json.loads(capsys.readouterr().out)
    found = {(v["reader"], v["element"]): v for v in data["values"]}
    # A receptor of 5 Hz is read one of its periods later, an effector of 500 Hz likewise.
    assert found["irp.c", "x.k.O_c"]["age_s"] == 0.2
    assert found["irp.c", "x.m.F_c"]["age_s"] == 0.002
    assert found["irp.c", "x.m.F_c"]["max_age_s"] == 0.1
    assert found["irp.E.m", "c_d"]["age_s"] == 0.002
    # Set points come out of memory.
    assert found["irp.m", "x.c.T_d"]["age_s"] is None


def test_every_value_has_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ages", FLAGSHIP, "--format", "json"]) == 0
    values = json.loads(capsys.readouterr().out)["values"]
    assert main(["ages", FLAGSHIP]) == 0
    lines = capsys.readouterr().out.splitlines()[1:]
    assert [line.split()[:2] for line in lines] == [[v["reader"], v["element"]] for v in values]


def test_a_faulty_specification_has_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("specc: 1\nsystem: demo\nagents: {a: {control: {rate: 10}}}\n")
    assert main(["ages", str(spec)]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert "E0104" in said.err
