"""The size of a person, which is wrong in the same way in every image: lasting errors, history."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fusion_scenes import LASER, both, laser_at, seen_by_laser
from tracking_scenes import camera_at

from perception import PersonObservation
from tracking import PersonTracker

OWN_STD = 0.02
SIZE_STD = 0.167
PLACE_M = np.array([3.0, 0.4])


def seen(
    place_m, stamp_s, *, ratio=1.0, lasting=SIZE_STD, size_ratio=None, noise=0.0, T=None
):  # fmt: skip
    """Return an image's observation of a place that is seen ``ratio`` times too far away.

    ``size_ratio`` is that of the size alone, where other cues have corrected the range.
    """
    T = camera_at() if T is None else T
    offset = np.append(np.asarray(place_m) - T[:2, 3], 0.0) @ T[:3, :3]
    range_m = np.linalg.norm(offset)
    position = offset * ratio * math.exp(noise)
    covariance = (lasting**2 + OWN_STD**2) * np.outer(position, position) + 0.03**2 * np.eye(3)
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=position,
        position_covariance_m2=covariance,
        gaze_camera=None,
        awareness=None,
        awareness_std=None,
        score=0.9,
        range_lasting_relative_std=lasting,
        size_range_m=range_m * (ratio if size_ratio is None else size_ratio) * math.exp(noise),
        size_range_relative_std=OWN_STD,
    )


def range_and_std(track):
    """Return the range from the origin and its standard deviation."""
    range_m = float(np.hypot(*track.position_odom_m))
    ray = track.position_odom_m / range_m
    return range_m, math.sqrt(ray @ track.covariance_odom[:2, :2] @ ray)


def after_images(tracker, stamps, **options):
    rng = np.random.default_rng(0)
    for stamp in stamps:
        given = seen(PLACE_M, stamp, noise=OWN_STD * rng.normal(), **options)
        tracks = tracker.update([given], stamp, camera_at())
    return tracks


def test_no_number_of_images_averages_the_lasting_error_out():
    (track,) = after_images(PersonTracker(), np.arange(0.0, 5.0, 0.05))
    range_m, std_m = range_and_std(track)
    assert std_m == pytest.approx(SIZE_STD * range_m, rel=0.1)
    # The error across the ray is no part of it.
    across = np.array([-PLACE_M[1], PLACE_M[0]]) / np.hypot(*PLACE_M)
    assert math.sqrt(across @ track.covariance_odom[:2, :2] @ across) < 0.04


def test_the_tracks_of_a_population_agree_with_their_covariances():
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(40):
        tracker, ratio = PersonTracker(), math.exp(rng.normal(0.0, 0.12))
        velocity = rng.normal(0.0, 0.3, 2)
        for stamp in np.arange(0.0, 1.5, 0.1):
            place = PLACE_M + velocity * stamp
            one = seen(place, stamp, ratio=ratio, lasting=0.12, noise=OWN_STD * rng.normal())
            tracks = tracker.update([one], stamp, camera_at())
        error = np.concatenate(
            (tracks[0].position_odom_m - place, tracks[0].velocity_odom_mps - velocity)
        )
        inside.append(error @ np.linalg.solve(tracks[0].covariance_odom, error) < 9.49)
    assert np.mean(inside) >= 0.88


@pytest.mark.parametrize("ratio", [1.0, 1.4, 1.75])
def test_the_size_that_a_scanner_measured_holds_when_it_is_lost(ratio):
    tracker = both()
    for tick in range(100):
        stamp = 0.05 * tick
        tracks = tracker.update([seen(PLACE_M, stamp, ratio=ratio)], stamp, camera_at())
        if stamp < 2.0:
            tracks = tracker.update(
                [seen_by_laser(PLACE_M, stamp)], stamp, laser_at(), sensor=LASER
            )
    (track,) = tracks
    range_m, std_m = range_and_std(track)
    assert range_m == pytest.approx(np.hypot(*PLACE_M), rel=0.03)
    assert 0.02 * range_m < std_m < 0.06 * range_m
    assert tracks[0].id == 1


def test_the_size_that_feet_or_depth_told_holds_when_they_are_hidden():
    tracker = PersonTracker()
    after_images(tracker, np.arange(0.0, 1.0, 0.05), lasting=0.03, size_ratio=1.6)
    (track,) = after_images(tracker, np.arange(1.0, 3.0, 0.05), ratio=1.6)
    range_m, std_m = range_and_std(track)
    assert range_m == pytest.approx(np.hypot(*PLACE_M), rel=0.03)
    assert std_m < 0.06 * range_m
    assert track.id == 1


def test_better_cues_move_the_track_of_the_same_person():
    tracker = PersonTracker()
    after_images(tracker, np.arange(0.0, 1.0, 0.05), ratio=1.2)
    (track,) = after_images(tracker, np.arange(1.0, 2.0, 0.05), lasting=0.03, size_ratio=1.2)
    range_m, std_m = range_and_std(track)
    assert range_m == pytest.approx(np.hypot(*PLACE_M), rel=0.02)
    assert std_m < 0.06 * range_m
    assert track.id == 1


def test_an_ambiguous_match_forgets_the_size():
    tracker = PersonTracker()
    stamps = np.arange(0.0, 1.0, 0.05)
    after_images(tracker, stamps, lasting=0.03, size_ratio=1.6)
    two = [seen(PLACE_M + offset, 1.0, lasting=0.03, size_ratio=1.6) for offset in (-0.15, 0.15)]
    tracker.update(two, 1.0, camera_at())
    # With its size known, it would be in these images (the test of hidden feet).
    tracks = after_images(tracker, np.arange(1.05, 1.5, 0.05), ratio=1.6)
    (first,) = [track for track in tracks if track.id == 1]
    assert first.time_since_seen_s > 0.4


def test_a_robot_that_drives_makes_the_velocity_of_people_of_unknown_size_less_certain():
    """A range that is wrong by a share moves a person who stands as the robot comes nearer."""

    def velocity_std(speed_mps):
        tracker = PersonTracker()
        for tick in range(20):
            T = camera_at()
            T[0, 3] += speed_mps * 0.05 * tick
            tracks = tracker.update([seen(PLACE_M, 0.05 * tick, T=T)], 0.05 * tick, T)
        return math.sqrt(tracks[0].covariance_odom[2, 2])

    still, driving = velocity_std(0.0), velocity_std(1.0)
    assert driving**2 - still**2 == pytest.approx(SIZE_STD**2, rel=0.15)
