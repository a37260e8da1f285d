"""From the boxes that a detector's decoder returns to the people in the image."""

from __future__ import annotations

import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ..._stages import PersonDetection
from ._decoders import Floats
from ._letterbox import LetterboxGeometry

# Most boxes that enter the removal of overlaps; no scene has so many people.
_MAX_CANDIDATES: Final = 1000
_MIN_SIDE_PX: Final = 1.0
# Of two boxes that overlap more than this, only the one with the higher score stays. One person may
# hide half of another, and both are reported.
_SAME_PERSON_IOU: Final = 0.5


def detections_of(
    boxes: Floats, scores: Floats, geometry: LetterboxGeometry
) -> tuple[PersonDetection, ...]:
    """Return the people, highest score first.

    Boxes with a smaller side than a pixel or with numbers that are not finite are dropped, and of
    boxes of one person all but the best.

    Args:
        boxes: (N, 4) corners in pixels of the network's input.
        scores: (N,), each at least the score threshold.
        geometry: of the image in the input.
    """
    if not len(boxes):
        return ()
    # Numbers that are not finite are dropped; they need no warning here.
    with np.errstate(all="ignore"):
        sizes = boxes[:, 2:] - boxes[:, :2]
        # One sum shows that all numbers are finite, but for those too large to add.
        finite = math.isfinite(float(boxes.sum()) + float(scores.sum()))
    if not (finite and sizes.min() > 0.0):
        good = np.isfinite(boxes).all(axis=1) & np.isfinite(scores) & (sizes > 0.0).all(axis=1)
        boxes, scores = boxes[good], scores[good]
    kept = _without_overlaps(boxes, scores)
    if not len(kept):
        return ()
    clipped = geometry.to_image(boxes[kept])
    sides = (clipped[:, 2:] - clipped[:, :2]).min(axis=1)
    return tuple(
        PersonDetection(box, min(score, 1.0))
        for box, score, side in zip(clipped, scores[kept].tolist(), sides.tolist(), strict=True)
        if side >= _MIN_SIDE_PX
    )


def _without_overlaps(boxes: Floats, scores: Floats) -> NDArray[np.intp]:
    """Return the rows that remain after non-maximum suppression, highest score first."""
    if len(boxes) < 2:
        return np.arange(len(boxes))
    corners_and_sizes = np.concatenate([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]], axis=1)
    kept = cv2.dnn.NMSBoxes(
        corners_and_sizes.tolist(),
        scores.tolist(),
        0.0,  # boxes below the score threshold are already dropped
        _SAME_PERSON_IOU,
        top_k=_MAX_CANDIDATES,
    )
    return np.asarray(kept, dtype=np.intp).reshape(-1)
