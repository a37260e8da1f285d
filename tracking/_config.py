"""Settings of the tracker and of its awareness filter."""

from __future__ import annotations

from pydantic import Field, model_validator

from .config import StrictConfig


class AwarenessFilterConfig(StrictConfig):
    """Settings of the awareness filter, which lives in logit(α) = ln(α / (1 − α)).

    The three time constants must not decrease in the order no face, unseen, evidence: seeing
    somebody without a face is never a reason to believe in awareness for longer.
    """

    prior_awareness: float = Field(default=0.05, gt=0.0, le=0.5)
    """α that is believed of a person about whom nothing is known."""

    prior_std_logit: float = Field(default=2.0, gt=0.0, le=5.0)
    """Standard deviation of that belief in logit(α); uncertainty never grows beyond it. Wide enough
    that one turn of the head, some six units of logit(α), is no surprise."""

    evidence_time_constant_s: float = Field(default=1.0, gt=0.0)
    """How fast attention itself wanders towards the prior between two frames that show a face."""

    unseen_time_constant_s: float = Field(default=0.3, gt=0.0)
    """How fast belief falls back to the prior while the person is not seen at all."""

    no_face_time_constant_s: float = Field(default=0.2, gt=0.0)
    """How fast belief falls back to the prior while the person is seen without a usable face."""

    max_evidence_gap_s: float = Field(default=0.25, gt=0.0)
    """Two frames with a face further apart than this do not vouch for the time between them."""

    evidence_correlation_s: float = Field(default=0.1, ge=0.0)
    """Errors of α this close in time count as one. It caps the information per second: a frame dt
    after the last one has its variance multiplied by ``evidence_correlation_s / dt`` where that is
    above one, so a faster camera, or one that repeats itself, does not make the filter surer."""

    clip_awareness: float = Field(default=0.02, gt=0.0, lt=0.5)
    """ε: α is taken as at least ε and at most 1 − ε before the logit."""

    min_evidence_std_logit: float = Field(default=0.3, gt=0.0)
    """Floor of a measurement's standard deviation in logit(α)."""

    max_evidence_std: float = Field(default=0.29, gt=0.0, le=0.5)
    """An α with a larger standard deviation is no evidence; 1/√12 ≈ 0.29 is that of a uniform
    distribution on [0, 1], which says nothing."""

    memory_s: float = Field(default=0.0, ge=0.0, le=10.0)
    """Longest that a glance may go on counting while nothing contradicts it: the time constants of
    unseen and of no face are at least this. A face that is seen to look away is evidence and ends
    it, and so does an ambiguous match. 0, the default, for no memory: whoever remembers relies on a
    person who has not been seen to look for as long."""

    lower_bound_confidence: float = Field(default=0.9, ge=0.5, lt=1.0)
    """One-sided confidence of ``awareness_lower``."""

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


class TrackerConfig(StrictConfig):
    """Settings of :class:`~tracking.PersonTracker`."""

    acceleration_density_m2ps3: float = Field(default=0.05, gt=0.0)
    """Spectral density q of the white acceleration that a walking person is modelled by."""

    initial_velocity_std_mps: float = Field(default=1.0, gt=0.0, le=3.0)
    """Cap on a new track's velocity uncertainty, per axis: how fast an unknown person may walk."""

    position_noise_floor_m: float = Field(default=0.05, gt=0.0)
    """Least standard deviation of a measured position along any direction of the floor plane."""

    gate_probability: float = Field(default=0.9999, gt=0.0, lt=1.0)
    """Share of a person's true measurements that the Mahalanobis gate lets through."""

    gate_distance_m: float = Field(default=1.0, gt=0.0)
    """Furthest a measurement may lie from where its track was expected."""

    miss_cost: float = Field(default=10.0)
    """What it costs to leave a track and a measurement alone instead of matching them, in units of
    d² + ln det S (S in m²): 2 ln(P_D / (2π β (1 − P_D))), here for a person detected in nine frames
    of ten and β = 0.01 false or first detections per m² and frame."""

    ambiguity_margin: float = Field(default=4.0, ge=0.0)
    """A rival match whose cost (d² + ln det S) is no more than this above the chosen one makes the
    match ambiguous; 4 is a likelihood ratio of e²."""

    ambiguity_distance_m: float = Field(default=0.8, ge=0.0)
    """Rivals further away than this are not confused with each other."""

    ambiguous_noise_factor: float = Field(default=2.0, ge=1.0)
    """The variance of a position is taken this many times when its match is ambiguous: between two
    people who pass, a wrong match would turn both velocities round."""

    confirm_hits: int = Field(default=4, ge=1, le=20)
    """Frames (distinct stamps) that must show a person before the track is confirmed, …"""

    confirm_window_s: float = Field(default=0.5, gt=0.0)
    """… all within this time, or within ``confirm_hits`` + 1 frame intervals of a slow camera."""

    max_tentative_gap_s: float = Field(default=0.12, ge=0.0)
    """A tentative track unseen for longer than this is dropped; each gets one more frame, however
    slow the camera."""

    max_missed_s: float = Field(default=1.2, gt=0.0)
    """A confirmed track that frames should have shown, and did not, for longer than this is
    dropped. It needs a view; without one nobody knows who should be visible."""

    max_coast_s: float = Field(default=3.0, ge=0.0, le=60.0)
    """A confirmed track unseen for longer than this is dropped, whatever the reason, …"""

    max_standing_coast_s: float = Field(default=5.0, ge=0.0, le=120.0)
    """… save that a person who stood still, and is out of view or hidden behind somebody, is
    remembered for this long. It needs a view and counts where it exceeds ``max_coast_s``."""

    standing_speed_mps: float = Field(default=0.3, ge=0.0)
    """Somebody no faster than this, and whose velocity is consistent with 0, stands."""

    standing_time_constant_s: float = Field(default=1.0, gt=0.0)
    """How fast the velocity of a standing person decays while they are not seen."""

    body_radius_m: float = Field(default=0.25, gt=0.0)
    """How much of the view a person takes up: what lies behind it is hidden."""

    max_lag_s: float = Field(default=0.5, ge=0.0, le=10.0)
    """A frame this much older than the latest is still taken, as if it had come in time; one that
    is older is refused."""

    stamp_tolerance_s: float = Field(default=1e-3, ge=0.0)
    """How far an observation's own stamp may lie from the stamp of its frame."""

    stature_m: float = Field(default=1.75, gt=0.0)
    """Stature assumed of every person."""

    awareness: AwarenessFilterConfig = Field(default_factory=AwarenessFilterConfig)
    """Settings of the awareness filter."""
