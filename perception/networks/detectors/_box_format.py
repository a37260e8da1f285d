"""Box formats of detectors: corners, or centre and size; recognised from the boxes."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...errors import PerceptionError

_CORNERS: Final = "xyxy"
_CENTRE_AND_SIZE: Final = "cxcywh"
_FORMATS: Final = (_CORNERS, _CENTRE_AND_SIZE)

# How far a box may reach beyond the input, as a fraction of the input's side: boxes of people who
# are cut off by the border do.
_OVERHANG: Final = 0.1


class BoxFormatVote:
    """Vote of the boxes on their own format: x1, y1, x2, y2 or cx, cy, w, h.

    Exports with the same shape (1, 300, 6) exist in both formats, and their metadata do not tell
    which. Each row is read both ways. As corners, x2 and y2 must be larger than x1 and y1. As
    centre and size, the box must lie in the input. A row that fits only one format votes for it,
    weighted by its score; other rows do not vote. The votes of the trial run at loading and of all
    images are added up, so that one image with a single ambiguous box does not decide. Without
    votes the format is corners, as in all known exporters.

    Args:
        known: ``"xyxy"`` or ``"cxcywh"`` if the caller knows the format; then no votes count.
    """

    def __init__(self, known: str | None = None) -> None:
        if known is not None and known not in _FORMATS:
            raise PerceptionError(
                f"box_format must be one of {', '.join(map(repr, _FORMATS))} or None, got {known!r}"
            )
        self._known = known
        self._balance = 0.0  # positive: centre and size lead; negative: corners lead

    @property
    def format(self) -> str:
        """Format after the votes so far: ``"xyxy"`` or ``"cxcywh"``."""
        if self._known is not None:
            return self._known
        return _CENTRE_AND_SIZE if self._balance > 0.0 else _CORNERS

    def update(self, boxes: NDArray[Any], scores: NDArray[Any], input_px: tuple[int, int]) -> None:
        """Add the votes of boxes (N, 4) with scores (N,) in an input of (width, height)."""
        if self._known is not None:
            return
        real = np.isfinite(boxes).all(axis=1) & (boxes != 0.0).any(axis=1)
        real &= np.isfinite(scores) & (scores > 0.0)
        boxes, scores = boxes[real], scores[real]
        first, second = boxes[:, :2], boxes[:, 2:]
        extent = np.asarray(input_px, dtype=np.float64)
        low, high = first - 0.5 * second, first + 0.5 * second
        corners = (second > first).all(axis=1)
        inside = (low >= -_OVERHANG * extent) & (high <= (1.0 + _OVERHANG) * extent)
        centre = (second > 0.0).all(axis=1) & inside.all(axis=1)
        for fits, other, sign in ((centre, corners, 1.0), (corners, centre, -1.0)):
            self._balance += sign * float(scores[fits & ~other].sum(dtype=np.float64))

    def corners(self, boxes: NDArray[Any]) -> NDArray[Any]:
        """Return boxes (N, 4) as x1, y1, x2, y2."""
        if self.format == _CORNERS:
            return boxes
        return centre_to_corners(boxes[:, :2], boxes[:, 2:])


def centre_to_corners(centre: NDArray[Any], size: NDArray[Any]) -> NDArray[Any]:
    """Return the corners x1, y1, x2, y2 (N, 4) of boxes with centres (N, 2) and sizes (N, 2)."""
    return np.concatenate([centre - 0.5 * size, centre + 0.5 * size], axis=1)
