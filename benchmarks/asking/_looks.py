"""True looks after requests for attention, and what the adapter made of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from sim_tests.crossing import CrossingFrame, CrossingResult

#: True α and lower bound from which somebody has looked.
LOOKED: Final = 0.5
#: A look within this time after a request answers it.
ANSWERED_WITHIN_S: Final = 2.5
#: Whoever has looked within this time before it was not won by it.
LOOKED_BEFORE_S: Final = 0.5
#: Somebody is at the obstacle's place within this distance.
SAME_PLACE_M: Final = 1.0


@dataclass(frozen=True, slots=True)
class AskedPerson:
    """The outcome of one request.

    Attributes:
        look_s: time from the request to the true look; None without one.
        measured_s: time from the look, or from the request without one, to the first update whose
            lower bound of α counts as a look; None if there was none within 3.5 s of the request.
        counted_s: time for which it counted without a break.
    """

    look_s: float | None
    measured_s: float | None
    counted_s: float = 0.0


def asked_people(result: CrossingResult) -> list[AskedPerson]:
    """Return what came of every request whose person is known, and had not looked before."""
    frames = result.frames
    times_s = np.array([frame.t_s for frame in frames])
    found = []
    for frame in frames:
        for alert in frame.constraints.alerts:
            if alert.kind != "attention":
                continue
            place = _place_of(frame, alert.track_id)
            person = None if place is None else _person_at(frame, place)
            if person is not None:
                asked = _asked(frames, times_s - frame.t_s, person)
                if asked is not None:
                    found.append(asked)
    return found


def _asked(
    frames: tuple[CrossingFrame, ...], since_s: FloatArray, person: int
) -> AskedPerson | None:
    looks = np.array([frame.truth[person].awareness >= LOOKED for frame in frames])
    lowers = np.array([_lower_of(frame, person) for frame in frames])
    if looks[(since_s >= -LOOKED_BEFORE_S) & (since_s <= 0.0)].any():
        return None
    after = np.flatnonzero(looks & (since_s > 0.0) & (since_s <= ANSWERED_WITHIN_S))
    begin_s = float(since_s[after[0]]) if len(after) else 0.0
    # Somebody who looks later than an answer may be measured then, and rightly so.
    until_s = ANSWERED_WITHIN_S + 1.0 if len(after) else ANSWERED_WITHIN_S
    counted = (lowers >= LOOKED) & (since_s >= begin_s - 1e-9) & (since_s <= until_s)
    look_s = begin_s if len(after) else None
    if not counted.any():
        return AskedPerson(look_s, None)
    first = int(np.argmax(counted))
    ends = np.flatnonzero((lowers < LOOKED) & (since_s > since_s[first]))
    end_s = since_s[ends[0]] if len(ends) else since_s[-1]
    return AskedPerson(look_s, float(since_s[first]) - begin_s, float(end_s - since_s[first]))


def _place_of(frame: CrossingFrame, track_id: int) -> FloatArray | None:
    for obstacle in frame.constraints.obstacles:
        if obstacle.track_id == track_id:
            return obstacle.center_odom_m
    return None


def _person_at(frame: CrossingFrame, place_m: FloatArray) -> int | None:
    if not frame.truth:
        return None
    away_m = [float(np.hypot(*(view.position_odom_m - place_m))) for view in frame.truth]
    nearest = int(np.argmin(away_m))
    return nearest if away_m[nearest] <= SAME_PLACE_M else None


def _lower_of(frame: CrossingFrame, person: int) -> float:
    """Return the lower bound of α of the obstacle at a person's place; 0 for none."""
    place_m = frame.truth[person].position_odom_m
    near = [
        (float(np.hypot(*(each.center_odom_m - place_m))), each.awareness_lower)
        for each in frame.constraints.obstacles
    ]
    away_m, lower = min(near, default=(np.inf, 0.0))
    return lower if away_m <= SAME_PLACE_M else 0.0
