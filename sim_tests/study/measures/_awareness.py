"""Awareness in an episode: people's attention, the nearest person's class, requests for a look."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

if TYPE_CHECKING:
    from ...crossing import ContactEvent, CrossingFrame, CrossingResult

#: Awareness of the person who came nearest, before the encounter, and the robot's error about it if
#: there is one; empty if nobody came near.
Awareness = Literal["", "aware", "unaware", "falsely_aware", "missed_aware"]

#: Largest distance between a track and its person.
MATCHED_WITHIN_M: Final = 1.0
#: The robot judges people aware from this lower bound of α on.
AWARE_FROM: Final = 0.5
#: Time before the closest approach over which awareness is judged.
JUDGED_OVER_S: Final = 3.0
#: Share of that time for which a person must be aware to be classed as aware.
AWARE_SHARE: Final = 0.5
#: Largest separation of an encounter: the far edge of Hall's social distance.
ENCOUNTER_WITHIN_M: Final = 3.6
#: Separations that differ by less count as equal.
SAME_SEPARATION_M: Final = 0.01
#: Separation within which attention matters. At 5 m a person assumed to walk at 1.6 m/s begins to
#: limit a robot of 1.5 m/s.
ATTENTION_WITHIN_M: Final = 5.0
#: Share of the time for which an attentive person is aware.
ATTENTIVE_FROM: Final = 0.8
#: Share of the time for which an unaware person may look at the robot; people who glance do for
#: 40 % and more.
UNAWARE_UP_TO: Final = 0.25
#: A person for whom attention mattered for less time is not judged.
_LEAST_TIME_S: Final = 0.5
#: A look within this time after a request is an answer.
ANSWERED_WITHIN_S: Final = 2.5
#: Somebody who has looked within this time before a request does not answer it.
LOOKED_BEFORE_S: Final = 0.5
#: Somebody who is no obstacle after this time was asked needlessly.
NEEDED_AFTER_S: Final = 1.0
_LIMITING: Final = re.compile(r"track (-?\d+):")
_SAME_S: Final = 1e-6


def matched_tracks(
    tracks_odom_m: FloatArray, people_odom_m: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows of tracks and of their people, matched by the least sum of distances.

    Args:
        tracks_odom_m: (T, 2) positions of the tracks.
        people_odom_m: (P, 2) positions of the people.
    """
    # Takes long to import; processes that only read runs do without.
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    gaps = tracks_odom_m[:, None, :] - people_odom_m[None, :, :]
    distances = np.hypot(gaps[..., 0], gaps[..., 1])
    # The cost of a pair beyond the bound is so high that as many pairs as possible lie within it.
    within = distances <= MATCHED_WITHIN_M
    costs = np.where(within, distances, 1e3)
    track, person = linear_sum_assignment(costs)
    kept = within[track, person]
    return track[kept], person[kept]


@lru_cache(maxsize=1)
def track_awareness(log: CrossingResult) -> tuple[FloatArray, FloatArray]:
    """Return α and its lower bound of each person's track, (N, P) each; NaN without a track.

    Tentative tracks count too, because the policy uses them.
    """
    mean = np.full(log.awareness.shape, np.nan)
    lower = np.full(log.awareness.shape, np.nan)
    for row, frame in enumerate(log.frames):
        if frame.tracks:
            positions = np.array([track.position_odom_m for track in frame.tracks])
            for index, person in zip(
                *matched_tracks(positions, log.people_odom_m[row]), strict=True
            ):
                mean[row, person] = frame.tracks[index].awareness
                lower[row, person] = frame.tracks[index].awareness_lower
    return mean, lower


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


def awareness_class(
    t_s: FloatArray, looking: NDArray[np.bool_], lower: FloatArray, row: int
) -> Awareness:
    """Return the awareness class of one person over the 3 s before an instant.

    The person is aware if for at least half of that time they look at the robot, or have within
    1 s. The robot judges them aware if the lower bound of the track is ≥ 0.5 for at least half of
    it. An instant without a track counts as not aware.

    Args:
        t_s: (N,) times.
        looking: (N,) whether the person looks, see :attr:`CrossingResult.looking`.
        lower: (N,) lower bound of the person's track, NaN without a track.
        row: index of the instant.
    """
    window = slice(int(np.searchsorted(t_s, t_s[row] - JUDGED_OVER_S - 1e-9)), row + 1)
    aware = float(np.mean(looking[window])) >= AWARE_SHARE
    judged = float(np.mean(lower[window] >= AWARE_FROM)) >= AWARE_SHARE  # NaN is not
    if aware:
        return "aware" if judged else "missed_aware"
    return "falsely_aware" if judged else "unaware"


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredAttention:
    """The attention of P people while it mattered.

    Attention matters while a person's surface is within 5 m of the robot and the robot is in front
    of the person, in sight.

    Attributes:
        could_look_s: (P,) seconds for which it mattered.
        aware_s: (P,) seconds of these in which they looked at it, or had within 1 s.
        looked_s: (P,) seconds of these in which they looked at it.
    """

    could_look_s: FloatArray
    aware_s: FloatArray
    looked_s: FloatArray

    @classmethod
    def of(cls, log: CrossingResult) -> MeasuredAttention:
        """Return the attention of the people of an episode."""
        matters = log.could_look & (log.separation_m < ATTENTION_WITHIN_M)
        steps_s = np.diff(log.t_s)

        def seconds(condition: NDArray[np.bool_]) -> FloatArray:
            return np.asarray(steps_s @ condition[:-1].astype(np.float64))

        return cls(seconds(matters), seconds(matters & log.looking), seconds(matters & log.looks))

    @property
    def judged(self) -> NDArray[np.bool_]:
        """(P,) whether attention mattered long enough to be judged."""
        return np.asarray(self.could_look_s >= _LEAST_TIME_S)

    @property
    def least_aware_share(self) -> float | None:
        """Smallest share of the time for which one of the people was aware; None without any."""
        judged = self.judged
        if not judged.any():
            return None
        return float((self.aware_s[judged] / self.could_look_s[judged]).min())


def moving_contacts_of(log: CrossingResult, noticed: str) -> list[ContactEvent]:
    """Return contacts of a moving robot with people of one of :data:`CONTACT_PEOPLE`."""
    people = (log.noticed | {"asked": requests_of(log).noticed_when_asked})[noticed]
    return [
        each
        for each in log.moving_contacts
        if people[max(int(np.searchsorted(log.t_s, each.t_s, "right")) - 1, 0), each.worker]
    ]


def min_margin_of(log: CrossingResult, noticed: str) -> float | None:
    """Return the smallest margin at a moving robot to people of one of :data:`NOTICED`."""
    counts = log.noticed[noticed] & log.moves[:, None]
    return float(log.margins_m[counts].min()) if counts.any() else None


@dataclass(frozen=True, slots=True, eq=False)
class Requests:
    """The requests for attention of one episode, as docs/measures.md defines them.

    Attributes:
        requests: their number.
        answered: those after which the person truly looked.
        needless: those to somebody who was no obstacle a second later, and had not looked.
        asked_twice: people who were asked more than once.
        after_answer: requests to a track that had answered before.
        answered_people: (N, P) whether somebody has answered a request by then.
        noticed_when_asked: (N, P) the same of people who had never noticed the robot before.
    """

    requests: int
    answered: int
    needless: int
    asked_twice: int
    after_answer: int
    answered_people: NDArray[np.bool_]
    noticed_when_asked: NDArray[np.bool_]


# Cached, as several measures of an episode need it.
@lru_cache(maxsize=1)
def requests_of(log: CrossingResult) -> Requests:
    """Return the requests of a crossing."""
    asked: Counter[int] = Counter()
    had_answered: set[int] = set()
    requests = answered = needless = after_answer = 0
    answered_people, when_asked = np.zeros((2, *log.looking.shape), dtype=np.bool_)
    for row, frame in enumerate(log.frames):
        had_answered |= {answer.track_id for answer in frame.constraints.answers}
        for alert in frame.constraints.alerts:
            if alert.kind != "attention":
                continue
            person = _person_of(alert.track_id, frame, log, row)
            requests += 1
            after_answer += alert.track_id in had_answered
            needless += _was_needless(alert.track_id, person, row, log)
            if person is not None:
                asked[person] += 1
                answer = _answer_to(person, row, log)
                if answer is not None:
                    answered += 1
                    answered_people[answer:, person] = True
                    if not log.has_noticed[answer - 1, person]:
                        when_asked[answer:, person] = True
    twice = sum(times > 1 for times in asked.values())
    return Requests(requests, answered, needless, twice, after_answer, answered_people, when_asked)


def _person_of(track_id: int, frame: CrossingFrame, log: CrossingResult, row: int) -> int | None:
    """Return the person nearest to the obstacle of a track, within 1 m; None for nobody."""
    place = next(
        (o.center_odom_m for o in frame.constraints.obstacles if o.track_id == track_id), None
    )
    if place is None or not frame.truth:
        return None
    distances_m = np.nan_to_num(np.hypot(*(log.people_odom_m[row] - place).T), nan=np.inf)
    nearest = int(np.argmin(distances_m))
    return nearest if distances_m[nearest] <= MATCHED_WITHIN_M else None


def _answer_to(person: int, row: int, log: CrossingResult) -> int | None:
    """Return the instant, within 2.5 s after a request, in which a person began to look."""
    since_s = log.t_s - log.t_s[row]
    looks = log.looks[:, person]
    before = (since_s >= -LOOKED_BEFORE_S - _SAME_S) & (since_s <= 0.0)
    after = (since_s > 0.0) & (since_s <= ANSWERED_WITHIN_S + _SAME_S)
    answered = looks[after].any() and not looks[before].any()
    return int(np.argmax(looks & after)) if answered else None


def _was_needless(track_id: int, person: int | None, row: int, log: CrossingResult) -> bool:
    """Return whether somebody no longer set the limit a second later, and had not looked.

    The last instant counts in an episode that ends before. A new track of the same person is still
    that person. A track without a person cannot look.
    """
    after = int(np.searchsorted(log.t_s, log.t_s[row] + NEEDED_AFTER_S - _SAME_S))
    after = min(after, len(log.t_s) - 1)
    frame = log.frames[after]
    if person is not None and log.looks[row + 1 : after + 1, person].any():
        return False
    limiting = _LIMITING.match(frame.constraints.limited_by)
    if limiting is None:
        return True
    limiting_id = int(limiting[1])
    same_person = person is not None and person == _person_of(limiting_id, frame, log, after)
    return limiting_id != track_id and not same_person
