"""A server that is slow, stopped or dead never delays the run that it shows."""

from __future__ import annotations

import json
import socket
import time
from functools import partial
from typing import Any

import pytest
from specc_runtime.page.link import Link

from tests.page.fake_server import Code, shown


class Ends:
    """A link, and the other end of its socket."""

    def __init__(self) -> None:
        ours, self.other = socket.socketpair()
        self.other.settimeout(10)
        self.commands: list[Any] = []
        self.ends = 0
        self.link = Link(ours.detach(), self.commands.append, self._end)

    def _end(self) -> None:
        self.ends += 1

    def wait(self, commands: int) -> list[Any]:
        until_s = time.monotonic() + 10
        while len(self.commands) < commands and time.monotonic() < until_s:
            time.sleep(0.002)
        return self.commands


def test_messages_come_in_their_order_and_of_states_the_newest() -> None:
    ends = Ends()
    lines = ends.other.makefile("rb")
    big = b'{"kind":"begin","scene":"%b"}' % (b"x" * 3_000_000)
    ends.link.post(big, 0)
    for number in range(100):
        ends.link.show(b'{"kind":"state","n":%d}' % number)
        ends.link.post(partial(b'{"kind":"spans","n":%d}'.__mod__, number))
    found = [json.loads(lines.readline()) for _ in range(102)]
    assert len(found[0]["scene"]) == 3_000_000
    assert [each["n"] for each in found if each["kind"] == "spans"] == [*range(100)]
    assert [each["n"] for each in found if each["kind"] == "state"] == [99]
    ends.link.close()
    assert ends.link.is_over and ends.ends == 1


def test_what_finds_no_room_is_lost_and_that_is_said() -> None:
    ends = Ends()
    begin_s = time.monotonic()
    for _ in range(100_000):
        ends.link.post(b"{%s}" % (b" " * 1000))
    assert time.monotonic() - begin_s < 10
    assert ends.link._weight <= 20_000
    lines = ends.other.makefile("rb")
    until_s = time.monotonic() + 10
    found = [lines.readline() for _ in range(15_000)]
    ends.link.post(b'{"kind":"last"}')
    while b"last" not in found[-1] and time.monotonic() < until_s:
        found.append(lines.readline())
    (told,) = [json.loads(line) for line in found if b"lost" in line]
    assert told["messages"] + len(found) - 2 == 100_000


def test_commands_come_however_they_are_cut() -> None:
    ends = Ends()
    text = (
        b'{"do":"pause"}\n\n{"do":\n{"do":"caf\xc3\xa9"}\n[1,2]\n{"do":"\\ud800"}\n'
        + b"[" * 10_000
        + b"\n"
    )
    for byte in text:
        ends.other.send(bytes([byte]))
    expected = [{"do": "pause"}, None, None, {"do": "café"}, [1, 2], None, None]
    assert ends.wait(len(expected)) == expected
    ends.commands.clear()
    ends.other.settimeout(30)
    ends.other.sendall(b"x" * 5_000_000 + b'\n{"do":"continue"}\n')
    until_s = time.monotonic() + 10
    while {"do": "continue"} not in ends.commands and time.monotonic() < until_s:
        time.sleep(0.01)
    assert ends.commands[-1] == {"do": "continue"}
    assert set(map(type, ends.commands[:-1])) == {type(None)}
    ends.link.close()


def test_a_message_that_cannot_be_made_stops_nothing() -> None:
    ends = Ends()
    ends.link.post(lambda: bytes(1 // 0))
    ends.link.show(b"{}")
    lines = ends.other.makefile("rb")
    assert {lines.readline()[:9], lines.readline()[:9]} == {b"{}\n", b'{"kind": '}
    assert "ZeroDivisionError" in ends.link.failure
    ends.link.close()


def test_closing_does_not_wait_for_a_server_that_is_stopped() -> None:
    ends = Ends()
    ends.link.post(b"x" * 10_000_000)
    begin_s = time.monotonic()
    ends.link.close(0.3)
    assert time.monotonic() - begin_s < 2
    assert ends.link.is_over


@pytest.mark.long
def test_a_dead_server_ends_no_run_and_lets_a_paused_one_go_on(gate: Code) -> None:
    with shown(gate, {"do": "pause"}, speed=1.0, duration_s=30.0) as run:
        run.server.paused()
        run.page.control.set_speed(None)
        run.server.end.shutdown(socket.SHUT_RDWR)
        run.thread.join(30)
        assert not run.thread.is_alive()
        assert run.code == 0
        assert run.page.wait() is None
