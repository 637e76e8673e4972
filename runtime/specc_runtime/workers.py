"""Threads that calls are handed to. They never keep the process from ending: a call may hang."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from threading import Thread
from typing import Any


class Workers:
    """So many daemon threads, which those of `concurrent.futures` cannot be."""

    def __init__(self, count: int, name: str = "specc-step") -> None:
        self._count = count
        self._calls: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = SimpleQueue()
        for number in range(count):
            Thread(target=self._serve, name=f"{name}_{number}", daemon=True).start()

    def submit(self, call: Callable[[], Any]) -> Future[Any]:
        """Have it called by one of the threads."""
        future: Future[Any] = Future()
        self._calls.put((future, call))
        return future

    def close(self) -> None:
        """Let the threads end once they have done what they were given; nobody waits for them."""
        for _ in range(self._count):
            self._calls.put(None)

    def _serve(self) -> None:
        while (given := self._calls.get()) is not None:
            future, call = given
            try:
                future.set_result(call())
            except BaseException as error:  # noqa: BLE001  # it is raised where the result is asked for
                future.set_exception(error)
