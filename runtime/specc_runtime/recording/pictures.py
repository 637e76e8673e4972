"""Images in recordings, as messages of Foxglove: compressed for viewing, or lossless."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from specc_runtime.forms import Misshapen, Schema, object_schema
from specc_runtime.recording.text import dumped
from specc_runtime.recording.times import TIME, stamped

_TEXT, _WHOLE = {"type": "string"}, {"type": "integer"}
_BYTES = {"type": "string", "contentEncoding": "base64"}
_COMPRESSED = object_schema({"timestamp": TIME, "frame_id": _TEXT, "data": _BYTES, "format": _TEXT})
_RAW = object_schema(
    {
        "timestamp": TIME,
        "frame_id": _TEXT,
        "width": _WHOLE,
        "height": _WHOLE,
        "encoding": _TEXT,
        "step": _WHOLE,
        "data": _BYTES,
    }
)
RAW, COMPRESSED = "foxglove.RawImage", "foxglove.CompressedImage"
_ENCODINGS = {"rgb8": (np.uint8, 3), "32FC1": (np.float32, 1)}
_MM_PER_M = 1000.0

Image = np.ndarray[Any, Any]
Make = Callable[[Image, float, str], bytes]
"""Makes the message of an image, a time and a frame."""


@dataclass(frozen=True, slots=True)
class Look:
    """Settings for images that are kept for viewing: rate, size, quality."""

    period_s: float
    """Least simulated time between two pictures of an element."""
    widths: tuple[float, float]
    """Greatest widths of colour images and of depth maps in pixels."""
    quality: int
    """Quality of JPEG, in percent."""
    is_calm: bool
    """Whether noise is removed from depth, by the median of 5 by 5 pixels."""


LOOKS = {
    "small": Look(1.0, (640, 320), 85, is_calm=True),
    "full": Look(0.0, (np.inf, np.inf), 95, is_calm=False),
}


def compressed(image: Image, look: Look) -> tuple[str, Schema, Make]:
    """Colours as JPEG, depth as PNG in whole mm: the schema and the function for a message."""
    import cv2  # noqa: F401  # a missing library is reported before the first message

    return COMPRESSED, _COMPRESSED, partial(_compressed, look)


def _compressed(look: Look, image: Image, time_s: float, frame: str) -> bytes:
    import cv2

    every = int(np.ceil(image.shape[1] / look.widths[image.ndim == 2])) or 1
    if image.ndim == 3:
        shown = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
        if every > 1:
            size = image.shape[1] // every, image.shape[0] // every
            shown = cv2.resize(shown, size, interpolation=cv2.INTER_AREA)
        form, options = "jpeg", [cv2.IMWRITE_JPEG_QUALITY, look.quality]
    else:
        in_mm = np.nan_to_num(image[::every, ::every] * np.float32(_MM_PER_M), nan=0.0)
        shown = np.clip(np.rint(in_mm), 0, np.iinfo(np.uint16).max).astype(np.uint16)
        shown = cv2.medianBlur(shown, 5) if look.is_calm else shown
        form, options = "png", []
    suffix = ".jpg" if form == "jpeg" else ".png"
    _, data = cv2.imencode(suffix, np.ascontiguousarray(shown), options)
    message = {"format": form, "data": b64encode(data.tobytes()).decode()}
    return dumped(stamped(time_s) | {"frame_id": frame} | message)


def raw(image: Image) -> tuple[str, Schema, Make]:
    """A lossless image: the schema and the function for a message."""
    return RAW, _RAW, _raw


def _raw(image: Image, time_s: float, frame: str) -> bytes:
    message = {
        "frame_id": frame,
        "width": image.shape[1],
        "height": image.shape[0],
        "encoding": "rgb8" if image.ndim == 3 else "32FC1",
        "step": image.nbytes // image.shape[0],  # of `tobytes`, whatever the strides are
        "data": b64encode(image.tobytes()).decode(),
    }
    return dumped(stamped(time_s) | message)


def read_raw(message: Any) -> Image:
    """The image of a message of `RAW`, read-only; raises Misshapen."""
    try:
        dtype, channels = _ENCODINGS[message["encoding"]]
        shape = (message["height"], message["width"], 3)[: 3 if channels == 3 else 2]
        image = np.frombuffer(b64decode(message["data"], validate=True), dtype).reshape(shape)
    except (KeyError, TypeError, ValueError) as error:
        raise Misshapen(f"no image: {error}") from None
    image.setflags(write=False)
    return image
