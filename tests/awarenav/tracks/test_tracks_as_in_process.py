"""Tracks from a file of estimates are those of the process that wrote it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from track_lines import pose

from awarenav.estimate import FrameEstimate, SourceFrame
from awarenav.estimate._results import estimate_record
from awarenav.records import write_records
from awarenav.tracks._recording import read_recording
from perception import Camera, PersonObservation
from tracking import PersonTracker

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
LASTING, NOISE = 0.15, 0.03
FRAMES, RATE_HZ = 30, 10.0


def estimates() -> list[FrameEstimate]:
    """A child whose size only the first second knows, and somebody who is seldom judged."""
    rng = np.random.default_rng(4)
    T = pose()
    frames = []
    for index in range(FRAMES):
        stamp_s = index / RATE_HZ
        people = []
        for who, (across_m, ahead_m) in enumerate([(-0.8 + 0.3 * stamp_s, 4.0), (1.2, 5.0)]):
            true = np.array([across_m, 0.3, ahead_m])
            known = who == 0 and stamp_s < 1.0
            place = true * (1.0 if known else 1.25) * (1.0 + 0.01 * rng.standard_normal())
            lasting = 0.02 if known else LASTING
            covariance = (lasting**2 + NOISE**2) * np.outer(place, place) + 0.02**2 * np.eye(3)
            judged = (index + who) % 3 != 0
            people.append(
                PersonObservation(
                    stamp_s,
                    place,
                    covariance,
                    np.array([0.0, 0.0, -1.0]) if judged else None,
                    0.8 if judged else None,
                    0.1 if judged else None,
                    0.9,
                    box_xyxy_px=np.array([300.0, 100.0, 360.0, 400.0]),
                    awareness_reason=None if judged else "face too small",
                    range_lasting_relative_std=lasting,
                    size_range_m=float(1.25 * np.linalg.norm(true)),
                    size_range_relative_std=NOISE,
                    eyes_seen=judged and who == 1,
                )
            )
        frame = SourceFrame(f"{index:06d}", stamp_s, np.zeros((480, 640, 3), np.uint8), T)
        frames.append(FrameEstimate(frame, CAMERA, T, tuple(people), None, (0, 1)))
    return frames


def tracks_of(frames):
    """Return the tracks after every frame of stamp, pose and observations."""
    tracker = PersonTracker()
    return [tracker.update(people, stamp_s, T) for stamp_s, T, people in frames]


def written(tmp_path, frames):
    path = tmp_path / "estimates.jsonl"
    write_records(path, [estimate_record(each, "12345678") for each in frames])
    return [(f.stamp_s, f.T_odom_camera, f.observations) for f in read_recording(path).frames]


def test_tracks_and_fields_of_a_file_are_those_in_process(tmp_path):
    frames = estimates()
    here = tracks_of([(e.frame.stamp_s, e.T_odom_camera, e.observations) for e in frames])
    read = tracks_of(written(tmp_path, frames))
    assert max(len(tracks) for tracks in here) == 2
    for ours, theirs in zip(here, read, strict=True):
        assert [(t.id, t.status) for t in ours] == [(t.id, t.status) for t in theirs]
        for one, other in zip(ours, theirs, strict=True):
            # Files have seven digits.
            for name in ("position_odom_m", "velocity_odom_mps", "covariance_odom"):
                np.testing.assert_allclose(
                    getattr(one, name), getattr(other, name), rtol=1e-4, atol=1e-6
                )
            for name in ("awareness", "awareness_std", "awareness_lower"):
                assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-6)
    for estimate, (_, _, people) in zip(frames, written(tmp_path, frames), strict=True):
        for one, other in zip(estimate.observations, people, strict=True):
            assert one.awareness_reason == other.awareness_reason
            assert one.eyes_seen == other.eyes_seen
            for name in (
                "range_lasting_relative_std",
                "size_range_m",
                "size_range_relative_std",
            ):
                assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-6)
