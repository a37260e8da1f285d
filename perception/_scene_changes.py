"""Places where an image differs from an earlier one, on a coarse grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray, ImageRgb

# The image is sampled at about this many pixels along its shorter side, and this many samples along
# each side make a cell.
_SAMPLES: Final = 60
_CELL_SAMPLES: Final = 5
# A cell has changed if it differs by more than so many grey levels, and so many times the median of
# all cells: noise and light change all of them. With a larger median the camera moves.
_LEAST_CHANGE: Final = 4.0
_TIMES_MEDIAN: Final = 3.0
_CAMERA_MOVES: Final = 6.0
# A change in so many cells is no noise. If more than this share of all cells changes by a lot, the
# scene is another one.
_FEWEST_CELLS: Final = 2
_LARGE_CHANGE: Final = 25.0
_SCENE_SHARE: Final = 0.5


class SceneChanges:
    """Compares images with a reference: is there something new outside known boxes?"""

    def __init__(self) -> None:
        self._reference: NDArray[np.uint8] | None = None
        self._step = 1

    def refer_to(self, image_rgb: ImageRgb) -> None:
        """Make this image (H, W, 3) the reference."""
        self._step = max(round(min(image_rgb.shape[:2]) / _SAMPLES), 1)
        self._reference = self._sampled(image_rgb)

    def found_in(self, image_rgb: ImageRgb, boxes_px: Sequence[FloatArray]) -> bool:
        """Return whether an image shows another scene, or something new outside the boxes (4,).

        Changes are compared with the median over the image. If that is large, because the camera
        moves or its noise is strong, only another scene counts.
        """
        changes = self.cells(image_rgb)
        if changes is None:
            return True
        if np.count_nonzero(changes > _LARGE_CHANGE) > _SCENE_SHARE * changes.size:
            return True
        median = float(np.median(changes))
        if median > _CAMERA_MOVES:
            return False
        changed = changes > max(_LEAST_CHANGE, _TIMES_MEDIAN * median)
        side = self._step * _CELL_SAMPLES
        for box in boxes_px:
            left, top, right, bottom = (box / side).tolist()
            # A cell more on each side: limbs and shadows reach beyond a box.
            rows = slice(max(math.floor(top) - 1, 0), math.ceil(bottom) + 1)
            changed[rows, max(math.floor(left) - 1, 0) : math.ceil(right) + 1] = False
        return int(np.count_nonzero(changed)) >= _FEWEST_CELLS

    def cells(self, image_rgb: ImageRgb) -> NDArray[np.float32] | None:
        """Return mean changes (rows, columns) of the cells in grey levels; None without reference.

        Only the green channel counts.
        """
        reference = self._reference
        if reference is None:
            return None
        sampled = self._sampled(image_rgb)
        difference = cv2.absdiff(sampled, reference).astype(np.float32)
        height, width = difference.shape
        size = max(round(width / _CELL_SAMPLES), 1), max(round(height / _CELL_SAMPLES), 1)
        return np.asarray(
            cv2.resize(difference, size, interpolation=cv2.INTER_AREA), dtype=np.float32
        )

    def _sampled(self, image_rgb: ImageRgb) -> NDArray[np.uint8]:
        first = self._step // 2
        return np.ascontiguousarray(image_rgb[first :: self._step, first :: self._step, 1])
