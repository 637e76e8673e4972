"""Writing an MCAP file while a run goes on: all but the last moment can be read after any end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

from specc_runtime.clock import WallClock
from specc_runtime.companion import OutputLost
from specc_runtime.faults import said
from specc_runtime.forms import Schema
from specc_runtime.options import UsageError
from specc_runtime.recording.container import Container, Message
from specc_runtime.recording.text import dumped

LIBRARY = "specc"
INTERVAL_S = 0.4
"""Wall time between two moments at which all that there is goes to the file."""
_MOST_WAITING = 20_000
_CHUNK_BYTES = 1 << 20
"""With so much a chunk is written: it need not wait for the rest, nor readers unpack more."""

Content = bytes | Callable[[], bytes]
"""The bytes of a message, or what makes them in the thread that writes."""


class Log:
    """An MCAP file with messages in JSON; a thread compresses and writes them.

    What cannot be written is told by `close`; until then the run goes on without it.
    """

    def __init__(self, path: Path, clock: WallClock) -> None:
        """Raises UsageError if there cannot be such a file."""
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise UsageError(f"cannot write {path}: {error.strerror}") from error
        self._path = path
        self._now_ns = clock.date_ns
        self._waiting: deque[tuple[int, int, int, Content]] = deque()
        self._error = ""
        self._lock = Lock()
        self._over = Event()
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._container: Container
        self._guarded(self._begin)
        self._thread = Thread(target=self._work, name="specc-recording", daemon=True)
        self._thread.start()

    def _begin(self) -> None:
        self._container = Container(self._file, LIBRARY)

    def note(self, name: str, data: Mapping[str, str]) -> None:
        """Names and texts about the run as a whole."""
        self._guarded(lambda: self._container.metadata(name, data))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """A file."""
        self._guarded(lambda: self._container.attachment(name, media_type, data))

    def channel(self, topic: str, schema: str, form: Schema) -> int:
        """The number of the channel of a topic, whose messages have a schema of that name."""
        if topic not in self._channels:
            self._guarded(lambda: self._register(topic, schema, form))
        return self._channels.get(topic, 0)

    def _register(self, topic: str, schema: str, form: Schema) -> None:
        if schema not in self._schemas:
            text = dumped({"title": schema} | form)
            self._schemas[schema] = self._container.schema(schema, text)
        self._channels[topic] = self._container.channel(topic, self._schemas[schema])

    def add(self, channel: int, time_s: float, content: Content) -> None:
        """A message of simulated time `time_s`; it has the wall time of now."""
        self._waiting.append((channel, round(time_s * 1e9), self._now_ns(), content))
        if len(self._waiting) > _MOST_WAITING:
            self._guarded(self._drain)

    def close(self) -> None:
        """Finish the file with its index. Raises OutputLost if something could not be written."""
        self._over.set()
        self._thread.join()
        self._guarded(self._drain)
        self._guarded(self._container.finish)
        try:
            self._file.close()
        except OSError as error:
            self._error = self._error or said(error)
        if self._error:
            raise OutputLost(f"the recording {self._path} is not complete: {self._error}")

    def _work(self) -> None:
        while not self._over.wait(INTERVAL_S):
            self._guarded(self._drain)

    def _drain(self) -> None:
        messages, size = list[Message](), 0
        for _ in range(len(self._waiting)):  # more may come meanwhile
            channel, time_ns, now_ns, content = self._waiting.popleft()
            data = content if isinstance(content, bytes) else content()
            messages.append((channel, time_ns, now_ns, data))
            size += len(data)
            if size > _CHUNK_BYTES:
                self._container.chunk(messages)
                self._file.flush()
                messages, size = [], 0
        self._container.chunk(messages)
        self._file.flush()

    def _guarded(self, write: Callable[[], Any]) -> None:
        """Write, unless something could not be written before."""
        with self._lock:
            if self._error:
                self._waiting.clear()
                return
            try:
                write()
            except Exception as error:  # noqa: BLE001  # a full disk, an image that has no JPEG
                strerror = getattr(error, "strerror", None)
                self._error = strerror or said(error)
