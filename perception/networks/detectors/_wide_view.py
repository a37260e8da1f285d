"""A person detector for wide cameras, in whose images people ahead are small."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..._camera import Camera
from ..._stages import PersonDetection, PersonDetector
from ...arrays import FloatArray, ImageRgb
from ...ownership import area, common_area

# In an input of 320 pixels somebody at 5 m is 97 pixels tall at 60° across, 56 at 90° and 32 at
# 120°. A detector finds few people of less than 30.
_WIDE: Final = 0.5
# Side of the middle, as a share of the image's width.
_SHARE: Final = 0.5
# In one look a person may be several boxes, of which this share lies in the other look's one.
_SAME_SHARE: Final = 0.5
# Shares of the middle's side. A box that ends this close to an edge is cut by it. That of somebody
# whom the edge cuts may end short of it by the second.
_EDGE: Final = 0.01
_SHORT: Final = 0.125


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
        coarse = self._detector.detect(image_rgb)
        kept = [
            each
            for each in fine
            if not self._at_edge(each.box_xyxy_px, _EDGE).any()
            and not any(self._is_piece(each.box_xyxy_px, other.box_xyxy_px) for other in coarse)
        ]
        kept += [
            each
            for each in coarse
            if not any(_lies_in(each.box_xyxy_px, other.box_xyxy_px) for other in kept)
        ]
        return tuple(sorted(kept, key=lambda each: -each.score))

    def _is_piece(self, fine: FloatArray, coarse: FloatArray) -> bool:
        """Return whether a box of the middle is what an edge has left of one of the whole image."""
        crossed = self._at_edge(coarse, 0.0) & self._at_edge(fine, _SHORT)
        return bool(crossed.any()) and _lies_in(fine, coarse)

    def _at_edge(self, box: FloatArray, share: float) -> NDArray[np.bool_]:
        """Return (4,) whether a box reaches each edge of the middle that is none of the image."""
        middle, margin_px = self._middle, share * (self._middle[2] - self._middle[0])
        low = (box[:2] < middle[:2] + margin_px) & (middle[:2] > 0)
        high = (box[2:] > middle[2:] - margin_px) & (middle[2:] < self._size)
        return np.concatenate([low, high])


def _lies_in(box: FloatArray, other: FloatArray) -> bool:
    """Return whether a box of one look shows the person of one of the other, or a part."""
    return common_area(box, other) > _SAME_SHARE * area(box)
