"""OpenCV's lens distortion: where the model ends, and its inverse."""

from __future__ import annotations

import math
from typing import Final

import cv2
import numpy as np

from .arrays import FloatArray

_WIDEST_RAD: Final = math.radians(89.9)
_SAMPLES: Final = 2048
_ITERATIONS: Final = 6
_EXACT_PX: Final = 1e-6
_CONVERGED_PX: Final = 1e-3
# Rays at the very end of the model cannot be moved outwards to measure a scale.
_INSIDE: Final = 0.99


class LensModel:
    """The distortion of a pinhole camera, from rays x/z, y/z to pixels and back.

    Far enough from the axis, many polynomials turn back: two rays would share a pixel. There the
    model ends, and nothing beyond is an image.

    Args:
        matrix: (3, 3).
        distortion: OpenCV's coefficients.

    Attributes:
        end: radius x/z, y/z at which the model ends; the tangent of 89.9° if it does not before.
    """

    def __init__(self, matrix: FloatArray, distortion: FloatArray) -> None:
        self._matrix, self._distortion = matrix, distortion
        k1, k2, _, _, k3, k4, k5, k6 = np.append(distortion, np.zeros(8))[:8].tolist()
        radii = np.tan(np.linspace(0.0, _WIDEST_RAD, _SAMPLES))
        s = radii * radii
        with np.errstate(divide="ignore", invalid="ignore"):
            image = radii * (1.0 + s * (k1 + s * (k2 + s * k3)))
            image /= 1.0 + s * (k4 + s * (k5 + s * k6))
        turns = np.flatnonzero(~(np.diff(image) > 0.0))
        count = int(turns[0]) + 1 if len(turns) else _SAMPLES
        self._radii, self._image = radii[:count], image[:count]
        self.end = float(self._radii[-1])

    def project(self, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the pixels (N, 2) of rays (N, 2), and their derivatives (N, 2, 2)."""
        points = np.column_stack((rays, np.ones(len(rays))))
        pixels, derivatives = cv2.projectPoints(
            points, np.zeros(3), np.zeros(3), self._matrix, self._distortion
        )
        # At z = 1, a shift of the camera is a shift of the ray.
        slopes = np.asarray(derivatives[:, 3:5], dtype=np.float64).reshape(-1, 2, 2)
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2), slopes

    def rays(self, pixels_px: FloatArray, *, nearest: bool) -> FloatArray:
        """Return the rays (N, 2) of pixels (N, 2), by Newton's method.

        Pixels beyond the end of the model are NaN, or those of the end with ``nearest``.
        """
        centred = (pixels_px - self._matrix[:2, 2]) / self._matrix.diagonal()[:2]
        reach = np.hypot(*centred.T)
        radius = np.interp(reach, self._image, self._radii)
        rays = start = centred * (radius / np.maximum(reach, 1e-12))[:, None]
        off = np.zeros_like(rays)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for _ in range(_ITERATIONS):
                image, slopes = self.project(rays)
                (a, b), (c, d) = slopes.transpose(1, 2, 0)
                off = pixels_px - image
                if np.abs(off).max() < _EXACT_PX:
                    break
                step = np.stack((d * off[:, 0] - b * off[:, 1], a * off[:, 1] - c * off[:, 0]))
                moved = rays + (step / (a * d - b * c)).T
                moved = np.where(np.isfinite(moved), moved, start)
                length = np.maximum(np.hypot(*moved.T), 1e-12)
                rays = moved * np.minimum(1.0, self.end / length)[:, None]
        beyond = np.abs(off).max(axis=1) > _CONVERGED_PX
        if beyond.any():
            rays = np.where(beyond[:, None], _INSIDE * start if nearest else np.nan, rays)
        return np.asarray(rays, dtype=np.float64)
