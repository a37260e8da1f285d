"""Pictures that cameras send and people are badly found in: two views in one, infrared, grey."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from .arrays import ImageRgb
from .no_view import why_no_view

# Two views of a stereo camera are compared at this width each, without what is smooth, shifted by
# up to this share of it. Of 28 photographs no two halves are so alike (0.66 at most).
_VIEW_PX: Final = 80
_SHIFT: Final = 0.2
_ALIKE: Final = 0.68
_SMOOTH_PX: Final = 4.0
# Levels by which the colours of a grey picture differ after a codec, in 99 pixels of a hundred.
_GREY_LEVELS: Final = 6.0
# A projector's dots: brighter than all on a ring of this radius by so many levels, so many of them
# in more than this share of the blocks of this side. Textures have them, too, but not everywhere:
# up to 0.6 in 28 photographs, from 0.8 on with drawn dots of 60 to 160 levels.
_RING_PX: Final = 3
_DOT_LEVELS: Final = 20
_BLOCK_PX: Final = 40
_DOTS: Final = 4
_DOTTED_SHARE: Final = 0.7


def picture_notes(image_rgb: ImageRgb) -> tuple[str, ...]:
    """Return in words why people may be missed, or seen twice, in a camera's pictures.

    One picture of a camera is enough. There are none for an ordinary one, nor for one that shows
    nothing.

    Args:
        image_rgb: (H, W, 3) uint8.
    """
    if why_no_view(image_rgb):
        return ()
    notes = []
    grey = np.asarray(cv2.cvtColor(np.ascontiguousarray(image_rgb), cv2.COLOR_RGB2GRAY), np.uint8)
    for axis, words in ((1, "side by side"), (0, "one above the other")):
        if _are_two_views(grey, axis):
            notes.append(
                f"the picture seems to hold two views of a stereo camera, {words}: people count "
                "twice, and distances are wrong; give the topic or the half of one camera"
            )
    spread = np.ptp(image_rgb[::2, ::2].reshape(-1, 3), axis=1)
    if float(np.percentile(spread, 99.0)) <= _GREY_LEVELS:
        if _has_dots(grey):
            notes.append(
                "the picture is grey and has bright dots all over, as infrared has with a "
                "projector: one person in three is missed; switch the projector off for this "
                "stream, or give the colour camera"
            )
        else:
            notes.append("the picture is grey: the networks have learned from colour")
    return tuple(notes)


def _are_two_views(grey: ImageRgb, axis: int) -> bool:
    half = grey.shape[axis] // 2
    if half < 2:
        return False
    views = [grey.take(range(start, start + half), axis=axis) for start in (0, half)]
    height, width = views[0].shape
    size = _VIEW_PX, max(round(height * _VIEW_PX / width), 1)
    rough = []
    for view in views:
        small = cv2.resize(view, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        rough.append(small - cv2.GaussianBlur(small, (0, 0), _SMOOTH_PX))
    most = round(_SHIFT * _VIEW_PX)
    part = rough[1][:, most:-most]
    if not (part.std() > 1.0 and rough[0].std() > 1.0):
        return False
    found = cv2.matchTemplate(rough[0], np.ascontiguousarray(part), cv2.TM_CCOEFF_NORMED)
    return float(found.max()) > _ALIKE


def _has_dots(grey: ImageRgb) -> bool:
    side = 2 * _RING_PX + 1
    ring = cv2.circle(np.zeros((side, side), np.uint8), (_RING_PX, _RING_PX), _RING_PX, 1, 1)
    around = cv2.dilate(grey, ring)
    peak = cv2.dilate(grey, np.ones((3, 3), np.uint8)) == grey
    dots = (peak & (grey.astype(np.int16) - around > _DOT_LEVELS)).astype(np.float32)
    size = max(grey.shape[1] // _BLOCK_PX, 1), max(grey.shape[0] // _BLOCK_PX, 1)
    counts = cv2.resize(dots, size, interpolation=cv2.INTER_AREA) * _BLOCK_PX**2
    return float(np.mean(counts >= _DOTS)) > _DOTTED_SHARE
