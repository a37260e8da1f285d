"""Crops of people for a pose network, and the way back from crop to image."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ...arrays import FloatArray, ImageRgb

#: Size of the crop relative to the box, as in RTMPose's configs.
BOX_PADDING: Final = 1.25
# Largest reduction that cv2.resize does. The window of a larger one, which is copied where it
# reaches beyond the image's border, would cost more memory than the time saved is worth.
_MAX_RESIZED: Final = 8.0


class PersonCrops:
    """Geometry of crops of one size in an image.

    A crop shows its box, enlarged by the padding and then extended to the crop's aspect ratio. In
    crop and image, pixel centres lie at whole numbers, as for keypoints, and
    ``u_image = origin + step · u_crop``. As in OpenMMLab's ``TopdownAffine``, the crop's pixel
    (width / 2, height / 2) lies at the middle of the box.

    A crop that is up to eight times smaller than the part of the image it shows is cut along whole
    pixels of the image. This shifts it by half a pixel at most; origin and step include the shift.
    ``cv2.resize`` cuts such crops in a third of the time of ``cv2.warpAffine``, which cuts the
    others.

    Args:
        boxes_xyxy_px: (N, 4) boxes; coordinates count from the image's corner.
        height_px: height of a crop.
        width_px: width of a crop.
        padding: factor on the box, > 0.

    Attributes:
        origin_px: (N, 2) image coordinates of the crop's pixel (0, 0).
        step_px: (N, 2) pixels of the image per pixel of the crop, along x and y. Both are equal
            but for the rounding to whole pixels; 0 for a box without extent.
    """

    def __init__(
        self,
        boxes_xyxy_px: Any,
        height_px: int,
        width_px: int,
        padding: float = BOX_PADDING,
    ) -> None:
        boxes = np.asarray(boxes_xyxy_px, dtype=np.float64).reshape(-1, 4)
        low, high = boxes[:, :2], boxes[:, 2:]
        size = np.array([width_px, height_px], dtype=np.float64)
        self._size_px = (width_px, height_px)
        shares = padding * (high - low) / size
        step = np.maximum(shares[:, :1], shares[:, 1:])
        # Coordinates from the corner and coordinates of pixel centres differ by half a pixel.
        origin = 0.5 * (low + high) - 0.5 - 0.5 * step * size
        self._whole = (step[:, 0] >= 1.0) & (step[:, 0] <= _MAX_RESIZED)
        # In a resized window, the pixel centre u_crop lies at left + (u_crop + 1/2) · step − 1/2.
        self._corner_px = np.rint(origin + 0.5 - 0.5 * step)
        self._window_px = np.rint(step * size)
        whole = self._whole[:, None]
        self.step_px: FloatArray = np.where(whole, self._window_px / size, step)
        snapped = self._corner_px + 0.5 * self.step_px - 0.5
        self.origin_px: FloatArray = np.where(whole, snapped, origin)

    def inside(self, image_rgb: ImageRgb) -> NDArray[np.bool_]:
        """Return (N,) True for each crop that shows a part of the image (H, W, 3)."""
        extent = np.array([image_rgb.shape[1], image_rgb.shape[0]])
        far = self.origin_px + self.step_px * (np.array(self._size_px) - 1)
        shows = (far > -0.5) & (self.origin_px < extent - 0.5) & (self.step_px > 0.0)
        return np.asarray(shows.all(axis=1))

    def cut(self, image_rgb: ImageRgb, row: int, out: NDArray[np.uint8]) -> None:
        """Write crop ``row`` into ``out`` (height, width, 3); pixels outside the image are black.

        The crop must show a part of the image: see :meth:`inside`.
        """
        if self._whole[row]:
            window = self._window(image_rgb, row)
            cv2.resize(window, self._size_px, dst=out, interpolation=cv2.INTER_LINEAR)
            return
        matrix = np.array(
            [
                [self.step_px[row, 0], 0.0, self.origin_px[row, 0]],
                [0.0, self.step_px[row, 1], self.origin_px[row, 1]],
            ]
        )
        cv2.warpAffine(
            image_rgb,
            matrix,
            self._size_px,
            dst=out,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(0, 0, 0),
        )

    def to_image(self, points_crop_px: NDArray[Any], rows: NDArray[np.intp]) -> FloatArray:
        """Map points (n, K, 2) of the crops ``rows`` (n,) to the image."""
        return np.asarray(self.origin_px[rows, None] + self.step_px[rows, None] * points_crop_px)

    def _window(self, image_rgb: ImageRgb, row: int) -> NDArray[np.uint8]:
        """Return the part of the image that crop ``row`` shows, in the image's pixels."""
        height, width = image_rgb.shape[:2]
        left, top = map(int, self._corner_px[row].tolist())
        across, down = map(int, self._window_px[row].tolist())
        right, bottom = left + across, top + down
        part = image_rgb[max(top, 0) : min(bottom, height), max(left, 0) : min(right, width)]
        beyond = max(-top, 0), max(bottom - height, 0), max(-left, 0), max(right - width, 0)
        if not any(beyond):
            return part
        return np.asarray(cv2.copyMakeBorder(part, *beyond, cv2.BORDER_CONSTANT, value=(0, 0, 0)))
