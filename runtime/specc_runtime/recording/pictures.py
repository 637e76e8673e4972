"""Images in recordings, as messages of Foxglove: compressed for viewing, or lossless."""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from struct import pack, unpack_from
from typing import Any

import numpy as np

from specc_runtime.forms import Misshapen, Schema, object_schema
from specc_runtime.recording.depth import DEPTH, read_depth
from specc_runtime.recording.text import dumped, loaded
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
_MOST_PIXELS = 1 << 26

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


def shown(image: Image, quality: int = 85) -> bytes:
    """The file of an image that a browser shows: JPEG where there is OpenCV, else PNG.

    Of a depth map (h, w) in m what is near is bright, and what has no reading is black.
    """
    if image.ndim == 2:
        return png(_grey(image))
    if find_spec("cv2") is None:
        return png(image)
    import cv2

    in_order = cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2BGR)
    return bytes(cv2.imencode(".jpg", in_order, [cv2.IMWRITE_JPEG_QUALITY, quality])[1])


def _grey(depth: Image) -> Image:
    """Bytes (h, w) of a depth map; the scale goes to a power of two in m, so that it stays."""
    metres = np.nan_to_num(depth, nan=0.0, posinf=0.0, neginf=0.0)
    farthest = float(metres.max(initial=0.0)) or 1.0
    reach = 2.0 ** np.ceil(np.log2(farthest))
    grey = 255.0 - 215.0 * np.clip(metres / reach, 0.0, 1.0)
    grey[metres <= 0.0] = 0.0
    found: Image = grey.astype(np.uint8)
    return found


def shown_message(message: bytes, schema: str) -> bytes | None:
    """The file that a browser shows of a recorded image; None for a message of another schema.

    Raises Misshapen.
    """
    if schema == COMPRESSED:
        return _decompressed(loaded(message))
    if schema == DEPTH:
        return shown(read_depth(message))
    return shown(read_raw(loaded(message))) if schema == RAW else None


def _decompressed(message: Any) -> bytes:
    """The file in a message; the depth in whole mm as grey, where there is OpenCV."""
    try:
        kind, data = message["format"], b64decode(message["data"], validate=True)
    except (KeyError, TypeError, ValueError) as error:
        raise Misshapen(f"no image: {error}") from None
    if kind not in ("jpeg", "png"):
        raise Misshapen("an image that is neither JPEG nor PNG")
    if kind == "jpeg" or find_spec("cv2") is None:
        return data
    import cv2

    if not _is_small(data):
        raise Misshapen("an image of too many pixels")
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise Misshapen("a damaged PNG")
    return shown(image / _MM_PER_M) if image.ndim == 2 else data


def _is_small(data: bytes) -> bool:
    """Whether the header of a PNG promises no more pixels than any camera has."""
    width, height = unpack_from(">II", data, 16) if len(data) > 24 else (0, 0)
    return bool(width * height <= _MOST_PIXELS)


def png(texels: Image) -> bytes:
    """A PNG of (h, w, 3) or (h, w) bytes."""
    height, width = texels.shape[:2]
    flat = texels.reshape(height, -1)
    rows = np.zeros((height, 1 + flat.shape[1]), np.uint8)  # each begins with its filter: none
    rows[:, 1:] = flat
    colours = 2 if texels.ndim == 3 else 0
    head = pack(">IIBBBBB", width, height, 8, colours, 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        pack(">I", len(data)) + kind + data + pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    )
