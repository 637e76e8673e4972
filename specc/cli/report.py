"""`specc report`: recorded runs, tests and sweeps as one file of HTML that opens from disk."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from specc.cli import streams
from specc.cli.files import write_output
from specc.cli.recordings import (
    DIFFERS,
    LOST,
    call_runtime,
    constants_for,
    print_losses,
    recorded_constants,
)
from specc.cli.view import recorded_run
from specc.diagnostics import nearest
from specc.diagnostics.phrases import counted, join_some, truncate
from specc.diagnostics.visible import visible
from specc.refusal import Refused

if TYPE_CHECKING:
    from specc.pipeline import Result
    from specc.tools.page.messages import Message
    from specc.tools.page.recorded import RecordedRun
    from specc.tools.report.results import Results, Section

MOST_RUNS = 40
"""With a section of their own."""
MOST_BYTES = 16_000_000
"""Of a report; the code that draws, and tables, are part of it."""
_OF_RUNS, _OF_ONE = 12_000_000, 4_000_000
_LONGEST, _MOST_NAMED = 200, 3
_VERDICTS = {"violated": "violated", "open": "open", "unknown": "not known", "holds": "hold"}


def report(options: Namespace) -> int:
    """Write the report; the exit code says whether parts of recordings are lost."""
    from specc.tools.report.results import results_at

    several: list[Results] = []
    files: dict[str, bool] = {}
    """Recordings, and whether somebody named them."""
    for word in options.files:
        found = results_at(word)
        if found is not None:
            several.append(found)
        else:
            files[word] = True
    for results in several:
        files |= {str(path): False for path in results.recordings if str(path) not in files}
    if len([file for file, is_named in files.items() if is_named]) > MOST_RUNS:
        raise Refused(f"{len(files)} recordings are too many for a report; name {MOST_RUNS}")
    made = _Report(options, [*files.items()][:MOST_RUNS])
    out = options.out or f"{Path(options.files[0]).resolve().stem}-report.html"
    if not out.endswith((".html", ".htm")):
        raise Refused(f"{out}: the name has to end in .html")
    code = made.read()
    if 0 < code < LOST:
        return code
    content = made.document(several).encode(errors="backslashreplace")
    inputs = [*options.files, *files]
    write_output(out, content, "html", inputs, by="report", force=options.force)
    streams.print_output(f"{out}\n")
    return code


@dataclass(frozen=True, slots=True)
class _ReportInput:
    """A recording in the report: its excerpt, and what the tables say of it."""

    section: Section
    text: str
    title: str
    facts: Sequence[tuple[str, str]]
    row: Message


class _Report:
    """The runs of a report, and what of them cannot be shown."""

    def __init__(self, options: Namespace, files: Sequence[tuple[str, bool]]) -> None:
        self._options, self._files = options, files
        self._runs: list[_ReportInput] = []
        self._unusable: list[str] = []
        self._results: dict[tuple[tuple[str, str], ...], Result] = {}
        """The user's specification, by the constants that were set."""
        self._signals: set[str] = set()
        """Those that are in any of the recordings."""

    def read(self) -> int:
        """Read all recordings; the exit code. Raises Refused where the only one is none."""
        code = 0
        share = min(_OF_ONE, _OF_RUNS // max(1, len(self._files)))
        for file, is_named in self._files:
            try:
                added = self._add(file, share)
            except Refused as refused:
                if is_named and len(self._files) == 1:
                    raise
                self._unusable.append(truncate(visible(str(refused)), _LONGEST))
                streams.print_message(f"specc: {refused}")
                added = LOST
            if 0 < added < LOST:  # the user's own specification cannot be used
                return added
            code = max(code, added)
        for name in self._options.signals if self._runs else ():
            if name not in self._signals:
                close = " or ".join(f"`{other}`" for other in nearest(name, sorted(self._signals)))
                hint = f"did you mean {close}?" if close else "`specc view` lists all of them"
                raise Refused(f"no recording has {name}; {hint}")
        return code

    def _add(self, file: str, share: int) -> int:
        """Read a recording; the exit code. Raises Refused."""
        from specc.tools.report.excerpt import excerpt
        from specc.tools.report.results import Section
        from specc.tools.sweep.table import key_of

        index = call_runtime("recording.index", "Index", Path(file))
        about, _ = call_runtime("recording.messages", "recorded", Path(file))
        given = self._specification(file, about)
        if given is not None and not given.ok:
            return streams.print_findings(given, self._options.spec) or DIFFERS
        words = [Path(word).name or word for word in self._options.files[:_MOST_NAMED]]
        more = ["..."] if len(self._options.files) > _MOST_NAMED else []
        command = ("specc", "report", *words, *more)
        run = recorded_run(index, given, self._options.spec or "", command)
        self._signals |= {signal["name"] for signal in run.hello()["signals"]}
        text = excerpt(run, self._options.signals, share)
        key = None
        with suppress(Refused, ValueError, TypeError):
            key = key_of(recorded_constants(about), int(about.get("seed", "")))
        section = Section(len(self._runs), file, key)
        facts = list(_facts(file, run, about, index.report))
        self._runs.append(
            _ReportInput(section, text, str(run.hello()["title"]), facts, _row(section, facts))
        )
        return int(print_losses(index.reading))

    def _specification(self, file: str, about: Mapping[str, str]) -> Result | None:
        """The user's own, with the constants of a recording. Raises Refused."""
        from specc import pipeline

        if not (spec := self._options.spec):
            return None
        values = constants_for(file, about, spec)
        key = tuple(sorted(values.items()))
        if key not in self._results:
            self._results[key] = pipeline.compile_spec(spec, values)
        return self._results[key]

    def document(self, several: Sequence[Results]) -> str:
        """The text of the file."""
        from specc.tools.report.document import document, table

        sections = [run.section for run in self._runs]
        tables = [each for results in several for each in results.tables(sections)]
        if not several and (len(self._files) > 1 or self._unusable):
            notes = [f"Not in this report: {words}" for words in self._unusable]
            tables.append(table("Recordings", _COLUMNS, [run.row for run in self._runs], notes))
        elif self._unusable:
            notes = [f"Not in this report: {words}" for words in self._unusable]
            tables.append(table("Recordings that cannot be shown", (), (), notes))
        about = {"tables": tables, "facts": [run.facts for run in self._runs]}
        titles = [results.title for results in several] or [run.title for run in self._runs]
        return document(titles[0] if titles else "Report", about, [run.text for run in self._runs])


# What is said of a run.

_COLUMNS = ("recording", "result", "seed", "constants", "until", "ended", "first failure")


def _facts(
    file: str, run: RecordedRun, about: Mapping[str, str], ending: Any
) -> Iterator[tuple[str, str]]:
    """Pairs of what is said of a run and the words."""
    hello, marks = run.hello(), run.marks()
    report = ending if isinstance(ending, dict) else {}
    bad = [mark for mark in marks if mark["kind"] in ("fault", "violation")]
    verdicts = [each["verdict"] for each in run.now()["requirements"]]
    counts = [f"{verdicts.count(v)} {w}" for v, w in _VERDICTS.items() if v in verdicts]
    faults = sum(1 for mark in bad if mark["kind"] == "fault")
    cycles = [mark["text"] for mark in marks if mark["kind"] == "cycle"]
    failures = [counted(faults, "fault")] if faults else []
    failures += [f"{verdicts.count('violated')} violated"] if "violated" in verdicts else []
    constants: Mapping[str, str] = {}
    with suppress(Refused):
        constants = recorded_constants(about)
    values = [f"{name} = {text}" for name, text in constants.items()]
    pairs = {
        "recording": Path(file).name,
        "result": ", ".join(failures) or "nothing went wrong",
        "specification": f"{hello['title']} ({about.get('spec', '')})",
        "seed": about.get("seed", ""),
        "constants": join_some(values, 2 * _MOST_NAMED),
        "going on from": about.get("from", ""),
        "until": f"{hello['end_s']:.6g} s",
        "ended": str(report.get("ended", "not in the file")),
        "cycles": join_some(cycles, 2 * _MOST_NAMED),
        "requirements": ", ".join(counts),
        "first failure": f"{bad[0]['time_s']:.6g} s {bad[0]['kind']}: {bad[0]['text']}"
        if bad
        else "",
    }
    return ((n, truncate(visible(str(text)), _LONGEST)) for n, text in pairs.items() if text)


def _row(section: Section, facts: Sequence[tuple[str, str]]) -> Message:
    from specc.tools.report.document import row

    known = dict(facts)
    is_bad = "first failure" in known
    return row([known.get(c, "") for c in _COLUMNS], is_bad=is_bad, run=section.number)
