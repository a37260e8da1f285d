"""A person candidate: what a detector in laser scans reports to a tracker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

from ..arrays import FloatArray, covariance_matrix, finite_array, finite_number, set_fields
from ..errors import PerceptionError

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
