"""`specc view`: a page over a recording, in the browser; it runs nothing that a file names."""

from __future__ import annotations

import asyncio
import signal
from argparse import Namespace
from functools import partial
from typing import TYPE_CHECKING, Any

from specc.cli import streams
from specc.cli.recordings import (
    DIFFERS,
    call_runtime,
    loss_words,
    print_losses,
    recorded_constants,
    recorded_texts,
    texts_by_path,
)
from specc.diagnostics import blocks
from specc.diagnostics.phrases import join_some, truncate
from specc.refusal import Refused, missing_package

if TYPE_CHECKING:
    from collections.abc import Mapping

    from specc.pipeline import Result
    from specc.tools.page.recorded import RecordedRun

_MOST_NAMED, _LONGEST = 3, 1000


def view(options: Namespace) -> int:
    """Show a recording until Ctrl-C; the exit code says whether parts of it are lost."""
    from specc import pipeline

    index = call_runtime("recording.index", "Index", options.file)
    result = None
    if options.spec:
        about, _ = call_runtime("recording.messages", "recorded", options.file)
        result = pipeline.compile_spec(options.spec, recorded_constants(about))
        if not result.ok:
            return streams.print_findings(result, options.spec) or DIFFERS
    try:
        asyncio.run(_serve(recorded_run(index, result, options.spec or ""), options.port))
    except ModuleNotFoundError as error:
        raise missing_package(error) from error
    return print_losses(index.reading)


def recorded_run(index: Any, given: Result | None = None, spec: str = "") -> RecordedRun:
    """The file of an index as a source of the page.

    `given` is the user's specification, compiled, at `spec`; without it that in the file is read,
    as data. Raises Refused.
    """
    from specc.tools.page.description import AssetShelf, Description
    from specc.tools.page.raw import RawContent
    from specc.tools.page.recorded import Content, RecordedRun, Recording, SpecifiedContent
    from specc.tools.why.lines import Explainer

    about, texts = call_runtime("recording.messages", "recorded", index.path)
    notices = loss_words(index.reading)
    result = given or _read_texts(about, texts, notices)
    if given and [*texts.values()] != [*recorded_texts(given.sources).values()]:
        notices.append(f"{spec} is not as it was recorded")
    recording = Recording(index, about, call_runtime, notices, spec)
    assets = AssetShelf()
    content: Content
    if result is None or result.system is None:
        content = RawContent(recording)
    else:
        explainer = Explainer(
            spec or next(iter(texts)),
            result.system,
            result.sources,
            is_exact=about.get("exact") == "true",
            array=partial(call_runtime, "stepping", "array") if spec else None,
        )
        content = SpecifiedContent(Description(result.system, result, assets), explainer)
    return RecordedRun(recording, content, assets)


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
    errors = [d.message for d in result.diagnostics if blocks(d.code, "build")]
    if not errors and result.system:
        return result
    what = truncate(join_some(errors, _MOST_NAMED, "; "), _LONGEST) or "there is none"
    notices.append(f"the specification in the file cannot be read: {what}")
    return None


async def _serve(source: RecordedRun, port: int) -> None:
    """Serve the page until Ctrl-C."""
    from specc.tools.page.server import Server

    server = Server(source, port)
    try:
        await server.start()
    except OSError as error:
        raise Refused(f"no page at port {port}: {error.strerror}") from error
    ended = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGINT, ended.set)
    server.begin()
    streams.print_message(f"specc: {server.url}")
    try:
        await ended.wait()
    finally:
        await server.stop()
