"""Awareness in an episode: the error of its estimate, and the class of the nearest person."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ._record import Awareness
from ._trace import Trace

if TYPE_CHECKING:
    from ...crossing import CrossingResult

#: Largest distance between a track and its person.
MATCHED_WITHIN_M: Final = 1.0
#: A person is aware from this α on; the robot judges them aware from this lower bound on.
AWARE_FROM: Final = 0.5
#: Time before the closest approach over which awareness is judged.
JUDGED_OVER_S: Final = 3.0
#: Share of that time for which a person must be aware to be classed as aware.
AWARE_SHARE: Final = 0.5
#: Largest separation of an encounter: the far edge of Hall's social distance.
ENCOUNTER_WITHIN_M: Final = 3.6
#: Separations that differ by less count as equal.
SAME_SEPARATION_M: Final = 0.01


def matched_tracks(
    tracks_odom_m: FloatArray, people_odom_m: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows of tracks and of their people, matched by the least sum of distances.

    Args:
        tracks_odom_m: (T, 2) positions of the tracks.
        people_odom_m: (P, 2) positions of the people.
    """
    gaps = tracks_odom_m[:, None, :] - people_odom_m[None, :, :]
    distances = np.hypot(gaps[..., 0], gaps[..., 1])
    # The cost of a pair beyond the bound is so high that as many pairs as possible lie within it.
    within = distances <= MATCHED_WITHIN_M
    costs = np.where(within, distances, 1e3)
    track, person = linear_sum_assignment(costs)
    kept = within[track, person]
    return track[kept], person[kept]


def track_awareness(result: CrossingResult, trace: Trace) -> tuple[FloatArray, FloatArray]:
    """Return α and its lower bound of each person's track, (N, P) each; NaN without a track.

    Tentative tracks count too, because the policy uses them.
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
    """Return the mean |α of the track − true α| over all instants and tracked people.

    None without a track.
    """
    known = np.isfinite(tracked)
    return float(np.abs(tracked - true)[known].mean()) if known.any() else None


def nearest_person(separation_m: FloatArray) -> tuple[int, int] | None:
    """Return the instant and the person of the closest approach, as indices of an (N, P) array.

    The instant is the first within 1 cm of the smallest separation: while both stand, the last
    micrometres are random. None if nobody came within 3.6 m.
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
    """Return the awareness class of one person over the 3 s before an instant.

    The person is aware if the true α is ≥ 0.5 for at least half of that time. The robot judges
    them aware if the lower bound of the track is ≥ 0.5 for at least half of it. An instant without
    a track counts as not aware.

    Args:
        t_s: (N,) times.
        true: (N,) true α of the person.
        lower: (N,) lower bound of the person's track, NaN without a track.
        row: index of the instant.
    """
    window = slice(int(np.searchsorted(t_s, t_s[row] - JUDGED_OVER_S - 1e-9)), row + 1)
    aware = _mostly_aware(true[window])
    judged = _mostly_aware(np.nan_to_num(lower[window], nan=0.0))
    if aware:
        return "aware" if judged else "missed_aware"
    return "falsely_aware" if judged else "unaware"


def _mostly_aware(values: FloatArray) -> bool:
    return float(np.mean(values >= AWARE_FROM)) >= AWARE_SHARE
