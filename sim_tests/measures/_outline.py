"""The robot's outline against discs: how far, and how long until they touch."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from perception.arrays import FloatArray


class Outline:
    """The convex hull of a footprint.

    Args:
        footprint_m: (M, 2) corners in the base frame, not all on one line.

    Attributes:
        reach_m: of the corner that is farthest from the base origin.
    """

    def __init__(self, footprint_m: FloatArray) -> None:
        self._corners: FloatArray = footprint_m[
            ConvexHull(footprint_m).vertices
        ]  # counter-clockwise
        edges = np.roll(self._corners, -1, axis=0) - self._corners
        self._lengths = np.hypot(edges[:, 0], edges[:, 1])
        self._along = edges / self._lengths[:, None]
        self._outward = np.stack([self._along[:, 1], -self._along[:, 0]], axis=1)
        self.reach_m = float(np.hypot(footprint_m[:, 0], footprint_m[:, 1]).max())

    def gap(self, points_base_m: FloatArray) -> FloatArray:
        """(N, 2) vector from the nearest point of the outline to each of N points; 0 inside."""
        to = points_base_m[:, None, :] - self._corners
        along = np.clip(np.einsum("nmi,mi->nm", to, self._along), 0.0, self._lengths)
        gaps = to - along[..., None] * self._along
        nearest = np.argmin(np.einsum("nmi,nmi->nm", gaps, gaps), axis=1)
        gap: FloatArray = gaps[np.arange(len(gaps)), nearest]
        inside = (np.einsum("nmi,mi->nm", to, self._outward) <= 0.0).all(axis=1)
        gap[inside] = 0.0
        return gap

    def distance(self, points_base_m: FloatArray) -> FloatArray:
        """(N,) distance of N points; 0 inside."""
        gap = self.gap(points_base_m)
        distance: FloatArray = np.hypot(gap[:, 0], gap[:, 1])
        return distance

    def time_to_disc(
        self, centres_base_m: FloatArray, velocities_base_mps: FloatArray, radius_m: float
    ) -> FloatArray:
        """When discs at constant velocities first touch the outline, s; infinite if never.

        Exact: the disc's centre against the outline grown by the radius, which is bounded by the
        edges moved outwards and circles about the corners. Discs that overlap the outline give 0
        if they come nearer, and infinity if they do not.

        Args:
            centres_base_m: (N, 2).
            velocities_base_mps: (N, 2) relative to the outline, which does not turn.
            radius_m: > 0 of the discs.

        Returns:
            (N,).
        """
        to = centres_base_m[:, None, :] - self._corners
        velocity = velocities_base_mps[:, None, :]
        # A velocity all but along an edge reaches it after longer than a float can say: never.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            outwards = np.einsum("nki,mi->nm", velocity, self._outward)
            to_edge = (radius_m - np.einsum("nmi,mi->nm", to, self._outward)) / outwards
            met = np.einsum("nmi,mi->nm", to + to_edge[..., None] * velocity, self._along)
            hits = (outwards < 0.0) & (to_edge >= 0.0) & (met >= 0.0) & (met <= self._lengths)
            to_edge = np.where(hits, to_edge, np.inf)

            # |to + velocity t| = radius
            speed2 = np.einsum("nki,nki->nk", velocity, velocity)
            approach = -np.einsum("nmi,nki->nm", to, velocity)
            beyond = np.einsum("nmi,nmi->nm", to, to) - radius_m**2
            discriminant = approach**2 - speed2 * beyond
            # The nearer root in the form that loses no digits.
            to_corner = beyond / (approach + np.sqrt(np.maximum(discriminant, 0.0)))
            hits = (approach > 0.0) & (discriminant >= 0.0) & (beyond >= 0.0)
            to_corner = np.where(hits, to_corner, np.inf)
        time: FloatArray = np.minimum(to_edge.min(axis=1), to_corner.min(axis=1))
        gap = self.gap(centres_base_m)
        distance = np.hypot(gap[:, 0], gap[:, 1])
        closing = (np.einsum("ni,ni->n", gap, velocities_base_mps) < 0.0) | (distance == 0.0)
        return np.where(distance < radius_m, np.where(closing, 0.0, np.inf), time)
