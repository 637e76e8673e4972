"""A compiler that reads files but knows no language: the seam that the commands stand on."""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import pytest

from specc.diagnostics import CommandName, Diagnostic, blocks
from specc.read import read_file
from specc.source import Place, Sources


@dataclass
class FakeResult:
    diagnostics: list[Diagnostic]
    sources: Sources
    system: None = None
    is_part: bool = False

    @property
    def ok(self) -> bool:
        return self.can("build")

    def can(self, command: CommandName) -> bool:
        return not any(blocks(finding.code, command) for finding in self.diagnostics)


@dataclass
class FakeBuild:
    result: FakeResult
    system: str
    files: dict[str, str]


FINDINGS = (
    ("E0101", "wrong"),
    ("W0001", "odd"),
    ("O0601", "rateless"),
    ("O0501", "plantless"),
)


@dataclass
class FakePipeline:
    """Refuses the key `wrong`, warns of `odd`, finds two keys open; the output lists the keys."""

    fault: BaseException | None = None
    built: list[str] = field(default_factory=list)

    def check_spec(self, path: str) -> FakeResult:
        return self.compile_spec(path)

    def compile_spec(self, path: str) -> FakeResult:
        if self.fault is not None:
            raise self.fault
        document = read_file(path)
        found = list(document.diagnostics)
        for code, key in FINDINGS:
            if key in (document.data or {}):
                found.append(Diagnostic(code, f"key {key}", Place(path, (key,), "key")))
        return FakeResult(found, Sources([document.source]))

    def build(
        self,
        path: str,
        values: Mapping[str, str] | None = None,
        *,
        stop_when: str | None = None,
        is_read: bool = True,
        publish: object = (),
        scenario: str | None = None,
        tests_all_rows: bool = False,
    ) -> FakeBuild:
        result = self.compile_spec(path)
        self.built.append(path)
        if not result.ok:
            return FakeBuild(result, "", {})
        data = read_file(path).data
        files = {"__init__.py": "", "arm/c.py": "\n".join(data) + "\n"}
        return FakeBuild(result, data["system"], files)


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> Iterator[FakePipeline]:
    import specc

    fake = FakePipeline()
    module = ModuleType("specc.pipeline")
    for name in ("check_spec", "compile_spec", "build"):
        setattr(module, name, getattr(fake, name))
    monkeypatch.setitem(sys.modules, "specc.pipeline", module)
    monkeypatch.setattr(specc, "pipeline", module, raising=False)
    yield fake


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working directory with one good, one wrong and one odd specification."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SPECC_TRACEBACK", raising=False)
    (tmp_path / "good.yaml").write_text("system: good\n")
    (tmp_path / "wrong.yaml").write_text("system: wrong\nwrong: 1\n")
    (tmp_path / "odd.yaml").write_text("system: odd\nodd: 1\n")
    return tmp_path
