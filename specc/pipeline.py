"""The story of the compiler: read, shape, resolve, check, lower, emit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from specc.diagnostics import Command, Diagnostic, stops, without_follow_ups
from specc.model.system import System
from specc.resolve import Findings, resolve
from specc.resolve.comments import told_of_comments
from specc.resolve.loader import Loader
from specc.source import Place, Sources


@dataclass(frozen=True, slots=True)
class Result:
    """What is known of a specification: its meaning, if it has one, and all findings."""

    system: System | None
    proofs: Any
    diagnostics: tuple[Diagnostic, ...]
    sources: Sources
    broken: frozenset[str] = frozenset()
    """Qualified names of subsystems that lack parts; nothing is generated from them."""

    @property
    def ok(self) -> bool:
        """Whether code can be generated."""
        return self.can("build")

    def can(self, command: Command) -> bool:
        """Whether nothing is wrong or missing that a command needs."""
        stopped = any(stops(finding.code, command) for finding in self.diagnostics)
        return self.system is not None and not stopped


@dataclass(frozen=True, slots=True)
class Build:
    """Generated files of a system, relative path -> text; empty if the specification has errors."""

    result: Result
    system: str
    files: dict[str, str]


def compile_spec(path: str, loader: Loader | None = None) -> Result:
    """Read, shape, resolve and check the specification at `path`.

    An editor brings its own loader, which keeps the files and all that was found.
    """
    from specc.checks import run_checks

    loader = loader or Loader(Findings())
    findings = loader.findings
    file = loader.load(path)
    if file is None:
        return Result(None, None, tuple(findings.diagnostics), loader.sources)
    resolved = resolve(file, loader.load, findings)
    sound = not any(stops(finding.code, "build") for finding in findings.diagnostics)
    checked, proofs = run_checks(resolved.system, resolved.broken, resolved.faulty, sound=sound)
    own = told_of_comments(findings.diagnostics, loader.sources)
    found = (*without_follow_ups(own, checked), *checked)
    return Result(resolved.system, proofs, found, loader.sources, resolved.broken)


def read_spec(path: str) -> Result:
    """Read, shape and resolve the specification at `path`; nothing is proved of it."""
    loader = Loader(Findings())
    file = loader.load(path)
    resolved = resolve(file, loader.load, loader.findings) if file is not None else None
    diagnostics = tuple(loader.findings.diagnostics)
    if resolved is None:
        return Result(None, None, diagnostics, loader.sources)
    return Result(resolved.system, None, diagnostics, loader.sources, resolved.broken)


def build(path: str) -> Build:
    """Compile the specification at `path`, then lower and emit it."""
    result = compile_spec(path)
    if not result.ok or result.system is None:
        return Build(result, "", {})
    from specc.emit import FormatError, emit
    from specc.lower import TooLarge, lower

    try:
        files = emit(lower(result.system, result.proofs))
    except (TooLarge, FormatError) as error:
        code, at = "E0094", Place(path)
        if isinstance(error, TooLarge):
            places = {s.qualified_name: s.place for s in result.system.subsystems}
            code, at = "E0093", replace(places.get(error.subsystem, at), part="key")
        message, _, help_text = str(error).partition("; ")
        refusal = Diagnostic(code, message, at, help=help_text)
        return Build(replace(result, diagnostics=(*result.diagnostics, refusal)), "", {})
    return Build(result, result.system.name, files)


def json_schema() -> dict[str, Any]:
    """JSON Schema of a specification file, for editors."""
    from specc.schema import json_schema as of_files

    return of_files()
