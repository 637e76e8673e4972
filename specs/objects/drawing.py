"""Drawing of packaging-like box faces: gradients, motifs and words, all from a seeded generator.

Lengths are millimetres on the face; colours are RGB triples; images are uint8 (h, w, 3) RGB.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Color = tuple[int, int, int]
Points = NDArray[np.float64]

DRAWN_PX_PER_MM = 6.0
# The Kinect sees 0.46 pixels a millimetre: a motif must be some pixels wide to give a feature.
MOTIF_SPACING_MM = 9.0
MOTIF_RADIUS_MM = (4.5, 9.5)
_SUBPIXEL_BITS = 4


@dataclass(frozen=True)
class Design:
    """What the faces of one object share; `titles` has one word a face."""

    seed: int
    palette: tuple[Color, ...]
    titles: tuple[str, ...]
    words: tuple[str, ...]
    motifs: tuple[str, ...]


def draw_face(design: Design, face: int, size_mm: tuple[float, float], px_per_mm: float) -> Image:
    """Face number `face` of a design, (height, width) = size_mm * px_per_mm; no two are alike."""
    rng = np.random.default_rng([design.seed, face])
    width_mm, height_mm = size_mm
    canvas = _background(rng, design, size_mm)
    for centre in _scatter(rng, size_mm, spacing_mm=MOTIF_SPACING_MM):
        radius_mm = rng.uniform(*MOTIF_RADIUS_MM)
        _motif(canvas, rng, design, centre, radius_mm)
    _title(canvas, rng, design, face, size_mm)
    size_px = (round(width_mm * px_per_mm), round(height_mm * px_per_mm))
    return np.asarray(cv2.resize(canvas, size_px, interpolation=cv2.INTER_AREA), np.uint8)


def save_png(path: Path, image: Image) -> None:
    """Write an RGB image with the strongest compression."""
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    if not cv2.imwrite(str(path), bgr, [cv2.IMWRITE_PNG_COMPRESSION, 9]):
        raise OSError(f"cannot write {path}")


def _background(rng: np.random.Generator, design: Design, size_mm: tuple[float, float]) -> Image:
    """A linear gradient between two colours of the palette, in a random direction."""
    width_px, height_px = (round(side * DRAWN_PX_PER_MM) for side in size_mm)
    first, second = (np.array(design.palette[i]) for i in rng.choice(len(design.palette), 2, False))
    angle = rng.uniform(0, 2 * np.pi)
    v, u = np.mgrid[0:height_px, 0:width_px]
    along = np.cos(angle) * (u / width_px - 0.5) + np.sin(angle) * (v / height_px - 0.5)
    mix = np.clip(along + 0.5, 0, 1)[..., None]
    return np.asarray(np.round(first * (1 - mix) + second * mix), np.uint8)


def _scatter(rng: np.random.Generator, size_mm: tuple[float, float], spacing_mm: float) -> Points:
    """Random places on the face, (n, 2), no two nearer than the spacing."""
    placed: list[NDArray[np.float64]] = []
    for candidate in rng.uniform((1.5, 1.5), np.subtract(size_mm, 1.5), (1500, 2)):
        if all(np.hypot(*(candidate - other)) >= spacing_mm for other in placed):
            placed.append(candidate)
    return np.array(placed)


def _motif(
    canvas: Image, rng: np.random.Generator, design: Design, centre: Points, radius_mm: float
) -> None:
    kind = design.motifs[rng.integers(len(design.motifs))]
    outline = _OUTLINES[kind](rng) * radius_mm
    turn = rng.uniform(0, 2 * np.pi)
    outer = _contrasting(canvas, rng, design, centre)
    _fill(canvas, centre + _turned(outline, turn), outer)
    inner = _contrasting(canvas, rng, design, centre)
    shift = _turned(rng.uniform(-0.2, 0.2, (1, 2)) * radius_mm, turn)
    _fill(canvas, centre + shift + 0.45 * _turned(outline, turn + rng.uniform(0, np.pi)), inner)


def _contrasting(canvas: Image, rng: np.random.Generator, design: Design, centre: Points) -> Color:
    """One of the palette's two colours that differ most in luminance from what is there."""
    v = min(int(centre[1] * DRAWN_PX_PER_MM), canvas.shape[0] - 1)
    u = min(int(centre[0] * DRAWN_PX_PER_MM), canvas.shape[1] - 1)
    here = _luminance(canvas[v, u])
    ranked = sorted(design.palette, key=lambda colour: -abs(_luminance(np.array(colour)) - here))
    return ranked[rng.integers(2)]


def _luminance(rgb: NDArray[np.generic]) -> float:
    return float(np.dot(rgb.astype(float), (0.299, 0.587, 0.114)))


def _turned(points: Points, angle: float) -> Points:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[c, s], [-s, c]]))


def _fill(canvas: Image, outline_mm: Points, colour: Color) -> None:
    fixed = np.round(outline_mm * DRAWN_PX_PER_MM * 2**_SUBPIXEL_BITS).astype(np.int32)
    cv2.fillPoly(canvas, [fixed], colour, cv2.LINE_AA, _SUBPIXEL_BITS)


def _title(
    canvas: Image, rng: np.random.Generator, design: Design, face: int, size_mm: tuple[float, float]
) -> None:
    """The face's own word on a plate, and a line of small print under it."""
    width_mm, height_mm = size_mm
    title = design.titles[face]
    centre = np.array([width_mm * rng.uniform(0.44, 0.56), height_mm * rng.uniform(0.4, 0.6)])
    letter_mm = min(0.22 * height_mm, 0.8 * width_mm / len(title))
    half = np.array([0.4 * len(title) * letter_mm + 2, 1.05 * letter_mm + 1])
    corners = np.array([[-1, -1], [1, -0.9], [1.05, 1], [-0.95, 0.92]]) * half
    ink, plate = design.palette[0], design.palette[-1]
    _fill(canvas, centre + corners, plate)
    _word(canvas, title, centre - np.array([0, 0.28 * letter_mm]), letter_mm, ink)
    small_print = " ".join(rng.permutation(design.words)[:3])
    small_mm = min(4.5, 0.3 * letter_mm, 2.2 * half[0] / len(small_print))
    _word(canvas, small_print, centre + np.array([0, 0.66 * letter_mm]), small_mm, ink)


def _word(canvas: Image, text: str, centre_mm: Points, letter_mm: float, colour: Color) -> None:
    font, thickness = cv2.FONT_HERSHEY_DUPLEX, max(2, round(0.16 * letter_mm * DRAWN_PX_PER_MM))
    (_, reference_px), _ = cv2.getTextSize("H", font, 1.0, 1)
    scale = letter_mm * DRAWN_PX_PER_MM / reference_px
    (width_px, height_px), _ = cv2.getTextSize(text, font, scale, thickness)
    u = round(float(centre_mm[0]) * DRAWN_PX_PER_MM - width_px / 2)
    v = round(float(centre_mm[1]) * DRAWN_PX_PER_MM + height_px / 2)
    cv2.putText(canvas, text, (u, v), font, scale, colour, thickness, cv2.LINE_AA)


def _blob(rng: np.random.Generator) -> Points:
    angle = np.sort(rng.uniform(0, 2 * np.pi, 9))
    return rng.uniform(0.55, 1.0, 9)[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)


def _leaf(rng: np.random.Generator) -> Points:
    t = np.linspace(-1, 1, 15)
    belly = rng.uniform(0.3, 0.6) * (1 - t**2) * (1 + rng.uniform(-0.5, 0.5) * t)
    return np.concatenate([np.stack([t, belly], 1), np.stack([t[::-1], -0.6 * belly[::-1]], 1)])


def _star(rng: np.random.Generator) -> Points:
    points = int(rng.integers(4, 8))
    angle = np.arange(2 * points) * np.pi / points
    radius = np.where(np.arange(2 * points) % 2, rng.uniform(0.35, 0.55), 1.0)
    radius = radius * rng.uniform(0.8, 1.0, 2 * points)
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)


def _crescent(rng: np.random.Generator) -> Points:
    outer = np.linspace(0.6, 2 * np.pi - 0.6, 24)
    bite = rng.uniform(0.35, 0.6)
    rim = np.stack([np.cos(outer), np.sin(outer)], 1)
    return np.concatenate(
        [rim, rim[::-1] * (1 - bite * np.sin((outer[::-1] - 0.6) / 1.7))[:, None]]
    )


def _shard(rng: np.random.Generator) -> Points:
    corners = np.array([[-1.0, -0.6], [0.9, -0.8], [1.0, 0.5], [-0.7, 0.8]])
    return corners + rng.uniform(-0.3, 0.3, (4, 2))


_OUTLINES = {
    "blob": _blob,
    "leaf": _leaf,
    "star": _star,
    "crescent": _crescent,
    "shard": _shard,
}
