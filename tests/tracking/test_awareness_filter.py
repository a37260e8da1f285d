"""The awareness filter alone: exactness, bounds, and the meaning of a measurement."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm

from tracking import AwarenessFilterConfig
from tracking.awareness_filter import (
    PRIOR,
    AwarenessBelief,
    drift,
    drift_unseen,
    estimate,
    evidence,
    forget,
    grace_s,
    logit,
    measure,
    sigmoid,
    trusted_std,
)

CONFIG = AwarenessFilterConfig()
Z = float(norm.ppf(CONFIG.lower_bound_confidence))
TAU_S = CONFIG.unseen_time_constant_s
# docs/tracking.md: the prior, the clipped ends, the least and the largest deviations.
PRIOR_AWARENESS, PRIOR_VARIANCE = 0.05, 2.0**2
CLIP, LEAST_STD, MOST_STD = 0.02, 0.3, 0.29
CORRELATION_S = 0.1
alphas = st.floats(0.0, 1.0)
stds = st.floats(0.0, MOST_STD)
intervals = st.floats(1e-3, 10.0)
# Any mean, any variance that a filter started at the prior can have, a bound below the mean.
beliefs = st.builds(
    lambda mean, variance, slack: AwarenessBelief(
        mean, variance, mean - Z * math.sqrt(variance) - slack
    ),
    st.floats(-8.0, 8.0),
    st.floats(1e-4, PRIOR_VARIANCE),
    st.just(0.0) | st.floats(0.0, 10.0),
)


@given(belief=beliefs, dt_s=st.floats(1e-3, 5.0))
def test_the_bound_falls_to_the_lowest_value_during_the_step(belief, dt_s) -> None:
    phi = np.exp(-np.linspace(0.0, dt_s, 4001) / TAU_S)
    m0 = logit(PRIOR_AWARENESS)
    path = (
        m0
        + phi * (belief.mean - m0)
        - Z * np.sqrt(PRIOR_VARIANCE + phi**2 * (belief.variance - PRIOR_VARIANCE))
    )
    lowest = min(belief.bound, path.min())
    after = drift(belief, dt_s, TAU_S, CONFIG).bound
    assert after <= lowest + 1e-9
    assert after == pytest.approx(lowest, abs=1e-3)
    assert forget(belief, CONFIG).bound <= belief.bound


@given(belief=beliefs, dt_s=intervals)
def test_a_hidden_face_lowers_the_bound_at_least_as_fast_as_being_unseen(belief, dt_s) -> None:
    no_face = drift(belief, dt_s, CONFIG.no_face_time_constant_s, CONFIG)
    unseen = drift(belief, dt_s, CONFIG.unseen_time_constant_s, CONFIG)
    assert no_face.bound <= unseen.bound + 1e-12


@given(belief=beliefs)
def test_without_evidence_the_belief_ends_at_the_prior(belief: AwarenessBelief) -> None:
    after = drift(belief, 100.0 * TAU_S, TAU_S, CONFIG)
    assert sigmoid(after.mean) == pytest.approx(PRIOR_AWARENESS)
    assert after.variance == pytest.approx(PRIOR_VARIANCE)


@given(belief=beliefs, alpha=alphas, std=stds, dt_s=intervals)
def test_a_measurement_is_a_scalar_bayes_update(belief, alpha, std, dt_s) -> None:
    measured = evidence(alpha, std)
    assert measured is not None
    mean, variance = measured
    variance = variance * max(1.0, CORRELATION_S / dt_s)
    information = 1.0 / belief.variance + 1.0 / variance
    after = measure(belief, measured, dt_s, CONFIG)
    assert after.variance == pytest.approx(1.0 / information)
    assert after.mean == pytest.approx(
        (belief.mean / belief.variance + mean / variance) / information, abs=1e-9
    )
    assert after.bound == pytest.approx(after.mean - Z * math.sqrt(after.variance))


@given(alpha=alphas, std=stds)
def test_the_one_sigma_points_of_a_measurement_are_those_of_alpha(alpha: float, std: float) -> None:
    measured = evidence(alpha, std)
    assert measured is not None
    mean, variance = measured
    sigma = math.sqrt(variance)
    epsilon = CLIP
    assert sigma >= LEAST_STD
    if sigma > LEAST_STD + 1e-9:
        for sign in (-1.0, 1.0):
            point = min(max(alpha + sign * std, epsilon), 1.0 - epsilon)
            assert sigmoid(mean + sign * sigma) == pytest.approx(point)


@given(low=alphas, high=alphas, std=stds)
def test_a_higher_alpha_is_higher_evidence(low: float, high: float, std: float) -> None:
    low, high = sorted((low, high))
    first, second = evidence(low, std), evidence(high, std)
    assert first is not None
    assert second is not None
    assert first.mean <= second.mean


def test_a_confident_zero_is_confident_unawareness() -> None:
    measured = evidence(0.0, 0.05)
    assert measured is not None
    mean, variance = measured
    # By the derivative at ε it would have almost no weight: σ = 0.05 / (0.02 · 0.98) = 2.6.
    assert sigmoid(mean + 2.0 * math.sqrt(variance)) < 0.1
    after = estimate(measure(PRIOR, measured, 1.0, CONFIG))
    assert after.awareness < PRIOR_AWARENESS
    assert after.awareness_std < 0.02


def test_an_alpha_with_a_large_standard_deviation_is_no_evidence() -> None:
    assert evidence(1.0, MOST_STD) is not None
    assert evidence(1.0, 0.3) is None
    assert evidence(1.0, 1e9) is None
    assert evidence(None, None) is None


@given(mean=st.floats(-12.0, 12.0), variance=st.floats(1e-4, 25.0))
def test_an_estimate_is_a_probability_with_a_bounded_deviation(mean, variance) -> None:
    result = estimate(AwarenessBelief(mean, variance, mean - Z * math.sqrt(variance)))
    assert 0.0 <= result.awareness_lower <= result.awareness <= 1.0
    assert 0.0 <= result.awareness_std <= 0.5


@pytest.mark.parametrize("mean", [-4.0, 0.0, 2.5])
@pytest.mark.parametrize("variance", [0.05, 2.25])
def test_the_deviation_is_that_of_the_logit_normal_distribution(mean, variance) -> None:
    std = math.sqrt(variance)

    def moment(order: int) -> float:
        density = norm(mean, std).pdf
        low, high = mean - 9.0 * std, mean + 9.0 * std
        return float(quad(lambda x: sigmoid(x) ** order * density(x), low, high)[0])

    expected = math.sqrt(moment(2) - moment(1) ** 2)
    assert estimate(AwarenessBelief(mean, variance)).awareness_std == pytest.approx(
        expected, rel=0.01
    )


@given(value=st.floats(-12.0, 12.0))
def test_a_lower_bound_below_the_clip_is_zero(value: float) -> None:
    epsilon = CLIP
    lower = estimate(AwarenessBelief(value, 1.0, value)).awareness_lower
    assert lower == pytest.approx(max(0.0, (sigmoid(value) - epsilon) / (1.0 - epsilon)))
    assert lower <= sigmoid(value)
    assert lower == 0.0 or sigmoid(value) > epsilon


def test_the_prior_has_a_lower_bound_of_zero() -> None:
    assert estimate(PRIOR).awareness_lower == 0.0
    assert estimate(PRIOR).awareness == pytest.approx(PRIOR_AWARENESS)


ages = st.floats(0.0, 1.0)
periods = st.floats(0.02, 1.0) | st.just(math.inf)


@given(belief=beliefs, age_s=ages, step_s=ages, period_s=periods)
def test_the_bound_never_rises_while_unseen(belief, age_s, step_s, period_s) -> None:
    after = drift_unseen(belief, 0.0, step_s, -age_s, period_s, CONFIG)
    assert after.bound <= belief.bound
    assert estimate(after).awareness_lower <= estimate(belief).awareness_lower
    # The grace changes how fast, and no more than that: the belief is between the two constants'.
    slow = drift(belief, step_s, CONFIG.evidence_time_constant_s, CONFIG)
    fast = drift(belief, step_s, CONFIG.unseen_time_constant_s, CONFIG)
    low, high = sorted((slow.mean, fast.mean))
    assert low - 1e-9 <= after.mean <= high + 1e-9


@given(belief=beliefs, age_s=ages, step_s=ages, share=st.floats(0.0, 1.0), period_s=periods)
def test_drift_while_unseen_is_exact_in_time(belief, age_s, step_s, share, period_s) -> None:
    middle_s = share * step_s
    once = drift_unseen(belief, 0.0, step_s, -age_s, period_s, CONFIG)
    middle = drift_unseen(belief, 0.0, middle_s, -age_s, period_s, CONFIG)
    twice = drift_unseen(middle, middle_s, step_s, -age_s, period_s, CONFIG)
    for name in ("mean", "variance", "bound"):
        assert getattr(twice, name) == pytest.approx(getattr(once, name), abs=1e-9)


def test_without_a_last_face_there_is_no_grace() -> None:
    belief = AwarenessBelief(1.0, 1.0, 1.0 - Z)
    after = drift_unseen(belief, 0.0, 0.2, -math.inf, 0.1, CONFIG)
    assert after.mean == drift(belief, 0.2, CONFIG.unseen_time_constant_s, CONFIG).mean


@pytest.mark.parametrize(
    ("period_s", "expected_s"), [(0.03, 0.1), (0.1, 0.1), (0.2, 0.2), (1.0, 0.25), (math.inf, 0.1)]
)
def test_the_grace_is_one_frame_within_limits(period_s: float, expected_s: float) -> None:
    assert grace_s(period_s, CONFIG) == expected_s
    assert grace_s(period_s, AwarenessFilterConfig(missed_frame_s=0.0)) == 0.0


def test_a_sigma_is_moved_towards_the_typical_one_and_keeps_its_order() -> None:
    reported = [0.0, 0.02, 0.1, 0.2, MOST_STD]
    trusted = [trusted_std(std) or 0.0 for std in reported]
    assert [trusted_std(std) for std in (0.3, 1e9, None)] == [None] * 3
    assert trusted[2] == pytest.approx(0.1)
    assert trusted == sorted(trusted)
    assert trusted[1] > reported[1]
    assert trusted[3] < reported[3]
    # A reported σ that is twice another counts as 2^0.6 times it.
    assert trusted[3] / trusted[2] == pytest.approx(2.0**0.6)
