"""The robot's outline against discs: how far, and how long until they touch.

Surrogates of conflict: time to collision and post-encroachment time.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._trace import Trace


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


# Poses are compared at so many instants a second; a robot at 1.5 m/s moves 75 mm in between.
_COMPARED_HZ: Final = 20.0
# So many of the nearest pairs are looked at again at so many instants about theirs.
_REFINED: Final = 8
_FINER: Final = 11
_ROWS_AT_ONCE: Final = 512


def min_time_to_collision_s(
    trace: Trace, outline: Outline, body_radius_m: float = BODY_RADIUS_M
) -> float | None:
    """The smallest time to collision of the episode; None if no course ever led to one.

    At each instant: when outline and body disc would touch if robot and person kept their
    velocities (Hayward 1972). The robot's turning is not extrapolated.
    """
    if not trace.people:
        return None
    relative = trace.people_odom_m - trace.robot_odom_m[:, None, :]
    ahead = np.stack([np.cos(trace.heading_odom_rad), np.sin(trace.heading_odom_rad)], axis=1)
    velocity = trace.people_odom_mps - (trace.speed_mps[:, None] * ahead)[:, None, :]
    times = outline.time_to_disc(
        trace.to_base(relative).reshape(-1, 2),
        trace.to_base(velocity).reshape(-1, 2),
        body_radius_m,
    )
    smallest = float(times.min())
    return smallest if np.isfinite(smallest) else None


def post_encroachment_s(
    trace: Trace, outline: Outline, body_radius_m: float = BODY_RADIUS_M
) -> float | None:
    """The smallest post-encroachment time; None if no place was used by both.

    The time between one of robot and person leaving a place and the other entering it (Allen, Shin
    and Cooper 1978), the smallest over all places and people. A place lies in the robot's outline
    at t and in the body disc at t' exactly if the two overlap, so it is the smallest |t − t'| over
    overlapping poses. Poses are compared every 0.05 s and, about the nearest of them, every 0.01 s
    on straight lines in between. 0 means that the outline and the disc overlapped at one instant,
    which a body, being slimmer, need not have felt.
    """
    step = 1
    if len(trace.t_s) > 1:
        step = max(round(1.0 / (_COMPARED_HZ * float(np.median(np.diff(trace.t_s))))), 1)
    smallest = np.inf
    for person in range(trace.people):
        paths = _Paths(trace, person, outline, body_radius_m)
        t_s = trace.t_s[::step]
        for first in range(0, len(t_s), _ROWS_AT_ONCE):
            robot_s = t_s[first : first + _ROWS_AT_ONCE]
            robot_row, person_row, apart_s = paths.overlaps(robot_s, t_s, smallest)
            for best in np.argsort(apart_s, kind="stable")[:_REFINED]:
                fine = paths.overlaps(
                    paths.around(robot_s[robot_row[best]]),
                    paths.around(t_s[person_row[best]]),
                    smallest,
                )[2]
                smallest = min(smallest, float(apart_s[best]), float(fine.min(initial=np.inf)))
    return smallest if np.isfinite(smallest) else None


class _Paths:
    """Robot's and one person's way, at any instant."""

    def __init__(self, trace: Trace, person: int, outline: Outline, body_radius_m: float) -> None:
        self._t_s = trace.t_s
        self._heading_rad = np.unwrap(trace.heading_odom_rad)
        self._robot_m = trace.robot_odom_m
        self._person_m = trace.people_odom_m[:, person]
        self._outline = outline
        self._radius_m = body_radius_m

    def around(self, t_s: float) -> FloatArray:
        """Instants about one."""
        fine = t_s + np.linspace(-1.0, 1.0, _FINER) / _COMPARED_HZ
        there: FloatArray = fine[(fine >= self._t_s[0]) & (fine <= self._t_s[-1])]
        return there

    def overlaps(
        self, robot_s: FloatArray, person_s: FloatArray, less_than_s: float
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
        """Rows of both instants whose poses overlap, and the time between them."""
        robot, person = self._at(robot_s, self._robot_m), self._at(person_s, self._person_m)
        offsets = person[None, :, :] - robot[:, None, :]
        apart_s = np.abs(person_s[None, :] - robot_s[:, None])
        reach = self._outline.reach_m + self._radius_m
        near = np.einsum("nki,nki->nk", offsets, offsets) < reach**2
        row, column = np.nonzero(near & (apart_s < less_than_s))
        turned = _turned(
            offsets[row, column], np.interp(robot_s, self._t_s, self._heading_rad)[row]
        )
        kept = self._outline.distance(turned) < self._radius_m
        row, column = row[kept], column[kept]
        return row, column, apart_s[row, column]

    def _at(self, t_s: FloatArray, path_m: FloatArray) -> FloatArray:
        return np.stack([np.interp(t_s, self._t_s, path_m[:, axis]) for axis in (0, 1)], axis=1)


def _turned(vectors_odom: FloatArray, heading_odom_rad: FloatArray) -> FloatArray:
    """(N, 2) vectors in the axes of a base frame each."""
    cos, sin = np.cos(heading_odom_rad), np.sin(heading_odom_rad)
    x, y = vectors_odom.T
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1)
