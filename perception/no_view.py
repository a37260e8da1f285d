"""Pictures that show nothing: of a covered, dead or frozen camera."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from .arrays import FloatArray, ImageRgb

#: Why a picture is no view: it is …
NoView: TypeAlias = Literal["black", "of one colour", "the same picture as before"]
#: The reason of a frozen camera.
FROZEN: Final = "the same picture as before"

# A picture is looked at in blocks of so many pixels a side: the noise of a covered sensor averages
# out in them, and what a scene shows does not.
_BLOCK_PX: Final = 8
# A picture without a block brighter than this is black: in it, no network finds anybody. A picture
# taken at night has lamps.
_BLACK_LEVEL: Final = 8
# A codec rounds one colour to levels this near to their median. Averages of noise are as near.
_COLOUR_LEVELS: Final = 3
# Most pictures are told by their blocks before hot pixels are taken out: in a larger share of them
# something is to be seen.
_SEEN_SHARE: Final = 0.01


def why_no_view(image_rgb: ImageRgb, before_rgb: ImageRgb | None = None) -> NoView | None:
    """Return why a picture is no view of the scene; None for a view.

    A camera that is covered, dead or frozen goes on sending pictures. That nobody is seen in them
    does not mean that nobody is there, so they must not reach a tracker:

        if why_no_view(image_rgb, before_rgb) is None:
            tracker.update(pipeline.process(image_rgb, stamp_s), stamp_s, T_odom_camera)

    A live camera has noise, so no two of its pictures are equal to the bit. Noise alone is no view,
    nor are single hot pixels. Frozen pictures into which a clock is drawn count as views.

    Args:
        image_rgb: (H, W, 3) uint8.
        before_rgb: the picture before it, in an array of its own; None for the first.
    """
    blocks = _blocks(image_rgb)
    level = np.median(blocks.reshape(-1, 3), axis=0).round()
    colours: tuple[tuple[NoView, FloatArray, FloatArray], ...] = (
        ("black", np.zeros(3), np.full(3, float(_BLACK_LEVEL))),
        ("of one colour", level - _COLOUR_LEVELS, level + _COLOUR_LEVELS),
    )
    for reason, low, high in colours:
        if _lie_within(blocks, low, high, _SEEN_SHARE):
            calm = np.asarray(cv2.medianBlur(np.ascontiguousarray(image_rgb), 3), np.uint8)
            if _lie_within(_blocks(calm), low, high, 0.0):
                return reason
    if before_rgb is not None and np.array_equal(image_rgb, before_rgb):
        return FROZEN
    return None


def _blocks(image_rgb: ImageRgb) -> ImageRgb:
    """Return the mean colour of every block of a picture."""
    height, width = image_rgb.shape[:2]
    size = max(width // _BLOCK_PX, 1), max(height // _BLOCK_PX, 1)
    return np.asarray(cv2.resize(image_rgb, size, interpolation=cv2.INTER_AREA))


def _lie_within(blocks_rgb: ImageRgb, low: FloatArray, high: FloatArray, others: float) -> bool:
    """Return whether all blocks but a share of others lie between two colours (3,)."""
    count = blocks_rgb.shape[0] * blocks_rgb.shape[1]
    within = cv2.countNonZero(cv2.inRange(blocks_rgb, low, high))
    return bool(count - within <= others * count)
