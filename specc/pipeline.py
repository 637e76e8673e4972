"""The story of the compiler: read, shape, resolve, check, lower, emit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from specc.diagnostics import (
    CommandName,
    Diagnostic,
    blocks,
    merge_duplicates,
    nearest,
    without_follow_ups,
)
from specc.diagnostics.phrases import join_words
from specc.limits import (
    DESCRIBE_LESS,
    MAX_BYTES,
    OUT_OF_PARTS,
    OUT_OF_STEPS,
    WorkKind,
    is_used_up,
    one_run,
    too_many_steps,
)
from specc.model.scenario import Scenario
from specc.model.system import System
from specc.policy import allowed_paths
from specc.read import Document, read_file, read_text
from specc.refusal import Refused
from specc.resolve import Findings, Loaded, is_certain, resolve, resolve_alone
from specc.resolve.expressions import add_comment_hints
from specc.resolve.loader import Loader
from specc.resolve.scenarios import in_scenario, settings_of
from specc.source import Place, Sources, real_path

_AS_WRITTEN: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Result:
    """What is known of a specification: its meaning, if it has one, and all findings."""

    system: System | None
    proofs: Any
    diagnostics: tuple[Diagnostic, ...]
    sources: Sources
    broken: frozenset[str] = frozenset()
    """Qualified names of subsystems that lack parts; nothing is generated from them."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Everything that the command line can set -> the unit of a number without one."""
    is_part: bool = False
    """Whether the file has no system, but definitions or a description; `system` has them alone."""

    @property
    def ok(self) -> bool:
        """Whether code can be generated."""
        return self.can("build")

    def can(self, command: CommandName) -> bool:
        """Whether everything that a command needs is there and right."""
        stopped = any(blocks(finding.code, command) for finding in self.diagnostics)
        return self.system is not None and not stopped

    def in_scenario(self, name: str) -> Result:
        """The same of the system as runs of a scenario have it, but for what that sets.

        Raises Refused if there is no such scenario.
        """
        scenario = self.scenario(name)
        if scenario is None or self.system is None:
            return self
        return replace(self, system=in_scenario(self.system, scenario))

    def scenario(self, name: str) -> Scenario | None:
        """The scenario of that name; None if the specification has no meaning.

        Raises Refused if there is no such scenario.
        """
        if self.system is None:
            return None
        known = {each.name: each for each in self.system.scenarios}
        if name not in known:
            near = [f"`{each}`" for each in nearest(name, known) or known]
            way = "the specification has none; `scenarios:` adds one"
            if near:
                way = f"did you mean {join_words(near, 'or')}?"
            raise Refused(f"there is no scenario {name!r}; {way}")
        return known[name]


@dataclass(frozen=True, slots=True)
class Build:
    """Generated files of a system, relative path -> text; empty if the specification has errors."""

    result: Result
    system: str
    files: dict[str, str]


def compile_spec(
    path: str,
    values: Mapping[str, str] = _AS_WRITTEN,
    texts: Mapping[str, str] = _AS_WRITTEN,
    *,
    stop_when: str | None = None,
    publish: Sequence[str] = (),
    scenario: str | None = None,
) -> Result:
    """Read, shape, resolve and check the system at `path`; any other file is refused (E0102).

    `values` are texts that take the place of those in the files, by the names of what they are
    values of; `texts` are those of files, by real path, that are read instead. `stop_when` is the
    text of the formula that ends a run, `publish` what others in ROS can watch besides. The system
    is that of runs of a `scenario`, if one is named.
    """

    loader = _with_texts(path, texts)
    with one_run():
        file = loader.load(path)
        return _compiled(file, loader, values, stop_when, publish, scenario)


def _with_texts(path: str, texts: Mapping[str, str]) -> Loader:
    def read(named: str, row_keys: tuple[str, ...]) -> Document:
        text = texts.get(real_path(named))
        return read_file(named, row_keys) if text is None else read_text(named, text, row_keys)

    return Loader(Findings(), read, allowed_paths(path))


def check_spec(
    path: str, loader: Loader | None = None, texts: Mapping[str, str] = _AS_WRITTEN
) -> Result:
    """Like `compile_spec`, but what systems use is checked too, as far as it goes by itself.

    An editor brings its own loader, which keeps the files and all that was found.
    """
    loader = loader or _with_texts(path, texts)
    with one_run():
        file = loader.load(path)
        if file is not None and file.spec.is_part:
            return _checked_alone(file, loader)
        return _compiled(file, loader)


def _checked_alone(file: Loaded, loader: Loader) -> Result:
    from specc.checks import run_checks

    findings = loader.findings
    system, resolver = resolve_alone(file, loader.load, findings, loader.reach)
    broken, faulty = frozenset(resolver.broken), frozenset(resolver.faulty)
    checked, proofs = run_checks(system, broken, faulty, sound=False)
    own = add_comment_hints(findings.diagnostics, loader.sources)
    found = findings.certain((*own, *(d for d in checked if is_certain(d, file.path))))
    found = _add_budget_findings(found, file)
    return Result(system, proofs, found, loader.sources, broken, is_part=True)


def _compiled(
    file: Loaded | None,
    loader: Loader,
    values: Mapping[str, str] = _AS_WRITTEN,
    stop_when: str | None = None,
    publish: Sequence[str] = (),
    scenario: str | None = None,
) -> Result:
    from specc.checks import run_checks

    findings = loader.findings
    if file is None:
        return Result(None, None, tuple(findings.diagnostics), loader.sources)
    given, stop = loader.set_values(values), loader.stop_formula(stop_when)
    if scenario is not None:
        given = {**settings_of(file, scenario), **given}
    resolved = resolve(file, loader.load, findings, loader.reach, given, stop)
    if publish and (plant := resolved.system.plant):
        plant = replace(plant, published=(*plant.published, *loader.published(publish)))
        resolved = replace(resolved, system=replace(resolved.system, plant=plant))
    sound = not any(blocks(finding.code, "build") for finding in findings.diagnostics)
    checked, proofs = run_checks(resolved.system, resolved.broken, resolved.faulty, sound=sound)
    own = add_comment_hints(findings.diagnostics, loader.sources)
    agents = [agent.name for agent in resolved.system.agents]
    every = findings.certain((*without_follow_ups(own, checked), *checked))
    found = _add_budget_findings(tuple(merge_duplicates(every, agents)), file)
    result = Result(resolved.system, proofs, found, loader.sources, resolved.broken, resolved.units)
    return result if scenario is None else result.in_scenario(scenario)


def _add_budget_findings(found: tuple[Diagnostic, ...], file: Loaded) -> tuple[Diagnostic, ...]:
    """The findings; where an allowance is used up and something was left out, one says so.

    Whoever used it up may have been looking at something whose findings are not shown, or be
    content with an answer that is not known.
    """
    steps = too_many_steps("folding")
    rest: tuple[tuple[WorkKind, str, str, str], ...] = (
        ("parts", "E0017", OUT_OF_PARTS, OUT_OF_PARTS),
        ("folding", "E0334", steps, f"not all constants are computed: {steps}"),
        ("proof", "W0606", OUT_OF_STEPS, f"{OUT_OF_STEPS}; some warnings may be missing"),
    )
    for work, code, words, message in rest:
        if is_used_up(work) and not any(words in finding.message for finding in found):
            found += (Diagnostic(code, message, Place(file.path), help=DESCRIBE_LESS),)
    return found


def read_spec(path: str, texts: Mapping[str, str] = _AS_WRITTEN) -> Result:
    """Read, shape and resolve the specification at `path`; nothing is proved of it.

    `texts` are those of files, by real path, that are read instead.
    """
    return _read(path, _with_texts(path, texts))


def read_texts(
    path: str, texts: Mapping[str, str], values: Mapping[str, str] = _AS_WRITTEN
) -> Result:
    """Like `read_spec`, of a specification that is in no file; `values` as in `compile_spec`.

    `texts` are those of all its files, by real path; no file is read.
    """

    def read(named: str, row_keys: tuple[str, ...]) -> Document:
        text = texts.get(real_path(named), "")
        return read_text(named, text if len(text) <= MAX_BYTES else "", row_keys)

    return _read(path, Loader(Findings(), read), values)


def _read(path: str, loader: Loader, values: Mapping[str, str] = _AS_WRITTEN) -> Result:
    with one_run():
        file = loader.load(path)
        if file is None:
            return Result(None, None, tuple(loader.findings.diagnostics), loader.sources)
        given = loader.set_values(values)
        resolved = resolve(file, loader.load, loader.findings, loader.reach, given)
        diagnostics = _add_budget_findings(tuple(loader.findings.diagnostics), file)
    return Result(
        resolved.system, None, diagnostics, loader.sources, resolved.broken, resolved.units
    )


def build(
    path: str,
    values: Mapping[str, str] = _AS_WRITTEN,
    texts: Mapping[str, str] = _AS_WRITTEN,
    *,
    stop_when: str | None = None,
    publish: Sequence[str] = (),
    scenario: str | None = None,
    is_read: bool = True,
    tests_all_rows: bool = False,
) -> Build:
    """Compile the specification at `path` like `compile_spec`, then lower and emit it."""
    result = compile_spec(
        path, values, texts, stop_when=stop_when, publish=publish, scenario=scenario
    )
    return generated(result, path, is_read=is_read, tests_all_rows=tests_all_rows)


def generated(
    result: Result, path: str, *, is_read: bool = True, tests_all_rows: bool = False
) -> Build:
    """Lower and emit what was compiled of the specification at `path`.

    Code that nobody reads, since it runs at once and is gone, is not formatted. It `tests_all_rows`
    where a run may skip periods, which proofs know nothing of: always behind ROS 2.
    """
    if not result.ok or result.system is None:
        return Build(result, "", {})
    plant = result.system.plant
    tests_all_rows |= plant is not None and plant.ros2 is not None
    from specc.emit import FormatError, emit, fill_templates
    from specc.lower import TooLarge, lower

    try:
        proofs = None if tests_all_rows else result.proofs
        plans = lower(result.system, proofs, result.proofs.ages)
        files = emit(plans) if is_read else fill_templates(plans)
    except (TooLarge, FormatError) as error:
        code, at = "E0094", Place(path)
        if isinstance(error, TooLarge):
            places = {s.qualified_name: s.place for s in result.system.subsystems}
            code, at = "E0093", replace(places.get(error.subsystem, at), part="key")
        message, _, help_text = str(error).partition("; ")
        refusal = Diagnostic(code, message, at, help=help_text)
        return Build(replace(result, diagnostics=(*result.diagnostics, refusal)), "", {})
    return Build(result, result.system.name, files)
