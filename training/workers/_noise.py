"""Noise and shade over space, which make paint look like cloth."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.ndimage import binary_closing, binary_fill_holes, gaussian_filter, map_coordinates

from ._piece import Array

_LATTICE: Final = 32


class Noise:
    """Smooth random values over space, the same for the same generator."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._values = rng.standard_normal((_LATTICE, _LATTICE, _LATTICE))

    def __call__(self, points_m: Array, wavelength_m: float | tuple[float, float, float]) -> Array:
        """Return zero-mean noise (N,) of unit spread with features of about ``wavelength_m``."""
        at = (points_m / np.asarray(wavelength_m) * 2.0).T % _LATTICE
        values: Array = map_coordinates(self._values, at, order=1, mode="grid-wrap")
        return values * 1.7

    def layered(self, points_m: Array, wavelength_m: float, octaves: int = 3) -> Array:
        """Return noise summed over halving wavelengths and amplitudes."""
        total = np.zeros(len(points_m))
        for octave in range(octaves):
            total += self(points_m + 0.37 * octave, wavelength_m / 2**octave) / 2**octave
        return total / 1.3


class Shade:
    """Ambient light at a place, from how much of the body surrounds it."""

    _CELL_M: Final = 0.01

    def __init__(self, points_m: Array) -> None:
        self._low = points_m.min(axis=0) - 0.2
        cells = np.ceil((points_m.max(axis=0) + 0.2 - self._low) / self._CELL_M).astype(int)
        solid = np.zeros(cells, dtype=bool)
        solid[tuple(((points_m - self._low) / self._CELL_M).astype(int).T)] = True
        solid = binary_fill_holes(binary_closing(solid, iterations=2))
        filled = solid.astype(np.float32)
        self._near = gaussian_filter(filled, 0.025 / self._CELL_M)
        self._far = gaussian_filter(filled, 0.06 / self._CELL_M)

    def __call__(self, points_m: Array, normals: Array) -> Array:
        """Return factors (N,) on the colour: 1 in the open, less in folds and between limbs."""
        near = self._at(self._near, points_m + 0.022 * normals)
        far = self._at(self._far, points_m + 0.060 * normals)
        light = 1.0 - 1.0 * np.maximum(near - 0.20, 0.0) - 1.1 * np.maximum(far - 0.12, 0.0)
        shade: Array = np.clip(light, 0.45, 1.0)
        return shade

    def _at(self, grid: Array, points_m: Array) -> Array:
        cells = ((points_m - self._low) / self._CELL_M - 0.5).T
        values: Array = map_coordinates(grid, cells, order=1, mode="nearest")
        return values
