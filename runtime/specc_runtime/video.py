"""A film of a run: pictures of the scene with the states of all subsystems drawn in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from specc_runtime.companion import OutputLost, View
from specc_runtime.faults import said
from specc_runtime.options import UsageError
from specc_runtime.values import Rgb

SUFFIXES = (".mp4", ".mkv")
SIZE_PX = (640, 480)
FRAMES_PER_S = 25.0
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LINE_PX = 20
_MARGIN_PX = 8
_SCALE = 0.5


class Video:
    """Writes an MP4 or Matroska file, one frame every `period_s` of simulated time.

    The index of an MP4 file comes last, and OpenCV has no option for fragments: one that was cut
    by a killed process does not play. A Matroska file plays up to what was written.
    """

    def __init__(self, path: Path, plant: Any, tick_s: float, camera: str) -> None:
        """Draws the first picture at once; raises UsageError if the file cannot be written.

        The plant needs `picture(camera, width, height)` and the camera; what it raises
        goes through.
        """
        if path.suffix.lower() not in SUFFIXES:
            raise UsageError(f"cannot write the video {path}: its name has to end in .mp4 or .mkv")
        ticks = max(1, round(1.0 / FRAMES_PER_S / tick_s))
        self.period_s = ticks * tick_s
        self._plant = plant
        self._path = path
        self._pictures = 0
        self._ended = ""
        self._camera = camera
        plant.picture(camera, *SIZE_PX)
        codec = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer = cv2.VideoWriter(str(path), codec, 1.0 / self.period_s, SIZE_PX)
        if not self._writer.isOpened():
            raise UsageError(f"cannot write the video {path}")

    def tick(self, view: View) -> None:
        """See `Companion`."""
        try:
            picture = self._plant.picture(self._camera, *SIZE_PX)
        except BaseException as error:
            self._ended = f" ends at {view.time_s:.2f} s: {said(error)}"
            raise
        lines = [("time", f"{view.time_s:.2f} s"), *view.states.items()]
        self._writer.write(cv2.cvtColor(annotated(picture, lines), cv2.COLOR_RGB2BGR))
        self._pictures += 1

    def close(self) -> None:
        """See `Companion`. Raises OutputLost unless the file has all pictures.

        What the encoder cannot write it loses without a word, so the file is read again.
        """
        self._writer.release()
        film = cv2.VideoCapture(str(self._path))
        found = 0
        while found < self._pictures and film.grab():
            found += 1
        film.release()
        if self._ended:
            raise OutputLost(f"the film {self._path}{self._ended}")
        if found < self._pictures:
            state = f"has {found} of {self._pictures} pictures" if found else "is missing"
            raise OutputLost(f"the film {self._path} {state}: it could not be written")


def annotated(picture: Rgb, lines: Sequence[tuple[str, str]]) -> Rgb:
    """A copy of the picture (h, w, 3) with two columns of text on a darkened corner."""
    drawn = np.ascontiguousarray(picture).copy()
    columns = [max(_width(text) for text in column) for column in zip(*lines, strict=True)]
    height = _LINE_PX * len(lines) + 2 * _MARGIN_PX
    drawn[:height, : sum(columns) + _MARGIN_PX] //= 3
    for number, line in enumerate(lines, start=1):
        x = _MARGIN_PX
        for text, column in zip(line, columns, strict=True):
            place = (x, _MARGIN_PX + number * _LINE_PX - 6)
            cv2.putText(drawn, text, place, _FONT, _SCALE, (255, 255, 255), 1, cv2.LINE_AA)
            x += column
    return drawn


def _width(text: str) -> int:
    """Pixels that a text needs, with room to the next column."""
    (width, _), _ = cv2.getTextSize(text, _FONT, _SCALE, 1)
    return int(width) + 2 * _MARGIN_PX
