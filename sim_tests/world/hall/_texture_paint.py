"""Brushes for procedural textures: noise, stains, boards, bands and printed text.

A canvas is an (H, W, 3) float32 array of sRGB values, 0 to 255, row 0 on top.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Canvas = NDArray[np.float32]
Rgb = Sequence[float] | NDArray[Any]


def plain(width_px: int, height_px: int, rgb: Rgb) -> Canvas:
    """A canvas of one colour."""
    return np.full((height_px, width_px, 3), rgb, dtype=np.float32)


def noise(
    rng: np.random.Generator, height_px: int, width_px: int, rows: int, columns: int
) -> NDArray[np.float32]:
    """(H, W) smooth noise of about unit spread whose edges meet when it is tiled."""
    grid = rng.standard_normal((rows, columns)).astype(np.float32)
    margin = 2
    padded = np.pad(grid, margin, mode="wrap")
    full_h, full_w = (
        round(height_px * padded.shape[0] / rows),
        round(width_px * padded.shape[1] / columns),
    )
    large = cv2.resize(padded, (full_w, full_h), interpolation=cv2.INTER_CUBIC)
    top, left = round(height_px * margin / rows), round(width_px * margin / columns)
    return np.asarray(large[top : top + height_px, left : left + width_px], dtype=np.float32)


def grain(canvas: Canvas, rng: np.random.Generator, amount: float, cells: int = 0) -> None:
    """Vary the brightness by ``amount`` (a share), in ``cells`` patches a side (0: every texel)."""
    height, width = canvas.shape[:2]
    if cells:
        field = noise(rng, height, width, cells, cells)
    else:
        field = rng.standard_normal((height, width)).astype(np.float32)
    canvas *= 1.0 + amount * field[..., None]


def band(canvas: Canvas, box: Any, rgb: Rgb, opacity: float = 1.0) -> None:
    """Blend a rectangle: ``box`` is x_min, y_min, x_max, y_max as shares of the canvas."""
    height, width = canvas.shape[:2]
    x0, x1 = round(box[0] * width), max(round(box[2] * width), round(box[0] * width) + 1)
    y0, y1 = round(box[1] * height), max(round(box[3] * height), round(box[1] * height) + 1)
    part = canvas[max(y0, 0) : y1, max(x0, 0) : x1]
    part += opacity * (np.asarray(rgb, dtype=np.float32) - part)


def shade_edges(canvas: Canvas, share: float, amount: float) -> None:
    """Darken a rim of ``share`` of the canvas, as worn edges of boxes are."""
    height, width = canvas.shape[:2]
    x = np.minimum(np.arange(width) + 0.5, width - np.arange(width) - 0.5) / width
    y = np.minimum(np.arange(height) + 0.5, height - np.arange(height) - 0.5) / height
    inner = np.minimum(np.minimum(x[None, :], y[:, None]) / max(share, 1e-6), 1.0)
    canvas *= (1.0 - amount * (1.0 - inner))[..., None].astype(np.float32)


def fade(canvas: Canvas, top: float, bottom: float) -> None:
    """Multiply by a vertical ramp from ``top`` to ``bottom``."""
    ramp = np.linspace(top, bottom, canvas.shape[0], dtype=np.float32)
    canvas *= ramp[:, None, None]


def round_shade(canvas: Canvas, cycles: int, depth: float) -> None:
    """Shade like ``cycles`` upright cylinders side by side, their rims darker by ``depth``."""
    phase = np.modf(np.linspace(0.0, cycles, canvas.shape[1], endpoint=False))[0] - 0.5
    canvas *= (1.0 - depth * (2.0 * phase) ** 2)[None, :, None].astype(np.float32)


def text(canvas: Canvas, words: str, centre: tuple[float, float], height: float, rgb: Rgb) -> None:
    """Write ``words`` about a centre (shares of the canvas), ``height`` a share of its height."""
    rows, columns = canvas.shape[:2]
    font = cv2.FONT_HERSHEY_SIMPLEX
    scale = height * rows / 22.0
    (wide, high), _ = cv2.getTextSize(words, font, scale, 1)
    ink = np.zeros((rows, columns), np.uint8)
    at = (round(centre[0] * columns - 0.5 * wide), round(centre[1] * rows + 0.5 * high))
    cv2.putText(ink, words, at, font, scale, 255, max(1, round(scale * 2.2)), cv2.LINE_AA)
    share = (ink.astype(np.float32) / 255.0)[..., None]
    canvas += share * (np.asarray(rgb, dtype=np.float32) - canvas)


def polygon(canvas: Canvas, corners: Sequence[tuple[float, float]], rgb: Rgb) -> None:
    """Fill a polygon given by shares of the canvas."""
    rows, columns = canvas.shape[:2]
    points = np.round(np.asarray(corners) * (columns, rows) * 16).astype(np.int32)
    ink = np.zeros((rows, columns), np.uint8)
    cv2.fillPoly(ink, [points.reshape(-1, 1, 2)], 255, cv2.LINE_AA, 4)
    share = (ink.astype(np.float32) / 255.0)[..., None]
    canvas += share * (np.asarray(rgb, dtype=np.float32) - canvas)


def stripes(canvas: Canvas, count: int, first: Rgb, second: Rgb, slant: float = 1.0) -> None:
    """Slanted stripes of two colours, ``count`` pairs across the width, tileable."""
    rows, columns = canvas.shape[:2]
    x = np.linspace(0.0, count, columns, endpoint=False)[None, :]
    y = np.linspace(0.0, slant * count * rows / columns, rows, endpoint=False)[:, None]
    on = np.modf(x + y)[0] < 0.5
    canvas[:] = np.where(
        on[..., None], np.asarray(first, np.float32), np.asarray(second, np.float32)
    )


def sealed(canvas: Canvas) -> NDArray[np.uint8]:
    """The finished picture: clipped, whole numbers, read-only."""
    picture = np.clip(np.round(canvas), 0, 255).astype(np.uint8)
    picture.setflags(write=False)
    return picture
