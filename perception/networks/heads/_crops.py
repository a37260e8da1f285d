"""Square crops around heads, cut in the same way for training and for estimation, and their blur.

A wide lens stretches what lies off its axis: by 1 / cos² of the angle to the axis in the radial
direction, and by 1 / cos across it. A crop that undoes this looks as if the camera had been turned
towards the head.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..._camera import Camera
from ...arrays import FloatArray, ImageRgb, finite_array, finite_number

_HALF_TURN: Final = np.array([-1.0, -1.0, 1.0])
_TURNED: Final = np.diag(_HALF_TURN)
# Step of the central difference for lenses with distortion, as a tangent: about half a head.
_STEP: Final = 0.03


def ray_axes(rays: FloatArray) -> FloatArray:
    """Return rotations (N, 3, 3) from ray axes to camera axes, for rays (N, 2) as x/z and y/z.

    Each is the smallest rotation that turns the camera's z axis onto the ray; its third column is
    the unit vector along the ray.
    """
    unit = np.ones((len(rays), 3))
    unit[:, :2] = rays
    unit /= np.sqrt((unit * unit).sum(axis=1))[:, None]
    # A half turn about z, which does not move z, then a half turn about the bisector of z and ray.
    unit[:, 2] += 1.0
    bisector = unit[:, :, None]
    return np.asarray(
        bisector * (bisector.swapaxes(1, 2) * (_HALF_TURN / bisector[:, 2:])) - _TURNED
    )


def ray_stretch(axes: FloatArray) -> FloatArray:
    """Return how a pinhole image stretches the plane across each ray.

    Args:
        axes: (N, 3, 3) from :func:`ray_axes`.

    Returns:
        (N, 2, 2) derivatives of x/z and y/z with respect to the tangents along the first two ray
        axes, at the ray; the identity on the optical axis.
    """
    ray = axes[:, :, 2]
    across = axes[:, :2, :2] - (ray[:, :2] / ray[:, 2:])[:, :, None] * axes[:, 2:, :2]
    return np.asarray(across / ray[:, 2:, None])


def ray_focal_px(camera: Camera) -> float:
    """Return the focal length of views along a ray: the geometric mean of fx and fy."""
    return float(np.sqrt(camera.fx_px * camera.fy_px))


def looking_at(camera: Camera, centre_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Turn a virtual camera towards each of N pixels.

    Args:
        camera: with or without distortion.
        centre_px: (N, 2).

    Returns:
        Ray axes (N, 3, 3), and matrices (N, 2, 2) from pixels of the turned camera to pixels of
        the image, relative to the centre: exact at the centre, first order around it. The focal
        length of the turned camera is :func:`ray_focal_px`.
    """
    rays = camera.normalise(centre_px, nearest=True)
    axes = ray_axes(rays)
    stretch = ray_stretch(axes)
    f = ray_focal_px(camera)
    plain = stretch * (np.array([[camera.fx_px], [camera.fy_px]]) / f)
    if camera.distortion is None:
        return axes, plain
    steps = _STEP * stretch.swapaxes(1, 2)
    ends = np.ones((len(rays), 2, 2, 3))
    ends[:, 0, :, :2] = rays[:, None] + steps
    ends[:, 1, :, :2] = rays[:, None] - steps
    pixels = camera.project(ends.reshape(-1, 3)).reshape(-1, 2, 2, 2)
    bent = (pixels[:, 0] - pixels[:, 1]).swapaxes(1, 2) / (2.0 * _STEP * f)
    # The distortion model may end within a step.
    known = np.isfinite(bent).all(axis=(1, 2), keepdims=True)
    return axes, np.asarray(np.where(known, bent, plain))


#: Value of pixels outside the image, in every channel.
OUTSIDE_GREY: Final = 114

# Limit of the cost for a face that fills the image. Beyond this factor the bilinear samples lie
# more than a pixel apart, but the average of so many samples does not alias visibly.
_MAX_OVERSAMPLING: Final = 8


def head_crop(
    image_rgb: NDArray[np.uint8],
    centre_px: ArrayLike,
    side_px: float,
    size: int = 64,
    stretch: FloatArray | None = None,
) -> NDArray[np.uint8]:
    """Cut a square out of an image and scale it to ``size`` × ``size`` pixels.

    Enlarging is bilinear. Shrinking averages over the area of each new pixel (bilinear samples at
    most a pixel apart, then OpenCV's ``INTER_AREA``), so that a near face does not alias. Nothing
    is rounded to whole pixels. The crop's corner lies at ``centre_px − side_px / 2``; the centre of
    column ``j`` of the result lies ``(j + 0.5) / size`` of the side from there. With a stretch, the
    square becomes a parallelogram in the image, as a wide lens shows it.

    Args:
        image_rgb: (H, W, 3).
        centre_px: (2,) centre of the crop in the coordinates of :meth:`perception.Camera.project`
            (pixel centres at whole numbers). It may lie outside the image.
        side_px: side of the square in pixels of the image, > 0.
        size: pixels per side of the result.
        stretch: (2, 2) from :func:`looking_at`; None for no stretch.

    Returns:
        (size, size, 3), grey (:data:`OUTSIDE_GREY`) outside the image.

    Raises:
        PerceptionError: for a centre or a side that is not finite, or a side ≤ 0.
    """
    u, v = finite_array("centre_px", centre_px, (2,)).tolist()
    side = finite_number("side_px", side_px, minimum=0.0, exclusive_minimum=True)
    height, width = image_rgb.shape[:2]
    xx, xy, yx, yy = (1.0, 0.0, 0.0, 1.0) if stretch is None else stretch.ravel().tolist()
    across, down = side * (abs(xx) + abs(xy)), side * (abs(yx) + abs(yy))
    if not (u + 0.5 * across > -1.0 and u - 0.5 * across < width + 1.0) or not (
        v + 0.5 * down > -1.0 and v - 0.5 * down < height + 1.0
    ):
        return np.full((size, size, 3), OUTSIDE_GREY, np.uint8)
    oversampling = min(max(math.ceil(max(across, down) / size - 1e-9), 1), _MAX_OVERSAMPLING)
    fine = size * oversampling
    step = side / fine
    # The centre of column j of the fine grid lies (j + ½) · step from the crop's corner.
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
    """Map points (…, 2) of a crop to the image.

    Args:
        points: (…, 2) in units of the crop's side, (0, 0) its top left corner.
        centre_px: as in :func:`head_crop`.
        side_px: as in :func:`head_crop`.
        stretch: (…, 2, 2) as in :func:`head_crop`.
    """
    across = (points - 0.5) * side_px
    if stretch is not None:
        across = (stretch @ across[..., None])[..., 0]
    return np.asarray(centre_px + across, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class HeadCrops:
    """Square crops of the N heads of one image, seen along the rays through their centres.

    Attributes:
        camera: camera of the image.
        centre_px: (N, 2) centres in the image.
        side_px: (N,) sides in pixels of a camera of :attr:`focal_px` that looks along the ray.
        axes: (N, 3, 3) ray axes in camera axes.
        stretch: (N, 2, 2) from pixels of that camera to pixels of the image.
    """

    camera: Camera
    centre_px: FloatArray
    side_px: FloatArray
    axes: FloatArray
    stretch: FloatArray

    @classmethod
    def of_sizes(cls, camera: Camera, centre_px: FloatArray, size_px: FloatArray) -> HeadCrops:
        """Return crops that measure about ``size_px`` (N,) in the image."""
        axes, stretch = looking_at(camera, centre_px)
        area = stretch[:, 0, 0] * stretch[:, 1, 1] - stretch[:, 0, 1] * stretch[:, 1, 0]
        return cls(camera, centre_px, size_px / np.sqrt(np.abs(area)), axes, stretch)

    @property
    def focal_px(self) -> float:
        """Focal length of the views along the rays."""
        return ray_focal_px(self.camera)

    def recentred(self, rows: NDArray[np.intp], to: FloatArray, factor: FloatArray) -> HeadCrops:
        """Return all crops, of which K have new centres and sides.

        Args:
            rows: (K,) rows of the crops that change.
            to: (K, 2) new centres in units of the crop's side, (0, 0) its top left corner.
            factor: (K,) new side relative to the old.
        """
        centre, side = self.centre_px.copy(), self.side_px.copy()
        axes, stretch = self.axes.copy(), self.stretch.copy()
        centre[rows] = crop_to_image(to, centre[rows], side[rows, None], stretch[rows])
        side[rows] *= factor
        axes[rows], stretch[rows] = looking_at(self.camera, centre[rows])
        return HeadCrops(self.camera, centre, side, axes, stretch)

    def cut(self, image_rgb: ImageRgb, row: int, size: int) -> NDArray[np.uint8]:
        """Cut crop ``row`` out of the image and scale it to ``size`` × ``size`` pixels."""
        return head_crop(
            image_rgb, self.centre_px[row], float(self.side_px[row]), size, self.stretch[row]
        )


_Grey = NDArray[np.float32]

# Crops are judged at this size, where noise and the blocks of JPEG have no detail of their own.
_SIZE: Final = 32
# The outer part of a crop shows more of the scenery than of the head.
_BORDER: Final = 4
# Mean square of the second differences, in squares of grey levels, of a crop that shows nothing.
_NO_DETAIL: Final = 0.01
# Length of a crop that shows nothing, as a share of its side.
_LONGEST: Final = 0.25
# Sharp heads have lengths up to this. Beyond it, errors of the direction grow with the length,
# compared with what the network says of them.
_SHARP: Final = 0.05


def blur_lengths(crops: Iterable[NDArray[np.uint8]]) -> FloatArray:
    """Return the length by which the detail of each crop is smeared, as a share of the crop's side.

    It is the root mean square of the picture's first derivative over that of the second, both along
    the direction in which the picture changes least. Motion blur leaves only frequencies below the
    inverse of its length along its direction, so the ratio grows with it. Brightness and contrast
    do not change it. Sharp heads have about 0.042, rendered and photographed ones alike.

    Args:
        crops: N crops (size, size, 3), RGB.

    Returns:
        (N,) lengths, at most 0.25, which a crop without any detail has.
    """
    return np.array([_blur_length(crop) for crop in crops], dtype=np.float64)


def uncertainty_factors(crops: Iterable[NDArray[np.uint8]]) -> FloatArray:
    """Return the factors (N,) ≥ 1 by which blur enlarges standard deviations of the direction."""
    return np.maximum(blur_lengths(crops) / _SHARP, 1.0)


def _blur_length(crop: NDArray[np.uint8]) -> float:
    small = cv2.resize(crop, (_SIZE, _SIZE), interpolation=cv2.INTER_AREA)
    inner = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)[_BORDER:-_BORDER, _BORDER:-_BORDER]
    across, down = _differences(inner.astype(np.float32))
    # The eigenvector of the structure tensor to its smaller eigenvalue.
    xx, xy, yy = np.vdot(across, across), np.vdot(across, down), np.vdot(down, down)
    angle = 0.5 * (math.atan2(2.0 * float(xy), float(xx - yy)) + math.pi)
    u, v = math.cos(angle), math.sin(angle)
    first = u * across + v * down
    across, down = _differences(first)
    second = u * across + v * down
    detail = float(np.vdot(second, second)) / second.size
    if detail < _NO_DETAIL:
        return _LONGEST
    change = float(np.vdot(first, first)) / first.size
    # Both differences are taken across two pixels.
    return min(2.0 / _SIZE * math.sqrt(change / detail), _LONGEST)


def _differences(picture: _Grey) -> tuple[_Grey, _Grey]:
    """Return the differences across and down of the inner pixels, over two pixels each."""
    return picture[1:-1, 2:] - picture[1:-1, :-2], picture[2:, 1:-1] - picture[:-2, 1:-1]
