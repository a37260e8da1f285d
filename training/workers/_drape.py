"""Clothes draped over a body, before they are cut."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.sparse import csr_matrix

from ._body import Body
from ._cloth import drape, smooth_normals
from ._piece import Array, smoothstep
from ._places import Places

_HEM_Z_M: Final = 0.035


class Drapes:
    """Shirt, vest and trousers as surfaces over every vertex of a body.

    Attributes:
        shirt_m: (N, 3).
        vest_m: (N, 3) over the shirt.
        trousers_m: (N, 3).
    """

    def __init__(
        self,
        body: Body,
        places: Places,
        neighbours: csr_matrix,
        *,
        slack_m: float,
        sleeve_m: float,
        neckline: Array,
    ) -> None:
        self._body, self._at, self._neighbours = body, places, neighbours
        self._normals = smooth_normals(body.vertices_m, body.triangles, neighbours)
        # At the neck cloth lies close, or it would span from shoulder to jaw.
        self._open = smoothstep(neckline, 0.015, 0.11)
        self.shirt_m = self._shirt(slack_m, sleeve_m)
        self.vest_m = self._vest()
        self.trousers_m = self._trousers()

    def _shirt(self, slack_m: float, sleeve_m: float) -> Array:
        along = self._at.along_arm_m
        loose = slack_m * (1.0 - 0.35 * smoothstep(along, 0.30, 0.50))
        if sleeve_m < 0.3:
            # A short sleeve stands off the arm.
            loose = loose + 0.007 * smoothstep(along, 0.08, sleeve_m)
        loose = 0.005 + (loose - 0.005) * (0.2 + 0.8 * self._open)
        reach = 0.002 + 0.06 * self._open
        return drape(
            self._body.vertices_m, self._normals, loose, self._neighbours, rounds=36, reach_m=reach
        )

    def _vest(self) -> Array:
        outward = smooth_normals(self.shirt_m, self._body.triangles, self._neighbours)
        gap = np.full(len(outward), 0.009)
        reach = 0.002 + 0.05 * self._open
        return drape(self.shirt_m, outward, gap, self._neighbours, rounds=30, reach_m=reach)

    def _trousers(self) -> Array:
        """Return trousers with slack that grows downwards and straight tubes about the shanks."""
        body, z = self._body, self._at.canon_m[:, 2]
        loose = 0.009 + 0.007 * smoothstep(z, 0.95, 0.55)
        surface = drape(body.vertices_m, self._normals, loose, self._neighbours, rounds=44)
        for hip in (10, 13):
            knee, ankle = body.joints_m[hip + 1], body.joints_m[hip + 2]
            rows = np.flatnonzero((body.weights[:, hip] > 0.9) & (z < 0.62))
            points = surface[rows]
            share = np.clip((knee[2] - points[:, 2]) / (knee[2] - ankle[2]), -0.3, 1.0)
            calf = points[np.abs(share - 0.3) < 0.06]
            middle = calf[:, :2].mean(axis=0)
            foot = ankle[:2] - [0.012, 0.0]
            axis = middle + np.clip(share, 0.0, 1.0)[:, None] * (foot - middle)
            out = points[:, :2] - axis
            radius = np.linalg.norm(out, axis=1)
            full = float(np.linalg.norm(calf[:, :2] - middle, axis=1).mean())
            wanted = full + (max(0.080, 0.96 * full) - full) * np.clip(share, 0.0, 1.0)
            wanted = wanted * smoothstep(share, -0.25, 0.25)
            grown = np.maximum(radius, wanted) / np.maximum(radius, 1e-6)
            points[:, :2] = axis + out * grown[:, None]
            surface[rows] = points
        for _ in range(4):
            surface = 0.5 * surface + 0.5 * (self._neighbours @ surface)
        # The lowest 15 cm widen towards the shoe.
        low, high = body.joints_m[12, 2] + 0.022, body.joints_m[12, 2] + 0.15
        share = np.clip((surface[:, 2] - low) / (high - low), 0.0, 1.0)
        stretched = _HEM_Z_M + share * (high - _HEM_Z_M)
        surface[:, 2] = np.where(surface[:, 2] < high, stretched, surface[:, 2])
        return surface
