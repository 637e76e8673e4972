"""Where time goes: every moment belongs to the innermost section that is open in its thread."""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

Places = Mapping[str, Sequence[tuple[object, str]]]
"""Sections, each with the classes or modules that it is in and the names of functions there."""


class Stopwatch:
    """Exclusive time of sections, for each thread on its own.

    `seconds` is that of the sections in the thread that made the stopwatch, `beside` that in other
    threads; `calls` counts both.
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        """`now_s` is the clock."""
        self._now_s = now_s
        self._home = threading.get_ident()
        self._local = threading.local()
        self.seconds: dict[str, float] = defaultdict(float)
        self.beside: dict[str, float] = defaultdict(float)
        self.calls: dict[str, int] = defaultdict(int)

    def timed(self, section: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, with its time counted as that of the section."""
        now_s, calls, local, home = self._now_s, self.calls, self._local, self._home

        def run(*arguments: Any, **named: Any) -> Any:
            seconds = self.seconds if threading.get_ident() == home else self.beside
            outer, begin_s = getattr(local, "open", (None, 0.0))
            now = now_s()
            if outer is not None:
                seconds[outer] += now - begin_s
            calls[section] += 1
            local.open = (section, now)
            try:
                return function(*arguments, **named)
            finally:
                now = now_s()
                seconds[section] += now - local.open[1]
                local.open = (outer, now)

        return run

    @contextmanager
    def watching(self, places: Places) -> Iterator[None]:
        """Inside, what the places name is timed as the sections by which they are listed."""
        real = [
            (section, owner, name, getattr(owner, name))
            for section, functions in places.items()
            for owner, name in functions
        ]
        try:
            for section, owner, name, function in real:
                setattr(owner, name, self.timed(section, function))
            yield
        finally:
            for _, owner, name, function in real:
                setattr(owner, name, function)
