"""The server answers its own page on this machine, and nobody else."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from http.cookies import SimpleCookie
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus

from tests.page.fake import FakeRun, fake_run

STRANGERS = "evil.example", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example", ""


@pytest.fixture(scope="module")
def run() -> Iterator[FakeRun]:
    with fake_run("specs/conveyor_gate.yaml") as started:
        yield started


def test_the_token_of_the_url_becomes_a_cookie(run: FakeRun) -> None:
    answer = run.get(f"/?token={run.token}", Cookie="")
    assert (answer.status, answer.getheader("Location")) == (303, "/")
    cookie = SimpleCookie(answer.getheader("Set-Cookie"))[f"specc-{run.port}"]
    assert (cookie.value, cookie["path"]) == (run.token, "/")
    assert cookie["httponly"] and cookie["samesite"] == "Strict"


@pytest.mark.parametrize("path", ["/", "/static/app.js", "/asset/0", "/ws", "/nothing"])
def test_nothing_without_a_token(run: FakeRun, path: str) -> None:
    others = "", "specc-1=x", f"specc-{run.port}=", f"specc-{run.port}=é", f"specc-1={run.token}"
    assert {run.get(path, Cookie=cookie).status for cookie in others} == {403}
    assert run.get(f"{path}?token=wrong", Cookie="").status == 403


@pytest.mark.parametrize("query", ["?token=", "?token", "?token=%00", "?x=1", "?token=a&token=b"])
def test_no_cookie_for_another_token(run: FakeRun, query: str) -> None:
    answer = run.get(f"/{query}", Cookie="")
    assert answer.status == 403 and not answer.getheader("Set-Cookie")


@pytest.mark.parametrize("host", STRANGERS)
def test_no_answer_under_another_name(run: FakeRun, host: str) -> None:
    assert run.get("/", Host=host).status == 403
    assert run.get(f"/?token={run.token}", Host=host).status == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1", ""])
def test_no_answer_for_another_origin(run: FakeRun, origin: str) -> None:
    own = f"http://127.0.0.1:{run.port}"
    assert run.get("/", Origin=own).status == 200
    assert run.get("/", Origin=origin or own + "0").status == 403


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null", "http://localhost:1"])
def test_no_socket_for_another_origin_or_none(run: FakeRun, origin: str | None) -> None:
    with pytest.raises(InvalidStatus, match="403"), run.visit(origin=origin):
        pass


def test_no_socket_without_a_token(run: FakeRun) -> None:
    for cookie in ("", f"specc-{run.port}=wrong"):
        with pytest.raises(InvalidStatus, match="403"), run.visit(cookie=cookie):
            pass


@pytest.mark.parametrize(
    "path",
    [
        "/../server.py",
        "/static/../server.py",
        "/static/%2e%2e/server.py",
        "/static/..%2fserver.py",
        "/static//app.js",
        "/static/",
        "/static",
        "//",
        "/asset/-1",
        "/asset/999999",
        "/asset/1e0",
        "/asset/0/",
        "/asset/%d9%a3",
        "/static/app.js%00",
        "/static/APP.JS",
        "/index.html",
        "/server.py",
    ],
)
def test_what_has_no_fixed_name_is_not_there(run: FakeRun, path: str) -> None:
    assert run.get(path).status == 404


def test_headers_of_every_answer(run: FakeRun) -> None:
    for path in ("/", "/static/app.js", "/asset/0", "/nothing"):
        for headers in ({}, {"Cookie": ""}):
            answer = run.get(path, **headers)
            policy = answer.getheader("Content-Security-Policy") or ""
            rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
            assert rules["default-src"] == "'none'"
            assert rules["script-src"] == rules["style-src"] == rules["connect-src"] == "'self'"
            assert rules["frame-ancestors"] == "'none'" and "unsafe" not in policy
            assert answer.getheader("X-Content-Type-Options") == "nosniff"
            assert answer.getheader("Referrer-Policy") == "no-referrer"
            assert answer.getheader("Cache-Control") == "no-store"
            assert not answer.getheader("Access-Control-Allow-Origin")


def test_files_of_the_page(run: FakeRun) -> None:
    folder = Path("specc/tools/page/static")
    names = {path.name for path in folder.iterdir() if path.is_file()}
    assert {"index.html", "app.js"} <= names
    for name in names:
        answer = run.get(f"/static/{name}")
        assert answer.status == 200
        assert answer.read() == (folder / name).read_bytes()
    assert run.get("/").read() == (folder / "index.html").read_bytes()
    assert "javascript" in (run.get("/static/app.js").getheader("Content-Type") or "")


@pytest.mark.parametrize("method", ["POST", "PUT", "HEAD", "OPTIONS", "DELETE"])
def test_only_get(run: FakeRun, method: str) -> None:
    with socket.create_connection(("127.0.0.1", run.port), 10) as connection:
        head = f"{method} / HTTP/1.1\r\nHost: 127.0.0.1:{run.port}\r\nCookie: {run.cookie}\r\n\r\n"
        connection.sendall(head.encode())
        answer = connection.recv(1000)
    assert answer.split()[1] in (b"400", b"405")


def test_it_listens_on_this_machine_only(run: FakeRun) -> None:
    with open("/proc/net/tcp", encoding="ascii") as table:
        rows = [line.split() for line in table.readlines()[1:]]
    listening = {row[1] for row in rows if row[3] == "0A"}
    assert {address for address in listening if address.endswith(f":{run.port:04X}")} == {
        f"0100007F:{run.port:04X}"
    }


def test_two_headers_of_one_name(run: FakeRun) -> None:
    host = f"127.0.0.1:{run.port}"
    head = f"GET / HTTP/1.1\r\nHost: {host}\r\nHost: {host}\r\nCookie: {run.cookie}\r\n\r\n"
    with socket.create_connection(("127.0.0.1", run.port), 10) as connection:
        connection.sendall(head.encode())
        assert b" 403 " in connection.recv(1000).splitlines()[0]
