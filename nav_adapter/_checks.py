"""Checks of input."""

from __future__ import annotations

from collections.abc import Iterable
from types import UnionType
from typing import Any, Final, get_args

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number
from tracking import PersonTrack

from ._errors import NavError

# Data older than this, over 30 000 years, have a stamp that was never a time.
_MOST_S: Final = 1e12
# Tolerated difference between the clocks of two computers, or of a camera and a control loop.
_CLOCK_TOLERANCE_S: Final = 0.05
_LARGEST_CELLS: Final = 4_000_000


def age_of_s(name: str, stamp_s: float, now: float) -> float:
    """Return the age of data, at least 0; refuse data from the future, and absurd stamps."""
    if stamp_s > now + _CLOCK_TOLERANCE_S:
        raise NavError(
            f"{name} must not lie after stamp_s, got {stamp_s:.6f} s and {now:.6f} s "
            f"(tolerance {_CLOCK_TOLERANCE_S:g} s)"
        )
    if now - stamp_s > _MOST_S:
        raise NavError(
            f"{name} must not lie more than {_MOST_S:g} s before stamp_s, got {stamp_s:g} s and "
            f"{now:g} s"
        )
    return max(0.0, now - stamp_s)


def checked_tracks(tracks: Iterable[PersonTrack]) -> tuple[PersonTrack, ...]:
    """Return the tracks after checking their types and ids."""
    try:
        checked = tuple(tracks)
    except TypeError:
        raise NavError(
            f"tracks must be an iterable of PersonTrack, got {type(tracks).__name__}"
        ) from None
    ids: set[int] = set()
    for index, track in enumerate(checked):
        if not isinstance(track, PersonTrack):
            raise NavError(f"tracks[{index}] must be a PersonTrack, got {type(track).__name__}")
        if track.id < 0:
            raise NavError(
                f"tracks must have ids of at least 0, got {track.id}: negative ones are those of "
                "the robot's stop polygon and of people whose id was exchanged"
            )
        if track.id in ids:
            raise NavError(f"tracks must have distinct ids, got id {track.id} twice")
        ids.add(track.id)
    return checked


def require_type(name: str, value: object, kind: type | UnionType) -> None:
    """Refuse an argument that is not of this type, or of one of these."""
    if not isinstance(value, kind):
        kinds = [each.__name__ for each in get_args(kind) or (kind,)]
        article = "an" if kinds[0][0] in "AEIOU" else "a"
        wanted = " or ".join("None" if name == "NoneType" else name for name in kinds)
        raise NavError(f"{name} must be {article} {wanted}, got {type(value).__name__}")


def goes_back(now: float, last_s: float) -> str:
    """Return the message about a stamp that goes back."""
    return f"stamp_s must not go backward, got {now:.6f} s after {last_s:.6f} s"


def checked_square(
    what: str, center_odom_m: Any, size_m: float, resolution_m: float
) -> tuple[FloatArray, float, int]:
    """Return corner (2,), cell's side (m) and cells per side of a square around a point.

    The corner is rounded to whole cells, so that people do not smear when the square moves.
    """
    center = finite_array("center_odom_m", center_odom_m, (2,), NavError)
    size = finite_number("size_m", size_m, NavError, minimum=0.0, exclusive_minimum=True)
    cell = finite_number("resolution_m", resolution_m, NavError, minimum=1e-3)
    side = round(min(size / cell, 1e9))  # of a float, which may overflow
    if not 0 < side * side <= _LARGEST_CELLS:
        raise NavError(
            f"a {what} must have 1 to {_LARGEST_CELLS} cells, got {side} x {side} "
            f"(size_m {size:g}, resolution_m {cell:g})"
        )
    return (np.floor(center / cell) - side // 2) * cell, cell, side
