"""Person candidates of laser scans: merged over scanners, and as observations for a tracker."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, get_args

import numpy as np

from .._observation import PersonObservation
from ..arrays import (
    FloatArray,
    covariance_matrix,
    finite_array,
    finite_number,
    rigid_transform,
    set_fields,
)
from ..errors import PerceptionError
from ..matrices import inverse_2x2

#: What a candidate stands on.
CandidateKind = Literal["two_legs", "one_leg", "trolley"]
_KINDS: Final[tuple[str, ...]] = get_args(CandidateKind)


@dataclass(frozen=True, slots=True, eq=False)
class PersonCandidate:
    """Something in a scan that may be a person. A scan says nothing about faces.

    Attributes:
        stamp_s: time of the middle of the scan.
        position_odom_m: (2,) the body's centre line.
        covariance_m2: (2, 2) of the position, in odom.
        score: probability that it is a person, in [0, 1].
        kind: ``"two_legs"``, ``"one_leg"`` (or two that touch), or ``"trolley"``: something of a
            trolley's size that has come to where the floor was free, which a person may push.

    Raises:
        PerceptionError: for a wrong shape, a value that is not finite, or an unknown kind.
    """

    stamp_s: float
    position_odom_m: FloatArray
    covariance_m2: FloatArray
    score: float
    kind: CandidateKind

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise PerceptionError(f"kind must be one of {', '.join(_KINDS)}, got {self.kind!r}")
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s),
            position_odom_m=finite_array("position_odom_m", self.position_odom_m, (2,)),
            covariance_m2=covariance_matrix("covariance_m2", self.covariance_m2, 2),
            score=finite_number("score", self.score, minimum=0.0, maximum=1.0),
        )


# Candidates of two scanners this near are one person; each scanner sees another side of the legs.
_SAME_M: Final = 0.45
# A trolley this near to somebody's legs is that person's.
_TROLLEY_M: Final = 1.2


def merge_candidates(groups: Iterable[Iterable[PersonCandidate]]) -> tuple[PersonCandidate, ...]:
    """Return the people in scans of several scanners, each person once, most certain first.

    A person whom two scanners see gets the weighted mean of both places, and the covariance of the
    better one: what the scans get wrong about a body, they get wrong together. Candidates of one
    scan are never merged.

    Args:
        groups: candidates of each scanner's last scan; their stamps should be near each other.
    """
    tagged = [(each, number) for number, group in enumerate(groups) for each in group]
    tagged.sort(key=lambda pair: (pair[0].kind == "trolley", -pair[0].score))
    merged: list[PersonCandidate] = []
    places: list[list[float]] = []
    sources: list[set[int]] = []
    for candidate, number in tagged:
        place = candidate.position_odom_m.tolist()
        trolley = candidate.kind == "trolley"
        best, nearest = -1, _TROLLEY_M if trolley else _SAME_M
        for row, other in enumerate(places):
            away = math.dist(other, place)
            if number not in sources[row] and away < nearest:
                best, nearest = row, away
        if best < 0:
            merged.append(candidate)
            places.append(place)
            sources.append({number})
        else:
            sources[best].add(number)
            if not trolley:
                merged[best] = _fused(merged[best], candidate)
                places[best] = merged[best].position_odom_m.tolist()
    return tuple(merged)


def _fused(one: PersonCandidate, other: PersonCandidate) -> PersonCandidate:
    first, second = (inverse_2x2(each.covariance_m2) for each in (one, other))
    mean = inverse_2x2(first + second) @ (
        first @ one.position_odom_m + second @ other.position_odom_m
    )
    sizes = [float(each.covariance_m2[0, 0] + each.covariance_m2[1, 1]) for each in (one, other)]
    better = one if sizes[0] <= sizes[1] else other
    kind: CandidateKind = "two_legs" if "two_legs" in (one.kind, other.kind) else one.kind
    return replace(
        one,
        stamp_s=max(one.stamp_s, other.stamp_s),
        position_odom_m=mean,
        covariance_m2=better.covariance_m2,
        kind=kind,
    )


# Height above the floor of the point that represents a body, and its spread among adults.
_CHEST_M: Final = 1.3
_CHEST_STD_M: Final = 0.2
# Standard deviation of a person's speed along each axis, for candidates of another instant.
_WALK_STD_MPS: Final = 1.0


def observations_of(
    candidates: Iterable[PersonCandidate], T_odom_scanner: Any, stamp_s: float | None = None
) -> tuple[PersonObservation, ...]:
    """Return person candidates as observations in the frame of a scanner, without awareness.

    They are for ``PersonTracker.update(observations, stamp_s, T_odom_scanner, sensor=…)``: the
    "camera" frame of these observations is the scanner's, whose pose the tracker's view needs. The
    floor is at z = 0 in odom.

    Args:
        candidates: of one scan, or of several scanners after :func:`merge_candidates`.
        T_odom_scanner: (4, 4) pose of the scanner at the time of the scan.
        stamp_s: time of the frame; None for each candidate's own, which is the same for all
            candidates of one scan. Candidates of another time get it too, and a variance for the
            way that people walk in between.

    Raises:
        PerceptionError: for something that is no candidate, a pose that is not rigid, or a stamp
            that is not finite.
    """
    T = rigid_transform("T_odom_scanner", T_odom_scanner)
    frame_s = None if stamp_s is None else finite_number("stamp_s", stamp_s)
    made = []
    for index, each in enumerate(candidates):
        if not isinstance(each, PersonCandidate):
            raise PerceptionError(
                f"candidates[{index}] must be a PersonCandidate, got {type(each).__name__}"
            )
        stamp = each.stamp_s if frame_s is None else frame_s
        walked_m = _WALK_STD_MPS * (stamp - each.stamp_s)
        covariance = np.diag([walked_m**2, walked_m**2, _CHEST_STD_M**2])
        covariance[:2, :2] += each.covariance_m2
        covariance = T[:3, :3].T @ covariance @ T[:3, :3]
        made.append(
            PersonObservation(
                stamp_s=stamp,
                position_camera_m=T[:3, :3].T
                @ (np.append(each.position_odom_m, _CHEST_M) - T[:3, 3]),
                position_covariance_m2=0.5 * (covariance + covariance.T),
                gaze_camera=None,
                awareness=None,
                awareness_std=None,
                score=each.score,
            )
        )
    return tuple(made)
