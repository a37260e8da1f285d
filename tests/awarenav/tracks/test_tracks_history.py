"""The life of a track: when it was seen, what stretches it has, what it is on average."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from awarenav.tracks._history import HistoryBuilder, TrackHistory, TrackSample


def sample(stamp_s, *, seen=True, status="confirmed", is_frame=True, awareness=0.5):
    return TrackSample(
        stamp_s=stamp_s,
        status=status,
        is_frame=is_frame,
        seen=seen,
        position_odom_m=np.array([stamp_s, 0.0]),
        velocity_odom_mps=np.array([1.0, 0.0]),
        position_covariance_m2=0.01 * np.eye(2),
        awareness=awareness,
        awareness_std=0.1,
        awareness_lower=0.5 * awareness,
    )


def history(samples, died_s=None):
    made = TrackHistory(1, samples[0])
    for each in samples[1:]:
        made.add(each)
    made.died_s = died_s
    return made


def test_a_span_goes_to_the_end_and_a_pause_of_the_camera_is_one_but_no_interval_of_frames():
    for died_s, end_s in ((None, 0.2), (0.3, 0.3)):
        gone = history([sample(0.1 * k, seen=k == 0) for k in range(3)], died_s)
        assert list(gone.unseen_spans()) == [(0.0, end_s)]
    slow = history([sample(0.0), sample(0.2, seen=False, is_frame=False), sample(0.4)])
    assert list(slow.unseen_spans()) == []
    paused = history([sample(0.0), sample(0.5, seen=False, is_frame=False), sample(1.0)])
    assert list(paused.unseen_spans()) == [(0.0, 1.0)]


@given(st.lists(st.booleans(), min_size=1, max_size=30))
def test_unseen_spans_cover_every_unseen_frame_and_no_seen_one(shown):
    shown = [True, *shown]
    made = history([sample(0.1 * k, seen=each) for k, each in enumerate(shown)])
    covered = list(made.unseen_spans())
    for each in made.samples:
        inside = any(start < each.stamp_s < end for start, end in covered)
        at_the_end = not each.seen and each is made.samples[-1]
        assert inside == (not each.seen and not at_the_end)
    assert made.seen_frames == sum(shown)


@given(st.lists(st.sampled_from(["tentative", "confirmed", "coasting"]), min_size=1, max_size=20))
def test_segments_join_without_a_gap_and_have_one_status_each(statuses):
    made = history([sample(0.1 * k, status=status) for k, status in enumerate(statuses)])
    runs = list(made.segments())
    for (_, before), (_, after) in itertools.pairwise(runs):
        assert after[0] is before[-1]
    fresh = [runs[0][1], *(run[1:] for _, run in runs[1:])]
    assert [each for run in fresh for each in run] == made.samples
    for (status, _), run in zip(runs, fresh, strict=True):
        assert {each.status for each in run} == {status}


def test_who_comes_back_gets_a_new_segment_and_means_leave_out_what_is_not_known():
    made = history([sample(stamp_s, status="given") for stamp_s in (0.0, 0.1, 0.2, 2.0, 2.1)])
    assert [len(run) for _, run in made.segments()] == [3, 2]
    made = history(
        [
            sample(0.0, awareness=0.2),
            sample(0.1, awareness=0.9, is_frame=False),
            sample(0.2, awareness=0.4),
            sample(0.3, awareness=math.nan),
        ]
    )
    assert made.mean("awareness") == pytest.approx(0.3)
    assert math.isnan(made.mean("measured_awareness"))


def test_stamps_that_go_back_are_refused_and_a_second_frame_of_an_instant_keeps_what_was_seen():
    made = history([sample(0.0), sample(0.1)])
    with pytest.raises(ValueError, match="go back"):
        made.add(sample(0.05))
    made.add(sample(0.1, seen=False))
    assert [each.seen for each in made.samples] == [True, True]


def test_a_track_that_is_missing_has_died_until_it_comes_back():
    builder = HistoryBuilder()
    builder.add(0.0, [(1, sample(0.0)), (2, sample(0.0))])
    builder.add(0.1, [(2, sample(0.1))])
    assert [each.died_s for each in builder.histories()] == [0.1, None]
    builder.add(0.2, [(1, sample(0.2))])
    assert [each.died_s for each in builder.histories()] == [None, 0.2]
