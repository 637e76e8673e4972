"""Loads the files of a specification, each once, and keeps their texts for the diagnostics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from specc.diagnostics import Diagnostic, Related
from specc.read import Document, read_file
from specc.resolve.context import Findings, Where
from specc.resolve.library import Loaded
from specc.schema import ROW_KEYS, shape
from specc.source import Sources

_WITHOUT_TEXT = frozenset(("E0001", "E0002", "E0003", "E0004"))


@dataclass(slots=True)
class Loader:
    """`load` gives a file its shape; a file that fails is reported once and is None ever after.

    `read` reads the file of a path; an editor puts its unsaved texts there.
    """

    findings: Findings
    read: Callable[[str, tuple[str, ...]], Document] = read_file
    sources: Sources = field(default_factory=Sources)
    _files: dict[str, Loaded | None] = field(default_factory=dict)

    def load(self, path: str, named_at: Where | None = None) -> Loaded | None:
        """The file at `path`; `named_at` is where another file names it."""
        if path not in self._files:
            self._files[path] = self._load(path, named_at)
        return self._files[path]

    @property
    def complete(self) -> bool:
        """Whether every file that was asked for has its shape."""
        return all(file is not None for file in self._files.values())

    def _load(self, path: str, named_at: Where | None) -> Loaded | None:
        document = self.read(path, ROW_KEYS)
        self.sources.add(document.source)
        self.findings.diagnostics += [_at(finding, named_at) for finding in document.diagnostics]
        if not document.ok:
            return None
        spec, wrong = shape(document.data, path)
        self.findings.diagnostics += wrong
        return None if spec is None else Loaded(path, spec, Where(path, (), document.data))


def _at(finding: Diagnostic, named_at: Where | None) -> Diagnostic:
    """A file that gives no text is best shown where it is named."""
    if named_at is None:
        return finding
    if finding.code in _WITHOUT_TEXT:
        message = f"{finding.message}: {finding.primary.file}"
        return replace(finding, message=message, primary=named_at.place)
    related = (*finding.related, Related(named_at.place, "used here"))
    return replace(finding, related=related)
