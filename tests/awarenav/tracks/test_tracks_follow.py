"""The tracker over a recording: what is kept is what the tracker said, late frames or not."""

from __future__ import annotations

import numpy as np
import pytest
from track_lines import lines, pose, recorded, standing, walking

from awarenav.errors import AwarenavError
from awarenav.estimate._results import track_record
from awarenav.tracks._tracking import track_recording, tracks_in_file
from tracking import PersonTracker

WALKERS = [walking(4.0, -2.0, 0.0, 1.0), standing(5.0, 1.0)]


def drawn(run):
    """All that is drawn of a run, as numbers."""
    return [
        (each.id, s.stamp_s, s.status, s.seen, *s.position_odom_m, s.awareness, s.awareness_lower)
        for each in run.histories
        for s in each.samples
    ]


def test_histories_are_the_tracks_of_the_tracker(tmp_path):
    recording = recorded(tmp_path, lines(WALKERS, hidden=lambda k, who: who == 0 and 15 < k < 22))
    run = track_recording(recording)
    tracker = PersonTracker()
    told = {}
    for frame in recording.frames:
        for track in tracker.update(frame.observations, frame.stamp_s, frame.T_odom_camera):
            told[track.id, track.stamp_s] = track
    kept = {(each.id, s.stamp_s): s for each in run.histories for s in each.frames}
    assert kept.keys() == told.keys()
    for key, track in told.items():
        sample = kept[key]
        assert sample.status == track.status
        assert sample.seen == (track.time_since_seen_s == 0.0)
        assert sample.awareness_lower == track.awareness_lower
        np.testing.assert_array_equal(sample.position_odom_m, track.position_odom_m)
        np.testing.assert_array_equal(sample.position_covariance_m2, track.covariance_odom[:2, :2])


def test_measured_awareness_goes_to_the_track_that_it_is_of(tmp_path):
    records = lines(WALKERS)
    for record in records:
        for who, someone in enumerate(record["people"]):
            someone["awareness"] = 0.2 if who else 0.8
    run = track_recording(recorded(tmp_path, records))
    assert [each.mean("measured_awareness") for each in run.histories] == pytest.approx([0.8, 0.2])


def test_a_pause_is_filled_with_predictions_that_fall_and_frames_stay_frames(tmp_path):
    records = [record for record in lines(WALKERS) if not 1.0 < record["stamp_s"] < 2.0]
    run = track_recording(recorded(tmp_path, records))
    for each in run.histories:
        paused = [s for s in each.samples if 1.0 < s.stamp_s < 2.0]
        assert len(paused) >= 5
        assert not any(s.is_frame or s.seen for s in paused)
        lower = [s.awareness_lower for s in paused]
        assert lower == sorted(lower, reverse=True)
        assert len(each.frames) == len(records)


def test_late_frames_within_the_lag_give_the_tracks_of_sorted_frames(tmp_path):
    records = lines(WALKERS, frames=30)
    shuffled = list(records)
    for k in (3, 9, 17, 24):
        shuffled[k], shuffled[k + 2] = shuffled[k + 2], shuffled[k]
    in_order = track_recording(recorded(tmp_path, records))
    late = track_recording(recorded(tmp_path, shuffled, "late.jsonl"))
    assert drawn(late) == drawn(in_order)
    assert any("late frames put back" in remark for remark in late.remarks)


@pytest.mark.parametrize(
    ("at", "ahead_s", "remark"),
    [
        (25, 0.0, "1 late frame refused"),
        (5, 4.0, "1 frame far ahead of those that follow: not used"),
    ],
)
def test_a_frame_far_too_late_or_ahead_is_counted_and_changes_nothing(
    tmp_path, at, ahead_s, remark
):
    records = lines(WALKERS, frames=30)
    wrong = {**records[5], "stamp_s": records[5]["stamp_s"] + ahead_s}
    del records[5]
    run = track_recording(recorded(tmp_path, [*records[:at], wrong, *records[at:]]))
    assert drawn(run) == drawn(track_recording(recorded(tmp_path, records, "without.jsonl")))
    assert any(each.startswith(remark) for each in run.remarks)
    assert len(run.camera_stamps_s) == len(records)


def test_the_path_of_the_camera_is_where_it_looks(tmp_path):
    records = lines(WALKERS, frames=5, camera=lambda stamp_s: pose(stamp_s, 2.0, 0.3 * stamp_s))
    run = track_recording(recorded(tmp_path, records))
    stamps = np.arange(5) / 10.0
    expected = np.stack([stamps, np.full(5, 2.0), 0.3 * stamps], axis=1)
    np.testing.assert_allclose(run.camera_poses, expected, atol=1e-12)
    assert run.span_s == (0.0, 0.4)


def test_a_frame_that_the_tracker_cannot_use_is_named(tmp_path):
    records = lines([standing(4.0, 0.0)], frames=8)
    records[6]["people"][0]["position_camera_m"] = [0.0, 0.0, 1e9]
    with pytest.raises(AwarenavError, match=r"estimates\.jsonl, frame '000006': .*within 100000 m"):
        track_recording(recorded(tmp_path, records))


def test_ids_of_a_file_are_taken_as_they_are(tmp_path):
    records = lines(WALKERS, named=True, hidden=lambda k, who: who == 1 and k >= 30)
    run = tracks_in_file(recorded(tmp_path, records))
    assert [each.id for each in run.histories] == [0, 1]
    assert [each.died_s for each in run.histories] == [None, 3.0]
    assert [each.seen_frames for each in run.histories] == [40, 30]
    for each, place in zip(run.histories, WALKERS, strict=True):
        expected = [place(stamp_s) for stamp_s in each.stamps_s]
        np.testing.assert_allclose(each.positions_odom_m, expected, atol=1e-9)


def test_tracks_of_a_file_come_back_as_the_tracker_wrote_them(tmp_path):
    records = lines(WALKERS, hidden=lambda k, who: who == 0 and 15 < k < 22)
    recording = recorded(tmp_path, records)
    tracker = PersonTracker()
    for record, frame in zip(records, recording.frames, strict=True):
        tracks = tracker.update(frame.observations, frame.stamp_s, frame.T_odom_camera)
        record["tracks"] = [track_record(track) for track in tracks]
    shown = tracks_in_file(recorded(tmp_path, records, "tracked.jsonl"))
    tracked = track_recording(recording)
    assert shown.source == "tracks of the file"
    for given, own in zip(shown.histories, tracked.histories, strict=True):
        assert [s.status for s in given.samples] == [s.status for s in own.frames]
        assert [s.seen for s in given.samples] == [s.seen for s in own.frames]
        lower = [s.awareness_lower for s in own.frames]
        np.testing.assert_allclose(given.values("awareness_lower"), lower, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"id": "a"}, "id must be a whole number"),
        ({"status": "lost"}, "status must be one of tentative"),
        ({"awareness": 1.2}, "awareness must"),
        ({"position_odom_m": [1.0]}, "position_odom_m"),
        ({"time_since_seen_s": None}, "time_since_seen_s"),
    ],
)
def test_an_invalid_track_of_a_file_is_refused_by_frame(tmp_path, change, message):
    track = {
        "id": 1,
        "status": "confirmed",
        "position_odom_m": [1.0, 2.0],
        "velocity_odom_mps": [0.0, 0.0],
        "awareness": 0.5,
        "awareness_std": 0.1,
        "awareness_lower": 0.4,
        "time_since_seen_s": 0.0,
    }
    records = lines([], frames=3)
    for record in records:
        record["tracks"] = [track]
    assert len(tracks_in_file(recorded(tmp_path, records)).histories) == 1
    records[1]["tracks"] = [{**track, **change}]
    with pytest.raises(AwarenavError, match=f"frame '000001', track 0: {message}"):
        tracks_in_file(recorded(tmp_path, records))
