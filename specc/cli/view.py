"""`specc view`: a page over a recording, in the browser; it runs nothing that a file names."""

from __future__ import annotations

import asyncio
import shlex
import signal
from argparse import Namespace
from functools import partial
from typing import TYPE_CHECKING, Any

from specc.cli import streams
from specc.cli.page import check_free
from specc.cli.recordings import (
    DIFFERS,
    as_recorded,
    call_runtime,
    constants_for,
    print_losses,
    recorded_constants,
    recorded_texts,
    spec_here,
    texts_by_path,
)
from specc.diagnostics import blocks
from specc.diagnostics.phrases import join_some, truncate
from specc.model.expr import Call, walk
from specc.refusal import Refused, missing_package, reason_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from specc.model.system import Subsystem
    from specc.pipeline import Result
    from specc.tools.page.recorded import RecordedRun
    from specc.tools.page.server import Server

_MOST_NAMED, _LONGEST = 3, 1000
_NO_FILE = "E0208"
_AT_FIRST_S, _NEWS_S = 2.0, 2.0
"""Wall time for which a file is read before it is shown, and then between two looks at it."""


def view(options: Namespace) -> int:
    """Show a recording until Ctrl-C; the exit code says whether parts of it are lost."""
    from specc import pipeline

    check_free(options.port)
    index = call_runtime("recording.index", "Index", options.file, _AT_FIRST_S)
    result = None
    if options.spec:
        about, _ = call_runtime("recording.messages", "recorded", options.file)
        values = constants_for(options.file, about, options.spec)
        result = pipeline.compile_spec(options.spec, values)
        if not result.ok:
            return streams.print_findings(result, options.spec) or DIFFERS
    try:
        asyncio.run(_serve(recorded_run(index, result, options.spec or ""), options.port))
    except ModuleNotFoundError as error:
        raise missing_package(error) from error
    return print_losses(index.reading)


def recorded_run(
    index: Any, given: Result | None = None, spec: str = "", command: Sequence[str] = ()
) -> RecordedRun:
    """The file of an index as a source of the page.

    `given` is the user's specification, compiled, at `spec`; without it that in the file is read,
    as data. `command` is the one to which `--spec` can be added, by default `specc view`. Raises
    Refused.
    """
    from specc.tools.page.description import AssetShelf, Description
    from specc.tools.page.raw import RawContent
    from specc.tools.page.recorded import RecordedContent, RecordedRun, Recording, SpecifiedContent
    from specc.tools.why.lines import Explainer

    about, texts = call_runtime("recording.messages", "recorded", index.path)
    notices: list[str] = []
    result = given or _read_texts(about, texts, notices)
    result = result and as_recorded(result, about)
    if given and [*texts.values()] != [*recorded_texts(given.sources).values()]:
        notices.append(f"{spec} is not as it was recorded")

    def all_notices() -> list[str]:
        until = f"it is still being read, until {index.end_s:.6g} s by now"
        return [*_losses(index), *notices, *([] if index.is_whole else [until])]

    recording = Recording(index, about, call_runtime, all_notices, spec)
    assets = AssetShelf()
    content: RecordedContent
    if result is None or result.system is None:
        content = RawContent(recording)
    else:
        if not spec and any(map(_calls_operators, result.system.subsystems)):
            own = command or ("specc", "view", str(index.path))
            named = shlex.join([*own, "--spec", spec_here(about) or "SPEC"])
            notices.append(
                "What operators compute is not known, for a recording does not decide which code"
                f" runs. To have them called, name the specification: {named}"
            )
        explainer = Explainer(
            spec or next(iter(texts)),
            result.system,
            result.sources,
            is_exact=about.get("exact") == "true",
            array=partial(call_runtime, "stepping", "array") if spec else None,
        )
        content = SpecifiedContent(Description(result.system, result, assets), explainer)
    return RecordedRun(recording, content, assets)


def _calls_operators(subsystem: Subsystem) -> bool:
    """Whether a condition of it does."""
    conditions = [row.condition for row in subsystem.transitions]
    conditions += [c for state in subsystem.states for _, c in state.behaviour.endings]
    exprs = [*(c.when for c in conditions), *(let.value for let in subsystem.lets)]
    return any(isinstance(node, Call) for expr in exprs for node in walk(expr))


def _losses(index: Any) -> list[str]:
    """What of a recording is not there any more, in words."""
    reading, words = index.reading, list[str]()
    if reading.damaged:
        parts = "one part" if reading.damaged == 1 else f"{reading.damaged} parts"
        words.append(f"The recording is damaged: {parts} of it cannot be read")
    return words + ([f"The recording was cut after {index.end_s:.6g} s"] if reading.cut else [])


def _read_texts(
    about: Mapping[str, str], texts: Mapping[str, str], notices: list[str]
) -> Result | None:
    """The specification in a recording, as data; None where it has errors, with a notice."""
    from specc import pipeline

    try:
        values = recorded_constants(about)
    except Refused as refused:
        values = {}
        notices.append(str(refused))
    spec = next(iter(texts), "")
    result = pipeline.read_texts(spec, texts_by_path(texts, spec), values)
    # Files that it names are not read, so it does not matter from where the page is opened.
    wrong = (d for d in result.diagnostics if blocks(d.code, "build") and d.code != _NO_FILE)
    errors = [d.message for d in wrong]
    if not errors and result.system:
        return result
    what = truncate(join_some(errors, _MOST_NAMED, "; "), _LONGEST)
    words = f"the specification in the file cannot be read: {what}"
    notices.append(words if texts else "there is no specification in the file")
    return None


async def _serve(source: RecordedRun, port: int) -> None:
    """Serve the page until Ctrl-C."""
    from specc.tools.page.server import Server

    server = Server(source, port)
    try:
        await server.start()
    except OSError as error:  # another program took the port meanwhile
        raise Refused(f"no page at port {port}: {reason_of(error)}") from error
    ended = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGINT, ended.set)
    server.begin()
    streams.print_message(f"specc: {server.url}")
    reading = asyncio.ensure_future(_read_on(source, server))
    try:
        await ended.wait()
        if reading.done():
            reading.result()
    finally:
        reading.cancel()
        await server.stop()


async def _read_on(source: RecordedRun, server: Server) -> None:
    """Read the rest of a large file, and show what is read of it. Raises Refused."""
    if source.is_whole:
        return
    try:
        while not source.is_whole:
            await asyncio.to_thread(source.read_on, _NEWS_S)
            server.tell({"type": "spans", "spans": source.spans(), "replace": True})
            server.tell({"type": "marks", "marks": source.marks(), "replace": True})
            server.tell_now()
    except Refused as refused:
        server.tell({"type": "refused", "text": str(refused)})
        raise
    server.begin()
