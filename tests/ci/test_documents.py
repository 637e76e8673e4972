"""docs/ci.md and docs/formats.md name what there is."""

import json
import re
from pathlib import Path

import pytest

from specc.cli import main
from specc.cli.streams import FORMATS
from specc.policy.settings import KEYS
from specc.read import read_text
from tests.policy.specs import write

DOCS = Path(__file__).parents[2] / "docs"
ROW = re.compile(r"^\s*\| `([^|]+?)` \|", re.MULTILINE)


def section(document: str, title: str) -> str:
    text = (DOCS / document).read_text(encoding="utf-8")
    return text.split(f"\n## {title}\n")[1].split("\n## ")[0]


def test_every_setting_is_documented() -> None:
    assert ROW.findall(section("ci.md", "Which findings are shown")) == list(KEYS)


def test_every_format_is_documented() -> None:
    headings = re.findall(r"^## (\w+)$", (DOCS / "formats.md").read_text(), re.MULTILINE)
    assert {"text", *headings} == set(FORMATS["validate"])


def test_every_member_of_json_is_documented(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path / "a.yaml")
    path.write_text(path.read_text().replace("[send]", "[sned]"))
    main(["validate", "a.yaml", "--format", "json"])
    data = json.loads(capsys.readouterr().out)
    finding = next(item for item in data["diagnostics"] if item["fix"])
    rows = [
        name for row in ROW.findall(section("formats.md", "json")) for name in row.split("`, `")
    ]
    top = {name.split(".")[0] for name in rows[: rows.index("diagnostics") + 1]}
    assert top == data.keys()
    assert {name.partition(".")[2] for name in rows if name.startswith("summary.")} == data[
        "summary"
    ].keys()
    assert set(rows[rows.index("diagnostics") + 1 :]) == finding.keys()
    for member in (*finding["location"], *finding["fix"], *finding["fix"]["edits"][0]):
        assert f"`{member}`" in section("formats.md", "json")


def test_the_examples_are_yaml() -> None:
    text = (DOCS / "ci.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^( *)```yaml\n(.*?)^ *```$", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 3
    for indent, block in blocks:
        assert read_text("ci.md", block.replace(f"\n{indent}", "\n").removeprefix(indent)).ok
