"""Requests for attention in an episode: how many, and which were answered or needless."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from ._awareness import AWARE_FROM, MATCHED_WITHIN_M
from ._trace import Trace

if TYPE_CHECKING:
    from ...crossing import CrossingFrame, CrossingResult

#: A look within this time after a request is an answer.
ANSWERED_WITHIN_S: Final = 2.5
#: Somebody who has looked within this time before a request does not answer it.
LOOKED_BEFORE_S: Final = 0.5
#: Somebody who is no obstacle after this time was asked needlessly.
NEEDED_AFTER_S: Final = 1.0
_LIMITING: Final = re.compile(r"track (-?\d+):")
_SAME_S: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Requests:
    """The requests for attention of one episode, as docs/simulation.md defines them.

    Attributes:
        requests: their number.
        answered: those after which the person truly looked.
        needless: those to somebody who was no obstacle a second later, and had not looked.
        asked_twice: people who were asked more than once.
        after_answer: requests to a track that had answered before.
    """

    requests: int = 0
    answered: int = 0
    needless: int = 0
    asked_twice: int = 0
    after_answer: int = 0

    @classmethod
    def of(cls, result: CrossingResult, trace: Trace) -> Requests:
        """Return the requests of a crossing."""
        asked: Counter[int] = Counter()
        had_answered: set[int] = set()
        requests = answered = needless = after_answer = 0
        for row, frame in enumerate(result.frames):
            had_answered |= {answer.track_id for answer in frame.constraints.answers}
            for alert in frame.constraints.alerts:
                if alert.kind != "attention":
                    continue
                person = _person_of(alert.track_id, frame, trace, row)
                requests += 1
                after_answer += alert.track_id in had_answered
                needless += _was_needless(alert.track_id, person, row, result, trace)
                if person is not None:
                    asked[person] += 1
                    answered += _was_answered(person, row, trace)
        twice = sum(times > 1 for times in asked.values())
        return cls(requests, answered, needless, twice, after_answer)


def _person_of(track_id: int, frame: CrossingFrame, trace: Trace, row: int) -> int | None:
    """Return the person nearest to the obstacle of a track, within 1 m; None for nobody."""
    place = next(
        (o.center_odom_m for o in frame.constraints.obstacles if o.track_id == track_id), None
    )
    if place is None or not trace.people:
        return None
    distances_m = np.hypot(*(trace.people_odom_m[row] - place).T)
    nearest = int(np.argmin(distances_m))
    return nearest if distances_m[nearest] <= MATCHED_WITHIN_M else None


def _was_answered(person: int, row: int, trace: Trace) -> bool:
    """Return whether a person began to look at the robot within 2.5 s after a request."""
    since_s = trace.t_s - trace.t_s[row]
    looks = trace.awareness[:, person] >= AWARE_FROM
    before = (since_s >= -LOOKED_BEFORE_S - _SAME_S) & (since_s <= 0.0)
    after = (since_s > 0.0) & (since_s <= ANSWERED_WITHIN_S + _SAME_S)
    return bool(looks[after].any() and not looks[before].any())


def _was_needless(
    track_id: int, person: int | None, row: int, result: CrossingResult, trace: Trace
) -> bool:
    """Return whether somebody no longer set the limit a second later, and had not looked.

    The last instant counts in an episode that ends before. A new track of the same person is still
    that person. A track without a person cannot look.
    """
    after = int(np.searchsorted(trace.t_s, trace.t_s[row] + NEEDED_AFTER_S - _SAME_S))
    after = min(after, len(trace.t_s) - 1)
    frame = result.frames[after]
    if person is not None and (trace.awareness[row + 1 : after + 1, person] >= AWARE_FROM).any():
        return False
    limiting = _LIMITING.match(frame.constraints.limited_by)
    if limiting is None:
        return True
    limiting_id = int(limiting[1])
    same_person = person is not None and person == _person_of(limiting_id, frame, trace, after)
    return limiting_id != track_id and not same_person
