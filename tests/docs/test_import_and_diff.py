"""What docs/import.md and docs/diff.md show is what the commands do."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from specc.cli.main import main
from specc.pipeline import compile_spec
from specc.tools.importers import import_fabric, import_scxml
from tests.tools.diff.conftest import BASE, edited

DOCS = Path(__file__).resolve().parents[2] / "docs"


def block(document: str, language: str, number: int = 0) -> str:
    text = (DOCS / document).read_text(encoding="utf-8")
    found = re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return str(found[number])


def test_the_definition_has_the_faults_that_the_text_names(tmp_path: Path) -> None:
    (tmp_path / "ram.xml").write_text(block("import.md", "xml"))
    made = import_fabric([str(tmp_path / "ram.xml")])
    spec = tmp_path / "ram.yaml"
    spec.write_text(made.text)
    assert sorted(d.code for d in compile_spec(str(spec)).diagnostics) == ["E0602", "E0603"]
    assumed = "".join(f"      {line}\n" for line in block("import.md", "yaml").splitlines())
    spec.write_text(made.text.replace("      transitions:", f"{assumed}      transitions:", 1))
    assert [d.code for d in compile_spec(str(spec)).diagnostics] == ["E0603"]


def test_names_in_the_table_are_those_that_are_given(tmp_path: Path) -> None:
    (tmp_path / "ram.xml").write_text(block("import.md", "xml"))
    text = import_fabric([str(tmp_path / "ram.xml")]).text
    for name in ("ram_parts:cmdValid", "ram_cmdValid(input_data, components)", "ram_run_hold",
                 "ram_msgs.msg:Command", "ram_msgs_Command:"):  # fmt: skip
        assert name in text, name


def test_a_chart_becomes_the_modes_and_rows_that_are_shown(tmp_path: Path) -> None:
    (tmp_path / "task.scxml").write_text(block("import.md", "xml", 1))
    made = import_scxml(str(tmp_path / "task.scxml"))
    spec = tmp_path / "task.yaml"
    spec.write_text(made.text)
    assert compile_spec(str(spec)).diagnostics == ()
    (machine,) = (s for s in yaml_of(made.text)["agents"].values() if "modes" in s["control"])
    shown = yaml_of(block("import.md", "yaml", 1))
    assert {name: machine["control"][name] for name in shown} == shown
    conditions = machine["control"]["conditions"]["initial"]
    for name, text in re.findall(r"(\w+), +\w+\] +# (on_.*)", block("import.md", "yaml", 1)):
        assert conditions[name] == text


def yaml_of(text: str) -> dict[str, Any]:
    return dict(yaml.load(text, Loader=yaml.BaseLoader))


def test_the_comparison_is_the_one_that_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old.yaml").write_text(BASE)
    (tmp_path / "new.yaml").write_text(
        edited(
            ("rate: 20 Hz", "rate: 25 Hz"),
            ("unsent: not fresh(x.desk.order)", "unsent: fresh(x.desk.mode)"),
            ("W: world", "W: hall"),
        )
    )
    assert main(["diff", "old.yaml", "new.yaml"]) == 1
    assert capsys.readouterr().out == block("diff.md", "text")
