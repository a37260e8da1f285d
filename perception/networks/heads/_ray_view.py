"""Views along a ray: a virtual camera turned towards a head, which undoes a wide lens's stretch.

A wide lens stretches what lies off its axis: by 1 / cos² of the angle to the axis in the radial
direction, and by 1 / cos across it. A crop that undoes this looks as if the camera had been turned
towards the head.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..._camera import Camera
from ...arrays import FloatArray

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
