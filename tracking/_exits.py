"""Exits: the places at the rim of the view where people appear and vanish, learned from tracks.

A camera's view moves with the camera, so places are kept on the floor relative to it. Somebody who
was last seen at an exit, and walks away from the camera, has left the view for good more probably
than somebody who vanishes elsewhere. People who vanish at a place and are found again are hidden
there: such a place is no exit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._table import BoolArray, TrackTable

# Events that are kept, the latest ones. A camera may be mounted otherwise the next day.
MAX_EVENTS: Final = 128
# A place is an exit if this many people have appeared or vanished around it, …
_EXIT_EVENTS: Final = 3
_EXIT_RADIUS_M: Final = 1.0
# … and at least this many times as many as have vanished there and have been found again.
_EXITS_PER_RETURN: Final = 2.0
# A gap this long, or two frames, is an absence; a shorter one is a missed detection.
_ABSENCE_S: Final = 0.5
# People who are there when the tracker starts have not appeared.
_START_S: Final = 1.0
# Nearer people are kept for as long as any other: they are beside the robot, and may come back.
_MIN_DISTANCE_M: Final = 3.0
_MIN_DEPARTURE_M: Final = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Exits:
    """Events on the floor relative to the camera, oldest first.

    Attributes:
        places_camera_m: (K, 2) on the axes of :func:`floor_places`.
        returned: (K,) True for people who vanished here and were found again, False for people who
            appeared here or vanished for good.
        start_s: stamp of the first frame; NaN before it.
    """

    places_camera_m: FloatArray
    returned: BoolArray
    start_s: float = math.nan

    @staticmethod
    def none() -> Exits:
        """Return no events."""
        return Exits(np.empty((0, 2)), np.empty(0, dtype=np.bool_))

    def with_events(self, places_camera_m: FloatArray, *, returned: bool) -> Exits:
        """Return these events and those at (K, 2) places; the oldest beyond a limit are lost."""
        if not len(places_camera_m):
            return self
        flags = np.full(len(places_camera_m), returned)
        return Exits(
            np.concatenate((self.places_camera_m, places_camera_m))[-MAX_EVENTS:],
            np.concatenate((self.returned, flags))[-MAX_EVENTS:],
            self.start_s,
        )

    def after_matches(
        self, before: TrackTable, after: TrackTable, stamp_s: float, period_s: float
    ) -> Exits:
        """Return these events and those of a frame of the camera that continues tracks.

        Args:
            before: N tracks before the frame.
            after: the same tracks with the frame's measurements, and new tracks.
            stamp_s: of the frame.
            period_s: usual time between frames.
        """
        count = len(before)
        exits = self if self.start_s == self.start_s else replace(self, start_s=stamp_s)
        seen = after.seen_stamps_s[:count, 0] == stamp_s
        gap_s = stamp_s - before.seen_stamps_s[:, 0]
        found = before.confirmed & seen & (gap_s >= absence_s(period_s)) & np.isfinite(gap_s)
        exits = exits.with_events(before.last_places_camera_m[found], returned=True)
        if stamp_s - exits.start_s <= _START_S:
            return exits
        appeared = after.confirmed[:count] & ~before.confirmed
        appeared &= before.birth_stamps_s > exits.start_s + _START_S
        # Whom another sensor knew before may have come from anywhere.
        appeared &= ~np.isfinite(before.seen_stamps_s[:, 1:]).any(axis=1)
        return exits.with_events(before.birth_places_camera_m[appeared], returned=False)

    def at(self, places_camera_m: FloatArray) -> BoolArray:
        """Return (N,) True for the places (N, 2) that are exits."""
        if np.count_nonzero(~self.returned) < _EXIT_EVENTS:
            return np.zeros(len(places_camera_m), dtype=np.bool_)
        offset = places_camera_m[:, None] - self.places_camera_m[None]
        near = (offset * offset).sum(axis=-1) <= _EXIT_RADIUS_M**2
        returns = (near & self.returned).sum(axis=1)
        exits = (near & ~self.returned).sum(axis=1)
        return np.asarray((exits >= _EXIT_EVENTS) & (exits >= _EXITS_PER_RETURN * returns))


def floor_places(positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
    """Return (N, 2) places on the floor relative to the camera, for positions (N, 2) in odom.

    The first axis is the camera's x axis on the floor; the second is 90° to its left, the viewing
    direction of a level camera. A camera that looks straight down has both.
    """
    right = T_odom_camera[:2, 0]
    length = float(np.hypot(right[0], right[1]))
    right = right / length if length > 1e-6 else np.array([1.0, 0.0])
    offset = positions_odom_m - T_odom_camera[:2, 3]
    return np.column_stack((offset @ right, offset[:, 1] * right[0] - offset[:, 0] * right[1]))


def walked_out(
    tracks: TrackTable, exits: Exits, unseen: BoolArray, T_odom_camera: FloatArray
) -> BoolArray:
    """Return (N,) True for unseen people who left by an exit and are far off, or going."""
    candidates = unseen & tracks.confirmed & ~tracks.standing
    if not candidates.any() or not len(exits.returned):
        return np.zeros(len(tracks), dtype=np.bool_)
    last = tracks.last_places_camera_m
    before_m = np.hypot(last[:, 0], last[:, 1])
    now_m = np.hypot(*(tracks.states[:, :2] - T_odom_camera[:2, 3]).T)
    leaves = (now_m >= _MIN_DISTANCE_M) & (now_m - before_m >= _MIN_DEPARTURE_M)
    return np.asarray(candidates & leaves & exits.at(last))


def absence_s(period_s: float) -> float:
    """Return the shortest gap that counts as an absence, given the time between frames."""
    return max(_ABSENCE_S, 2.5 * period_s if np.isfinite(period_s) else 0.0)
