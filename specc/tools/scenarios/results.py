"""The results of the scenarios of a specification: as a file, for later, and as JUnit's XML."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from specc.atomic_files import write_atomically
from specc.diagnostics.visible import visible, visible_lines
from specc.tools.scenarios.judging import ScenarioResult, reasons_by_seeds, seeds_in_words

FILE, FORMAT, VERSION = "results.json", "specc-test", 1
_MOST_BYTES = 50_000_000
"""Of a file of results that is read."""


def write_results(
    folder: Path,
    specification: str,
    digest: str,
    results: Sequence[ScenarioResult],
    others: Sequence[Mapping[str, Any]] = (),
) -> Path:
    """Write what came of scenarios of a specification with these texts into a folder; the file.

    `others` are what an earlier test wrote of scenarios that were not run. A digest that is empty
    says that no scenario was, since the specification could not be used.
    """
    folder.mkdir(parents=True, exist_ok=True)
    data = {
        "format": FORMAT,
        "version": VERSION,
        "specification": specification,
        "specification_sha256": digest,
        "scenarios": [*(result.as_data() for result in results), *others],
    }
    write_atomically(file := folder / FILE, json.dumps(data, indent=2) + "\n")
    return file


def remove_results(folder: Path, specification: str, run: Collection[str]) -> None:
    """Remove the results of an earlier test of some scenarios, with their recordings.

    The folder goes with its last result.
    """
    for entry in _scenarios(_data(folder)):
        for name in _recordings(entry) if entry.get("name") in run else ():
            (folder / name).unlink(missing_ok=True)
    if not other_results(folder, specification, run):
        (folder / FILE).unlink(missing_ok=True)
        with suppress(OSError):  # there is something else in it, or no folder
            folder.rmdir()


def other_results(
    folder: Path, specification: str, run: Collection[str], known: Collection[str] | None = None
) -> list[dict[str, Any]]:
    """What an earlier test wrote of scenarios that it has not seen pass, but of those that are run.

    If those that are `known` are given, only of them.
    """
    data = _data(folder)
    if data.get("specification") != specification:
        return []
    return [
        entry
        for entry in _scenarios(data)
        if isinstance(name := entry.get("name"), str)
        and entry.get("passed") is not True
        and name not in run
        and (known is None or name in known)
    ]


@dataclass(frozen=True, slots=True)
class EarlierTest:
    """Scenarios that an earlier test has not seen pass, of a specification with this digest.

    All, if `is_unknown`: none was run.
    """

    names: frozenset[str] = frozenset()
    digest: str = ""
    is_unknown: bool = False


def earlier_test(folder: Path, specification: str) -> EarlierTest:
    """What an earlier test of a specification left in a folder; without names if there is none."""
    data = _data(folder)
    if data.get("specification") != specification:
        return EarlierTest()
    entries = _scenarios(data)
    names = (entry.get("name") for entry in entries if entry.get("passed") is not True)
    digest = str(data.get("specification_sha256", ""))
    found = frozenset(name for name in names if isinstance(name, str))
    return EarlierTest(found, digest, is_unknown=not digest)


def digest_of(texts: Iterable[str]) -> str:
    """The digest of the texts of a specification."""
    return sha256(json.dumps([*texts]).encode()).hexdigest()


def _data(folder: Path) -> dict[str, Any]:
    """The content of a file of results; nothing if it is no such file."""
    file = folder / FILE
    try:
        if file.stat().st_size > _MOST_BYTES:
            return {}
        data = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    is_known = isinstance(data, dict) and data.get("format") == FORMAT
    return data if is_known and data.get("version") == VERSION else {}


def _scenarios(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    entries = data.get("scenarios")
    for entry in entries if isinstance(entries, list) else ():
        if isinstance(entry, dict):
            yield entry


def _recordings(entry: dict[str, Any]) -> Iterator[str]:
    """The recordings beside the file that an entry names, by the names that they were given."""
    runs, scenario = entry.get("runs"), entry.get("name")
    for run in runs if isinstance(runs, list) else ():
        if isinstance(run, dict) and isinstance(scenario, str) and scenario.isidentifier():
            name, seed = run.get("recording"), run.get("seed")
            if isinstance(seed, int) and name == f"{scenario}-{seed}.mcap":
                yield name


# JUnit's XML, which services for CI show.

Case = tuple[str, str | None]
"""The name of a case, and why it failed; empty if it did not, None if that is not known."""


def as_junit(suites: Sequence[tuple[str, Sequence[Case]]]) -> str:
    """A suite for each specification, with its cases."""
    texts = "".join(_suite(name, cases) for name, cases in suites)
    every = [case for _, cases in suites for case in cases]
    head = '<?xml version="1.0" encoding="UTF-8"?>\n'
    return f"{head}<testsuites {_counts(every)}>\n{texts}</testsuites>\n"


def cases_of(results: Sequence[ScenarioResult]) -> list[Case]:
    """The case of each scenario."""
    return [
        (result.scenario.name, None if result.is_cut else failure_text(result))
        for result in results
    ]


def failure_text(result: ScenarioResult) -> str:
    """How many runs passed and why others did not; empty if enough did."""
    if result.is_passed:
        return ""
    count = f"{result.passes} of {len(result.runs)} runs pass, {result.required} have to"
    reasons = reasons_by_seeds([run for run in result.runs if not run.is_passed])
    return "\n".join([count, *(f"{seeds_in_words(runs, 8)}: {why}" for why, runs in reasons)])


def _counts(cases: Sequence[Case]) -> str:
    failures = sum(bool(failure) for _, failure in cases)
    cut = sum(failure is None for _, failure in cases)
    return f'tests="{len(cases)}" failures="{failures}" errors="0" skipped="{cut}"'


def _suite(name: str, cases: Sequence[Case]) -> str:
    title = quoteattr(visible(name))
    body = "".join(_case(title, *case) for case in cases)
    return f"<testsuite name={title} {_counts(cases)}>\n{body}</testsuite>\n"


def _case(suite: str, name: str, failure: str | None) -> str:
    head = f"<testcase classname={suite} name={quoteattr(visible(name))}"
    if failure is None:
        return f'{head}>\n<skipped message="not run"/>\n</testcase>\n'
    if not failure:
        return f"{head}/>\n"
    message, text = failure.partition("\n")[0], escape(visible_lines(failure))
    return (
        f"{head}>\n<failure message={quoteattr(visible(message))}>{text}</failure>\n</testcase>\n"
    )
