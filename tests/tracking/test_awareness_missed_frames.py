"""Awareness when single frames miss the person, and when the reported σ is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm
from tracking_scenes import CAMERA, observe

from tracking import AwarenessFilterConfig, PersonTracker, TrackerConfig
from tracking.awareness_filter import (
    AwarenessBelief,
    drift,
    drift_unseen,
    estimate,
    grace_s,
    trusted_std,
)

CONFIG = AwarenessFilterConfig()
Z = float(norm.ppf(CONFIG.lower_bound_confidence))

beliefs = st.builds(
    lambda mean, variance: AwarenessBelief(
        np.array([mean]), np.array([variance]), np.array([mean - Z * math.sqrt(variance)])
    ),
    st.floats(-8.0, 8.0),
    st.floats(1e-4, CONFIG.prior_std_logit**2),
)
ages = st.floats(0.0, 1.0)
periods = st.floats(0.02, 1.0) | st.just(math.inf)


def bounds_of(
    alphas: list[float | str | None],
    rate_hz: float,
    std: float = 0.1,
    config: TrackerConfig | None = None,
) -> np.ndarray:
    """Return awareness_lower after each frame; None is no face, "unseen" no person."""
    tracker, bounds = PersonTracker(config or TrackerConfig()), []
    for step, alpha in enumerate(alphas):
        now = step / rate_hz
        seen = alpha != "unseen"
        frame = [observe((3.0, 0.0), now, awareness=alpha, awareness_std=std)] if seen else []
        tracks = tracker.update(frame, now, CAMERA)
        bounds.append(tracks[0].awareness_lower if tracks else 0.0)
    return np.array(bounds)


# How much of the bound is left in the missed frame, which lasts longer with a slow camera.
@pytest.mark.parametrize(("rate_hz", "left"), [(5.0, 0.4), (10.0, 0.6), (15.0, 0.6), (30.0, 0.8)])
def test_a_single_missed_frame_costs_little(rate_hz: float, left: float) -> None:
    looks = [0.9] * round(2.0 * rate_hz)
    bounds = bounds_of([*looks, "unseen", 0.9], rate_hz)
    before, missed, after = bounds[-3:]
    assert left * before < missed < before
    assert after > 0.8 * before


@pytest.mark.parametrize("rate_hz", [10.0, 15.0, 30.0])
def test_missed_frames_in_a_row_end_awareness_within_0_3_s(rate_hz: float) -> None:
    looks, misses = [0.95] * round(2.0 * rate_hz), ["unseen"] * round(0.3 * rate_hz)
    bounds = bounds_of([*looks, *misses], rate_hz)
    assert (np.diff(bounds[-len(misses) - 1 :]) < 0.0).all()
    assert bounds[-1] < 0.25 * bounds[-len(misses) - 1]


def test_a_frame_without_a_face_ends_the_grace() -> None:
    looks = [0.95] * 60
    faceless = bounds_of([*looks, None, "unseen"], 30.0)
    missed = bounds_of([*looks, "unseen", "unseen"], 30.0)
    assert faceless[-1] < faceless[-2] < missed[-2]
    slow = TrackerConfig(awareness=AwarenessFilterConfig(missed_frame_s=0.0))
    assert faceless[-1] == pytest.approx(bounds_of([*looks, None, "unseen"], 30.0, config=slow)[-1])


@given(belief=beliefs, age_s=ages, step_s=ages, period_s=periods)
def test_the_bound_never_rises_while_unseen(
    belief: AwarenessBelief, age_s: float, step_s: float, period_s: float
) -> None:
    stamps = np.array([-age_s])
    after = drift_unseen(belief, 0.0, step_s, stamps, period_s, CONFIG)
    assert after.bound <= belief.bound
    assert estimate(after, CONFIG).awareness_lower <= estimate(belief, CONFIG).awareness_lower
    # The grace changes how fast, and no more than that: the belief is between the two constants'.
    slow = drift(belief, step_s, CONFIG.evidence_time_constant_s, CONFIG)
    fast = drift(belief, step_s, CONFIG.unseen_time_constant_s, CONFIG)
    low, high = sorted((float(slow.mean[0]), float(fast.mean[0])))
    assert low - 1e-9 <= float(after.mean[0]) <= high + 1e-9


@given(belief=beliefs, age_s=ages, step_s=ages, share=st.floats(0.0, 1.0), period_s=periods)
def test_drift_while_unseen_is_exact_in_time(
    belief: AwarenessBelief, age_s: float, step_s: float, share: float, period_s: float
) -> None:
    stamps, middle_s = np.array([-age_s]), share * step_s
    once = drift_unseen(belief, 0.0, step_s, stamps, period_s, CONFIG)
    middle = drift_unseen(belief, 0.0, middle_s, stamps, period_s, CONFIG)
    twice = drift_unseen(middle, middle_s, step_s, stamps, period_s, CONFIG)
    for name in ("mean", "variance", "bound"):
        assert getattr(twice, name) == pytest.approx(getattr(once, name), abs=1e-9)


def test_without_a_last_face_there_is_no_grace() -> None:
    belief = AwarenessBelief(np.array([1.0]), np.array([1.0]), np.array([1.0 - Z]))
    after = drift_unseen(belief, 0.0, 0.2, np.array([np.nan]), 0.1, CONFIG)
    assert after.mean == drift(belief, 0.2, CONFIG.unseen_time_constant_s, CONFIG).mean


@pytest.mark.parametrize(
    ("period_s", "expected_s"), [(0.03, 0.1), (0.1, 0.1), (0.2, 0.2), (1.0, 0.25), (math.inf, 0.1)]
)
def test_the_grace_is_one_frame_within_limits(period_s: float, expected_s: float) -> None:
    assert grace_s(period_s, CONFIG) == expected_s
    assert grace_s(period_s, AwarenessFilterConfig(missed_frame_s=0.0)) == 0.0


def test_a_prediction_is_a_frame_that_missed_the_person() -> None:
    for ahead_s in (0.05, 0.1, 0.17, 0.3):
        tracker = PersonTracker()
        for step in range(30):
            now = 0.1 * step
            tracker.update([observe((3.0, 0.0), now, awareness=0.9)], now, CAMERA)
        (predicted,) = tracker.predict(now + ahead_s)
        (missed,) = tracker.update([], now + ahead_s, CAMERA)
        assert predicted.awareness_lower == missed.awareness_lower
        assert predicted.awareness == missed.awareness


def test_a_wrong_sigma_moves_the_bound_less_than_before() -> None:
    as_reported = TrackerConfig(awareness=AwarenessFilterConfig(reported_std_weight=1.0))
    for alpha in (0.5, 0.7, 0.9):
        spread = [
            np.ptp([bounds_of([alpha] * 40, 10.0, std, config)[-1] for std in (0.05, 0.1, 0.2)])
            for config in (TrackerConfig(), as_reported)
        ]
        assert spread[0] < 0.75 * spread[1]


def test_a_sigma_is_moved_towards_the_typical_one_and_keeps_its_order() -> None:
    reported = np.array([0.0, 0.02, 0.1, 0.2, CONFIG.max_evidence_std, 0.3, 1e9, np.nan])
    trusted = trusted_std(reported, CONFIG)
    assert np.isnan(trusted).tolist() == [False] * 5 + [True] * 3
    assert trusted[2] == pytest.approx(CONFIG.typical_evidence_std)
    assert (np.diff(trusted[:5]) > 0.0).all()
    assert trusted[1] > reported[1]
    assert trusted[3] < reported[3]
    exact = AwarenessFilterConfig(reported_std_weight=1.0)
    assert trusted_std(reported[:5], exact) == pytest.approx(reported[:5])
