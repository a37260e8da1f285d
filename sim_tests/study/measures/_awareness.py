"""Awareness in an episode: how well it was estimated, and who stood how to the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ._record import Awareness
from ._trace import Trace

if TYPE_CHECKING:
    from ...crossing import CrossingResult

#: A track belongs to a person no farther away than this.
MATCHED_WITHIN_M: Final = 1.0
#: From here up somebody counts as aware, and a track's lower bound as saying so.
AWARE_FROM: Final = 0.5
#: So long before the closest approach it is judged,
JUDGED_OVER_S: Final = 3.0
#: and somebody who was aware for this share of the time was aware.
AWARE_SHARE: Final = 0.5
#: Nobody farther away was encountered: the far edge of Hall's social distance.
ENCOUNTER_WITHIN_M: Final = 3.6
#: Separations that differ by less are the same.
SAME_SEPARATION_M: Final = 0.01


def matched_tracks(
    tracks_odom_m: FloatArray, people_odom_m: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows of tracks and of people that belong together, by the least sum of distances.

    Args:
        tracks_odom_m: (T, 2).
        people_odom_m: (P, 2).
    """
    gaps = tracks_odom_m[:, None, :] - people_odom_m[None, :, :]
    distances = np.hypot(gaps[..., 0], gaps[..., 1])
    # A pair beyond the bound costs so much that as many as possible lie within it.
    within = distances <= MATCHED_WITHIN_M
    costs = np.where(within, distances, 1e3)
    track, person = linear_sum_assignment(costs)
    kept = within[track, person]
    return track[kept], person[kept]


def track_awareness(result: CrossingResult, trace: Trace) -> tuple[FloatArray, FloatArray]:
    """(N, P) α and its lower bound of each person's track; NaN where there is none.

    Tentative tracks count too: the policy reckons with them.
    """
    mean = np.full(trace.awareness.shape, np.nan)
    lower = np.full(trace.awareness.shape, np.nan)
    if not trace.people:
        return mean, lower
    for row, frame in enumerate(result.frames):
        if frame.tracks:
            positions = np.array([track.position_odom_m for track in frame.tracks])
            for index, person in zip(
                *matched_tracks(positions, trace.people_odom_m[row]), strict=True
            ):
                mean[row, person] = frame.tracks[index].awareness
                lower[row, person] = frame.tracks[index].awareness_lower
    return mean, lower


def awareness_error(true: FloatArray, tracked: FloatArray) -> float | None:
    """Mean |α of the track − true α| over all instants and people with a track; None without."""
    known = np.isfinite(tracked)
    return float(np.abs(tracked - true)[known].mean()) if known.any() else None


def nearest_person(separation_m: FloatArray) -> tuple[int, int] | None:
    """Instant and person (rows of an (N, P) array) of the closest approach.

    The instant is the first within 1 cm of the smallest separation: while both stand, the last
    micrometres are chance. None if nobody came within 3.6 m.
    """
    if not separation_m.size:
        return None
    smallest = float(separation_m.min())
    if smallest >= ENCOUNTER_WITHIN_M:
        return None
    person = int(np.argmin(separation_m.min(axis=0)))
    row = int(np.argmax(separation_m[:, person] <= smallest + SAME_SEPARATION_M))
    return row, person


def awareness_class(t_s: FloatArray, true: FloatArray, lower: FloatArray, row: int) -> Awareness:
    """How one person stood to the robot in the 3 s before an instant, and what was made of it.

    Aware: true α ≥ 0.5 for at least half of the time. Judged aware: the track's lower bound ≥ 0.5
    for at least half of it; an instant without a track says "not aware".

    Args:
        t_s: (N,).
        true: (N,) α of the person.
        lower: (N,) of the person's track, NaN where there is none.
        row: of the instant.
    """
    window = slice(int(np.searchsorted(t_s, t_s[row] - JUDGED_OVER_S - 1e-9)), row + 1)
    aware = _for_long(true[window])
    judged = _for_long(np.nan_to_num(lower[window], nan=0.0))
    if aware:
        return "aware" if judged else "missed_aware"
    return "falsely_aware" if judged else "unaware"


def _for_long(values: FloatArray | Sequence[float]) -> bool:
    return float(np.mean(np.asarray(values) >= AWARE_FROM)) >= AWARE_SHARE
