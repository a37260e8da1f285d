"""Settings of the tracker and of its awareness filter."""

from __future__ import annotations

import math
from functools import cached_property
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, Final, Protocol

from pydantic import Field, ValidationError, model_validator

from ._errors import TrackingError
from .config import StrictConfig, complaints

# Bounds far beyond any sensible setting. Further out the arithmetic overflows or becomes singular.
_LEAST_S: Final = 1e-4
_MOST_S: Final = 1e5
_MOST_M: Final = 1e4


class AwarenessFilterConfig(StrictConfig):
    """Settings of the awareness filter, which lives in logit(α) = ln(α / (1 − α)).

    The three time constants must not decrease in the order no face, unseen, evidence: a person who
    is seen without a face must not count as aware for longer than one who is not seen.
    """

    evidence_time_constant_s: float = Field(default=1.0, ge=_LEAST_S, le=_MOST_S)
    """Time constant of the drift to the prior between two frames that show a face, and in the
    first moment (``missed_frame_s``) in which no frame shows the person."""

    unseen_time_constant_s: float = Field(default=0.3, ge=_LEAST_S, le=_MOST_S)
    """Time constant of the drift to the prior while no frame shows the person."""

    missed_frame_s: float = Field(default=0.1, ge=0.0, le=1.0)
    """For this long after the last frame with a face, or for one usual frame interval up to 0.25 s
    if that is longer, a frame without the person may just have missed them: the belief drifts with
    ``evidence_time_constant_s``. 0 switches this off: a missed frame then counts as unseen at
    once."""

    no_face_time_constant_s: float = Field(default=0.2, ge=_LEAST_S, le=_MOST_S)
    """Time constant of the drift to the prior while the person is seen without a usable face."""

    noticed_memory_s: float = Field(default=0.0, ge=0.0, le=10.0)
    """``PersonTrack.noticed`` lasts at most this long after the last look at the robot, while a
    sensor other than the camera keeps seeing the person. 0 switches it off."""

    lower_bound_confidence: float = Field(default=0.9, ge=0.5, lt=1.0)
    """One-sided confidence of ``awareness_lower``."""

    @cached_property
    def bound_sigmas(self) -> float:
        """Standard deviations of logit(α) between mean and lower bound."""
        return NormalDist().inv_cdf(self.lower_bound_confidence)

    @model_validator(mode="after")
    def _order_time_constants(self) -> AwarenessFilterConfig:
        constants = (
            self.no_face_time_constant_s,
            self.unseen_time_constant_s,
            self.evidence_time_constant_s,
        )
        if list(constants) != sorted(constants):
            raise ValueError(
                "no_face_time_constant_s <= unseen_time_constant_s <= evidence_time_constant_s "
                f"must hold, got {', '.join(f'{constant:g}' for constant in constants)} s"
            )
        return self


class TrackingConfig(StrictConfig):
    """Base of configs whose constructor raises :class:`TrackingError`."""

    if not TYPE_CHECKING:  # type checkers know the settings from the fields

        def __init__(self, **settings: Any) -> None:
            try:
                super().__init__(**settings)
            except ValidationError as cause:
                raise TrackingError(f"{type(self).__name__}: {complaints(cause)}") from cause


class TrackedPolicy(Protocol):
    """The needs of a policy from the tracker, as :class:`nav_adapter.AwarenessPolicy` has them."""

    @property
    def filter(self) -> AwarenessFilterConfig:
        """Settings of the awareness filter."""
        ...


class TrackerConfig(TrackingConfig):
    """Settings of :class:`~tracking.PersonTracker`.

    Raises:
        TrackingError: for settings that are unknown, out of range or not finite.
    """

    acceleration_density_m2ps3: float = Field(default=0.05, ge=1e-9, le=1e4)
    """Spectral density q of the white acceleration in the motion model of a person."""

    gate_probability: float = Field(default=0.9999, gt=0.0, lt=1.0)
    """Share of a person's true measurements that pass the Mahalanobis gate."""

    gate_distance_m: float = Field(default=1.0, ge=1e-4, le=_MOST_M)
    """Largest distance of a measurement from the predicted position of its track. With a slow
    camera it is 3 m/s times the interval of frames, if that is more."""

    confirm_logit: float = Field(default=2.3, ge=-1e3, le=1e3)
    """A track is confirmed once the log-likelihood ratio of its detections to clutter exceeds this
    minus ln(time between frames / 1 s)."""

    miss_cost: float = Field(default=10.0, ge=-1e3, le=1e3)
    """Cost of leaving a track and a measurement unmatched, in units of d² + ln det S (S in m²):
    2 ln(P_D / (2π β (1 − P_D))), here for a detection probability P_D of 0.9 and a density β of
    0.01 false or first detections per m² and frame."""

    max_missed_s: float = Field(default=1.2, ge=_LEAST_S, le=_MOST_S)
    """A confirmed track is deleted after this time in which frames should have shown the person and
    did not, …"""

    max_coast_s: float = Field(default=3.0, ge=0.0, le=60.0)
    """… after this time in which none could, or 5 s if that is more and the person stood still,
    which needs a view. The times add up: half of one and half of another end a track as well."""

    max_lag_s: float = Field(default=0.5, ge=0.0, le=10.0)
    """A frame up to this much older than the latest is processed as if it had come in order. An
    older one is refused."""

    max_pause_s: float = Field(default=10.0, ge=1.0, le=1e12)
    """A frame later than the last by more than this is refused: its stamp may be wrong."""

    new_clock_after_s: float = Field(default=1.0, ge=0.0, le=_MOST_S)
    """Refused frames that follow one another for this time, and are more than two, show that the
    clock has been set. The tracker then starts anew."""

    awareness: AwarenessFilterConfig = Field(default_factory=AwarenessFilterConfig)
    """Settings of the awareness filter."""

    @cached_property
    def gate_chi2(self) -> float:
        """Largest squared Mahalanobis distance of a match: χ² with two degrees of freedom."""
        return -2.0 * math.log1p(-self.gate_probability)

    @classmethod
    def for_policy(cls, policy: TrackedPolicy) -> TrackerConfig:
        """Return the defaults with all that a policy needs from the tracker.

        Without it a rule of the policy may never hold, and nothing tells.

        Raises:
            TrackingError: for an object that is no policy.
        """
        try:
            return cls(awareness=policy.filter)
        except AttributeError as cause:
            raise TrackingError(
                f"policy must be an AwarenessPolicy, got {type(policy).__name__}: {cause}"
            ) from None
