"""A person detector for wide cameras, in whose images people ahead are small."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..._camera import Camera
from ..._stages import PersonDetection, PersonDetector
from ...arrays import FloatArray, ImageRgb
from ...ownership import area, common_area

# In an input of 320 pixels somebody at 5 m is 97 pixels tall at 60° across, 56 at 90° and 32 at
# 120°. A detector finds few people of less than 30.
_WIDE: Final = 0.5
# Side of the middle, as a share of the image's width.
_SHARE: Final = 0.5
# In the whole image a small person may be several boxes, of which this share lies in the fine one.
_SAME_SHARE: Final = 0.5
_EDGE_PX: Final = 2.0


def for_wide_view(detector: PersonDetector, camera: Camera) -> PersonDetector:
    """Return a detector for a camera: the same one, or one that also looks at the middle.

    Args:
        detector: one whose input has the same size for every camera.
        camera: camera of its images; it is wide above 90° across.
    """
    return (
        WideViewDetector(detector, camera) if camera.fx_px < _WIDE * camera.width_px else detector
    )


class WideViewDetector:
    """A detector that looks at the image and again at its middle, where people are smallest.

    A pinhole image enlarges what is far from its axis. The middle is half as wide as the image and
    has twice as many of the input's pixels for each person. People whom its edges cut are left to
    the other look. Both looks together take twice the time of one.

    Args:
        detector: the detector.
        camera: camera of its images.
    """

    def __init__(self, detector: PersonDetector, camera: Camera) -> None:
        self._detector = detector
        width, height = camera.width_px, camera.height_px
        side = round(_SHARE * width)
        left = min(max(round(camera.cx_px - 0.5 * side), 0), width - side)
        top = min(max(round(camera.cy_px - 0.5 * side), 0), max(height - side, 0))
        self._middle = np.array([left, top, left + side, min(top + side, height)])
        self._size = np.array([width, height])

    def detect(self, image_rgb: ImageRgb) -> tuple[PersonDetection, ...]:
        """Return the people in an image, highest score first; errors are those of the detector."""
        left, top, right, bottom = self._middle.tolist()
        part = np.ascontiguousarray(image_rgb[top:bottom, left:right])
        shift = np.array([left, top, left, top], dtype=float)
        fine = [
            PersonDetection(each.box_xyxy_px + shift, each.score)
            for each in self._detector.detect(part)
        ]
        kept = [each for each in fine if not self._is_cut(each.box_xyxy_px)]
        kept += [
            each
            for each in self._detector.detect(image_rgb)
            if not any(_same(each.box_xyxy_px, other.box_xyxy_px) for other in kept)
        ]
        return tuple(sorted(kept, key=lambda each: -each.score))

    def _is_cut(self, box: FloatArray) -> bool:
        """Return whether a box reaches an edge of the middle that is none of the image."""
        middle = self._middle
        low = (box[:2] < middle[:2] + _EDGE_PX) & (middle[:2] > 0)
        high = (box[2:] > middle[2:] - _EDGE_PX) & (middle[2:] < self._size)
        return bool(low.any() or high.any())


def _same(coarse: FloatArray, fine: FloatArray) -> bool:
    """Return whether a box of the whole image shows the person of one of the middle, or a part."""
    return common_area(coarse, fine) > _SAME_SHARE * area(coarse)
