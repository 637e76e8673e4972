"""Specifications under an editor's folders: which are analysed, and what is known of them."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from specc.diagnostics import Diagnostic
from specc.pipeline import Result, check_spec
from specc.policy import allowed_paths, judge, settings_for
from specc.read import AllowedPaths, Document, claims_to_be_specification, read_file, read_text
from specc.read.document import UnreadableFileError, load_text
from specc.resolve import Findings
from specc.resolve.loader import Loader
from specc.resources import on_disk
from specc.source import Place, SourceFile, Sources, real_path
from specc.tools.lsp.index import Index
from specc.tools.lsp.unfinished import Shift, shift, without_errors

_SYSTEM = re.compile(r"(?:^|\r)system\s*:", re.MULTILINE)
_SUFFIXES = (".yaml", ".yml")
_MOST_FILES = 2000


@dataclass(frozen=True, slots=True)
class TextRange:
    """A part of the text of a file, in offsets."""

    path: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class FileEdit(TextRange):
    """New text for a part of a file."""

    text: str


@dataclass
class Analysis:
    """What was found about one file, `root`, and all that it uses."""

    root: str
    loader: Loader
    result: Result
    diagnostics: tuple[Diagnostic, ...]
    """What comments and settings leave of those of the result."""
    lacks_lines: bool = False
    """Whether lines with errors are left out, so that only its names are of use."""

    @property
    def sources(self) -> Sources:
        """The texts that took part."""
        return self.loader.sources

    @cached_property
    def index(self) -> Index:
        """The symbols."""
        return Index(self.sources, self.result.system, self.loader.findings)

    def includes(self, path: str) -> bool:
        """Whether a file took part."""
        return self.sources.get(path) is not None

    def describes(self, path: str) -> bool:
        """Whether a part of the system is what the file describes, not other parts alone."""
        return any(use.place.file == path for use in self.loader.findings.uses)


@dataclass(frozen=True, slots=True)
class View:
    """The last analysis that understood a file, beside the present texts."""

    index: Index
    shift: Callable[[str], Shift]
    """From the analysed text of a file to its present one."""

    def present_range(self, path: str, start: int, end: int) -> TextRange | None:
        """A range of an analysed text in the present one; None if it was edited since."""
        moved = self.shift(path)
        first, last = moved.to_new(start), moved.to_new(end)
        return TextRange(path, first, last) if first is not None and last is not None else None


@dataclass(eq=False, slots=True)
class Project:
    """Open texts, and an analysis for each system (or file that no system uses) among them."""

    folders: tuple[str, ...] = ()
    _open: dict[str, SourceFile] = field(default_factory=dict)
    _current: dict[str, Analysis] = field(default_factory=dict)
    _last_good: dict[str, Analysis] = field(default_factory=dict)
    """By root, the last analysis in which every file has its shape."""

    def put(self, path: str, text: str) -> None:
        """Take the text of an open file, saved or not."""
        self._open[path] = SourceFile(path, text)

    def close(self, path: str) -> None:
        """Go back to what is on the disk."""
        self._open.pop(path, None)
        for root in list(self._current):
            self._forget(root)

    def open_paths(self) -> set[str]:
        """The files that the editor has open."""
        return set(self._open)

    def source(self, path: str) -> SourceFile:
        """The present text of a file; empty if it cannot be read."""
        if (opened := self._open.get(path)) is not None:
            return opened
        try:
            text, _ = load_text(path)
        except UnreadableFileError as refusal:
            text = refusal.text
        return SourceFile(path, text)

    def is_specification(self, path: str) -> bool:
        """Whether a text claims to be one: other YAML files are none of our business."""
        return claims_to_be_specification(self.source(path).text)

    def is_used(self, path: str) -> bool:
        """Whether a known system reads the file, or looked for it without finding it."""
        return any(root != path for root in self._systems_reading(path))

    def forget_deleted(self, path: str) -> None:
        """Drop what is known of a system whose file is gone and not open."""
        if path in self._current and path not in self._open and not os.path.exists(on_disk(path)):
            self._drop(path)

    def find_roots(self, path: str, search: bool = False) -> list[str]:
        """The systems that a file belongs to, or the file itself.

        With `search`, systems on the disk are analysed first. The analysis of the file alone is
        dropped if a system has it.
        """
        if _SYSTEM.search(self.source(path).text):
            return [path, *(root for root in self._systems_reading(path) if root != path)]
        found = list(self._systems_reading(path))
        if not found and search:
            for candidate in self._systems_mentioning(os.path.basename(path)):
                self.analyse(candidate)
            found = list(self._systems_reading(path))
            for root in set(self._current) - set(found):
                self._forget(root)
        if found:
            self._current.pop(path, None)
        return found or [path]

    def analyse(self, root: str) -> Analysis:
        """Compile a system, or look at a file that is none by itself."""
        analysis = self._current[root] = self._compile(root)
        known = self._last_good.get(root)
        if analysis.loader.is_complete:
            self._last_good[root] = analysis
        elif known is None or known.lacks_lines:
            self._last_good[root] = self._compile(root, lacks_lines=True)
        return analysis

    def _compile(self, root: str, *, lacks_lines: bool = False) -> Analysis:
        read = self._read_without_errors if lacks_lines else self._read
        loader = Loader(Findings(), read, reach=self._readable_paths(root))
        result = check_spec(root, loader)
        settings = settings_for(os.path.dirname(root)).settings
        judged = judge(result.diagnostics, loader.sources, settings, not result.is_part)
        return Analysis(root, loader, result, judged.diagnostics, lacks_lines)

    def _readable_paths(self, root: str) -> AllowedPaths:
        """What a file may name: besides its project, what is open in the editor, and folders."""
        return AllowedPaths(
            (*allowed_paths(root).folders, *map(real_path, (*self.folders, *self._open)))
        )

    def compare(self, texts: Mapping[str, str]) -> tuple[list[Diagnostic], list[Diagnostic]]:
        """What is wrong with the specifications that read some files, now and with other texts."""
        other = Project(self.folders, {**self._open})
        for changed, text in texts.items():
            other.put(changed, text)
        roots = [analysis.root for analysis in self._readers(texts)]
        before = [d for root in roots for d in self._compile(root).diagnostics]
        after = [d for root in roots for d in other._compile(root).diagnostics]
        return before, after

    def indexes(self, paths: Iterable[str]) -> list[Index]:
        """The symbols of all systems that read one of some files, whether they are open or not."""
        return [analysis.index for analysis in self._readers(paths)]

    def _readers(self, paths: Iterable[str]) -> list[Analysis]:
        """The analyses that one of some files is part of; systems are looked for on the disk."""
        wanted = list(paths)
        found = {root: self._complete(root) for root in self._current}
        for name in {os.path.basename(path) for path in wanted}:
            for root in self._systems_mentioning(name):
                if root not in found:
                    found[root] = self._compile(root)
        return [analysis for analysis in found.values() if any(map(analysis.includes, wanted))]

    def analyses(self) -> Iterable[Analysis]:
        """All present analyses."""
        return self._current.values()

    def earlier_findings(self, analysis: Analysis) -> Iterator[tuple[Sources, Diagnostic]]:
        """Findings of the last good analysis about files that have errors now, with its texts."""
        good = self._complete(analysis.root)
        if good is analysis or good.lacks_lines:
            return
        known = {(found.code, found.message) for found in analysis.diagnostics}
        for found in good.diagnostics:
            is_known = (found.code, found.message) in known
            if not is_known and not analysis.loader.is_understood(found.primary.file):
                yield good.sources, found

    def view(self, path: str) -> View | None:
        """What is known of a file; None if it was never part of an analysis."""
        found = []
        for root in dict.fromkeys((path, *self._current)):
            if (current := self._current.get(root)) is not None:
                is_good = current.loader.is_understood(path)
                found.append(current if is_good else self._last_good[root])
        found = [analysis for analysis in found if analysis.includes(path)]
        if found and not any(analysis.describes(path) for analysis in found):
            # No system uses it as it is described: what it says by itself.
            found.append(self._compile(path, lacks_lines=True))
        best = next((each for each in found if each.describes(path)), *found[:1] or (None,))
        if best is None:
            return None
        index = best.index
        return View(index, lambda file: shift(index.text(file), self.source(file).text))

    def present_range(self, sources: Sources, place: Place) -> TextRange | None:
        """Where a place in analysed texts is in the present ones; None if it was edited since."""
        source = sources.get(place.file)
        if source is None:
            return TextRange(place.file, 0, 0)
        moved = shift(source.text, self.source(place.file).text)
        start, end = map(moved.to_new, source.offsets(place))
        return None if start is None or end is None else TextRange(place.file, start, end)

    def _complete(self, root: str) -> Analysis:
        """The present analysis; if a file has errors, the last good one."""
        current = self._current[root]
        return current if current.loader.is_complete else self._last_good[root]

    def _systems_reading(self, path: str) -> Iterator[str]:
        """The known systems that read a file."""
        for root in list(self._current):
            best = self._complete(root)
            if best.result.system is not None and not best.result.is_part and best.includes(path):
                yield root

    def _forget(self, root: str) -> None:
        """Drop an analysis that no open file takes part in."""
        if root not in self._open and not any(map(self._current[root].includes, self._open)):
            self._drop(root)

    def _drop(self, root: str) -> None:
        self._current.pop(root, None)
        self._last_good.pop(root, None)

    def _systems_mentioning(self, file_name: str) -> Iterator[str]:
        """Files of systems, in the folders of the editor, that mention a file by its name."""
        for path in _yaml_files(self.folders):
            text = self.source(path).text
            if file_name in text and _SYSTEM.search(text):
                yield path

    def _read(self, path: str, row_keys: tuple[str, ...]) -> Document:
        opened = self._open.get(path)
        return read_text(path, opened.text, row_keys) if opened else read_file(path, row_keys)

    def _read_without_errors(self, path: str, row_keys: tuple[str, ...]) -> Document:
        document = self._read(path, row_keys)
        return without_errors(document) if document.source.text else document


def _yaml_files(folders: Iterable[str]) -> Iterator[str]:
    count = 0
    for folder in folders:
        for directory, below, names in os.walk(folder):
            below[:] = [name for name in below if not name.startswith((".", "node_modules"))]
            for name in sorted(names):
                if name.endswith(_SUFFIXES):
                    count += 1
                    if count > _MOST_FILES:
                        return
                    yield os.path.join(directory, name)
