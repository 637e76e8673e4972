"""How long somebody who types waits: from a change of a text to what is found in it.

A server is told of the flagship with a line more, letter by letter, as `tests/tools/lsp` does. Each
wait is compared with an analysis of the whole text by itself, whose files are read already.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from statistics import median
from time import perf_counter

from bench.harness.building import FLAGSHIP
from bench.harness.tables import table
from bench.harness.timing import undisturbed
from specc.pipeline import check_spec
from tests.tools.lsp.client import Client
from tests.tools.lsp.sessions import SESSIONS, typed

SERVER = [sys.executable, "-m", "specc", "lsp"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--every", type=int, default=2, help="letters between two changes")
    parser.add_argument("--repeats", type=int, default=15, help="of the analysis by itself")
    options = parser.parse_args(arguments)
    alone_s = analysis_s(options.repeats)
    rows: list[tuple[str, ...]] = [
        ("an analysis by itself", "", f"{1e3 * alone_s:.0f}", "", "1.00")
    ]
    rows.append(_row("a number", list(waited_s(numbers(options.repeats))), alone_s))
    every: list[float] = []
    for number, (before, line, _) in enumerate(SESSIONS, 1):
        sizes = range(1, len(line) + 1, options.every)
        waits = list(waited_s(typed(before, line, size)[0] for size in sizes))
        every += waits
        rows.append(_row(f"line {number}", waits, alone_s))
    rows.append(_row("all lines", every, alone_s))
    head = ("change", "changes", "median, ms", "slowest, ms", "x by itself")
    print(
        table("From a change to its diagnostics, flagship, without the editor itself", head, rows)
    )


def _row(name: str, waits: Sequence[float], alone_s: float) -> tuple[str, ...]:
    middle = median(waits)
    times = f"{1e3 * middle:.0f}", f"{1e3 * max(waits):.0f}"
    return (name, str(len(waits)), *times, f"{middle / alone_s:.2f}")


def analysis_s(repeats: int) -> float:
    """Median seconds of an analysis in this process; the first one imports what it needs."""
    times = []
    for _ in range(repeats + 1):
        with undisturbed():
            begin = perf_counter()
            check_spec(str(FLAGSHIP))
            times.append(perf_counter() - begin)
    return median(times[1:])


def numbers(count: int) -> Iterator[str]:
    """Texts without errors: the flagship with another value of a constant in each."""
    before, after = FLAGSHIP.read_text(encoding="utf-8").split("0.09[m]")
    for number in range(1, count + 1):
        yield f"{before}0.09{number}[m]{after}"


def waited_s(texts: Iterable[str]) -> Iterator[float]:
    """Seconds from each change of the flagship to the diagnostics of the text that it leads to."""
    with Client(SERVER, FLAGSHIP.parent) as client:
        uri = client.open(FLAGSHIP)
        client.diagnostics(uri)
        for text in texts:
            begin = perf_counter()
            client.change(uri, text)
            client.diagnostics(uri)
            yield perf_counter() - begin


if __name__ == "__main__":
    main()
