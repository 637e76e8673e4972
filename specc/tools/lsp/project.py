"""Specifications under an editor's folder: checked, kept, forgotten."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from specc.diagnostics import Diagnostic
from specc.pipeline import Result, check_spec
from specc.policy import allowed_paths, judge, settings_for
from specc.read import AllowedPaths, Document, claims_to_be_specification, read_file, read_text
from specc.resolve import Findings
from specc.resolve.loader import Loader
from specc.resources import on_disk
from specc.schema import ROW_KEYS
from specc.source import SourceFile, Sources, real_path
from specc.tools.lsp.index import Index, build_index
from specc.tools.lsp.unfinished import Shift, certain, mended, shift

_SYSTEM = re.compile(r"(?:^|\r)system\s*:", re.MULTILINE)
_SUFFIXES = (".yaml", ".yml")
_MOST_FILES = 2000
_LITTLE = 200
"""Characters; after a change of at most so many an earlier analysis still serves."""


@dataclass
class Analysis:
    """What was found about one file, `root`, and all that it uses."""

    root: str
    loader: Loader
    result: Result
    documents: dict[str, Document]
    diagnostics: tuple[Diagnostic, ...] = ()
    """What comments and settings leave of those of the result."""

    @property
    def complete(self) -> bool:
        """Whether every file has its shape, so that all of it took part."""
        return self.loader.complete

    @cached_property
    def index(self) -> Index:
        """The symbols; made when somebody asks for them."""
        return build_index(self.loader.sources, self.result.system, self.loader.findings)

    def has(self, path: str) -> bool:
        """Whether a file took part."""
        return self.loader.sources.get(path) is not None

    def has_read(self, path: str) -> bool:
        """Whether a part of the system is what the file describes, not other parts alone."""
        return any(use.place.file == path for use in self.loader.findings.uses)


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of the text of a file, in offsets."""

    path: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class FileEdit(Stretch):
    """New text for a part of a file."""

    text: str


@dataclass(frozen=True, slots=True)
class View:
    """The latest understood state of a file beside its present text."""

    index: Index
    source: SourceFile
    shift: Shift


@dataclass(eq=False, slots=True)
class Project:
    """Open texts, and an analysis for each system (or file that no system uses) among them."""

    folders: tuple[str, ...] = ()
    _open: dict[str, SourceFile] = field(default_factory=dict)
    _documents: dict[str, tuple[object, Document]] = field(default_factory=dict)
    _current: dict[str, Analysis] = field(default_factory=dict)
    _understood: dict[str, Analysis] = field(default_factory=dict)
    _mended: dict[str, tuple[Analysis, Analysis]] = field(default_factory=dict)
    _without: dict[str, tuple[Document, Document]] = field(default_factory=dict)
    _alone: dict[str, tuple[str, Analysis]] = field(default_factory=dict)

    def put(self, path: str, text: str) -> None:
        """Take the text of an open file, saved or not."""
        self._open[path] = SourceFile(path, text)

    def close(self, path: str) -> None:
        """Go back to what is on the disk."""
        self._open.pop(path, None)
        for root in list(self._current):
            self._forget(root)

    def is_open(self, path: str) -> bool:
        """Whether the editor has the file open."""
        return path in self._open

    def source(self, path: str) -> SourceFile:
        """The present text of a file; empty if it cannot be read."""
        return self._open.get(path) or self._read(path, ()).source

    def is_specification(self, path: str) -> bool:
        """Whether a text claims to be one: other YAML files are none of our business."""
        return claims_to_be_specification(self.source(path).text)

    def is_used(self, path: str) -> bool:
        """Whether a known system reads the file, or looked for it without finding it."""
        return any(root != path for root in self._using(path))

    def forget_deleted(self, path: str) -> None:
        """Drop what is known of a system whose file is gone and not open."""
        if path in self._current and path not in self._open and not os.path.exists(on_disk(path)):
            self._drop(path)

    def roots(self, path: str, search: bool = False) -> list[str]:
        """The systems that a file belongs to, or itself; `search` looks on the disk too."""
        if _SYSTEM.search(self.source(path).text):
            return [path, *(root for root in self._using(path) if root != path)]
        found = list(self._using(path))
        if not found and search:
            for candidate in self._systems(os.path.basename(path)):
                self.analyse(candidate)
            found = list(self._using(path))
            for root in set(self._current) - set(found):
                self._forget(root)
        if found:
            self._current.pop(path, None)
        return found or [path]

    def analyse(self, root: str) -> Analysis:
        """Compile a system, or look at a file that is none by itself."""
        analysis = self._analysed(root, self._read)
        self._current[root] = analysis
        if analysis.complete:
            self._understood[root] = analysis
        else:
            analysis.diagnostics += tuple(self._certain(root, analysis))
        return analysis

    def _certain(self, root: str, analysis: Analysis) -> Iterator[Diagnostic]:
        """What is wrong beside the errors that keep a text from being read."""
        best = self._without_errors(root, analysis)
        if best.complete:
            known = self._understood.get(root)
            earlier = known.diagnostics if known else ()
            sources = best.loader.sources
            yield from certain(best.diagnostics, sources, analysis.loader.sources, earlier)

    def _analysed(self, root: str, read: Callable[[str, tuple[str, ...]], Document]) -> Analysis:
        documents: dict[str, Document] = {}

        def noted(path: str, row_keys: tuple[str, ...]) -> Document:
            documents[path] = read(path, row_keys)
            return documents[path]

        loader = Loader(Findings(), noted, reach=self._reach(root))
        result = check_spec(root, loader)
        return _judged(Analysis(root, loader, result, documents))

    def _reach(self, root: str) -> AllowedPaths:
        """What a file may name: besides its project, what is open in the editor, and folders."""
        return AllowedPaths(
            (*allowed_paths(root).folders, *map(real_path, (*self.folders, *self._open)))
        )

    def compare(self, texts: Mapping[str, str]) -> tuple[list[Diagnostic], list[Diagnostic]]:
        """What is wrong with the specifications that read some files, now and with other texts."""
        other = Project(self.folders, {**self._open}, {**self._documents})
        for changed, text in texts.items():
            other.put(changed, text)
        roots = [analysis.root for analysis in self._readers(texts)]
        before = [d for root in roots for d in self._analysed(root, self._read).diagnostics]
        after = [d for root in roots for d in other.analyse(root).diagnostics]
        return before, after

    def indexes(self, paths: Iterable[str]) -> list[Index]:
        """The symbols of all systems that read one of some files, whether they are open or not."""
        return [analysis.index for analysis in self._readers(paths)]

    def _readers(self, paths: Iterable[str]) -> list[Analysis]:
        """The analyses that one of some files is part of; systems are looked for on the disk."""
        wanted = list(paths)
        found = dict(self._current)
        for name in {os.path.basename(path) for path in wanted}:
            for root in self._systems(name):
                if root not in found:
                    found[root] = self._analysed(root, self._read)
        best = [(self._best(root) or analysis) for root, analysis in found.items()]
        return [a for a in best if any(map(a.has, wanted))]

    def analyses(self) -> Iterable[Analysis]:
        """All present analyses."""
        return self._current.values()

    def view(self, path: str) -> View | None:
        """What is known of a file; None if it was never part of an analysis."""
        roots = dict.fromkeys((path, *self._current))
        found = [best for root in roots if (best := self._best(root)) and best.has(path)]
        if found and not any(best.has_read(path) for best in found):
            found.append(self._by_itself(path))
        best = next((best for best in found if best.has_read(path)), *found[:1] or (None,))
        if best is None:
            return None
        source, text = self.source(path), best.index.text(path)
        return View(best.index, source, shift(text, source.text))

    def _by_itself(self, path: str) -> Analysis:
        """What a file says that no system uses as it is described; made once for its text."""
        text = self.source(path).text
        known = self._alone.get(path)
        if known is None or known[0] != text:
            known = self._alone[path] = (text, self._analysed(path, self._read_mended))
        return known[1]

    def _best(self, root: str) -> Analysis | None:
        """The analysis that says most: of texts with errors, an earlier or a mended one."""
        current = self._current.get(root)
        if current is None or current.complete:
            return current
        earlier = self._understood.get(root)
        if earlier is not None and self._differs(earlier) <= _LITTLE:
            return earlier
        best = self._without_errors(root, current)
        return best if best.complete or earlier is None else earlier

    def _without_errors(self, root: str, current: Analysis) -> Analysis:
        """The analysis of mended texts; made once for each of the present ones."""
        known = self._mended.get(root)
        if known is None or known[0] is not current:
            made = self._moved(known[1]) if known else None
            known = self._mended[root] = (current, made or self._analysed(root, self._read_mended))
        return known[1]

    def _moved(self, earlier: Analysis) -> Analysis | None:
        """The analysis of mended texts at their present places, if they differ in blanks alone.

        While somebody types in a line that cannot be read, it is blank in all of them.
        """
        read = {path: self._read_mended(path, ROW_KEYS) for path in earlier.documents}
        if not all(_alike(earlier.documents[path], document) for path, document in read.items()):
            return None
        sources = Sources(document.source for document in read.values())
        loader = replace(earlier.loader, sources=sources)
        return _judged(replace(earlier, loader=loader, documents=read))

    def _differs(self, earlier: Analysis) -> int:
        """The most characters of a file that lie in the stretch that has changed since."""
        pairs = ((known.text, self.source(known.path).text) for known in earlier.loader.sources)
        return max((shift(*texts).size for texts in pairs), default=0)

    def _read_mended(self, path: str, row_keys: tuple[str, ...]) -> Document:
        document = self._read(path, row_keys)
        known = self._without.get(path)
        if known is None or known[0] is not document:
            better = mended(document) if document.source.text else None
            known = self._without[path] = (document, better or document)
        return known[1]

    def _using(self, path: str) -> Iterator[str]:
        """Systems that are known to read a file."""
        for root, analysis in list(self._current.items()):
            best = analysis if analysis.complete else self._understood.get(root, analysis)
            if best.result.system is not None and not best.result.is_part and best.has(path):
                yield root

    def _forget(self, root: str) -> None:
        """Drop an analysis that no open file takes part in."""
        if root not in self._open and not any(map(self._current[root].has, self._open)):
            self._drop(root)

    def _drop(self, root: str) -> None:
        self._current.pop(root, None)
        self._understood.pop(root, None)
        self._mended.pop(root, None)

    def _systems(self, named: str) -> Iterator[str]:
        """Files of systems, in the folders of the editor, that speak of a file by its name."""
        for path in _yaml_files(self.folders):
            text = self.source(path).text
            if named in text and _SYSTEM.search(text):
                yield path

    def _read(self, path: str, row_keys: tuple[str, ...]) -> Document:
        """The document of an open text, else of the file; each is read once."""
        opened = self._open.get(path)
        stamp: object = (opened.text, row_keys) if opened else (_stamp(path), row_keys)
        known = self._documents.get(path)
        if known is None or known[0] != stamp:
            read = read_text(path, opened.text, row_keys) if opened else read_file(path, row_keys)
            known = self._documents[path] = (stamp, read)
        return known[1]


def _judged(analysis: Analysis) -> Analysis:
    """The analysis with the diagnostics that comments and settings leave."""
    settings = settings_for(os.path.dirname(analysis.root)).settings
    sources, result = analysis.loader.sources, analysis.result
    judged = judge(result.diagnostics, sources, settings, not result.is_part)
    return replace(analysis, diagnostics=judged.diagnostics)


def _alike(one: Document, other: Document) -> bool:
    """Whether two texts have the same words and values, and nothing wrong in them."""
    if one is other:
        return True
    if one.diagnostics or other.diagnostics or repr(one.data) != repr(other.data):
        return False
    return one.source.text.split() == other.source.text.split()


def _stamp(path: str) -> object:
    try:
        status = os.stat(on_disk(path))
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size


def _yaml_files(folders: Iterable[str]) -> Iterator[str]:
    seen = 0
    for folder in folders:
        for directory, below, names in os.walk(folder):
            below[:] = [name for name in below if not name.startswith((".", "node_modules"))]
            for name in sorted(names):
                if name.endswith(_SUFFIXES):
                    seen += 1
                    if seen > _MOST_FILES:
                        return
                    yield os.path.join(directory, name)
