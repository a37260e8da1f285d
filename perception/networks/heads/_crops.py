"""Square crops about a head, cut out the same way for training and for use.

The crops about the heads of one frame, each as a camera turned to that head would see it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..._camera import Camera
from ...arrays import FloatArray, ImageRgb, finite_array, finite_number
from ._ray_view import focal_px, looking_at

#: What stands for the world outside the image, in every channel.
OUTSIDE_GREY: Final = 114

# Beyond this factor the bilinear samples lie more than a pixel apart; averaged by the dozen they
# still do not alias visibly, and a face that fills the picture costs no more than this.
_MAX_OVERSAMPLING: Final = 8


def head_crop(
    image_rgb: NDArray[np.uint8],
    centre_px: ArrayLike,
    side_px: float,
    size: int = 64,
    stretch: FloatArray | None = None,
) -> NDArray[np.uint8]:
    """Cut a square out of an image and bring it to ``size`` × ``size`` pixels.

    Enlarging is bilinear. Shrinking averages over the area of each new pixel (bilinear samples at
    most a pixel apart, then OpenCV's ``INTER_AREA``), so that a near face does not alias. Nothing
    is rounded to whole pixels. The crop's corner lies at ``centre_px − side_px / 2``; column ``j``
    of the result has its centre at ``(j + 0.5) / size`` of the side from there. A stretch makes
    the square a parallelogram of the image, by which a wide lens draws it.

    Args:
        image_rgb: (H, W, 3).
        centre_px: (2,) where the middle of the crop lies, in the coordinates of
            :meth:`perception.Camera.project` (pixel centres at whole numbers). It may lie outside.
        side_px: length of its side in pixels of the image, > 0.
        size: pixels along a side of the result.
        stretch: (2, 2) from :func:`._ray_view.looking_at`; None is none.

    Returns:
        (size, size, 3), grey (:data:`OUTSIDE_GREY`) outside the image.

    Raises:
        PerceptionError: for a centre or a side that is no such number.
    """
    u, v = finite_array("centre_px", centre_px, (2,)).tolist()
    side = finite_number("side_px", side_px, minimum=0.0, exclusive_minimum=True)
    height, width = image_rgb.shape[:2]
    xx, xy, yx, yy = (1.0, 0.0, 0.0, 1.0) if stretch is None else stretch.ravel().tolist()
    wide, high = side * (abs(xx) + abs(xy)), side * (abs(yx) + abs(yy))
    if not (u + 0.5 * wide > -1.0 and u - 0.5 * wide < width + 1.0) or not (
        v + 0.5 * high > -1.0 and v - 0.5 * high < height + 1.0
    ):
        return np.full((size, size, 3), OUTSIDE_GREY, np.uint8)
    oversampling = min(max(math.ceil(max(wide, high) / size - 1e-9), 1), _MAX_OVERSAMPLING)
    fine = size * oversampling
    step = side / fine
    # Column j of the fine grid lies at (j + ½) · step from the crop's corner.
    first = 0.5 * (step - side)
    grid_to_image = np.array(
        [
            [step * xx, step * xy, u + first * (xx + xy)],
            [step * yx, step * yy, v + first * (yx + yy)],
        ]
    )
    crop = cv2.warpAffine(
        image_rgb,
        grid_to_image,
        (fine, fine),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(OUTSIDE_GREY,) * 3,
    )
    if oversampling > 1:
        crop = cv2.resize(crop, (size, size), interpolation=cv2.INTER_AREA)
    return np.asarray(crop, dtype=np.uint8)


def crop_to_image(
    points: FloatArray,
    centre_px: FloatArray,
    side_px: float | FloatArray,
    stretch: FloatArray | None = None,
) -> FloatArray:
    """Map (…, 2) points in units of a crop's side, (0, 0) its top-left corner, to pixels.

    ``stretch`` (…, 2, 2) is that of :func:`head_crop`.
    """
    across = (points - 0.5) * side_px
    if stretch is not None:
        across = (stretch @ across[..., None])[..., 0]
    return np.asarray(centre_px + across, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class HeadCrops:
    """Square crops of N heads, seen along the rays through their middles.

    Attributes:
        camera: that took the picture.
        centre_px: (N, 2) their middles in the image.
        side_px: (N,) their sides in pixels of a camera of :attr:`focal_px` along the ray.
        axes: (N, 3, 3) ray axes in the camera.
        stretch: (N, 2, 2) from those pixels to the image's.
    """

    camera: Camera
    centre_px: FloatArray
    side_px: FloatArray
    axes: FloatArray
    stretch: FloatArray

    @classmethod
    def of_sizes(cls, camera: Camera, centre_px: FloatArray, size_px: FloatArray) -> HeadCrops:
        """Crops that measure about ``size_px`` (N,) in the image."""
        axes, stretch = looking_at(camera, centre_px)
        area = stretch[:, 0, 0] * stretch[:, 1, 1] - stretch[:, 0, 1] * stretch[:, 1, 0]
        return cls(camera, centre_px, size_px / np.sqrt(np.abs(area)), axes, stretch)

    @property
    def focal_px(self) -> float:
        """Focal length of the cameras that look along the rays."""
        return focal_px(self.camera)

    def only(self, rows: NDArray[np.intp]) -> HeadCrops:
        """Some of the crops."""
        return HeadCrops(
            self.camera,
            self.centre_px[rows],
            self.side_px[rows],
            self.axes[rows],
            self.stretch[rows],
        )

    def moved(self, rows: NDArray[np.intp], to: FloatArray, factor: FloatArray) -> HeadCrops:
        """Crops of which some have their middle at ``to`` (K, 2), in units of their own side.

        Their sides are multiplied by ``factor`` (K,).
        """
        centre, side = self.centre_px.copy(), self.side_px.copy()
        axes, stretch = self.axes.copy(), self.stretch.copy()
        centre[rows] = crop_to_image(to, centre[rows], side[rows, None], stretch[rows])
        side[rows] *= factor
        axes[rows], stretch[rows] = looking_at(self.camera, centre[rows])
        return HeadCrops(self.camera, centre, side, axes, stretch)

    def cut(self, image_rgb: ImageRgb, row: int, size: int) -> NDArray[np.uint8]:
        """Cut one crop of ``size`` × ``size`` pixels out of the picture."""
        return head_crop(
            image_rgb, self.centre_px[row], float(self.side_px[row]), size, self.stretch[row]
        )
