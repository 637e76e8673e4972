"""Somebody types into the flagship: what is offered, and what is analysed meanwhile."""

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.house.tree import ROOT
from tests.seeds import short
from tests.tools.lsp.client import Client
from tests.tools.lsp.sessions import FLAGSHIP, SESSIONS, typed
from tests.tools.lsp.workspace import SYSTEM, write

SERVER = [sys.executable, "-m", "specc", "lsp"]


def position(text: str, offset: int) -> tuple[int, int]:
    return text.count("\n", 0, offset), offset - text.rfind("\n", 0, offset) - 1


def proposals(found: dict[str, Any], typed: str) -> list[str]:
    """What an editor shows: in the order of the server, filtered by the word at the cursor."""
    word = re.search(r"\w*$", typed)
    assert word
    items = sorted(found["items"], key=lambda item: item["sortText"])
    labels = [item["label"] for item in items]
    return [label for label in labels if label.lower().startswith(word.group().lower())]


COUNTING = """\
from specc.tools.lsp import project, server

analyse = project.Project.analyse


def counted(self, root):
    with open({log!r}, "a") as log:
        log.write("analysed\\n")
    return analyse(self, root)


project.Project.analyse = counted
server.PAUSE_S = 2.0
"""


@pytest.mark.long
def test_what_is_typed_without_a_pause_is_analysed_once(tmp_path: Path) -> None:
    log = tmp_path / "log"
    (tmp_path / "sitecustomize.py").write_text(COUNTING.format(log=str(log)))
    write(tmp_path)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    with Client(["env", f"PYTHONPATH={path}", *SERVER], tmp_path) as client:
        uri = client.open(tmp_path / "arm.yaml")
        client.diagnostics(uri)
        for size in range(20):
            client.change(uri, f"{SYSTEM}# {'a note'[:size]}\n")
        client.diagnostics(uri)
    assert log.read_text().splitlines() == ["analysed"] * 2


@pytest.fixture(scope="module")
def editor() -> Iterator[tuple[Client, str]]:
    """A client in which the flagship is open."""
    with Client(SERVER, ROOT) as client:
        uri = client.open(FLAGSHIP)
        assert client.diagnostics(uri) == []
        yield client, uri
    assert client.exit_code == 0


@pytest.mark.parametrize(("before", "line", "wanted"), short(SESSIONS, 3))
def test_what_is_wanted_is_among_the_first(
    editor: tuple[Client, str], before: str, line: str, wanted: dict[str, str]
) -> None:
    client, uri = editor
    text = FLAGSHIP.read_text()
    assert text.count(before) == 1
    left = dict(wanted)
    ends = {line.index(ending) + len(ending) for ending in wanted}
    for size in sorted({*range(1, len(line) + 1, 20), *ends}):
        now, cursor = typed(before, line, size)
        client.change(uri, now)
        client.diagnostics(uri)
        at = position(now, cursor)
        found = client.ask("completion", uri, *at)
        client.ask("hover", uri, at[0], at[1] - 1)
        client.ask("signatureHelp", uri, *at)
        for ending in [ending for ending in left if line[:size].endswith(ending)]:
            label = left.pop(ending)
            assert label in proposals(found, line[:size])[:5], ending
    client.change(uri, text)
    assert client.diagnostics(uri) == []
    assert left == {}
