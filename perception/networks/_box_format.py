"""Telling corner boxes from centre boxes by the boxes themselves."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..errors import PerceptionError

CORNERS: Final = "xyxy"
CENTRE: Final = "cxcywh"
#: What a caller may say beforehand.
BOX_FORMATS: Final = (CORNERS, CENTRE)

# How far a network's box may hang over the input, as a fraction of it: cut-off people do.
_OVERHANG: Final = 0.1


class BoxFormatVote:
    """Decides whether rows of four numbers are x1, y1, x2, y2 or cx, cy, w, h.

    Exports with the same shape (1, 300, 6) come in both formats, and their metadata does not tell
    them apart. Each row is read both ways. Read as corners it must have its right below its left;
    read as centre and size it must lie in the input. A row that only one reading fits votes
    for it, with its score; rows that fit both or neither are silent. Votes add up from the
    network's trial run when it is loaded and from every picture, so that one picture with a single
    undecided box does not decide. Without votes it is corners, as all known exporters have it.

    Args:
        known: the format where the caller knows it: no vote is taken then.
    """

    def __init__(self, known: str | None = None) -> None:
        if known is not None and known not in BOX_FORMATS:
            raise PerceptionError(
                f"box_format must be one of {', '.join(map(repr, BOX_FORMATS))} or None, "
                f"got {known!r}"
            )
        self._known = known
        self._balance = 0.0  # above zero: centre and size

    @property
    def format(self) -> str:
        """``"xyxy"`` or ``"cxcywh"``, as things stand."""
        if self._known is not None:
            return self._known
        return CENTRE if self._balance > 0.0 else CORNERS

    def listen(self, boxes: NDArray[Any], scores: NDArray[Any], input_px: tuple[int, int]) -> None:
        """Take the votes of boxes (N, 4) with scores (N,) in an input of width, height."""
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
        """Boxes (N, 4) as x1, y1, x2, y2."""
        if self.format == CORNERS:
            return boxes
        return centre_to_corners(boxes[:, :2], boxes[:, 2:])


def centre_to_corners(centre: NDArray[Any], size: NDArray[Any]) -> NDArray[Any]:
    """Centres (N, 2) and sizes (N, 2) to x1, y1, x2, y2 (N, 4)."""
    return np.concatenate([centre - 0.5 * size, centre + 0.5 * size], axis=1)
