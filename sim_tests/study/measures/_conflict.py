"""Surrogate measures of conflict: time to collision and post-encroachment time.

The robot is the convex hull of its footprint, and a person is a disc.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

if TYPE_CHECKING:
    from ...crossing import CrossingResult


# Poses are compared at this rate; a robot at 1.5 m/s moves 75 mm in between.
_COMPARED_HZ: Final = 20.0
# The nearest pairs of poses, this many, are compared again at this many instants about theirs.
_REFINED_PAIRS: Final = 8
_REFINED_INSTANTS: Final = 11
# Instants of the robot that are compared at once, to bound the memory.
_ROWS_AT_ONCE: Final = 512


class Outline:
    """The convex hull of a robot's footprint.

    Args:
        footprint_m: (M, 2) corners in the base frame, not all on one line.

    Attributes:
        reach_m: distance of the farthest corner from the base origin.
        bounds_m: (2, 2) least and largest x and y.
    """

    def __init__(self, footprint_m: FloatArray) -> None:
        # Takes long to import; processes that only read runs do without.
        from scipy.spatial import ConvexHull  # noqa: PLC0415

        corners = ConvexHull(footprint_m).vertices  # counter-clockwise
        self._corners: FloatArray = footprint_m[corners]
        edges = np.roll(self._corners, -1, axis=0) - self._corners
        self._lengths = np.hypot(edges[:, 0], edges[:, 1])
        self._along = edges / self._lengths[:, None]
        self._outward = np.stack([self._along[:, 1], -self._along[:, 0]], axis=1)
        self.bounds_m = np.stack([footprint_m.min(axis=0), footprint_m.max(axis=0)])
        self.reach_m = float(np.hypot(footprint_m[:, 0], footprint_m[:, 1]).max())

    def gap(self, points_base_m: FloatArray) -> FloatArray:
        """Return the (N, 2) vectors from the outline's nearest points to N points; 0 inside."""
        to = points_base_m[:, None, :] - self._corners
        along = np.clip(np.einsum("nmi,mi->nm", to, self._along), 0.0, self._lengths)
        gaps = to - along[..., None] * self._along
        nearest = np.argmin(np.einsum("nmi,nmi->nm", gaps, gaps), axis=1)
        gap: FloatArray = gaps[np.arange(len(gaps)), nearest]
        inside = (np.einsum("nmi,mi->nm", to, self._outward) <= 0.0).all(axis=1)
        gap[inside] = 0.0
        return gap

    def distance(self, points_base_m: FloatArray) -> FloatArray:
        """Return the (N,) distances of N points from the outline; 0 inside."""
        gap = self.gap(points_base_m)
        distance: FloatArray = np.hypot(gap[:, 0], gap[:, 1])
        return distance

    def time_to_disc(
        self, centres_base_m: FloatArray, velocities_base_mps: FloatArray, radius_m: float
    ) -> FloatArray:
        """Return the times at which moving discs first touch the outline, s; infinite if never.

        The times are exact. A disc touches the outline where its centre reaches the outline grown
        by the radius; that shape is bounded by the edges moved outwards and by circles about the
        corners. For a disc that overlaps the outline, the time is 0 if it comes nearer, else
        infinite.

        Args:
            centres_base_m: (N, 2) centres of the discs.
            velocities_base_mps: (N, 2) constant velocities relative to the outline, which does not
                turn.
            radius_m: radius of the discs, > 0.
        """
        to = centres_base_m[:, None, :] - self._corners
        velocity = velocities_base_mps[:, None, :]
        # A velocity almost parallel to an edge gives a time beyond a float: the disc never touches.
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
            # The smaller root, in the form without cancellation.
            to_corner = beyond / (approach + np.sqrt(np.maximum(discriminant, 0.0)))
            hits = (approach > 0.0) & (discriminant >= 0.0) & (beyond >= 0.0)
            to_corner = np.where(hits, to_corner, np.inf)
        time: FloatArray = np.minimum(to_edge.min(axis=1), to_corner.min(axis=1))
        gap = self.gap(centres_base_m)
        distance = np.hypot(gap[:, 0], gap[:, 1])
        closing = (np.einsum("ni,ni->n", gap, velocities_base_mps) < 0.0) | (distance == 0.0)
        return np.where(distance < radius_m, np.where(closing, 0.0, np.inf), time)


def min_time_to_collision_s(
    log: CrossingResult, body_radius_m: float = BODY_RADIUS_M
) -> float | None:
    """Return the smallest time to collision of the episode; None if there was never one.

    At each instant it is the time until outline and body disc touch if robot and person keep their
    velocities (Hayward 1972). The robot's turning is not extrapolated.
    """
    relative = log.people_odom_m - log.robot_odom_m[:, None, :]
    times = Outline(log.robot.footprint_m).time_to_disc(
        log.to_base(relative).reshape(-1, 2),
        (log.to_base(log.people_odom_mps) - log.velocity_base_mps[:, None, :]).reshape(-1, 2),
        body_radius_m,
    )
    smallest = float(np.fmin.reduce(times, initial=np.inf))
    return smallest if np.isfinite(smallest) else None


def post_encroachment_s(log: CrossingResult, body_radius_m: float = BODY_RADIUS_M) -> float | None:
    """Return the smallest post-encroachment time; None if robot and people shared no place.

    It is the time between one of robot and person leaving a place and the other entering it (Allen,
    Shin and Cooper 1978), the smallest over all places and people. A place lies in the robot's
    outline at t and in the body disc at t' exactly if the two overlap. The result is therefore the
    smallest |t − t'| over overlapping poses. Poses are compared every 0.05 s and, about the nearest
    of them, every 0.01 s on straight lines in between. 0 means that the outline and the disc
    overlapped at one instant. The body is slimmer than the disc and may not have been touched.
    """
    outline, step = Outline(log.robot.footprint_m), 1
    if len(log.t_s) > 1:
        step = max(round(1.0 / (_COMPARED_HZ * float(np.median(np.diff(log.t_s))))), 1)
    smallest = np.inf
    for person in range(log.people_odom_m.shape[1]):
        paths = _Paths(log, person, outline, body_radius_m)
        t_s = log.t_s[::step]
        for first in range(0, len(t_s), _ROWS_AT_ONCE):
            robot_s = t_s[first : first + _ROWS_AT_ONCE]
            robot_row, person_row, apart_s = paths.overlaps(robot_s, t_s, smallest)
            for best in np.argsort(apart_s, kind="stable")[:_REFINED_PAIRS]:
                fine = paths.overlaps(
                    paths.around(robot_s[robot_row[best]]),
                    paths.around(t_s[person_row[best]]),
                    smallest,
                )[2]
                smallest = min(smallest, float(apart_s[best]), float(fine.min(initial=np.inf)))
    return smallest if np.isfinite(smallest) else None


class _Paths:
    """The paths of the robot and of one person, interpolated at any instant."""

    def __init__(
        self, log: CrossingResult, person: int, outline: Outline, body_radius_m: float
    ) -> None:
        self._t_s = log.t_s
        self._heading_rad = np.unwrap(log.heading_odom_rad)
        self._robot_m = log.robot_odom_m
        self._person_m = log.people_odom_m[:, person]
        self._outline = outline
        self._radius_m = body_radius_m

    def around(self, t_s: float) -> FloatArray:
        """Return finely spaced instants about one instant."""
        fine = t_s + np.linspace(-1.0, 1.0, _REFINED_INSTANTS) / _COMPARED_HZ
        inside: FloatArray = fine[(fine >= self._t_s[0]) & (fine <= self._t_s[-1])]
        return inside

    def overlaps(
        self, robot_s: FloatArray, person_s: FloatArray, less_than_s: float
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
        """Return the rows of both instants whose poses overlap, and the time between them."""
        robot, person = self._at(robot_s, self._robot_m), self._at(person_s, self._person_m)
        offsets = person[None, :, :] - robot[:, None, :]
        apart_s = np.abs(person_s[None, :] - robot_s[:, None])
        reach = self._outline.reach_m + self._radius_m
        near = np.einsum("nki,nki->nk", offsets, offsets) < reach**2
        row, column = np.nonzero(near & (apart_s < less_than_s))
        offsets_base = _to_base(
            offsets[row, column], np.interp(robot_s, self._t_s, self._heading_rad)[row]
        )
        overlap = self._outline.distance(offsets_base) < self._radius_m
        row, column = row[overlap], column[overlap]
        return row, column, apart_s[row, column]

    def _at(self, t_s: FloatArray, path_m: FloatArray) -> FloatArray:
        return np.stack([np.interp(t_s, self._t_s, path_m[:, axis]) for axis in (0, 1)], axis=1)


def _to_base(vectors_odom: FloatArray, heading_odom_rad: FloatArray) -> FloatArray:
    """Return (N, 2) vectors, each in the axes of its own base frame."""
    cos, sin = np.cos(heading_odom_rad), np.sin(heading_odom_rad)
    x, y = vectors_odom.T
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1)
