"""`[tool.specc]` of the nearest pyproject.toml, and what the command line says instead."""

from pathlib import Path

import pytest

from specc.cli import main
from specc.policy import Overrides, Settings, settings_for
from tests.policy.specs import write


def project(folder: Path, text: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "pyproject.toml").write_text(text)
    return folder


def test_the_nearest_file_with_a_section_counts(tmp_path: Path) -> None:
    project(tmp_path, "[tool.specc]\nstrict = true\n")
    project(tmp_path / "a", '[project]\nname = "specc-user"\n')
    project(tmp_path / "a/b", '[tool.specc]\nignore = ["W0611"]\n')
    assert settings_for(str(tmp_path / "a")).settings.strict
    assert settings_for(str(tmp_path / "a/b/c")).settings.ignore == ("W0611",)
    assert not settings_for(str(tmp_path / "a/b/c")).settings.strict


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("strct = true", "E0905"),
        ("strict = 1", "E0905"),
        ('ignore = "W0611"', "E0905"),
        ("select = [1]", "E0905"),
        ('ignore = ["W9"]', "E0905"),
        ('ignore = [""]', "E0905"),
        ('ignore = ["E0101"]', "E0903"),
        ("strict = = 1", "E0905"),
    ],
)
def test_wrong_settings_are_found_where_they_stand(line: str, code: str, tmp_path: Path) -> None:
    project(tmp_path, f"[project]\nname = 'x'\n[tool.specc]\n{line}\n")
    found = settings_for(str(tmp_path))
    (finding,) = found.diagnostics
    assert finding.code == code
    assert found.source is not None
    assert found.source.span(finding.primary).line == 4
    assert finding.help


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"# specc\nx = [", "this is not TOML"),
        (b"# specc\n\xff = 1\n", "the file is not UTF-8 text"),
        (b"[tool]\nspecc = 1\n", "`tool.specc` is not a table"),
    ],
)
def test_a_file_without_readable_settings(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_bytes(content)
    (finding,) = settings_for(str(tmp_path)).diagnostics
    assert (finding.code, finding.message.split(":")[0]) == ("E0905", message)


def test_a_file_without_a_section_says_nothing(tmp_path: Path) -> None:
    project(tmp_path, 'tool = 1\ntitle = "specc"\n')
    assert settings_for(str(tmp_path)).diagnostics == ()


def test_the_command_line_replaces_key_by_key() -> None:
    settings = Settings(select=("W04",), ignore=("W06",), strict=True, exclude=("x",), base="b")
    assert Overrides().applied_to(settings) == settings
    changed = Overrides(ignore=(), strict=False).applied_to(settings)
    assert changed == Settings(select=("W04",), exclude=("x",), base="b")


def test_excluded_paths() -> None:
    settings = Settings(exclude=("old", "*/draft_*.yaml"), base="/p")
    assert settings.excludes(Path("/p/old/a/b.yaml"))
    assert settings.excludes(Path("/p/a/draft_1.yaml"))
    assert not settings.excludes(Path("/p/older/b.yaml"))


def test_settings_reach_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.yaml")
    assert main(["validate", "a.yaml"]) == 0
    project(tmp_path / "p", "[tool.specc]\nstrict = true\n")
    write(tmp_path / "p/a.yaml")
    assert main(["validate", "p/a.yaml"]) == 1
    assert main(["validate", "p/a.yaml", "--no-strict"]) == 0
    assert main(["validate", "p/a.yaml", "--ignore", "W0611"]) == 0
    assert main(["build", "p/a.yaml"]) == 1
    assert not (tmp_path / "generated").exists()
    capsys.readouterr()


def test_a_wrong_setting_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(project(tmp_path, "[tool.specc]\nstrct = true\n"))
    write(tmp_path / "a.yaml")
    assert main(["validate", "a.yaml"]) == 1
    assert "help: did you mean `strict`?" in capsys.readouterr().err


HEAD = "[tool.specc]\n"
EXCESSIVE = {
    "a dotted key": ("# specc\n" + "a." * 20_000 + "a = 1\n", "a key has more than 32 parts"),
    "a dotted key behind quotes": (
        '# specc\nx = [""" """", {' + "a." * 33 + "a = 1}]\n",
        "a key has more than 32 parts",
    ),
    "quoted keys": (HEAD + "'a.b' . \"c\" ." * 20 + "a = 1\n", "a key has more than 32 parts"),
    "brackets": (HEAD + "a = " + "[" * 2000, "brackets are nested more than 32 deep"),
    "digits": (HEAD + "x = " + "9" * 5000, "a number has more than 1,000 digits"),
    "a NUL": (HEAD + 'allow = ["\\u0000"]', "`allow` has an item with a NUL character"),
    "items": (HEAD + f"allow = {['a'] * 201}", "`allow` has more than 200 items"),
    "a long item": (HEAD + f"allow = ['{'a/' * 501}']", "`allow` has an item of more than"),
    "keys": (HEAD + "".join(f"k{i} = 1\n" for i in range(51)), "the section has more than 50 keys"),
    "bytes": ("#" * 200_001, "the file has more than 200,000 bytes"),
}


@pytest.mark.parametrize("name", EXCESSIVE)
def test_files_of_strangers_are_bounded(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Refused before the reader of TOML sees it, which would take gigabytes for some of them."""
    text, message = EXCESSIVE[name]
    monkeypatch.chdir(project(tmp_path, text))
    write(tmp_path / "a.yaml")
    assert main(["validate", "a.yaml"]) == 1
    assert f"error[E0905]: {message}" in capsys.readouterr().err


@pytest.mark.parametrize(
    "text",
    [
        f"description = '{'a.' * 50}'",
        f'description = """{"[" * 50} "" {"a." * 50}\\\\"""',
        f"ends = '''{'a.' * 50}'''''\nversions = [{'1.5, ' * 50}]",
        f"{'a.' * 31}a = '1' # {'a.' * 50}",
    ],
)
def test_texts_and_comments_of_other_tools_count_as_what_they_are(
    text: str, tmp_path: Path
) -> None:
    project(tmp_path, f"[project]\n{text}\n[tool.specc]\nstrict = true\n")
    found = settings_for(str(tmp_path))
    assert found.settings.strict
    assert not found.diagnostics
