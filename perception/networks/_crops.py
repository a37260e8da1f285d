"""People cut out of a picture for a network, and points of the cut-outs back in the picture."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, ImageRgb

#: How much larger than the box the crop is, in RTMPose's configs and ours.
BOX_PADDING: Final = 1.25
# Beyond this the window, copied where it reaches over the picture's edge, would cost more memory
# than it saves time.
_MAX_RESIZED: Final = 8.0


class PersonCrops:
    """Where crops of one size lie in a picture.

    A crop shows its box enlarged by the padding, then widened or heightened to the crop's aspect.
    Crop and picture both count pixel centres as whole numbers, as keypoints do, and
    ``u_image = origin + step · u_crop``. As in OpenMMLab's ``TopdownAffine``, the crop's pixel
    (width / 2, height / 2) lies on the middle of the box.

    A crop that is up to eight times smaller than what it shows is cut along whole pixels of the
    picture (a shift of half a pixel at most, which origin and step hold exactly): ``cv2.resize``
    does that at a third of the cost of ``cv2.warpAffine``, which cuts the others.

    Args:
        boxes_xyxy_px: (N, 4) boxes that count pixels from the picture's corner.
        height_px: of a crop.
        width_px: of a crop.
        padding: factor on the box, > 0.

    Attributes:
        origin_px: (N, 2) the picture's point on which the crop's pixel (0, 0) lies.
        step_px: (N, 2) pixels of the picture a pixel of the crop, along x and y, alike but for the
            rounding to whole pixels; 0 for a box without an extent.
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
        # Half a pixel lies between counting from the corner and counting centres.
        origin = 0.5 * (low + high) - 0.5 - 0.5 * step * size
        self._whole = (step[:, 0] >= 1.0) & (step[:, 0] <= _MAX_RESIZED)
        # Pixel centre u_crop of a resized window lies at left + (u_crop + 1/2) · step − 1/2.
        self._corner_px = np.rint(origin + 0.5 - 0.5 * step)
        self._window_px = np.rint(step * size)
        whole = self._whole[:, None]
        self.step_px: FloatArray = np.where(whole, self._window_px / size, step)
        snapped = self._corner_px + 0.5 * self.step_px - 0.5
        self.origin_px: FloatArray = np.where(whole, snapped, origin)

    def inside(self, image_rgb: ImageRgb) -> NDArray[np.bool_]:
        """(N,) whether the crop shows any of the picture (H, W, 3)."""
        extent = np.array([image_rgb.shape[1], image_rgb.shape[0]])
        far = self.origin_px + self.step_px * (np.array(self._size_px) - 1)
        shows = (far > -0.5) & (self.origin_px < extent - 0.5) & (self.step_px > 0.0)
        return np.asarray(shows.all(axis=1))

    def cut(self, image_rgb: ImageRgb, row: int, out: NDArray[np.uint8]) -> None:
        """Write crop ``row`` into ``out`` (height, width, 3); it is black beyond the picture.

        The crop must show some of the picture: see :meth:`inside`.
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
        """Points (n, K, 2) of the crops ``rows`` (n,) to the picture."""
        return np.asarray(self.origin_px[rows, None] + self.step_px[rows, None] * points_crop_px)

    def _window(self, image_rgb: ImageRgb, row: int) -> NDArray[np.uint8]:
        """What crop ``row`` shows, in the picture's own pixels."""
        height, width = image_rgb.shape[:2]
        left, top = map(int, self._corner_px[row].tolist())
        across, down = map(int, self._window_px[row].tolist())
        right, bottom = left + across, top + down
        part = image_rgb[max(top, 0) : min(bottom, height), max(left, 0) : min(right, width)]
        beyond = max(-top, 0), max(bottom - height, 0), max(-left, 0), max(right - width, 0)
        if not any(beyond):
            return part
        return np.asarray(cv2.copyMakeBorder(part, *beyond, cv2.BORDER_CONSTANT, value=(0, 0, 0)))
