"""Drawing into images: the colour of awareness, lines, discs, areas and text."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray, ImageRgb

Colour = tuple[int, int, int]

WHITE: Final[Colour] = (246, 245, 242)
DARK: Final[Colour] = (22, 24, 30)

_NO_EVIDENCE: Final[Colour] = (150, 152, 160)
_UNAWARE: Final = np.array([222.0, 66.0, 52.0])
_UNCERTAIN: Final = np.array([240.0, 172.0, 46.0])
_AWARE: Final = np.array([52.0, 178.0, 108.0])

_SHIFT: Final = 4  # sub-pixel bits of OpenCV's drawing functions
# OpenCV's fixed-point coordinates overflow not far beyond this.
_FAR_PX: Final = 20_000.0
# The fonts of OpenCV 4 have only ASCII characters.
_ASCII: Final = {"α": "alpha", "±": "+-", "σ": "sigma", "°": " deg", "·": "-", "≥": ">=", "–": "-"}


def awareness_colour(alpha: float | None) -> Colour:
    """Return the colour of α: red for unaware, amber, green for aware; grey for no evidence."""
    if alpha is None:
        return _NO_EVIDENCE
    low, high = (_UNAWARE, _UNCERTAIN) if alpha < 0.5 else (_UNCERTAIN, _AWARE)
    share = 2.0 * alpha if alpha < 0.5 else 2.0 * alpha - 1.0
    red, green, blue = (low + share * (high - low)).round().astype(int).tolist()
    return red, green, blue


def drawable(points_px: FloatArray) -> bool:
    """Return whether all points are finite and near enough for OpenCV to draw."""
    return bool(np.isfinite(points_px).all() and np.abs(points_px).max(initial=0.0) < _FAR_PX)


def draw_line(image: ImageRgb, points_px: Any, colour: Colour, width_px: int) -> None:
    """Draw an antialiased line through points (N, 2)."""
    cv2.polylines(image, [_fixed_point(points_px)], False, colour, width_px, cv2.LINE_AA, _SHIFT)


def draw_disc(image: ImageRgb, centre_px: Any, radius_px: float, colour: Colour) -> None:
    """Draw an antialiased disc."""
    u, v = _fixed_point(centre_px).reshape(2).tolist()
    cv2.circle(image, (u, v), round(radius_px * (1 << _SHIFT)), colour, -1, cv2.LINE_AA, _SHIFT)


def fill_hull(image: ImageRgb, points_px: FloatArray, colour: Colour, opacity: float) -> None:
    """Blend the convex hull of points (N, 2) into the image."""
    low = np.floor(points_px.min(axis=0)).astype(int) - 1
    high = np.ceil(points_px.max(axis=0)).astype(int) + 2
    left, top = np.maximum(low, 0).tolist()
    right, bottom = np.minimum(high, (image.shape[1], image.shape[0])).tolist()
    if right <= left or bottom <= top:
        return
    part = image[top:bottom, left:right]
    layer = part.copy()
    hull = cv2.convexHull((points_px - (left, top)).astype(np.float32)).reshape(-1, 2)
    cv2.fillConvexPoly(layer, _fixed_point(hull), colour, cv2.LINE_AA, _SHIFT)
    cv2.addWeighted(layer, opacity, part, 1.0 - opacity, 0.0, dst=part)


def darken_box(image: ImageRgb, box: tuple[int, int, int, int], opacity: float = 0.72) -> None:
    """Darken a box (left, top, right, bottom), so that text on it can be read."""
    left, top, right, bottom = box
    part = image[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)]
    if part.size:
        dark = np.full_like(part, DARK)
        cv2.addWeighted(dark, opacity, part, 1.0 - opacity, 0.0, dst=part)


class Font:
    """A font of one size.

    Args:
        height_px: height of a line of text.
        weight: 100 (thin) to 1000 (black), 400 is regular. 0 is OpenCV 5's default, which is not
            the same in all processes.
    """

    def __init__(self, height_px: int, weight: int = 0) -> None:
        self.height_px = height_px
        self._weight = weight
        self._thickness_px = 1 if weight < 600 else 2
        # The typeface of OpenCV 5 has Greek letters; its size is 0.72 of a line's height.
        self._face: Any = _typeface()
        self._size = max(round(0.72 * height_px), 8)

    def width_px(self, text: str) -> int:
        """Return the width of a line of text."""
        if self._face is None:
            plain = _in_ascii(text)
            (width, _), _ = cv2.getTextSize(
                plain, cv2.FONT_HERSHEY_SIMPLEX, self.height_px / 34.0, self._thickness_px
            )
            return int(width)
        measure: Any = cv2.getTextSize
        return int(measure((0, 0), text, (0, 0), self._face, self._size, self._weight)[2])

    def write(self, image: ImageRgb, text: str, corner: tuple[int, int], colour: Colour) -> None:
        """Write a line of text with its upper left corner at ``corner``."""
        base = (corner[0], corner[1] + round(0.74 * self.height_px))
        put: Any = cv2.putText
        if self._face is None:
            scale = self.height_px / 34.0
            plain = _in_ascii(text)
            face, thick = cv2.FONT_HERSHEY_SIMPLEX, self._thickness_px
            put(image, plain, base, face, scale, colour, thick, cv2.LINE_AA)
        else:
            put(image, text, base, colour, self._face, self._size, self._weight)


@lru_cache(maxsize=1)
def _typeface() -> Any:
    """Return OpenCV's sans-serif typeface, or None before OpenCV 5."""
    make = getattr(cv2, "FontFace", None)
    return None if make is None else make("sans")


def _in_ascii(text: str) -> str:
    return "".join(_ASCII.get(letter, letter) for letter in text)


def _fixed_point(points: Any) -> NDArray[np.int32]:
    """Return points (N, 2) as OpenCV's fixed-point coordinates (N, 1, 2)."""
    scaled = np.asarray(points, dtype=np.float64) * (1 << _SHIFT)
    fixed: NDArray[np.int32] = np.round(scaled).astype(np.int32).reshape(-1, 1, 2)
    return fixed
