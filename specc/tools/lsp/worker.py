"""A process that answers calls one after the other and can be ended at any time.

A call that is cancelled while it runs, or takes too long, is ended with its process; the next call
starts another one.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from specc.processes import end_with_parent

LIMIT_S = 10.0
"""A call that takes longer is given up."""
LIMIT_GB = 2
"""Address space of the process; a call that needs more is given up."""


class ProcessEndedError(Exception):
    """The process ended during a call, which took too long or too much; the message says which."""


class CallFailedError(Exception):
    """A call raised what it should not have; the message is the traceback."""


class Worker:
    """Calls methods of the object that `make` returns, in another process.

    Exceptions of the `expected` types are raised here as well; any other is a fault.
    """

    def __init__(
        self, make: Callable[[], object], expected: tuple[type[Exception], ...] = ()
    ) -> None:
        self._make, self._expected = make, expected
        self._turn = asyncio.Lock()
        self._process: Any = None
        self._pipe: Any = None
        self.started_s: float | None = None
        """When the call that runs began."""
        self.took_s = 0.0
        """How long the last call took."""

    async def call(self, name: str, *arguments: Any) -> Any:
        """The result of a method; calls wait for their turn. No name: only start the process."""
        async with self._turn:
            if self._process is None:
                self._start()
                await self._result("", ())
            return await self._result(name, arguments)

    async def _result(self, name: str, arguments: tuple[Any, ...]) -> Any:
        loop = asyncio.get_running_loop()
        started_s = self.started_s = time.monotonic()
        try:
            self._pipe.send((name, arguments))
            async with asyncio.timeout(LIMIT_S if name else None):
                value, error = await loop.run_in_executor(None, self._pipe.recv)
        except TimeoutError:
            self.close()
            raise ProcessEndedError(f"took more than {LIMIT_S:.0f} s") from None
        except (EOFError, OSError):
            self.close()
            raise ProcessEndedError("ended its process") from None
        except asyncio.CancelledError:
            self.close()
            raise
        finally:
            self.started_s, self.took_s = None, time.monotonic() - started_s
        if isinstance(error, ProcessEndedError):
            self.close()
        if error is not None:
            raise error
        return value

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        arguments = (theirs, self._make, self._expected)
        self._process = context.Process(target=_work, args=arguments, daemon=True)
        self._process.start()
        theirs.close()

    def close(self) -> None:
        """End the process; who waits for an answer of it reads the end of the pipe."""
        if self._process is not None:
            self._process.kill()
        self._process = self._pipe = None


def _work(pipe: Any, make: Callable[[], object], expected: tuple[type[Exception], ...]) -> None:
    """Answer calls until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _limit_memory()
    end_with_parent()
    session = make()
    with suppress(EOFError, OSError):
        while True:
            name, arguments = pipe.recv()
            pipe.send(_answer(session, name, arguments, expected) if name else (None, None))


def _answer(
    session: object, name: str, arguments: tuple[Any, ...], expected: tuple[type[Exception], ...]
) -> tuple[Any, Exception | None]:
    try:
        return getattr(session, name)(*arguments), None
    except expected as error:
        return None, error
    except MemoryError:
        return None, ProcessEndedError(f"took more than {LIMIT_GB} GB of memory")
    except Exception:  # noqa: BLE001 - it is for the other side to tell
        return None, CallFailedError(traceback.format_exc())


def _limit_memory() -> None:
    if sys.platform != "win32":
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_AS)
        wanted = LIMIT_GB * 10**9
        with suppress(ValueError, OSError):  # some systems have no such limit
            least = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
            resource.setrlimit(resource.RLIMIT_AS, (least, most))
