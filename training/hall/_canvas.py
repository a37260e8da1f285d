"""Drawing primitives for procedural textures: noise, bands, shades, polygons and text.

A canvas is an (H, W, 3) float32 array of sRGB values, 0 to 255, its first row at the top. Boxes,
corners and centres are given as shares of the canvas: (0, 0) is its upper left corner, (1, 1) its
lower right one.
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
    """Return a canvas of one colour."""
    return np.full((height_px, width_px, 3), rgb, dtype=np.float32)


def finished(canvas: Canvas) -> NDArray[np.uint8]:
    """Return the texture painted on a canvas: rounded, clipped to 0 to 255, read-only."""
    texture = np.clip(np.round(canvas), 0, 255).astype(np.uint8)
    texture.setflags(write=False)
    return texture


def noise(
    rng: np.random.Generator, height_px: int, width_px: int, rows: int, columns: int
) -> NDArray[np.float32]:
    """Return (H, W) smooth noise with a standard deviation of about 1, seamless when tiled."""
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
    """Vary the brightness by a share ``amount``, in cells × cells patches (0: per texel)."""
    height, width = canvas.shape[:2]
    if cells:
        field = noise(rng, height, width, cells, cells)
    else:
        field = rng.standard_normal((height, width)).astype(np.float32)
    canvas *= 1.0 + amount * field[..., None]


def band(canvas: Canvas, box: Any, rgb: Rgb, opacity: float = 1.0) -> None:
    """Blend a rectangle ``box`` (x_min, y_min, x_max, y_max) into the canvas."""
    height, width = canvas.shape[:2]
    x0, x1 = round(box[0] * width), max(round(box[2] * width), round(box[0] * width) + 1)
    y0, y1 = round(box[1] * height), max(round(box[3] * height), round(box[1] * height) + 1)
    part = canvas[max(y0, 0) : y1, max(x0, 0) : x1]
    part += opacity * (np.asarray(rgb, dtype=np.float32) - part)


def shade_edges(canvas: Canvas, share: float, amount: float) -> None:
    """Darken a rim as wide as ``share`` of the canvas by up to ``amount``, like worn edges."""
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
    """Write ``words`` about ``centre``, as high as ``height`` of the canvas."""
    rows, columns = canvas.shape[:2]
    font = cv2.FONT_HERSHEY_SIMPLEX
    scale = height * rows / 22.0
    (wide, high), _ = cv2.getTextSize(words, font, scale, 1)
    coverage = np.zeros((rows, columns), np.uint8)
    at = (round(centre[0] * columns - 0.5 * wide), round(centre[1] * rows + 0.5 * high))
    cv2.putText(coverage, words, at, font, scale, 255, max(1, round(scale * 2.2)), cv2.LINE_AA)
    _blend(canvas, coverage, rgb)


def polygon(canvas: Canvas, corners: Sequence[tuple[float, float]], rgb: Rgb) -> None:
    """Fill a polygon."""
    rows, columns = canvas.shape[:2]
    points = np.round(np.asarray(corners) * (columns, rows) * 16).astype(np.int32)
    coverage = np.zeros((rows, columns), np.uint8)
    cv2.fillPoly(coverage, [points.reshape(-1, 1, 2)], 255, cv2.LINE_AA, 4)
    _blend(canvas, coverage, rgb)


def disc(
    canvas: Canvas,
    radius: float,
    rgb: Rgb,
    centre: tuple[float, float] = (0.5, 0.5),
    corners: int = 24,
) -> None:
    """Fill a regular polygon about ``centre``; it is an ellipse on a canvas that is not square."""
    x, y = centre
    angles = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    polygon(canvas, [(x + radius * np.cos(a), y + radius * np.sin(a)) for a in angles], rgb)


def _blend(canvas: Canvas, coverage: NDArray[np.uint8], rgb: Rgb) -> None:
    """Blend a colour into the canvas by its coverage (H, W), 0 to 255."""
    share = (coverage.astype(np.float32) / 255.0)[..., None]
    canvas += share * (np.asarray(rgb, dtype=np.float32) - canvas)


def stripes(canvas: Canvas, count: int, first: Rgb, second: Rgb, slant: float = 1.0) -> None:
    """Fill with slanted stripes of two colours, ``count`` pairs across the width, seamless."""
    rows, columns = canvas.shape[:2]
    x = np.linspace(0.0, count, columns, endpoint=False)[None, :]
    y = np.linspace(0.0, slant * count * rows / columns, rows, endpoint=False)[:, None]
    on = np.modf(x + y)[0] < 0.5
    canvas[:] = np.where(
        on[..., None], np.asarray(first, np.float32), np.asarray(second, np.float32)
    )
