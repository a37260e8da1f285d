"""The simulated attention of benchmarks/tracking_awareness, its scores and its command."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.tracking_awareness import (
    FALSE_SHARE,
    HistogramFilter,
    LogitGaussian,
    Measured,
    Smoothed,
    autoregressive,
    directions,
    hold_latest,
    judge,
    main,
    make_set,
    measure,
    missed_targets,
    onset_times_s,
    release_times_s,
    score,
    simulate,
    threshold_for,
    time_unseen_s,
    track,
)
from perception import AttentionCone
from tracking import TrackerConfig

FILTERS = [
    LogitGaussian(),
    LogitGaussian(reset_below_sigmas=2.5),
    LogitGaussian(reset_above_sigmas=2.5),
    LogitGaussian(bias_std_logit=0.5),
    HistogramFilter(),
    HistogramFilter(bins=2),
    Smoothed(),
]


@pytest.fixture(scope="module")
def small():
    return make_set(5, 20.0, 12, 40.0)


def test_the_same_seed_gives_the_same_people():
    first, second = (make_set(3, 10.0, 2, 6.0) for _ in range(2))
    assert first.attention.awareness.tobytes() == second.attention.awareness.tobytes()
    assert first.measured.awareness.tobytes() == second.measured.awareness.tobytes()


def test_true_awareness_is_the_cone_of_the_angle_between_gaze_and_robot(small):
    attention = small.attention
    sight = -attention.heads_camera_m
    sight = sight / np.linalg.norm(sight, axis=2, keepdims=True)
    gaze = directions(attention.heads_camera_m, attention.gaze_rad)
    assert np.linalg.norm(gaze, axis=2) == pytest.approx(1.0)
    angle = np.arccos(np.clip((gaze * sight).sum(axis=2), -1.0, 1.0))
    edge = AttentionCone().half_angle_rad
    expected = np.where(angle < edge, 1.0 - np.tan(np.minimum(angle, edge)) / math.tan(edge), 0.0)
    # arccos is inexact near 0.
    assert attention.awareness == pytest.approx(expected, abs=1e-6)
    straight = directions(attention.heads_camera_m, np.zeros_like(attention.gaze_rad))
    assert straight == pytest.approx(sight, abs=1e-12)


def test_glances_have_the_lengths_that_were_set():
    attention = simulate(np.random.default_rng(0), 60, 120.0, 50.0)
    # A turn takes a quarter of a second, and the cone is left within part of it.
    aware = attention.awareness >= 0.5
    lengths = []
    for person in aware.T:
        edges = np.flatnonzero(np.diff(person.astype(int)))
        starts = edges[~person[edges]]
        lengths += [
            (edges[edges > start][0] - start) / 50.0 for start in starts if (edges > start).any()
        ]
    assert np.median(lengths) == pytest.approx(0.83, abs=0.1)
    assert np.percentile(lengths, 75) == pytest.approx(1.5, abs=0.25)
    reach = np.hypot(attention.heads_camera_m[..., 0], attention.heads_camera_m[..., 2])
    assert reach.max() < 8.01


def test_errors_are_as_large_as_those_of_the_shipped_networks():
    data = make_set(7, 10.0, 60, 60.0)
    near = np.linalg.norm(data.attention.heads_camera_m, axis=2) < 6.0
    degrees = np.degrees(data.measured.error_rad[near])
    assert np.median(degrees) == pytest.approx(4.9, abs=0.7)
    assert np.percentile(degrees, 90) == pytest.approx(13.0, abs=2.0)
    truth, alpha = data.attention.awareness, data.measured.awareness
    informative = near & ~np.isnan(alpha) & ((truth > 0.0) | (alpha > 0.0))
    error = np.abs(alpha - truth)[informative]
    assert (error <= data.measured.awareness_std[informative]).mean() == pytest.approx(
        0.68, abs=0.08
    )


def test_autoregressive_noise_has_unit_variance_and_its_correlation_time():
    stamps = np.arange(4000) * 0.05
    noise = autoregressive(np.random.default_rng(1), stamps, np.full(40, 0.3), 1)[..., 0]
    assert noise.var() == pytest.approx(1.0, rel=0.05)
    lagged = (noise[:-6] * noise[6:]).mean()
    assert lagged == pytest.approx(math.exp(-1.0), abs=0.04)


def test_the_filter_alone_equals_the_filter_in_the_tracker(small):
    # People stand still at exact positions, so that no match is ambiguous.
    still = np.broadcast_to((0.0, 0.0, 3.0), small.measured.chests_camera_m.shape)
    measured = replace(
        small.measured,
        chests_camera_m=still,
        chest_covariances_m2=np.zeros_like(small.measured.chest_covariances_m2) + 0.01 * np.eye(3),
    )
    _, alone = LogitGaussian()(small.attention.stamps_s, measured)
    _, tracked = track(small.attention, measured, TrackerConfig())
    # Until a person is confirmed the tracker's bound is 0, as after being unseen for long.
    unseen_s = time_unseen_s(small.attention.stamps_s, measured.seen)
    kept = (unseen_s[20:] < 3.0).all(axis=0)
    settled = np.arange(len(alone)) > 20
    assert kept.sum() >= 6
    assert alone[settled][:, kept] == pytest.approx(tracked[settled][:, kept], abs=1e-9)


@pytest.mark.parametrize("one", FILTERS)
def test_no_filter_raises_its_bound_without_evidence(one, small):
    _, lower = one(small.attention.stamps_s, small.measured)
    blind = np.isnan(small.measured.awareness[1:])
    assert (np.diff(lower, axis=0)[blind] <= 1e-12).all()
    assert ((lower >= 0.0) & (lower <= 1.0)).all()


def test_holding_the_latest_value_is_dangerous(small):
    stamps, seen = small.attention.stamps_s, small.measured.seen
    unseen = time_unseen_s(stamps, seen) > 0.3
    truth = small.attention.awareness
    for one, dangerous in ((hold_latest, True), (LogitGaussian(), False)):
        _, lower = one(stamps, small.measured)
        above = lower > threshold_for(lower, truth)
        assert above[unseen].any() == dangerous


def test_one_per_cent_of_unaware_frames_exceed_the_threshold():
    rng = np.random.default_rng(2)
    lower, truth = rng.random((1000, 20)), np.zeros((1000, 20))
    assert (lower > threshold_for(lower, truth)).mean() == pytest.approx(FALSE_SHARE, abs=1e-3)


def test_onset_and_release_times_of_known_cases():
    stamps = np.arange(40) * 0.1
    truth = np.zeros((40, 1))
    truth[10:20] = 0.9
    seen = np.ones((40, 1), dtype=bool)
    above = np.zeros((40, 1), dtype=bool)
    above[12:22] = True
    assert onset_times_s(stamps, truth, seen, above) == pytest.approx([0.3])
    assert release_times_s(stamps, truth, seen, above) == pytest.approx([0.3])
    assert np.isinf(onset_times_s(stamps, truth, seen, np.zeros_like(above))).all()
    # A person who is no longer seen must be released although they still look.
    truth[10:] = 0.9
    seen[16:] = False
    assert release_times_s(stamps, truth, seen, above) == pytest.approx([0.7])
    assert time_unseen_s(stamps, seen)[-1, 0] == pytest.approx(stamps[-1] - stamps[15])


def test_shares_of_known_cases():
    stamps = np.arange(4) * 0.1
    truth = np.array([[0.0], [0.1], [0.8], [0.9]])
    lower = np.array([[0.0], [0.3], [0.5], [0.1]])
    yes = np.ones((4, 1), dtype=bool)
    found = score(stamps, truth, yes, yes, lower, 0.2)
    assert found.coverage == pytest.approx(0.75)
    assert found.coverage_partial == pytest.approx(2 / 3)
    assert found.false_share == pytest.approx(0.5)
    assert found.recall == pytest.approx(0.5)


@pytest.mark.parametrize("rate_hz", [10.0, pytest.param(20.0, marks=pytest.mark.full), 30.0])
def test_the_tracker_meets_its_targets_on_seeds_it_was_not_tuned_on(rate_hz):
    train, test = (make_set(seed, rate_hz, 16, 40.0) for seed in (31, 32))
    _, lower = track(train.attention, train.measured, TrackerConfig())
    threshold = threshold_for(lower, train.attention.awareness)
    _, lower = track(test.attention, test.measured, TrackerConfig())
    scores = judge(test, lower, threshold)
    assert missed_targets(scores) == [], scores


def test_a_camera_that_sees_nobody_measures_nothing(small):
    blind = Measured(
        np.zeros_like(small.measured.seen),
        np.full_like(small.measured.awareness, np.nan),
        np.full_like(small.measured.awareness, np.nan),
        small.measured.chests_camera_m,
        small.measured.chest_covariances_m2,
        small.measured.error_rad,
    )
    _, lower = track(small.attention, blind, TrackerConfig())
    assert not lower.any()


def test_only_people_in_sight_have_a_measured_alpha():
    attention = simulate(np.random.default_rng(9), 5, 10.0, 20.0)
    measured = measure(attention, np.random.default_rng(10))
    shown = ~np.isnan(measured.awareness)
    assert (measured.seen | ~shown).all()
    assert (shown == ~np.isnan(measured.awareness_std)).all()


@pytest.mark.parametrize(
    "arguments",
    [
        ["--people", "0"],
        ["--duration", "1"],
        ["--person", "40"],
        ["--train-seed", "3", "--test-seed", "3"],
        ["--plot", "nowhere/one.png"],
        ["--plot", "one.jpeg"],
        ["--out", "nowhere/figures.json"],
    ],
)
def test_the_command_refuses_bad_input(arguments, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    assert "error: --" in capsys.readouterr().err


def test_the_command_writes_figures_and_a_picture(tmp_path, monkeypatch, capsys):
    picture, figures = Path("one.png"), Path("figures.json")
    monkeypatch.chdir(tmp_path)
    main(
        f"--people 3 --duration 8 --only-ours --baseline none.json --plot {picture} "
        f"--out {figures}".split()
    )
    assert picture.stat().st_size > 10_000
    assert '"20hz_recall"' in figures.read_text()
    assert "release s" in capsys.readouterr().out
