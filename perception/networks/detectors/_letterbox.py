"""Letterboxing: an image of any size scaled into a network's input, and boxes mapped back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ...arrays import FloatArray, ImageRgb
from .._images import PixelFormat

_PADDING_GREY: Final = 114


@dataclass(frozen=True, slots=True)
class LetterboxGeometry:
    """Position and scale of an image of one size in the network's input.

    Coordinates of image and input both count from the corner, as boxes do. ``cv2.resize`` maps the
    image's corners onto the corners of the scaled image, so
    x_image = (x_input − left) · width_image / width_scaled holds exactly. The factor for y differs
    slightly, because both sides are rounded to whole pixels.

    Attributes:
        image_px: width and height of the image.
        scaled_px: width and height of the scaled image in the input.
        corner_px: left and top of the scaled image in the input.
    """

    image_px: tuple[int, int]
    scaled_px: tuple[int, int]
    corner_px: tuple[int, int]

    @classmethod
    def of(
        cls, image_px: tuple[int, int], input_px: tuple[int, int], *, centred: bool
    ) -> LetterboxGeometry:
        """Return the geometry of the largest scaled image that fits; sizes are (width, height)."""
        scale = min(available / side for available, side in zip(input_px, image_px, strict=True))
        width, height = (
            min(max(round(side * scale), 1), available)
            for side, available in zip(image_px, input_px, strict=True)
        )
        # An odd pixel of padding goes to the right or bottom, as in Ultralytics' LetterBox.
        left, top = (input_px[0] - width) // 2, (input_px[1] - height) // 2
        return cls(image_px, (width, height), (left, top) if centred else (0, 0))

    def to_image(self, boxes_xyxy: NDArray[Any]) -> FloatArray:
        """Map boxes (N, 4) from the input to the image and clip them to the image."""
        factor = np.divide(self.image_px, self.scaled_px)
        boxes = (boxes_xyxy.astype(np.float64) - self.corner_px * 2) * np.tile(factor, 2)
        return np.asarray(np.clip(boxes, 0.0, self.image_px * 2))


class Letterbox:
    """Network input that is filled with one image at a time, padded with grey (114).

    Every image is written into the same array: run the network before the next :meth:`fill`.

    Args:
        height_px: height of the input.
        width_px: width of the input.
        pixels: pixel format of the network.
        centred: True puts the image into the middle, False at the top left.
    """

    def __init__(
        self, height_px: int, width_px: int, pixels: PixelFormat, *, centred: bool
    ) -> None:
        self._input_px = (width_px, height_px)
        self._pixels = pixels
        self._centred = centred
        self._blob = pixels.empty_blob(1, height_px, width_px)
        self._geometry: LetterboxGeometry | None = None
        self._scaled = np.empty((1, 1, 3), np.uint8)

    def fill(self, image_rgb: ImageRgb) -> tuple[NDArray[Any], LetterboxGeometry]:
        """Scale ``image_rgb`` (H, W, 3) bilinearly into the input; return input and geometry.

        The input has the shape (1, 3, height, width).
        """
        size = (image_rgb.shape[1], image_rgb.shape[0])
        geometry = self._geometry
        if geometry is None or geometry.image_px != size:
            geometry = self._prepare(size)
        scaled = image_rgb
        if geometry.scaled_px != size:
            scaled = self._scaled
            cv2.resize(image_rgb, geometry.scaled_px, dst=scaled, interpolation=cv2.INTER_LINEAR)
        (width, height), (left, top) = geometry.scaled_px, geometry.corner_px
        self._pixels.write(scaled, self._blob[0, :, top : top + height, left : left + width])
        return self._pixels.as_input(self._blob), geometry

    def _prepare(self, size: tuple[int, int]) -> LetterboxGeometry:
        """Write the padding for images of a new size; it is kept until the size changes again."""
        geometry = LetterboxGeometry.of(size, self._input_px, centred=self._centred)
        width, height = self._input_px
        self._pixels.write(np.full((height, width, 3), _PADDING_GREY, np.uint8), self._blob[0])
        self._scaled = np.empty((geometry.scaled_px[1], geometry.scaled_px[0], 3), np.uint8)
        self._geometry = geometry
        return geometry
