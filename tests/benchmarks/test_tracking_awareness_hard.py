"""The hard simulation of benchmarks/tracking_awareness: passers-by, missed frames, a wrong σ."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tracking_awareness import PlainLogit, main, make_hard_set, threshold_for, track
from benchmarks.tracking_awareness._hard_cli import joined, missed_targets
from tracking import AwarenessFilterConfig, TrackerConfig


@pytest.fixture(scope="module")
def hard():
    return make_hard_set(40, 10.0, 40, 40.0)


def test_the_same_seed_gives_the_same_passers_by():
    first, second = (make_hard_set(3, 10.0, 2, 10.0) for _ in range(2))
    assert first.attention.awareness.tobytes() == second.attention.awareness.tobytes()
    assert first.measured.awareness_std.tobytes() == second.measured.awareness_std.tobytes()


def test_single_frames_are_missed_as_described(hard):
    in_sight, seen = hard.in_sight, hard.measured.seen
    assert not (seen & ~in_sight).any()
    assert 0.65 < seen[in_sight].mean() < 0.8
    # Most misses are of one frame: the person is shown before and after.
    single = in_sight[1:-1] & ~seen[1:-1] & seen[:-2] & seen[2:]
    assert single.sum() > 0.35 * (in_sight & ~seen).sum()


def test_the_reported_sigma_is_wrong_by_up_to_two_and_stays_so_for_a_while(hard):
    shown = ~np.isnan(hard.measured.awareness) & (hard.attention.awareness > 0.3)
    shown &= hard.attention.awareness < 0.7  # clipping at 0 and 1 does not matter here
    error = (hard.measured.awareness - hard.attention.awareness)[shown]
    std = hard.measured.awareness_std[shown]
    low, high = np.quantile(std, (0.25, 0.75))
    # With an honest σ both would be 1.
    assert np.std(error[std < low]) > 1.2 * std[std < low].mean()
    assert np.std(error[std > high]) < 0.8 * std[std > high].mean()
    logs = np.log(hard.measured.awareness_std)
    steps = np.abs(np.diff(logs, axis=0))
    assert np.nanmedian(steps) < 0.5 * np.nanstd(logs)


def test_missed_frames_and_a_wrong_sigma_cost_less_than_before(hard):
    recalls = []
    before = AwarenessFilterConfig(missed_frame_s=0.0, reported_std_weight=1.0)
    for config in (AwarenessFilterConfig(), before):
        _, lower = track(hard.attention, hard.measured, TrackerConfig(awareness=config))
        threshold = threshold_for(lower, hard.attention.awareness)
        scores = joined([hard], [lower], threshold)
        assert scores.above_unseen == 0.0
        assert scores.false_share <= 0.011
        recalls.append(scores.recall)
    assert recalls[0] > recalls[1] + 0.03


def test_the_plain_filter_raises_no_bound_without_evidence(hard):
    _, lower = PlainLogit()(hard.attention.stamps_s, hard.measured)
    blind = np.isnan(hard.measured.awareness[1:])
    assert (np.diff(lower, axis=0)[blind] <= 1e-12).all()


def test_a_missed_target_is_named(hard):
    nothing = np.zeros_like(hard.measured.awareness)
    scores = joined([hard], [nothing], 0.5)
    assert "10 Hz: recall misses its target" in missed_targets(10.0, scores)
    always = joined([hard], [nothing + 1.0], 0.5)
    assert missed_targets(5.0, always) == ["5 Hz: above_unseen misses its target"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--hard", "--train-seed", "1", "--test-seed", "3"], "at least 4 apart"),
        (["--hard", "--plot", "a.png"], "no plot"),
    ],
)
def test_bad_options_of_the_hard_mode_are_refused(arguments, message, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2
    assert message in capsys.readouterr().err


def test_the_hard_mode_prints_a_table_for_each_rate(capsys):
    main(["--hard", "--only-ours", "--people", "2", "--duration", "8"])
    shown = capsys.readouterr().out
    assert all(f"{rate} Hz\n" in shown for rate in (5, 10, 15, 30))
