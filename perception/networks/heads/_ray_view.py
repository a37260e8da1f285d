"""Looking along a ray: the camera turned towards a head, so that no wide lens stretches it.

A wide lens draws whatever stands at its side long: by 1 / cos² of the angle off the axis outwards
and 1 / cos across. A crop that undoes this looks as if the camera had been turned to the head.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..._camera import Camera
from ...arrays import FloatArray

_HALF_TURN: Final = np.array([-1.0, -1.0, 1.0])
_TURNED: Final = np.diag(_HALF_TURN)
# Half the distance over which a distorted lens is differentiated, as a tangent: about a head's.
_STEP: Final = 0.03


def ray_axes(rays: FloatArray) -> FloatArray:
    """Rotations (N, 3, 3) from ray axes to the camera for rays (N, 2) given as x/z and y/z.

    The smallest rotation that takes the camera's z axis onto the ray: its third column is the ray.
    """
    unit = np.ones((len(rays), 3))
    unit[:, :2] = rays
    unit /= np.sqrt((unit * unit).sum(axis=1))[:, None]
    # A half turn about z, which leaves z where it is, then one about the bisector of z and ray.
    unit[:, 2] += 1.0
    bisector = unit[:, :, None]
    return np.asarray(
        bisector * (bisector.swapaxes(1, 2) * (_HALF_TURN / bisector[:, 2:])) - _TURNED
    )


def ray_stretch(axes: FloatArray) -> FloatArray:
    """How the image plane z = 1 stretches the plane across each ray: (N, 2, 2).

    Args:
        axes: (N, 3, 3) from :func:`ray_axes`.

    Returns:
        The derivative of x/z and y/z by the tangents along the first two ray axes, at the ray; the
        unit matrix on the optical axis.
    """
    ray = axes[:, :, 2]
    across = axes[:, :2, :2] - (ray[:, :2] / ray[:, 2:])[:, :, None] * axes[:, 2:, :2]
    return np.asarray(across / ray[:, 2:, None])


def focal_px(camera: Camera) -> float:
    """The focal length of the cameras that look along rays: the geometric mean of the lens's."""
    return float(np.sqrt(camera.fx_px * camera.fy_px))


def looking_at(camera: Camera, centre_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Turn the camera towards some pixels.

    Args:
        camera: with or without distortion.
        centre_px: (N, 2).

    Returns:
        Ray axes (N, 3, 3), and the matrices (N, 2, 2) that take pixels of the turned camera, whose
        focal length is :func:`focal_px`, to pixels of the image: exact at the centre, to first
        order around it.
    """
    rays = camera.normalise(centre_px)
    axes = ray_axes(rays)
    stretch = ray_stretch(axes)
    f = focal_px(camera)
    if camera.distortion is None:
        return axes, stretch * (np.array([[camera.fx_px], [camera.fy_px]]) / f)
    steps = _STEP * stretch.swapaxes(1, 2)
    ends = np.ones((len(rays), 2, 2, 3))
    ends[:, 0, :, :2] = rays[:, None] + steps
    ends[:, 1, :, :2] = rays[:, None] - steps
    pixels = camera.project(ends.reshape(-1, 3)).reshape(-1, 2, 2, 2)
    return axes, np.asarray((pixels[:, 0] - pixels[:, 1]).swapaxes(1, 2) / (2.0 * _STEP * f))
