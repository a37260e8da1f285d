"""The crops about the heads of one frame, each as a camera turned to that head would see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._camera import Camera
from .._protocols import ImageRgb
from ..arrays import FloatArray
from ._head_crop import crop_to_image, head_crop
from ._ray_view import focal_px, looking_at


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
