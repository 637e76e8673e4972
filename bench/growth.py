"""How long `specc validate` takes as each list of a specification grows, in CPU time.

`tests/checks/test_growth.py` holds the calls to what is said here of the times. The other table has
what each command takes of small files that ask for much; 2 s and 300 MB are promised, of one of a
megabyte, or that it is refused.
"""

from __future__ import annotations

import argparse
import io
import multiprocessing
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from bench.harness.hostile import HOSTILE
from bench.harness.lists import GROWING, MAIN, put
from bench.harness.tables import table
from specc.cli.main import main as specc
from tests.recording.bombs import bombs
from tests.recording.test_foreign_code import TALK
from tests.sweep import hostile
from tests.tools.lsp.client import Client

OTHER, BOMB = "other.yaml", "bomb.mcap"
COMMANDS: Mapping[str, Sequence[str]] = {
    "validate": ("validate", MAIN),
    "build": ("build", MAIN, "--out", "gen"),
    "status": ("status", MAIN),
    "ages": ("ages", MAIN),
    "graph": ("graph", MAIN, "--format", "dot"),
    "diff": ("diff", MAIN, OTHER),
    "fmt": ("fmt", "--diff", MAIN),
    "explain": ("explain", "E" * 100_000),
    "lsp": (),
}
"""Those that read specifications; the editor's server is told of one that is opened."""
READERS: Mapping[str, Sequence[str]] = {
    "replay": ("replay", BOMB, "--spec", MAIN),
    "why": ("why", f"{BOMB}@0.4", "--spec", MAIN),
    "plot": ("plot", BOMB, "--csv"),
    "recover": ("recover", BOMB, "--out", "out.mcap"),
    "run --from": ("run", MAIN, "--duration", "0.5", "--from", f"{BOMB}@0.4"),
}
"""Those that read recordings."""
BOMBS = ("steps of zeros", "steps with [],", "many steps with [],", "empty records in chunks")
_PYTHON = (sys.executable, "-m", "specc")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--sizes", type=int, nargs="*", default=[50, 100, 200, 400])
    parser.add_argument("--only", default="", help="lists and commands with this in their name")
    options = parser.parse_args(arguments)
    _print_hostile(options.only)
    rows = []
    for name in GROWING:
        if options.only in name:
            _cpu_s(name, 3)  # imports what it takes
            times = [_cpu_s(name, size) for size in options.sizes]
            rows.append((name, *(f"{1e3 * time:.0f}" for time in times)))
    title = "CPU time of `specc validate` without the start of its process, ms"
    print(table(title, ("list", *map(str, options.sizes)), rows))


def _cpu_s(name: str, size: int) -> float:
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        put(GROWING[name](size), Path(scratch))
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            begin = process_time()
            specc(["validate", str(Path(scratch, MAIN))])
            return process_time() - begin


def _print_hostile(only: str) -> None:
    """What processes take, from their start to their end."""
    makers = {name: _putting(name) for name in HOSTILE}
    rows = [_row(name, command, makers) for name, command in COMMANDS.items() if only in name]
    title = "CPU time, s, and memory, MB, of one command; explore, run and sweep are left out"
    print(table(title, ("command", *HOSTILE), rows))
    texts = dict(bombs())
    recorded = {name: _recording(texts[name]) for name in BOMBS}
    rows = [_row(name, command, recorded) for name, command in READERS.items() if only in name]
    title = "CPU time, s, and memory, MB, of opening a recording of 1 MB; what runs do is left out"
    print(table(title, ("command", *BOMBS), rows))
    rows = [
        (name, *_cells([_used(_done(arguments, lines), (*hostile.COMMAND, *arguments))]))
        for name, (arguments, lines) in hostile.HOSTILE.items()
        if only in f"sweep {name}"
    ]
    title = "CPU time, s, and memory, MB, of a sweep whose runs are all in a folder of 1 MB"
    print(table(title, ("runs with", "sweep"), rows))


def _putting(name: str) -> Callable[[], None]:
    def there() -> None:
        put(HOSTILE[name](), Path())
        text = Path(MAIN).read_text(encoding="utf-8")
        Path(OTHER).write_text(text.replace("x.c.go", "x.c.go + 0"), encoding="utf-8")

    return there


def _recording(made: Callable[[], bytes]) -> Callable[[], None]:
    def there() -> None:
        Path(MAIN).write_text(TALK, encoding="utf-8")
        Path(BOMB).write_bytes(made())

    return there


def _done(arguments: Sequence[str], lines: Callable[[], Iterable[str]]) -> Callable[[], None]:
    def there() -> None:
        with redirect_stdout(io.StringIO()):
            hostile.begun(*arguments)
        hostile.put(lines())

    return there


def _row(
    name: str, command: Sequence[str], makers: Mapping[str, Callable[[], None]]
) -> tuple[str, ...]:
    """The cells of one command."""
    return (name, *_cells(_used(maker, command) for maker in makers.values()))


def _cells(used: Iterable[tuple[float, float]]) -> Iterator[str]:
    return (f"{cpu_s:.1f} {memory_mb:.0f}" for cpu_s, memory_mb in used)


def _used(make: Callable[[], None], command: Sequence[str]) -> tuple[float, float]:
    """CPU seconds and megabytes of a process, measured by a parent that has no other child."""
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        # A process of its own makes the files: a child begins with the memory of its parent.
        for do in (lambda _: make(), lambda end: end.send(_measured(command))):
            here, there = multiprocessing.Pipe()
            parent = multiprocessing.get_context("fork").Process(
                target=_inside, args=(Path(scratch), do, there)
            )
            parent.start()
            parent.join()
        found: tuple[float, float] = here.recv()
        return found


def _inside(folder: Path, do: Callable[[Connection], None], end: Connection) -> None:
    os.chdir(folder)
    do(end)


def _measured(command: Sequence[str]) -> tuple[float, float]:
    if command:
        subprocess.run([*_PYTHON, *command], capture_output=True, check=False)
    else:
        _opened()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def _opened() -> None:
    with Client([*_PYTHON, "lsp"], Path.cwd()) as client:
        client.diagnostics(client.open(Path(MAIN).absolute()))


if __name__ == "__main__":
    main()
