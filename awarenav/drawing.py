"""The colour of awareness, the same in every picture.

Colours, lines and letters of the pictures.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray, ImageRgb

Colour = tuple[int, int, int]

_UNKNOWN: Final[Colour] = (150, 152, 160)
_UNAWARE: Final = np.array([222.0, 66.0, 52.0])
_UNCERTAIN: Final = np.array([240.0, 172.0, 46.0])
_AWARE: Final = np.array([52.0, 178.0, 108.0])


def awareness_colour(alpha: float | None) -> Colour:
    """Red for unaware over amber to green for aware; grey for no evidence."""
    if alpha is None:
        return _UNKNOWN
    low, high = (_UNAWARE, _UNCERTAIN) if alpha < 0.5 else (_UNCERTAIN, _AWARE)
    share = 2.0 * alpha if alpha < 0.5 else 2.0 * alpha - 1.0
    red, green, blue = (low + share * (high - low)).round().astype(int).tolist()
    return red, green, blue


WHITE: Final[Colour] = (246, 245, 242)
NIGHT: Final[Colour] = (22, 24, 30)
_SHIFT: Final = 4  # sub-pixel bits of OpenCV's drawing functions
# Beyond this, OpenCV's fixed-point coordinates are near their end.
_FAR_PX: Final = 20_000.0
# Before version 5 OpenCV has only letters of the American alphabet.
_PLAIN: Final = {"α": "alpha", "±": "+-", "σ": "sigma", "°": " deg", "·": "-"}


def drawable(points_px: FloatArray) -> bool:
    """Whether all points are where OpenCV can draw."""
    return bool(np.isfinite(points_px).all() and np.abs(points_px).max(initial=0.0) < _FAR_PX)


def line(image: ImageRgb, points_px: Any, colour: Colour, width_px: int) -> None:
    """An antialiased line through points (N, 2)."""
    cv2.polylines(image, [_fixed(points_px)], False, colour, width_px, cv2.LINE_AA, _SHIFT)


def dot(image: ImageRgb, centre_px: Any, radius_px: float, colour: Colour) -> None:
    """An antialiased disc."""
    u, v = _fixed(centre_px).reshape(2).tolist()
    cv2.circle(image, (u, v), round(radius_px * (1 << _SHIFT)), colour, -1, cv2.LINE_AA, _SHIFT)


def tint(image: ImageRgb, points_px: FloatArray, colour: Colour, opacity: float) -> None:
    """Blend the convex hull of points (N, 2) into the image; only the pixels around it are read."""
    low = np.floor(points_px.min(axis=0)).astype(int) - 1
    high = np.ceil(points_px.max(axis=0)).astype(int) + 2
    left, top = np.maximum(low, 0).tolist()
    right, bottom = np.minimum(high, (image.shape[1], image.shape[0])).tolist()
    if right <= left or bottom <= top:
        return
    part = image[top:bottom, left:right]
    layer = part.copy()
    hull = cv2.convexHull((points_px - (left, top)).astype(np.float32)).reshape(-1, 2)
    cv2.fillConvexPoly(layer, _fixed(hull), colour, cv2.LINE_AA, _SHIFT)
    cv2.addWeighted(layer, opacity, part, 1.0 - opacity, 0.0, dst=part)


def plate(image: ImageRgb, box: tuple[int, int, int, int], opacity: float = 0.72) -> None:
    """Darken a rectangle (left, top, right, bottom) for writing on."""
    left, top, right, bottom = box
    part = image[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)]
    if part.size:
        night = np.full_like(part, NIGHT)
        cv2.addWeighted(night, opacity, part, 1.0 - opacity, 0.0, dst=part)


class Lettering:
    """Letters of one height.

    Args:
        height_px: of a line.
    """

    def __init__(self, height_px: int) -> None:
        self.height_px = height_px
        # OpenCV 5 brings a typeface with Greek; it is drawn 0.72 of a line tall.
        self._face: Any = _typeface()
        self._size = max(round(0.72 * height_px), 8)

    def width(self, text: str) -> int:
        """Pixels that a text is wide."""
        if self._face is None:
            plain = _in_plain_letters(text)
            (width, _), _ = cv2.getTextSize(
                plain, cv2.FONT_HERSHEY_SIMPLEX, self.height_px / 34.0, 1
            )
            return int(width)
        measure: Any = cv2.getTextSize
        return int(measure((0, 0), text, (0, 0), self._face, self._size)[2])

    def write(self, image: ImageRgb, text: str, corner: tuple[int, int], colour: Colour) -> None:
        """Write a line with its upper left corner at ``corner``."""
        base = (corner[0], corner[1] + round(0.74 * self.height_px))
        put: Any = cv2.putText
        if self._face is None:
            scale = self.height_px / 34.0
            plain = _in_plain_letters(text)
            put(image, plain, base, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv2.LINE_AA)
        else:
            put(image, text, base, colour, self._face, self._size)


@lru_cache(maxsize=1)
def _typeface() -> Any:
    make = getattr(cv2, "FontFace", None)
    return None if make is None else make("sans")


def _in_plain_letters(text: str) -> str:
    return "".join(_PLAIN.get(letter, letter) for letter in text)


def _fixed(points: Any) -> NDArray[np.int32]:
    scaled = np.asarray(points, dtype=np.float64) * (1 << _SHIFT)
    fixed: NDArray[np.int32] = np.round(scaled).astype(np.int32).reshape(-1, 1, 2)
    return fixed
