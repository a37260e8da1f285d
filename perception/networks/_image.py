"""The check that every image passes before it enters a network."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import ImageRgb
from ..errors import PerceptionError

# OpenCV addresses the pixels of a warped image with 16-bit integers.
_MAX_SIDE_PX: Final = 32766


def rgb_image(image_rgb: Any) -> ImageRgb:
    """Check that ``image_rgb`` is an 8-bit RGB image and return it in a form that OpenCV can read.

    Args:
        image_rgb: (H, W, 3) uint8, with 1 to 32766 pixels per side. A view that OpenCV cannot
            read, such as ``image_bgr[..., ::-1]``, is copied.

    Raises:
        PerceptionError: for anything else; the message says what was given.
    """
    if not isinstance(image_rgb, np.ndarray):
        raise PerceptionError(
            f"image_rgb must be a uint8 array of shape (H, W, 3), got {type(image_rgb).__name__}"
        )
    if image_rgb.dtype != np.uint8 or image_rgb.ndim != 3 or image_rgb.shape[2] != 3:
        raise PerceptionError(
            "image_rgb must be uint8 RGB of shape (H, W, 3), "
            f"got {image_rgb.dtype} of shape {image_rgb.shape}{_conversion_hint(image_rgb)}"
        )
    height, width = image_rgb.shape[:2]
    if not (1 <= height <= _MAX_SIDE_PX and 1 <= width <= _MAX_SIDE_PX):
        raise PerceptionError(
            f"image_rgb must have 1 to {_MAX_SIDE_PX} pixels per side, got {width} x {height}"
        )
    if image_rgb.strides[1:] != (3, 1) or image_rgb.strides[0] < 3 * width:
        return np.ascontiguousarray(image_rgb)
    return image_rgb


def _conversion_hint(image: NDArray[Any]) -> str:
    if image.dtype == np.uint8 and image.ndim == 2:
        return "; cv2.cvtColor(image, cv2.COLOR_GRAY2RGB) makes it RGB"
    if image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 4:
        return "; drop the fourth channel"
    return ""
