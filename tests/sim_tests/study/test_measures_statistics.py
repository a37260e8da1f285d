"""Intervals cover what they say they cover, and pairs are pairs."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, bootstrap

from sim_tests import SimError
from sim_tests.study.measures import (
    EpisodeRecord,
    bootstrap_interval,
    paired,
    paired_difference,
    proportion_interval,
    violates_more,
    zero_of_n_upper,
)


def coverage(draw, truth, strata=None, runs=300):
    """Share of 95 % intervals that hold the truth; its standard error is 1.3 % of 300 runs."""
    rng = np.random.default_rng(11)
    hits = 0
    for _ in range(runs):
        interval = bootstrap_interval(draw(rng), rng, strata=strata, resamples=600)
        hits += interval.low <= truth <= interval.high
    return hits / runs


def test_intervals_of_means_cover_normal_and_skewed_values():
    assert coverage(lambda rng: rng.normal(2.0, 3.0, 30), 2.0) > 0.90
    assert coverage(lambda rng: rng.exponential(1.0, 40), 1.0, runs=1000) > 0.89


def test_two_seeds_a_scenario_suffice_for_an_honest_interval():
    """The plain bootstrap within strata of two would cover 83 %, one across them nearly always."""
    scenarios = np.repeat(np.arange(20), 2)
    levels = np.random.default_rng(3).normal(0.0, 5.0, 20)[scenarios]

    def draw(rng):
        return levels + rng.normal(0.0, 1.0, 40)

    within = coverage(draw, levels.mean(), strata=scenarios.tolist())
    assert 0.88 < within < 0.985
    assert coverage(draw, levels.mean(), runs=100) > 0.99


def test_the_interval_of_a_ratio_covers_it():
    rng = np.random.default_rng(7)
    hits = 0
    for _ in range(200):
        lost = rng.gamma(2.0, 2.0, 60)
        won = lost * rng.uniform(0.1, 0.7, 60)
        interval = bootstrap_interval(won, rng, over=lost, resamples=600)
        hits += interval.low <= 0.4 <= interval.high
    assert hits / 200 > 0.89


def test_without_strata_it_agrees_with_scipy():
    values = np.random.default_rng(1).exponential(1.0, 60)
    mine = bootstrap_interval(values, np.random.default_rng(2), resamples=20_000)
    theirs = bootstrap((values,), np.mean, n_resamples=20_000, method="BCa").confidence_interval
    width = theirs.high - theirs.low
    assert mine.value == pytest.approx(values.mean())
    # Drawn are n − 1, so it is wider by √(60/59), under 1 %.
    assert mine.low == pytest.approx(theirs.low, abs=0.04 * width)
    assert mine.high == pytest.approx(theirs.high, abs=0.04 * width)


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=12), st.floats(0.1, 10.0))
def test_intervals_hold_their_value_and_scale_with_the_data(values, scale):
    def interval(given):
        return bootstrap_interval(given, np.random.default_rng(0), resamples=200)

    plain, scaled = interval(values), interval([scale * value for value in values])
    slack = 1e-9 * max(map(abs, values)) + 1e-12
    assert min(values) - slack <= plain.low <= plain.high <= max(values) + slack
    assert scaled.value == pytest.approx(scale * plain.value, abs=slack * scale)


def test_too_little_to_say_anything_is_said():
    rng = np.random.default_rng(0)
    assert not bootstrap_interval([], rng).known
    one = bootstrap_interval([3.0], rng)
    assert (one.value, one.bounded) == (3.0, False)
    same = bootstrap_interval([2.0] * 5, rng)
    assert (same.low, same.high) == (2.0, 2.0)
    assert not bootstrap_interval([1.0, 2.0], rng, over=[0.0, 0.0]).known
    # One episode alone carries the denominator: many resamples are without it.
    assert not bootstrap_interval([1.0, 0.0, 0.0], rng, over=[1.0, 0.0, 0.0]).bounded


@given(st.integers(1, 3000), st.floats(0.5, 0.999))
def test_none_of_n_leaves_the_share_that_would_have_shown_none_so_often(n, level):
    upper = zero_of_n_upper(n, level)
    assert (1.0 - upper) ** n == pytest.approx(1.0 - level, rel=1e-9)
    assert upper == pytest.approx(
        binomtest(0, n, alternative="less").proportion_ci(level, "exact").high, rel=1e-9
    )


@given(st.integers(1, 60), st.data())
def test_shares_have_the_exact_interval(n, data):
    count = data.draw(st.integers(0, n))
    interval = proportion_interval(count, n)
    assert interval.low <= interval.value <= interval.high
    if 0 < count < n:
        exact = binomtest(count, n).proportion_ci(0.95, "exact")
        assert (interval.low, interval.high) == pytest.approx((exact.low, exact.high))
    mirrored = proportion_interval(n - count, n)
    assert (mirrored.low, mirrored.high) == pytest.approx((1 - interval.high, 1 - interval.low))


def episodes(policy, lost, violation=None, scenario="a"):
    violation = [0.0] * len(lost) if violation is None else violation
    return [
        EpisodeRecord(
            scenario,
            seed,
            policy,
            "ReferencePlanner",
            "truth",
            time_lost_s=time,
            violation_time_s=violated,
            duration_s=10.0,
        )
        for seed, (time, violated) in enumerate(zip(lost, violation, strict=True))
    ]


def lost_more(blind, policy):
    return paired_difference(blind, policy, "time_lost_s", over="time_lost_s")


def violation_excess(blind, policy, over="violation_time_s"):
    return paired_difference(blind, policy, "violation_time_s", over=over)


def test_a_share_is_of_all_time_lost():
    blind = episodes("blind", [10.0, 1.0, 4.0])
    policy = episodes("balanced", [5.0, 1.0, 4.0])
    assert lost_more(blind, policy).value == pytest.approx(-5.0 / 15.0)
    assert lost_more(blind, blind).value == 0.0
    assert lost_more(blind, episodes("balanced", [20.0, 1.0, 4.0])).value > 0.0
    assert not lost_more(episodes("blind", [0.0, 0.0]), policy).known


def test_a_policy_that_halves_every_delay_loses_half_with_certainty():
    lost = np.random.default_rng(0).gamma(2.0, 2.0, 50).tolist()
    share = lost_more(episodes("blind", lost), episodes("x", [0.5 * time for time in lost]))
    assert (share.low, share.value, share.high) == pytest.approx((-0.5, -0.5, -0.5))


def test_pairs_are_of_the_same_scenario_version_and_seed_in_any_order():
    blind = episodes("blind", [3.0, 4.0, 5.0]) + episodes("blind", [6.0], scenario="b")
    policy = episodes("x", [1.0, 2.0]) + episodes("x", [6.0, 7.0], scenario="b")
    keys = [(first.scenario, first.seed) for first, _ in paired(blind[::-1], policy)]
    assert keys == [("a", 0), ("a", 1), ("b", 0)]
    other_version = [replace(record, scenario_version=2) for record in policy]
    assert paired(blind, other_version) == ()
    with pytest.raises(SimError, match="'a', seed 0 is there twice"):
        paired(blind + blind, policy)


def test_pairs_without_the_figure_are_left_out_and_counted():
    blind = episodes("blind", [3.0, 4.0, 5.0, 6.0])
    policy = episodes("x", [1.0, None, 2.0, 6.0])
    policy[3] = replace(policy[3], error="it broke")
    difference = paired_difference(blind, policy, "time_lost_s")
    assert (difference.value, difference.n, difference.left_out) == (-2.5, 2, 2)
    assert lost_more(blind, policy).left_out == 2
    with pytest.raises(SimError, match="field must be a number"):
        paired_difference(blind, policy, "reaction")


def test_pairing_takes_out_what_the_scenario_costs_everybody():
    rng = np.random.default_rng(4)
    hard = rng.normal(20.0, 10.0, 40)
    blind = episodes("blind", (hard + rng.normal(1.0, 0.1, 40)).tolist())
    policy = episodes("x", hard.tolist())
    interval = paired_difference(blind, policy, "time_lost_s", rng)
    assert -1.1 < interval.low < interval.high < -0.9


def test_longer_violation_is_relative_to_blind_and_to_its_time():
    blind = episodes("blind", [0.0] * 4, [0.2, 0.2, 0.0, 0.4])
    policy = episodes("x", [0.0] * 4, [0.3, 0.1, 0.0, 0.8])
    assert violation_excess(blind, policy).value == pytest.approx(0.4 / 0.8)
    assert violation_excess(blind, policy, "duration_s").value == pytest.approx(0.4 / 40.0)
    assert violates_more(blind, policy).value == 0.5
    never = episodes("blind", [0.0] * 4)
    assert not violation_excess(never, policy).known
    none = violates_more(never, never)
    assert (none.value, none.high) == (0.0, zero_of_n_upper(4))
