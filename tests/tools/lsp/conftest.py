"""One server for all tests that do not ask how it begins and ends."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import pytest

from tests.tools.lsp.client import Client
from tests.tools.lsp.workspace import write

_numbers = count()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    command = [sys.executable, "-m", "specc", "lsp"]
    with Client(command, tmp_path_factory.mktemp("workspace")) as client:
        yield client
    assert client.exit_code == 0


@pytest.fixture
def folder(server: Client) -> Path:
    """A folder of the server's workspace for one test, with a small system in it."""
    folder = server.folder / f"folder_{next(_numbers)}"
    folder.mkdir()
    write(folder)
    return folder


@pytest.fixture
def client(server: Client) -> Iterator[Client]:
    """The server, in which the texts of a test are closed when it is over."""
    yield server
    server.close_all()
