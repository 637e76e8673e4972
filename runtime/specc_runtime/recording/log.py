"""Writes an MCAP file during a run: after any ending, all but the last moment can be read."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fcntl import LOCK_EX, LOCK_NB, flock
from itertools import repeat
from operator import itemgetter
from pathlib import Path
from threading import Event, RLock, Thread
from typing import IO, Any, Protocol

import numpy as np

from specc_runtime.clock import WallClock
from specc_runtime.companion import OutputLost
from specc_runtime.faults import error_text
from specc_runtime.forms import Schema
from specc_runtime.options import UsageError
from specc_runtime.recording.container import CHUNK_BYTES, Container, write_chunks
from specc_runtime.recording.text import dumped

LIBRARY = "specc"
FORMAT = "1"
"""Version of the content of messages; replay reads the versions that it knows."""
INTERVAL_S = 0.4
"""Wall time between two flushes to the file."""
MOST_BYTES = 1 << 26
"""Bytes that may wait to be written; with more, the run waits."""
_BATCH, _LATE = 128, 8
"""Messages of a channel whose texts are made together, if small; times so many while a chunk is
being written."""
_PATIENCE = 64
"""Times so many for channels whose texts the writing thread makes; with more, the run waits."""

Content = bytes | Callable[[], bytes]
"""The bytes of a message, or a function that makes them in the writing thread."""
Texts = Callable[[Sequence[Any], Sequence[float], Sequence[int]], Iterable[bytes]]
"""Makes the texts of messages from their contents, simulated times in s and dates in ns."""
_date = itemgetter(2)


class Sink(Protocol):
    """Where messages of one topic go."""

    def add(self, time_s: float, content: Any) -> None:
        """Add a message of simulated time `time_s`, whose content does not change any more."""


class Sinks(Protocol):
    """Where messages go: a file, or somebody who looks at the last ones."""

    def channel(
        self,
        topic: str,
        schema: str,
        form: Schema,
        texts: Texts = ...,
        *,
        is_preceded: bool = ...,
    ) -> Sink:
        """What takes the messages of a topic; see `Log.channel`."""


def own(path: Path) -> IO[bytes]:
    """Open a file, emptied, and lock it until it is closed or the process ends.

    Raises UsageError, also for a link.
    """
    how = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW
    try:
        file = os.fdopen(os.open(path, how, 0o666), "r+b")
        check_unowned(file, path)
        file.truncate()
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}") from error
    return file


def check_unowned(file: IO[bytes], path: Path) -> None:
    """Lock an open file; raises UsageError while another process holds the lock."""
    try:
        flock(file, LOCK_EX | LOCK_NB)
    except BlockingIOError:
        file.close()
        raise UsageError(f"cannot write {path}: another run is being recorded there") from None
    except OSError:
        pass  # a file system without locks


class Log:
    """An MCAP file with messages in JSON; a thread compresses and writes them.

    If writing fails, the run goes on without it, and `close` reports the failure.
    """

    def __init__(self, path: Path, clock: WallClock, profile: str = "") -> None:
        """`profile` is that of MCAP. Raises UsageError if the file cannot be opened, or another run
        writes it.
        """
        self._file = own(path)
        self._profile = profile
        self.begin_ns = 0
        """What the time 0 s of the run is in the file."""
        self.path = path
        self._clock = clock
        self._batch: list[tuple[int, int, int, Content]] = []
        self._size = 0
        self._error = ""
        self._lock = RLock()
        self._wake = Event()
        self._over = False
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, Channel] = {}
        self._apart: set[int] = set()
        self._container: Container
        self._guarded(self._begin)
        self._thread = Thread(target=self._work, name="specc-recording", daemon=True)
        self._thread.start()

    def _begin(self) -> None:
        self._container = Container(self._file, LIBRARY, self.path.parent, self._profile)

    def note(self, name: str, data: Mapping[str, str]) -> None:
        """Write metadata of the run: names and texts."""
        self._guarded(lambda: self._container.metadata(name, data))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """A file."""
        self._guarded(lambda: self._container.attachment(name, media_type, data))

    def channel(
        self,
        topic: str,
        schema: str,
        form: Schema | bytes,
        texts: Texts = lambda contents, *_: contents,
        *,
        is_preceded: bool = False,
        is_apart: bool = False,
        is_deferred: bool = False,
        encoding: str = "json",
    ) -> Channel:
        """Open a channel for a topic, with the name of a schema, which is a text for ROS.

        If other messages may precede those of the channel, texts are made in the order of dates.
        A channel that is apart has chunks of its own, so that it is read without the others. If it
        is deferred, only the writing thread makes texts, which take long.
        """
        if topic not in self._channels:
            channel = Channel(self, texts, self._clock, is_preceded, is_deferred)
            self._channels[topic] = channel
            self._guarded(lambda: self._register(channel, topic, (schema, form), encoding))
            if is_apart:
                self._apart.add(channel.number)
        return self._channels[topic]

    def _register(
        self, channel: Channel, topic: str, named: tuple[str, Schema | bytes], encoding: str
    ) -> None:
        schema, form = named
        if schema not in self._schemas:
            if isinstance(form, bytes):
                self._schemas[schema] = self._container.schema(schema, form, "ros2msg")
            elif encoding == "json":
                text = dumped({"title": schema} | form)
                self._schemas[schema] = self._container.schema(schema, text)
            else:
                self._schemas[schema] = self._container.schema(schema, b"", encoding)
        number = self._schemas[schema]
        channel.number = self._container.channel(topic, number, encoding)

    def precede(self, message: tuple[int, int, int, Content], size: int) -> None:
        """Write a message of about `size` bytes before the message whose text is being made."""
        self._batch.append(message)
        self._size += size

    def take(self, channel: Channel, *, is_late: bool) -> None:
        """Make the texts of waiting messages; postponed while a chunk is being written, unless
        it is late.
        """
        if self._lock.acquire(blocking=is_late):
            try:
                self._guarded(lambda: self._take(channel))
                if self._size > MOST_BYTES:
                    self._guarded(self._drain)
            finally:
                self._lock.release()

    def _take(self, channel: Channel) -> None:
        before = self._size
        group = [channel]
        if channel.is_preceded:
            group = [each for each in list(self._channels.values()) if each.is_preceded]
        batches = [each.take_messages() for each in group]
        if len(batches) == 1:
            messages = list(batches[0][1])
        else:
            order = sorted((date, i) for i, (dates, _) in enumerate(batches) for date in dates)
            messages = [next(batches[i][1]) for _, i in order]
        self._batch += messages
        self._size += sum([len(message[3]) for message in messages])
        for each in group if messages else ():
            each.adapt((self._size - before) // len(messages))
        if self._size > CHUNK_BYTES:
            self._wake.set()

    def flush(self) -> None:
        """Write all waiting messages now."""
        self._guarded(self._drain)

    def close(self) -> None:
        """Finish the file with its index. Raises OutputLost if writing failed."""
        self._over = True
        self._wake.set()
        self._thread.join()
        self.flush()
        self._guarded(self._container.finish)
        try:
            self._file.close()
        except OSError as error:
            self._error = self._error or error_text(error)
        if self._error:
            raise OutputLost(f"the recording {self.path} is not complete: {self._error}")

    def _work(self) -> None:
        while not self._over:
            self._wake.wait(INTERVAL_S)
            self._wake.clear()
            self.flush()

    def _drain(self) -> None:
        for channel in list(self._channels.values()):
            self._take(channel)
        self._batch.sort(key=_date)
        messages = (
            (number, time_ns, date_ns, content if isinstance(content, bytes) else content())
            for number, time_ns, date_ns, content in self._batch
        )
        write_chunks(self._container, messages, self._apart)
        self._batch.clear()
        self._size = 0
        self._file.flush()

    def _guarded(self, write: Callable[[], Any]) -> None:
        """Write, unless writing failed before."""
        with self._lock:
            if self._error:
                self._batch.clear()
                return
            try:
                write()
            except Exception as error:  # noqa: BLE001  # a full disk, an image that has no JPEG
                strerror = getattr(error, "strerror", None)
                self._error = strerror or error_text(error)


class Channel:
    """A channel of similar messages, whose texts are made together."""

    def __init__(
        self,
        log: Log,
        texts: Texts,
        clock: WallClock,
        is_preceded: bool,
        is_deferred: bool = False,
    ) -> None:
        self.number = 0
        self.is_preceded = is_preceded
        self._log = log
        self._texts = texts
        self._date_ns = clock.date_ns
        self._waiting: list[tuple[float, int, Any]] = []
        self._patience = _PATIENCE if is_deferred else 1
        self._most = _BATCH if is_deferred else 1

    def add(self, time_s: float, content: Any) -> None:
        """Add a message of simulated time `time_s`, dated with the current wall time.

        The content must not change any more.
        """
        waiting = self._waiting
        waiting.append((time_s, self._date_ns(), content))
        if len(waiting) >= self._patience * self._most:
            is_late = len(waiting) >= max(_LATE, self._patience) * self._most
            self._log.take(self, is_late=is_late)

    def adapt(self, size: int) -> None:
        """Set the number of messages that wait, from the bytes of one message."""
        self._most = max(1, min(_BATCH, CHUNK_BYTES // (size + 1)))

    def take_messages(self) -> tuple[Sequence[int], Iterator[tuple[int, int, int, bytes]]]:
        """Take the waiting messages: their dates, and the messages, with texts made in turn."""
        waiting = self._waiting[:]
        if not waiting:
            return (), iter(())
        del self._waiting[: len(waiting)]  # more may have come meanwhile
        times, dates, contents = zip(*waiting, strict=True)
        times_ns = np.rint(np.array(times) * 1e9).astype(np.int64) + self._log.begin_ns
        texts = self._texts(contents, times, dates)
        return dates, zip(repeat(self.number), times_ns.tolist(), dates, texts, strict=False)
