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
    about, texts = call_runtime("recording.messages", "recorded", options.file)
    notices = loss_words(index.reading)
    try:
        values = recorded_constants(about)
    except Refused as refused:
        values = {}
        notices.append(str(refused))
    if options.spec:
        result = pipeline.compile_spec(options.spec, values)
        if not result.ok:
            return streams.print_findings(result, options.spec) or DIFFERS
        if [*texts.values()] != [*recorded_texts(result.sources).values()]:
            notices.append(f"{options.spec} is not as it was recorded")
    else:
        result = _recorded(texts, values)
        notices += _errors(result)
    try:
        asyncio.run(_serve(_source(options, index, about, result, notices), options.port))
    except ModuleNotFoundError as error:
        raise missing_package(error) from error
    return print_losses(index.reading)


def _recorded(texts: Mapping[str, str], values: Mapping[str, str]) -> Result:
    """The specification in a recording, as data."""
    from specc import pipeline

    spec = next(iter(texts), "")
    return pipeline.read_texts(spec, texts_by_path(texts, spec), values)


def _errors(result: Result) -> list[str]:
    """Why what is recorded of the specification cannot be used, if it cannot."""
    errors = [d.message for d in result.diagnostics if blocks(d.code, "build")]
    if result.system is not None and not errors:
        return []
    what = truncate(join_some(errors, _MOST_NAMED, "; "), _LONGEST) or "there is none"
    return [f"the specification in the file cannot be read, so values are as recorded: {what}"]


def _source(
    options: Namespace, index: Any, about: Mapping[str, str], result: Result, notices: list[str]
) -> RecordedRun:
    """The recording as a source of the page."""
    from specc.tools.page.description import AssetShelf, Description
    from specc.tools.page.raw import RawContent
    from specc.tools.page.recorded import Content, RecordedRun, Recording, SpecifiedContent
    from specc.tools.why.lines import Explainer

    spec = options.spec or ""
    recording = Recording(index, about, call_runtime, notices, spec)
    assets = AssetShelf()
    content: Content = RawContent(recording)
    if result.system is not None and not _errors(result):
        explainer = Explainer(
            spec or next(iter(s.path for s in result.sources), ""),
            result.system,
            result.sources,
            is_exact=about.get("exact") == "true",
            array=partial(call_runtime, "stepping", "array") if spec else None,
        )
        content = SpecifiedContent(Description(result.system, result, assets), explainer)
    return RecordedRun(recording, content, assets)


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
