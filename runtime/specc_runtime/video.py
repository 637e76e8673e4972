"""A film of a run: pictures of the scene with the states of all machines drawn in."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol

import cv2
import numpy as np

from specc_runtime.atomic_files import replacing
from specc_runtime.clock import WallClock
from specc_runtime.companion import OutputLost, View
from specc_runtime.faults import error_text
from specc_runtime.options import Options, UsageError
from specc_runtime.printing import say
from specc_runtime.values import Rgb

MOST_PICTURES = 240
MOST_BYTES = 256 * 2**20
"""Pictures of an animation, and bytes of them: all are in memory until it is written."""
_QUALITY = 50
_FONT = cv2.FONT_HERSHEY_SIMPLEX


class File(Protocol):
    """Takes pictures, one every `period_s` of simulated time; has the usual size and rate."""

    size_px: ClassVar[tuple[int, int]]
    frames_per_s: ClassVar[float]

    def __init__(self, path: Path, period_s: float, size_px: tuple[int, int]) -> None: ...

    def add(self, picture: Rgb) -> None:
        """The next picture (h, w, 3)."""

    def close(self) -> str:
        """Write what is not written yet; what is wrong with the file, or nothing."""


class Film:
    """An MP4 or Matroska file.

    The index of an MP4 file comes last, and OpenCV has no option for fragments: one that was cut
    by a killed process does not play. A Matroska file plays up to what was written.
    """

    size_px: ClassVar = (640, 480)
    frames_per_s: ClassVar = 25.0

    def __init__(self, path: Path, period_s: float, size_px: tuple[int, int]) -> None:
        """Raises UsageError if the file cannot be written."""
        self._path = path
        self._pictures = 0
        codec = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer = cv2.VideoWriter(str(path), codec, 1.0 / period_s, size_px)
        if not self._writer.isOpened():
            raise UsageError(f"cannot write the video {path}")

    def add(self, picture: Rgb) -> None:
        """See `File`."""
        self._writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        self._pictures += 1

    def close(self) -> str:
        """See `File`. What the encoder cannot write it loses without a word: it is read again."""
        self._writer.release()
        film = cv2.VideoCapture(str(self._path))
        found = 0
        while found < self._pictures and film.grab():
            found += 1
        film.release()
        if found == self._pictures:
            return ""
        state = f"has {found} of {self._pictures} pictures" if found else "is missing"
        return f" {state}: it could not be written"


class Animation:
    """An animated WebP file, small and seldom drawn, that shows in pages; written at the end.

    Where a run is too long for `MOST_PICTURES` or `MOST_BYTES`, every second picture is left out,
    again and again.
    """

    size_px: ClassVar = (400, 300)
    frames_per_s: ClassVar = 10.0

    def __init__(self, path: Path, period_s: float, size_px: tuple[int, int]) -> None:
        """Raises UsageError if the file cannot be written."""
        self._path = path
        self._period_ms = 1000.0 * period_s
        self._pictures: list[Rgb] = []
        self._most = min(MOST_PICTURES, MOST_BYTES // (3 * size_px[0] * size_px[1]))
        if self._most < MOST_PICTURES:
            say(f"{path} will have {self._most} pictures at most, because they are large")
        self._every = 1
        self._added = 0
        if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
            raise UsageError(f"cannot write the video {path}")

    def add(self, picture: Rgb) -> None:
        """See `File`."""
        if self._added % self._every == 0:
            self._pictures.append(np.ascontiguousarray(picture[:, :, ::-1]))
        self._added += 1
        if len(self._pictures) > self._most:
            del self._pictures[1::2]
            self._every *= 2

    def close(self) -> str:
        """See `File`."""
        if not self._pictures:
            return ""
        film = cv2.Animation()
        film.frames = self._pictures
        film.durations = [round(self._every * self._period_ms)] * len(self._pictures)
        try:
            options = [cv2.IMWRITE_WEBP_QUALITY, _QUALITY]
            _, data = cv2.imencodeanimation(".webp", film, options)
            with replacing(self._path) as aside:
                aside.write_bytes(data.tobytes())
        except (OSError, cv2.error) as error:
            return f" is missing: {error_text(error)}"
        return ""


_FILES: dict[str, type[File]] = {".mp4": Film, ".mkv": Film, ".webp": Animation}


class Video:
    """Draws the plant for a file, of the kind that its suffix says.

    `busy_s` is the wall time that this has taken.
    """

    def __init__(self, options: Options, plant: Any, tick_s: float, clock: WallClock) -> None:
        """Draws the scene at once; raises UsageError if the file cannot be written.

        The plant needs `picture(camera, width, height)` and the camera; what it raises
        goes through.
        """
        path = options.video
        kind = None if path is None else _FILES.get(path.suffix.lower())
        if path is None or kind is None:
            raise UsageError(
                f"cannot write the video {path}: its name has to end in .mp4, .mkv or .webp"
            )
        ticks = max(1, round(1.0 / (options.fps or kind.frames_per_s) / tick_s))
        self.period_s = ticks * tick_s
        self.busy_s = 0.0
        self._plant = plant
        self._clock = clock
        self._path = path
        self._ended = ""
        self._view = options.camera, *(options.size or kind.size_px)
        if options.geom_groups is not None:
            plant.show_geom_groups(options.geom_groups)
        self._first: Rgb | None = plant.picture(*self._view)
        self._file = kind(path, self.period_s, self._view[1:])

    def tick(self, view: View) -> None:
        """See `Companion`."""
        begin_s = self._clock.now_s()
        try:
            picture = self._plant.picture(*self._view)
        except BaseException as error:
            self._ended = f" ends at {view.time_s:.2f} s: {error_text(error)}"
            raise
        lines = [("time", f"{view.time_s:.2f} s"), *view.states.items()]
        self._file.add(annotated(picture, lines))
        self._first = None
        self.busy_s += self._clock.now_s() - begin_s

    def close(self) -> None:
        """See `Companion`. Raises OutputLost unless the file has all pictures.

        A run that is over before the first tick leaves the picture of its beginning.
        """
        if self._first is not None:
            self._file.add(self._first)
        wrong = self._file.close()
        if self._ended or wrong:
            raise OutputLost(f"the film {self._path}{self._ended or wrong}")


def annotated(picture: Rgb, lines: Sequence[tuple[str, str]]) -> Rgb:
    """A copy of the picture (h, w, 3) with two columns of text on a darkened corner.

    The text is smaller in a smaller picture.
    """
    drawn = np.ascontiguousarray(picture).copy()
    scale = 0.1 + drawn.shape[1] / 1600
    margin, step = round(16 * scale), round(40 * scale)
    columns = [max(_width(text, scale) for text in column) for column in zip(*lines, strict=True)]
    height = step * len(lines) + 2 * margin
    drawn[:height, : sum(columns) + margin] //= 3
    for number, line in enumerate(lines, start=1):
        x = margin
        for text, column in zip(line, columns, strict=True):
            place = (x, margin + number * step - round(12 * scale))
            cv2.putText(drawn, text, place, _FONT, scale, (255, 255, 255), 1, cv2.LINE_AA)
            x += column
    return drawn


def _width(text: str, scale: float) -> int:
    """Pixels that a text needs, with room to the next column."""
    (width, _), _ = cv2.getTextSize(text, _FONT, scale, 1)
    return int(width) + round(32 * scale)
