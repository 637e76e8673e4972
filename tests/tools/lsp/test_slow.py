"""Texts that take for ever, and requests without their form: the server goes on and answers."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.tools.lsp.client import Client, ServerError
from tests.tools.lsp.workspace import SYSTEM, place

SLOW = SYSTEM.replace("system: arm", "system: slow")
GREEDY = SYSTEM.replace("system: arm", "system: greedy")
DEADLY = SYSTEM.replace("system: arm", "system: deadly")
MEDDLING = """\
import os, time
from specc.tools.lsp import project, worker

analyse = project.Project.analyse


def slow(self, root):
    while "system: slow" in self.source(root).text:
        time.sleep(0.01)
    if "system: deadly" in self.source(root).text:
        os._exit(3)
    if "system: greedy" in self.source(root).text:
        bytes(3 * 10**9)
    return analyse(self, root)


project.Project.analyse = slow
worker.LIMIT_S = 3.0
"""
INVALID_PARAMS = -32602


def meddled(folder: Path) -> Client:
    """A client of a server to which the check of some texts never ends."""
    meddling = folder / "meddling"
    meddling.mkdir()
    (meddling / "sitecustomize.py").write_text(MEDDLING)
    workspace = folder / "workspace"
    workspace.mkdir()
    path = os.pathsep.join([str(meddling), os.environ.get("PYTHONPATH", "")])
    command = ["env", f"PYTHONPATH={path}", sys.executable, "-m", "specc", "lsp"]
    return Client(command, workspace)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """In place of that of the folder."""
    with meddled(tmp_path_factory.mktemp("slow")) as client:
        yield client
    assert client.exit_code == 0


def errors(client: Client, uri: str) -> set[str]:
    return {item.get("code", "") for item in client.diagnostics(uri) if item["severity"] == 1}


@pytest.mark.long
def test_shutdown_is_answered_while_a_check_runs(tmp_path: Path) -> None:
    with meddled(tmp_path) as client:
        client.open(client.folder / "slow.yaml", SLOW)
    assert client.exit_code == 0


def test_a_change_abandons_the_check(client: Client, folder: Path) -> None:
    """Questions behind it are answered."""
    uri = client.open(folder / "slow.yaml", SLOW)
    client.change(uri, SYSTEM.replace("limit)", "limits)"))
    with suppress(ServerError):  # or a hover, or none
        client.ask("hover", uri, 0, 0)
    assert errors(client, uri) == {"E0201"}


@pytest.mark.long
def test_a_check_that_takes_too_long_is_given_up(client: Client, folder: Path) -> None:
    other = client.open(folder / "arm.yaml")
    assert errors(client, other) == set()
    uri = client.open(folder / "slow.yaml", SLOW)
    (found,) = client.diagnostics(uri)
    assert "given up" in found["message"]
    # What was known of the other text is found out anew.
    assert errors(client, other) == set()
    line = SYSTEM[: place(SYSTEM, "X_c: |T_c, grip")].count("\n")
    column = SYSTEM.splitlines()[line].index("T_c, grip")
    assert "eq. 24" in client.ask("hover", other, line, column)["contents"]["value"]
    client.change(uri, SYSTEM)
    assert errors(client, uri) == set()


def test_a_process_that_dies_is_replaced(client: Client, folder: Path) -> None:
    uri = client.open(folder / "deadly.yaml", DEADLY)
    client.change(uri, SYSTEM)
    assert errors(client, uri) == set()


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "why"), [(DEADLY, "ended its process"), (GREEDY, "more than 2 GB of memory")]
)
def test_what_ends_the_process_is_told_and_other_texts_are_found_anew(
    client: Client, folder: Path, text: str, why: str
) -> None:
    other = client.open(folder / "arm.yaml")
    assert errors(client, other) == set()
    uris = [client.open(folder / name, text) for name in ("a.yaml", "b.yaml")]
    for uri in uris:
        (found,) = client.diagnostics(uri)
        assert why in found["message"]
    assert errors(client, other) == set()
    client.change(uris[0], SYSTEM)
    assert errors(client, uris[0]) == set()


MALFORMED: list[tuple[str, Any]] = [
    ("hover", {"x": 1}),
    ("hover", []),
    ("hover", None),
    ("hover", {"textDocument": {"uri": 7}, "position": {"line": "a", "character": 0}}),
    ("hover", {"textDocument": {"uri": "file:///a"}, "position": {"line": -1, "character": 0}}),
    ("rename", {"textDocument": {"uri": "file:///a"}, "position": {"line": 0, "character": 0}}),
    ("codeAction", {"textDocument": {"uri": "file:///a"}, "range": {}, "context": {}}),
]


@pytest.mark.long
def test_malformed_requests_get_invalid_params(client: Client) -> None:
    for method, params in MALFORMED:
        with pytest.raises(ServerError) as refused:
            client.request(f"textDocument/{method}", params)
        assert refused.value.code == INVALID_PARAMS
