"""The examples of the codes of names and types fail and pass as they say."""

from pathlib import Path

from specc.diagnostics.code import all_codes
from specc.resolve import Findings, resolve
from specc.resolve.loader import Loader

# Those that are found while expressions get their meaning, before anything is checked.
CODES = tuple(
    code for code in all_codes().values() if code.id == "E0201" or "E0230" <= code.id <= "E0321"
)


def codes_found(text: str, directory: Path) -> list[str]:
    path = directory / "demo.yaml"
    path.write_text(text)
    findings = Findings()
    loader = Loader(findings)
    file = loader.load(str(path))
    if file is not None:
        resolve(file, loader.load, findings)
    return [found.code for found in findings.diagnostics if found.severity != "open"]


def test_examples(tmp_path: Path) -> None:
    for code in CODES:
        assert codes_found(code.failing, tmp_path) == [code.id]
        assert codes_found(code.passing, tmp_path) == [], code.id
