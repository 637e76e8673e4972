"""A film of a run: pictures of the scene with the states of all subsystems drawn in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from specc_runtime.companion import View
from specc_runtime.options import UsageError
from specc_runtime.values import Rgb

CAMERA = "overview"
SIZE_PX = (960, 720)
FRAMES_PER_S = 25.0
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LINE_PX = 24


class Video:
    """Writes an MP4 file, one frame every `period_s` of simulated time."""

    def __init__(self, path: Path, plant: Any, tick_s: float) -> None:
        """Draws the first picture at once; raises UsageError if the file cannot be written.

        The plant needs `picture(camera, width, height)` and a camera "overview"; what it raises
        goes through.
        """
        ticks = max(1, round(1.0 / FRAMES_PER_S / tick_s))
        self.period_s = ticks * tick_s
        self._plant = plant
        plant.picture(CAMERA, *SIZE_PX)
        codec = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer = cv2.VideoWriter(str(path), codec, 1.0 / self.period_s, SIZE_PX)
        if not self._writer.isOpened():
            raise UsageError(f"cannot write the video {path}")

    def tick(self, view: View) -> None:
        """See `Companion`."""
        picture = self._plant.picture(CAMERA, *SIZE_PX)
        lines = [f"{view.time_s:6.2f} s", *(f"{n}  {s}" for n, s in view.states.items())]
        self._writer.write(cv2.cvtColor(annotated(picture, lines), cv2.COLOR_RGB2BGR))

    def close(self) -> None:
        """See `Companion`."""
        self._writer.release()


def annotated(picture: Rgb, lines: list[str]) -> Rgb:
    """A copy of the picture (h, w, 3) with lines of text in its upper left corner."""
    drawn = np.ascontiguousarray(picture).copy()
    for number, line in enumerate(lines, start=1):
        place = (12, 6 + number * _LINE_PX)
        for colour, width in (((0, 0, 0), 4), ((255, 255, 255), 1)):  # an outline, then the text
            cv2.putText(drawn, line, place, _FONT, 0.6, colour, width, cv2.LINE_AA)
    return drawn
