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

    prior_awareness: float = Field(default=0.05, gt=0.0, le=0.5)
    """α of a person of whom nothing is known: the mean of the prior is its logit."""

    prior_std_logit: float = Field(default=2.0, gt=0.0, le=5.0)
    """Standard deviation of the prior in logit(α); uncertainty never grows beyond it. It is wide
    enough for one turn of the head, about six units of logit(α)."""

    evidence_time_constant_s: float = Field(default=1.0, ge=_LEAST_S, le=_MOST_S)
    """Time constant of the drift to the prior between two frames that show a face, and in the
    first moment (``missed_frame_s``) in which no frame shows the person."""

    unseen_time_constant_s: float = Field(default=0.3, ge=_LEAST_S, le=_MOST_S)
    """Time constant of the drift to the prior while no frame shows the person."""

    missed_frame_s: float = Field(default=0.1, ge=0.0, le=1.0)
    """For this long after the last frame with a face, or for one usual frame interval up to
    ``max_evidence_gap_s`` if that is longer, a frame without the person may just have missed them:
    the belief drifts with ``evidence_time_constant_s``. 0 switches this off: a missed frame then
    counts as unseen at once."""

    no_face_time_constant_s: float = Field(default=0.2, ge=_LEAST_S, le=_MOST_S)
    """Time constant of the drift to the prior while the person is seen without a usable face."""

    max_evidence_gap_s: float = Field(default=0.25, ge=_LEAST_S, le=_MOST_S)
    """Two frames with a face further apart than this are no evidence for the time between them."""

    evidence_correlation_s: float = Field(default=0.1, ge=0.0, le=_MOST_S)
    """Errors of α this close in time count as one error. This caps the information per second: the
    variance of a frame dt after the last one is multiplied by ``evidence_correlation_s / dt`` where
    that is above one, so a faster camera, or one that repeats frames, adds no certainty."""

    clip_awareness: float = Field(default=0.02, ge=1e-9, lt=0.5)
    """ε: α is clipped to [ε, 1 − ε] before the logit."""

    min_evidence_std_logit: float = Field(default=0.3, ge=1e-4, le=100.0)
    """Smallest standard deviation of a measurement in logit(α)."""

    typical_evidence_std: float = Field(default=0.1, ge=1e-3, le=0.5)
    """Standard deviation of α that a measurement usually has; see ``reported_std_weight``."""

    reported_std_weight: float = Field(default=0.6, ge=0.0, le=1.0)
    """Weight w of a reported σ against the typical one: the filter uses σ^w · σ_typical^(1 − w).
    Half is right if σ differs between measurements by as large a factor as it is wrong. 1 trusts
    the reported σ; 0 ignores it."""

    max_evidence_std: float = Field(default=0.29, gt=0.0, le=0.5)
    """An α with a larger reported σ is no evidence. 1/√12 ≈ 0.29 is the standard deviation
    of the uniform distribution on [0, 1], which carries no information."""

    memory_s: float = Field(default=0.0, ge=0.0, le=10.0)
    """Memory of a look at the robot: the time constants of unseen and of no face are at least this.
    A face that looks away is evidence and ends the memory, and so does an ambiguous match. The
    default 0 is no memory; with a memory the robot relies on a look that is that old."""

    noticed_memory_s: float = Field(default=0.0, ge=0.0, le=10.0)
    """``PersonTrack.noticed`` lasts at most this long after the last look at the robot, while a
    sensor other than the camera keeps seeing the person. 0 switches it off."""

    lower_bound_confidence: float = Field(default=0.9, ge=0.5, lt=1.0)
    """One-sided confidence of ``awareness_lower``."""

    @cached_property
    def prior_logit(self) -> float:
        """Mean of the prior in logit(α)."""
        return math.log(self.prior_awareness / (1.0 - self.prior_awareness))

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

    initial_velocity_std_mps: float = Field(default=1.0, ge=1e-4, le=3.0)
    """Standard deviation of a new track's velocity, per axis: how fast people may walk."""

    position_noise_floor_m: float = Field(default=0.05, ge=1e-4, le=_MOST_M)
    """Smallest standard deviation of a measured position in any direction of the floor plane."""

    gate_probability: float = Field(default=0.9999, gt=0.0, lt=1.0)
    """Share of a person's true measurements that pass the Mahalanobis gate."""

    gate_distance_m: float = Field(default=1.0, ge=1e-4, le=_MOST_M)
    """Largest distance of a measurement from the predicted position of its track. With a slow
    camera it is 3 ``initial_velocity_std_mps`` times the interval of frames, if that is more."""

    detection_probability: float = Field(default=0.9, ge=0.01, le=0.999)
    """P_D, the share of frames that report a person in sight."""

    detection_correlation_s: float = Field(default=0.12, ge=0.0, le=_MOST_S)
    """Frames closer than this share their errors, clutter included, and count in proportion."""

    confirm_logit: float = Field(default=2.3, ge=-1e3, le=1e3)
    """A track is confirmed once the log-likelihood ratio of its detections to clutter exceeds this
    minus ln(time between frames / 1 s)."""

    weak_score: float = Field(default=0.25, ge=0.0, le=1.0)
    """A detection with a score below this may continue a confirmed track that no other detection
    continues. It never starts a track and is no evidence of awareness. The shipped detector reports
    no scores below 0.25 unless its ``score_threshold`` is lowered."""

    miss_cost: float = Field(default=10.0, ge=-1e3, le=1e3)
    """Cost of leaving a track and a measurement unmatched, in units of d² + ln det S (S in m²):
    2 ln(P_D / (2π β (1 − P_D))), here for a detection probability P_D of 0.9 and a density β of
    0.01 false or first detections per m² and frame."""

    ambiguity_margin: float = Field(default=4.0, ge=0.0, le=1e3)
    """A match is ambiguous if a rival match costs (d² + ln det S) at most this much more. 4 is a
    likelihood ratio of e²."""

    ambiguity_distance_m: float = Field(default=0.8, ge=0.0, le=_MOST_M)
    """Rivals further away than this do not make a match ambiguous."""

    ambiguous_noise_factor: float = Field(default=2.0, ge=1.0, le=1e4)
    """Factor on the variance of a measured position whose match is ambiguous. When two people pass
    each other, a wrong match would otherwise reverse both velocities."""

    max_missed_s: float = Field(default=1.2, ge=_LEAST_S, le=_MOST_S)
    """A confirmed track is deleted after this time in which frames should have shown the person and
    did not, …"""

    max_coast_s: float = Field(default=3.0, ge=0.0, le=60.0)
    """… after this time in which none could, …"""

    max_standing_coast_s: float = Field(default=5.0, ge=0.0, le=120.0)
    """… or after this time if the person stood still, which needs a view. The three add up: half of
    one and half of another end a track as well."""

    standing_speed_mps: float = Field(default=0.3, ge=0.0, le=100.0)
    """A person no faster than this, with a velocity consistent with 0, counts as standing."""

    standing_time_constant_s: float = Field(default=1.0, ge=_LEAST_S, le=_MOST_S)
    """Time constant with which the velocity of an unseen standing person decays."""

    body_radius_m: float = Field(default=0.25, ge=1e-3, le=10.0)
    """Radius of a person as an occluder: a body hides the people behind it."""

    size_error_share: float = Field(default=0.35, ge=0.0, le=1.0)
    """Standard deviation of the range that a camera infers from the size of a person, as a share
    of the range that another sensor measures. Children and people who sit are put up to 1.7 times
    too far away. 0 takes the camera's ranges as they are."""

    max_lag_s: float = Field(default=0.5, ge=0.0, le=10.0)
    """A frame up to this much older than the latest is processed as if it had come in order. An
    older one is refused."""

    max_pause_s: float = Field(default=10.0, ge=1.0, le=1e12)
    """A frame later than the last by more than this is refused: its stamp may be wrong."""

    new_clock_after_s: float = Field(default=1.0, ge=0.0, le=_MOST_S)
    """Refused frames that follow one another for this time, and are more than two, show that the
    clock has been set. The tracker then starts anew."""

    stamp_tolerance_s: float = Field(default=1e-3, ge=0.0, le=_MOST_S)
    """Largest difference between the stamps of an observation and of its frame."""

    stature_m: float = Field(default=1.75, gt=0.0, le=10.0)
    """Stature assumed for every person."""

    awareness: AwarenessFilterConfig = Field(default_factory=AwarenessFilterConfig)
    """Settings of the awareness filter."""

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
