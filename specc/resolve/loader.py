"""Loads the files of a specification, each once, and keeps their texts for the diagnostics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from specc.diagnostics import Diagnostic, Related
from specc.limits import MAX_FILES, MAX_PARTS, MAX_VALUES
from specc.model.bindings import Published
from specc.read import ANYWHERE, AllowedPaths, Document, read_file, refuse_other_yaml
from specc.resolve.context import Findings, YamlNode
from specc.resolve.library import Loaded
from specc.schema import ROW_KEYS, SpecFile, desugar, shape
from specc.source import (
    PUBLISH,
    SET,
    STOP_WHEN,
    Place,
    SourceFile,
    Sources,
    TextNode,
    on_command_line,
    real_path,
)

_PARTS = ("virtual_effectors", "virtual_receptors", "real_effectors", "real_receptors")
_WITHOUT_TEXT = frozenset(("E0001", "E0004", "E0022"))


@dataclass(eq=False, slots=True)
class Loader:
    """`load` gives a file its shape; a file that fails is reported once and is None from then on.

    `read` reads the file of a path; an editor puts its unsaved texts there.
    """

    findings: Findings
    read: Callable[[str, tuple[str, ...]], Document] = read_file
    reach: AllowedPaths = ANYWHERE
    sources: Sources = field(default_factory=Sources)
    _files: dict[str, Loaded | None] = field(default_factory=dict)
    _values: int = 0
    _is_full: bool = False

    def load(self, path: str, named_at: YamlNode | None = None) -> Loaded | None:
        """The file at `path`; `named_at` is where another file names it."""
        real = real_path(path)
        if real not in self._files:
            self._files[real] = self._load(path, named_at)
        return self._files[real]

    def set_values(self, values: Mapping[str, str]) -> dict[str, YamlNode]:
        """Note the texts of the command line as a source; returns a node for each, by name."""
        if values:
            self.sources.add(on_command_line(values))
        return {name: YamlNode(SET, (name,), text) for name, text in values.items()}

    def stop_formula(self, formula: str | None) -> YamlNode | None:
        """The formula of the command line that ends a run."""
        if formula is None:
            return None
        self.sources.add(SourceFile(STOP_WHEN, formula, TextNode(0, len(formula), formula)))
        return YamlNode(STOP_WHEN, (), formula)

    def published(self, names: Sequence[str]) -> tuple[Published, ...]:
        """What the command line says that others in ROS can watch."""
        text = "\n".join(names)
        self.sources.add(SourceFile(PUBLISH, text, TextNode(0, len(text), text)))
        return tuple(Published(name, Place(PUBLISH)) for name in names)

    @property
    def is_complete(self) -> bool:
        """Whether every file that was asked for has its shape."""
        return all(file is not None for file in self._files.values())

    def is_understood(self, path: str) -> bool:
        """Whether a file was asked for and has its shape."""
        return self._files.get(real_path(path)) is not None

    def _load(self, path: str, named_at: YamlNode | None) -> Loaded | None:
        if not self.reach.contains(path):
            if named_at is not None:
                self.findings.report_outside(self.reach, path, named_at)
            else:
                self.findings.diagnostics.append(self.reach.link_finding(path))
            return None
        if len(self._files) >= MAX_FILES:
            self._refuse(f"more than {MAX_FILES} files are used", named_at)
            return None
        document = refuse_other_yaml(self.read(path, ROW_KEYS))
        self.sources.add(document.source)
        self._values += document.size
        if self._values > MAX_VALUES and named_at is not None:
            message = f"with this file there are more than {MAX_VALUES} values"
            self._refuse(message, named_at)
            return None
        self.findings.diagnostics += [
            _at_use(finding, named_at) for finding in document.diagnostics
        ]
        if not document.ok:
            return None
        data, faults = desugar(document.data, path)
        spec, wrong = (None, []) if faults else shape(SpecFile, data, path)
        self.findings.diagnostics += (*faults, *wrong)
        if spec is None:
            return None
        top = YamlNode(path, (), data)
        agents = [*spec.agents.values(), *([spec.agent] if spec.agent else [])]
        if sum(1 + sum(len(getattr(agent, key)) for key in _PARTS) for agent in agents) > MAX_PARTS:
            message = f"the file describes more than {MAX_PARTS} agents, subsystems and devices"
            hint = "describe repeated parts once, in a file of their own, or split the system"
            self.findings.report("E0017", message, top["agents"].key, help=hint)
            return None
        of_systems = [key for key in ("require", "let", "scenarios") if getattr(spec, key)]
        if named_at is not None and of_systems and spec.system is None:
            what = "scenarios" if of_systems == ["scenarios"] else "requirements"
            message = f"only systems have {what}, and this file is used by others"
            moved = of_systems[0] if what == "scenarios" else "require"
            hint = f"move `{moved}` to the file of the system, with the names of its agents"
            self.findings.report("E0101", message, top[of_systems[0]].key, help=hint)
        return Loaded(path, spec, top)

    def _refuse(self, message: str, named_at: YamlNode | None) -> None:
        """Report, once, that there is too much to read."""
        if not self._is_full and named_at is not None:
            hint = "move a part of the system into a specification of its own"
            self.findings.report("E0017", message, named_at.place, help=hint)
        self._is_full = True


def _at_use(finding: Diagnostic, named_at: YamlNode | None) -> Diagnostic:
    """Move a finding about a file without text to the place where the file is named."""
    if named_at is None:
        return finding
    if finding.code in _WITHOUT_TEXT:
        message = f"{finding.message}: {finding.primary.file}"
        return replace(finding, message=message, primary=named_at.place)
    related = (*finding.related, Related(named_at.place, "used here"))
    return replace(finding, related=related)
