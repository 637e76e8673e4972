"""A browser that is connected: what it is to get, and what it asked.

A slow browser delays nobody: what is of the moment replaces what was not sent yet, and one that
does not take what it has to get is dropped; when it comes again it gets everything anew.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from specc.tools.page.messages import Message

_MOST_BYTES, _MOST_MESSAGES = 16_000_000, 2000
"""That wait for a browser."""
_LONGEST_S = 10.0
"""That it may take to get one message: pings do not find a browser whose buffers are full."""
_MOST_QUESTIONS = 64
"""Of different kinds that wait for their answers."""


@dataclass(slots=True)
class Watched:
    """What a browser shows besides what all of them get."""

    signals: list[str] | None = None
    """None: all of them."""
    camera: str = ""
    scene: bool = True


@dataclass(eq=False, slots=True)
class Client:
    """A browser."""

    connection: ServerConnection
    watched: Watched = field(default_factory=Watched)
    _queue: deque[str] = field(default_factory=deque)
    _bytes: int = 0
    _latest: dict[Hashable, str | bytes] = field(default_factory=dict)
    """What is of the moment: only the newest of each kind is sent."""
    _questions: dict[Hashable, Message] = field(default_factory=dict)
    _has_more: asyncio.Event = field(default_factory=asyncio.Event)
    _is_asked: asyncio.Event = field(default_factory=asyncio.Event)

    def put(self, text: str) -> None:
        """Send a message after those before it."""
        self._queue.append(text)
        self._bytes += len(text)
        if self._bytes > _MOST_BYTES or len(self._queue) > _MOST_MESSAGES:
            self.drop()
        self._has_more.set()

    def put_latest(self, kind: Hashable, content: str | bytes) -> None:
        """Send it instead of the one of the same kind that was not sent yet."""
        self._latest[kind] = content
        self._has_more.set()

    def take_back(self, kind: Hashable) -> None:
        """Do not send what was put as the latest of this kind."""
        self._latest.pop(kind, None)

    def forget(self) -> None:
        """Send nothing of what waits: something else begins."""
        self._queue.clear()
        self._latest.clear()
        self._bytes = 0

    def drop(self) -> None:
        """End the connection at once."""
        self.forget()
        self.connection.transport.abort()

    async def write(self) -> None:
        """Send what there is to send, until the connection ends."""
        while True:
            await self._has_more.wait()
            self._has_more.clear()
            while self._queue or self._latest:
                try:
                    async with asyncio.timeout(_LONGEST_S):
                        await self.connection.send(self._next())
                except TimeoutError:
                    return self.drop()
                except ConnectionClosed:
                    return None

    def _next(self) -> str | bytes:
        if self._queue:
            text = self._queue.popleft()
            self._bytes -= len(text)
            return text
        return self._latest.pop(next(iter(self._latest)))

    def ask(self, key: Hashable, question: Message) -> None:
        """Note a question; one of the same kind that was not answered yet is not answered."""
        self._questions.pop(key, None)
        if len(self._questions) < _MOST_QUESTIONS:
            self._questions[key] = question
        self._is_asked.set()

    async def answer(self, reply: Callable[[Client, Message], Any]) -> None:
        """Let the questions be answered one after the other, until the connection ends."""
        while True:
            await self._is_asked.wait()
            self._is_asked.clear()
            while self._questions:
                await reply(self, self._questions.pop(next(iter(self._questions))))
