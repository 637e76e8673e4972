"""A file through what else reads specifications: commands, importers and the language server."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from random import Random

from bench.fuzzing.trial import Trial, guarded
from specc.cli.main import main
from specc.tools.lsp.features import completions, definition, hover, notes, renameable
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import RenameError

XML = Path(__file__).parents[2] / "tests/tools/importers/files"
_PIECES = (
    *(
        "<",
        ">",
        "/>",
        "</",
        "&",
        "&amp;",
        "&#0;",
        "&x;",
        "<!--",
        "-->",
        "<![CDATA[",
        "]]>",
        "<?xml?>",
    ),
    *('"', "'", "=", " ", "\x00", "é", "<a/>", '<a b="c">', "</state>", "0", "-1", "1e999", ""),
)
Try = Callable[[], object]


def tried_elsewhere(path: Path, spec: Path, random: Random) -> Trial:
    """Hand a file that was made from `spec` to one of them."""
    commands: tuple[list[str], ...] = (
        ["fmt", "--diff", str(path)],
        ["fmt", str(path)],
        ["status", str(path)],
        ["diff", str(spec), str(path)],
        ["diff", str(path), str(spec), "--format", "json"],
        ["validate", "--fix", str(path)],
        ["validate", "--format", "sarif", str(path)],
        ["ages", str(path)],
    )
    kind = random.random()
    if kind < 0.6:
        return guarded(_command(random.choice(commands)))
    if kind < 0.8:
        return guarded(_editing(path, spec, random))
    return guarded(_importing(path, random))


def _command(arguments: list[str]) -> Try:
    def run() -> None:
        os.environ["SPECC_TRACEBACK"] = "1"
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            try:
                main(arguments)
            except SystemExit as end:
                if end.code not in (0, 1, 2, None):
                    raise RuntimeError(f"{arguments[0]} exits with {end.code}") from None

    return run


def _editing(path: Path, spec: Path, random: Random) -> Try:
    """The text replaces another one in an editor, which then asks about a few places of it."""
    text = path.read_bytes().decode("utf-8", "replace")
    before = spec.read_bytes().decode("utf-8", "replace")
    places = [random.randint(0, len(text)) for _ in range(3)]

    def run() -> None:
        project, name = Project(), str(path)
        for version in (before, text):
            project.put(name, version)
            for root in project.find_roots(name):
                project.analyse(root)
            notes(project)
        for place in places:
            for ask in (hover, definition, completions):
                ask(project, name, place)
            with suppress(RenameError):
                renameable(project, name, place)

    return run


def _importing(path: Path, random: Random) -> Try:
    """A file of another tool with a few changes, or the specification as if it were one."""
    original = random.choice(sorted(XML.iterdir()))
    text = original.read_text(encoding="utf-8")
    for _ in range(random.randint(1, 6)):
        start = random.randrange(len(text) + 1)
        end = start + random.choice((0, 0, 1, 5, 40))
        other = random.randrange(len(text) + 1)
        piece = random.choice((*_PIECES, text[other : other + random.randrange(60)]))
        text = text[:start] + piece + text[end:]
    source = path.with_suffix(original.suffix)
    source.write_text(text if random.random() < 0.95 else path.read_text(errors="replace"), "utf-8")
    kind = "scxml" if original.suffix == ".scxml" else "fabric"
    return _command(["import", random.choice((kind, kind, "scxml")), str(source)])
