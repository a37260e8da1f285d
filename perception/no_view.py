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

# A picture without a pixel brighter than this is black: in it, no network finds anybody. A picture
# taken at night has lamps, or noise that reaches higher.
_BLACK_LEVEL: Final = 8
# A codec rounds one colour to levels so far from their median.
_ROUNDING_LEVELS: Final = 2
# So large a share of the pixels may differ: they are hot pixels of a covered sensor. A lit person
# far away is more than that.
_HOT_SHARE: Final = 1e-4
# Most pictures are told by about this many samples along the shorter side, in a larger share of
# which something is to be seen.
_SAMPLES: Final = 48
_SAMPLE_SHARE: Final = 0.01


def why_no_view(image_rgb: ImageRgb, before_rgb: ImageRgb | None = None) -> NoView | None:
    """Return why a picture is no view of the scene; None for a view.

    A camera that is covered, dead or frozen goes on sending pictures. That nobody is seen in them
    does not mean that nobody is there, so they must not reach a tracker:

        if why_no_view(image_rgb, before_rgb) is None:
            tracker.update(pipeline.process(image_rgb, stamp_s), stamp_s, T_odom_camera)

    A live camera has noise, so no two of its pictures are equal to the bit. Dark pictures with
    noise, and frozen ones into which a clock is drawn, count as views.

    Args:
        image_rgb: (H, W, 3) uint8.
        before_rgb: the picture before it, in an array of its own; None for the first.
    """
    step = max(min(image_rgb.shape[:2]) // _SAMPLES, 1)
    sample = image_rgb[step // 2 :: step, step // 2 :: step]
    level = np.median(sample.reshape(-1, 3), axis=0).round()
    colours: tuple[tuple[NoView, FloatArray, FloatArray], ...] = (
        ("black", np.zeros(3), np.full(3, float(_BLACK_LEVEL))),
        ("of one colour", level - _ROUNDING_LEVELS, level + _ROUNDING_LEVELS),
    )
    for reason, low, high in colours:
        # The sample decides quickly for most pictures, the whole picture for sure.
        if _lie_within(sample, low, high, _SAMPLE_SHARE) and _lie_within(
            image_rgb, low, high, _HOT_SHARE
        ):
            return reason
    if before_rgb is not None and np.array_equal(image_rgb, before_rgb):
        return FROZEN
    return None


def _lie_within(image_rgb: ImageRgb, low: FloatArray, high: FloatArray, others: float) -> bool:
    """Return whether all pixels but a share of others lie between two colours (3,)."""
    pixels = image_rgb.shape[0] * image_rgb.shape[1]
    within = cv2.countNonZero(cv2.inRange(np.ascontiguousarray(image_rgb), low, high))
    return bool(pixels - within <= others * pixels)
