"""The life of a server: how it begins and ends, and what it takes from a client that errs."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.tools.lsp.client import Client, ServerError
from tests.tools.lsp.workspace import LIBRARY, SYSTEM, write

SERVER = [sys.executable, "-m", "specc", "lsp"]
NOBODY: dict[str, Any] = {"processId": None, "rootUri": None, "capabilities": {}}
BEGIN = [
    {"id": 1, "method": "initialize", "params": NOBODY},
    {"method": "initialized", "params": {}},
]
EARLY = [
    {"id": 9, "method": "textDocument/foldingRange", "params": {}},
    {"id": 5, "method": "textDocument/hover", "params": {}},
]
END: list[dict[str, Any]] = [{"id": 99, "method": "shutdown"}, {"method": "exit"}]


def framed(message: dict[str, Any] | bytes) -> bytes:
    if isinstance(message, bytes):
        return message
    body = json.dumps({"jsonrpc": "2.0", **message}).encode()
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


@pytest.mark.parametrize(
    ("messages", "code"),
    [
        pytest.param([*BEGIN, {"method": "exit"}], 1, marks=pytest.mark.long),
        pytest.param(BEGIN, 0, marks=pytest.mark.long),
        ([*EARLY, *BEGIN, {"method": "$/cancelRequest", "params": {"id": 77}}, *END], 0),
    ],
)
def test_ends_with_the_code_of_the_protocol(
    messages: list[dict[str, Any] | bytes], code: int, tmp_path: Path
) -> None:
    """A client whose process cannot be seen is served like any other."""
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    begin = {**BEGIN[0], "params": {**NOBODY, "processId": gone.pid}}
    sent = b"".join(framed(begin if message is BEGIN[0] else message) for message in messages)
    ended = subprocess.run(SERVER, input=sent, capture_output=True, cwd=tmp_path, timeout=60)
    assert ended.returncode == code
    # Nothing is asked before the beginning.
    assert ended.stdout.count(b'"code": -32002') == sum(early in messages for early in EARLY)


def body(text: str) -> bytes:
    return f"Content-Length: {len(text)}\r\n\r\n{text}".encode()


OPEN = '"textDocument": {"uri": "file:///a.yaml", "version": 1}'
DEEP = "[" * 100_000
HOVER = '{"jsonrpc": "2.0", "id": 5, "method": "textDocument/hover", "params": %s}'


NO_MESSAGES: list[tuple[str, tuple[int | None, int] | None]] = [
    ('{"method": 5}', (None, -32600)),
    ('{"jsonrpc": "2.0", "method": 5}', (None, -32600)),
    ('{"jsonrpc": "2.0", "id": 71}', (71, -32600)),
    ('{"id": 71, "method": "shutdown"}', (71, -32600)),
    ('{"jsonrpc": "2.0", "id": [1], "method": "shutdown"}', (None, -32600)),
    ("[1, 2]", (None, -32600)),
    ("7", (None, -32600)),
    ("{bad", (None, -32700)),
    ('"\\ud800', (None, -32700)),
    (DEEP, (None, -32700)),
    (HOVER % "[]", (5, -32602)),
    (HOVER % '{"textDocument": {"jsonrpc": "2.0"}}', (5, -32602)),
    ('{"jsonrpc": "2.0", "id": 6, "method": "specc/nothing"}', (6, -32601)),
    ('{"jsonrpc": "2.0", "id": 77, "result": null}', None),
    ('{"jsonrpc": "2.0", "method": "specc/nothing"}', None),
    ('{"jsonrpc": "2.0", "method": "textDocument/didOpen", "params": 3}', None),
    (
        '{"jsonrpc": "2.0", "method": "textDocument/didChange", '
        f'"params": {{{OPEN}, "contentChanges": [{{"text": "a"}}]}}}}',
        None,
    ),
]
"""Texts, each with the number of the request and the code of the answer, if there is one."""


def absurd(length: str) -> bytes:
    """A header that nobody means; what follows it without the end of a line hides no message."""
    return f"Content-Length: {length}\r\n\r\n{{}}".encode()


@pytest.mark.long
def test_what_is_no_message_is_refused_as_json_rpc_says(tmp_path: Path) -> None:
    texts = [body(text) for text, _ in NO_MESSAGES]
    sent = b"".join([*map(framed, BEGIN), *texts, absurd("9" * 12), *map(framed, END)])
    ended = subprocess.run(SERVER, input=sent, capture_output=True, cwd=tmp_path, timeout=60)
    found = [json.loads(part) for part in re.findall(rb"\{.*?\}(?=Content|$)", ended.stdout)]
    told = [item for item in found if item.get("id") not in (1, 99)]
    codes = [(item["id"], item["error"]["code"]) for item in told]
    absurd_one = None, -32700
    assert codes == [*(answer for _, answer in NO_MESSAGES if answer), absurd_one]
    assert (ended.returncode, ended.stderr) == (0, b"")


@pytest.mark.long
@pytest.mark.parametrize("length", ["9" * 12, "9" * 8_000, "9" * 30, "16000001", "-5", "x"])
def test_a_header_that_nobody_means_is_passed_over(length: str, tmp_path: Path) -> None:
    sent = b"".join(map(framed, [*BEGIN, absurd(length), *END]))
    ended = subprocess.run(SERVER, input=sent, capture_output=True, cwd=tmp_path, timeout=60)
    assert b'"id": 99' in ended.stdout
    assert (b"-32700" in ended.stdout) == (length.isdigit() and len(length) < 4_000)
    assert (ended.returncode, ended.stderr) == (0, b"")


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ends_when_the_process_of_its_client_is_gone(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as client:
        begin = {**BEGIN[0], "params": {**NOBODY, "processId": client.pid}}
        server = subprocess.Popen(
            SERVER, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=tmp_path
        )
        assert server.stdin
        assert server.stdout
        server.stdin.write(framed(begin))
        server.stdin.flush()
        assert server.stdout.readline()
        client.communicate(b"\n")
    try:
        assert server.wait(30) == 1
    finally:
        server.kill()
        server.stdin.close()
        server.stdout.close()


def errors(client: Client, uri: str) -> set[str]:
    return {item["code"] for item in client.diagnostics(uri) if item["severity"] == 1}


def test_a_file_that_vanishes_and_comes_back(client: Client, folder: Path) -> None:
    library = folder / "lib/fingers.yaml"
    changed = {"changes": [{"uri": library.as_uri(), "type": 3}]}
    uri = client.open(folder / "arm.yaml")
    assert errors(client, uri) == set()
    library.unlink()
    client.notify("workspace/didChangeWatchedFiles", changed)
    assert "E0001" in errors(client, uri)
    library.write_text(LIBRARY)
    client.notify("workspace/didChangeWatchedFiles", changed)
    assert errors(client, uri) == set()


def wait_for(client: Client, uri: str, code: str) -> None:
    """Wait until an error is told; raises `queue.Empty` if it never is."""
    while code not in errors(client, uri):
        pass


def test_two_systems_and_the_library_they_share(client: Client, folder: Path) -> None:
    (folder / "other.yaml").write_text(SYSTEM.replace("system: arm", "system: other"))
    systems = [client.open(folder / name) for name in ("arm.yaml", "other.yaml")]
    library = client.open(folder / "lib/fingers.yaml")
    client.change(library, LIBRARY.replace("{tolerance: ", "{width: "))
    for system in systems:
        wait_for(client, system, "E0201")
    client.close(library)
    for system in systems:
        while errors(client, system):
            pass


def test_a_system_that_is_deleted_is_told_about_no_more(client: Client, folder: Path) -> None:
    system = folder / "arm.yaml"
    system.write_text(SYSTEM.replace("limit)", "limits)"))
    library = client.open(folder / "lib/fingers.yaml")
    wait_for(client, system.as_uri(), "E0201")
    system.unlink()
    changed = {"changes": [{"uri": system.as_uri(), "type": 3}]}
    client.notify("workspace/didChangeWatchedFiles", changed)
    while errors(client, system.as_uri()):
        pass
    client.change(library, LIBRARY.replace("x.E.d_m}}", "'1[N]'}}"))
    wait_for(client, library, "E0310")


def test_diagnostics_carry_the_version_that_they_are_about(client: Client, folder: Path) -> None:
    uri = client.open(folder / "arm.yaml")
    client.diagnostics(uri)
    for number in range(20):
        client.change(uri, SYSTEM.replace("q_m, limit)", f"q_m, {number}[N])"))
    # Of what is typed in one go only the last is told about.
    assert errors(client, uri) == {"E0310"}
    client.change(uri, SYSTEM)
    assert errors(client, uri) == set()


@pytest.mark.parametrize("break_", ["\r\n", "\r"])
def test_line_breaks_of_other_systems(break_: str, client: Client, folder: Path) -> None:
    text = SYSTEM.replace("\n", break_)
    uri = client.open(folder / "arm.yaml", text)
    assert errors(client, uri) == set()
    line = next(n for n, at in enumerate(SYSTEM.split("\n")) if "near_goal:" in at)
    column = SYSTEM.split("\n")[line].index("q_p")
    assert "previous joints" in json.dumps(client.ask("hover", uri, line, column))
    client.change(uri, text.replace("limit)", "limits)"))
    (found,) = [d for d in client.diagnostics(uri) if d["code"] == "E0201"]
    assert found["range"]["start"]["line"] == line


def test_two_folders(client: Client, tmp_path: Path) -> None:
    second = {"uri": tmp_path.as_uri(), "name": "second"}
    write(tmp_path)
    added = {"added": [second], "removed": []}
    client.notify("workspace/didChangeWorkspaceFolders", {"event": added})
    wrong = LIBRARY.replace('{tolerance: "real[m]"}', '{width: "real[m]"}')
    client.open(tmp_path / "lib/fingers.yaml", wrong)
    system = (tmp_path / "arm.yaml").as_uri()
    assert errors(client, system) == {"E0201", "E0211"}
    gone = {"added": [], "removed": [second]}
    client.notify("workspace/didChangeWorkspaceFolders", {"event": gone})


def test_a_file_that_is_on_no_disk(client: Client) -> None:
    uri = client.open_as("untitled:Untitled-1", "specc: 2")
    assert errors(client, uri)
    with pytest.raises(ServerError):
        client.request("textDocument/nothing", {})
