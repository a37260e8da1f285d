"""Views: people who should have been seen are deleted soon, others are kept for longer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, camera_at, observe

from perception import Camera
from tracking import CameraView, PersonTrack, PersonTracker, TrackerConfig, TrackingError, View
from tracking._track_management import unoccluded_share

CONFIG = TrackerConfig()
LENS = Camera.from_fov(640, 480, math.radians(60.0))
VIEW = CameraView(LENS)


def watch(
    tracker: PersonTracker,
    person_m: tuple[float, float],
    velocity_mps: tuple[float, float] = (0.0, 0.0),
    *,
    others_m: tuple[tuple[float, float], ...] = (),
    until_s: float = 2.0,
    noise_m: float = 0.0,
) -> tuple[float, tuple[PersonTrack, ...]]:
    """Show a person who ends at ``person_m`` and others who stand; return the last stamp."""
    rng = np.random.default_rng(1)
    tracks: tuple[PersonTrack, ...] = ()
    now = 0.0
    for step in range(round(until_s / PERIOD_S) + 1):
        now = step * PERIOD_S
        place = np.add(person_m, np.multiply(velocity_mps, now - until_s))
        shown = np.array([place, *others_m])
        shown += rng.normal(0.0, noise_m, shown.shape)
        tracks = tracker.update([observe(spot, now) for spot in shown], now, CAMERA)
    return now, tracks


def kept_for_s(
    tracker: PersonTracker,
    track_id: int,
    from_s: float,
    camera: FloatArray,
    others_m: tuple[tuple[float, float], ...] = (),
    period_s: float = PERIOD_S,
) -> float:
    """Return how long a person is reported after the last frame that showed them."""
    for step in range(1, round(20.0 / period_s)):
        now = from_s + step * period_s
        people = [observe(spot, now, T_odom_camera=camera) for spot in others_m]
        if track_id not in [track.id for track in tracker.update(people, now, camera)]:
            return step * period_s
    return math.inf


# The person's last position and velocity, the camera's pose from then on, the people in front, and
# how long the track must be kept. The camera looks along x with half an angle of view of 30°.
MISSED_S, COAST_S, STANDING_S = (
    CONFIG.max_missed_s,
    CONFIG.max_coast_s,
    CONFIG.max_standing_coast_s,
)
CASES: dict[str, tuple[tuple[float, float], tuple[float, float], FloatArray, Any, float]] = {
    "stands in the middle of the view": ((4.0, 0.0), (0.0, 0.0), CAMERA, (), MISSED_S),
    "walks in the middle of the view": ((4.0, -1.0), (0.0, 0.8), CAMERA, (), MISSED_S),
    "stands where the camera has turned away": (
        (4.0, 0.0),
        (0.0, 0.0),
        camera_at(yaw_rad=1.5),
        (),
        STANDING_S,
    ),
    "walks where the camera has turned away": (
        (4.0, 0.0),
        (0.0, 1.0),
        camera_at(yaw_rad=-1.5),
        (),
        COAST_S,
    ),
    "stands beside the robot": ((2.0, 0.0), (0.0, 0.0), camera_at(2.0, -1.0), (), STANDING_S),
    "stands behind somebody": ((5.0, 0.0), (0.0, 0.0), CAMERA, ((2.5, 0.0),), STANDING_S),
    "stands beside somebody": ((5.0, 0.8), (0.0, 0.0), CAMERA, ((2.5, -0.8),), MISSED_S),
    "stands in front of somebody": ((2.5, 0.0), (0.0, 0.0), CAMERA, ((5.0, 0.0),), MISSED_S),
    "walks too far away to be seen": ((8.0, 0.0), (1.0, 0.0), CAMERA, (), COAST_S),
    "stands too near to be seen": ((2.0, 0.0), (0.0, 0.0), camera_at(1.75), (), STANDING_S),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("period_s", [0.05, 0.2])
def test_an_unseen_person_is_kept_for_the_expected_time(case: str, period_s: float) -> None:
    place, velocity, camera, others, expected_s = CASES[case]
    tracker = PersonTracker(view=VIEW)
    now, tracks = watch(tracker, place, velocity, others_m=others)
    assert tracks[0].status == "confirmed"
    kept_s = kept_for_s(tracker, tracks[0].id, now, camera, others, period_s)
    assert kept_s == pytest.approx(expected_s, rel=0.08, abs=period_s + 1e-9)


@pytest.mark.parametrize("case", CASES)
def test_without_a_view_every_person_is_kept_for_the_same_time(case: str) -> None:
    place, velocity, camera, others, _ = CASES[case]
    tracker = PersonTracker()
    now, tracks = watch(tracker, place, velocity, others_m=others)
    kept_s = kept_for_s(tracker, tracks[0].id, now, camera, others)
    assert kept_s == pytest.approx(COAST_S, abs=PERIOD_S + 1e-9)


def test_no_false_track_stays_at_the_edge_of_the_view() -> None:
    """A person who walks out of the image leaves no track inside it."""
    for edge_m in np.linspace(1.6, 2.3, 8):  # the image ends at 4 m · tan 30° = 2.31 m
        tracker = PersonTracker(view=VIEW)
        now, _ = watch(tracker, (4.0, edge_m), (0.0, 1.2), noise_m=0.03)
        for step in range(1, 60):
            later = now + step * PERIOD_S
            for track in tracker.update((), later, CAMERA):
                inside = VIEW.visibility(track.position_odom_m[None], CAMERA)[0] == 1.0
                assert not inside or later - now <= MISSED_S + PERIOD_S


def test_a_partly_hidden_person_is_kept_for_a_time_in_between() -> None:
    kept = []
    for aside_m in (0.0, 0.15, 0.25, 0.35, 0.5, 0.8):
        tracker = PersonTracker(view=VIEW)
        front = ((2.5, aside_m),)
        now, tracks = watch(tracker, (5.0, 0.0), others_m=front)
        kept.append(kept_for_s(tracker, tracks[0].id, now, CAMERA, front))
    assert kept == sorted(kept, reverse=True)
    assert kept[0] == pytest.approx(STANDING_S, rel=0.05)
    assert kept[-1] == pytest.approx(MISSED_S, abs=2 * PERIOD_S)
    assert MISSED_S < kept[3] < STANDING_S


def test_a_person_who_is_not_seen_hides_nobody() -> None:
    tracker = PersonTracker(view=VIEW)
    now, tracks = watch(tracker, (5.0, 0.0), others_m=((2.5, 0.0),))
    assert kept_for_s(tracker, tracks[0].id, now, CAMERA) == pytest.approx(MISSED_S, abs=0.11)


def test_one_frame_after_a_pause_deletes_nobody() -> None:
    tracker = PersonTracker(view=VIEW)
    now, (track,) = watch(tracker, (4.0, 0.0))
    assert [t.id for t in tracker.update((), now + 2.0, CAMERA)] == [track.id]
    assert len(tracker.update((), now + 2.0 + MISSED_S, CAMERA)) == 1
    assert tracker.update((), now + 2.0 + MISSED_S + PERIOD_S, CAMERA) == ()


def test_a_standing_person_beside_the_robot_keeps_the_position() -> None:
    """The robot passes a standing person: the position is kept, with a consistent covariance."""
    # Once the person is out of view, every fourth frame will do: the rate does not matter there.
    stamps_s = [*np.arange(34) * PERIOD_S, *np.arange(36, 230, 4) * PERIOD_S]
    errors, spreads = [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        tracker = PersonTracker(TrackerConfig(max_standing_coast_s=10.0), view=VIEW)
        for now in stamps_s:
            T = camera_at(0.6 * now, 0.0)
            ahead = 3.0 - 0.6 * now
            measured = rng.normal((3.0, 1.0), 0.1)
            visible = ahead > 2.0
            people = [observe(measured, now, T_odom_camera=T)] if visible else []
            tracks = tracker.update(people, now, T)
        (track,) = tracks
        assert track.time_since_seen_s > 9.5
        errors.append(track.position_odom_m - (3.0, 1.0))
        spreads.append(track.covariance_odom[:2, :2])
    distances = np.linalg.norm(errors, axis=1)
    assert np.median(distances) < 0.35
    nees = [e @ np.linalg.solve(P, e) for e, P in zip(errors, spreads, strict=True)]
    assert np.mean(nees) < 2.0
    assert max(math.sqrt(np.linalg.eigvalsh(P)[-1]) for P in spreads) < 1.0


def test_the_memory_of_a_standing_person_does_not_depend_on_the_frame_rate() -> None:
    ends = []
    for pace in (1, 4, 16):
        tracker = PersonTracker(view=VIEW)
        now, _ = watch(tracker, (4.0, 0.0), noise_m=0.05)
        away = camera_at(yaw_rad=3.0)
        for step in range(pace, 81, pace):
            (track,) = tracker.update((), now + step * PERIOD_S, away)
        ends.append(track)
    for other in ends[1:]:
        np.testing.assert_allclose(other.position_odom_m, ends[0].position_odom_m, atol=1e-9)
        np.testing.assert_allclose(other.covariance_odom, ends[0].covariance_odom, atol=1e-9)


def test_a_walker_does_not_count_as_standing() -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        tracker = PersonTracker(view=VIEW)
        for step in range(40):
            now = step * PERIOD_S
            place = rng.normal((4.0, 0.7 * now - 1.0), 0.1)
            tracker.update([observe(place, now)], now, CAMERA)
        away = camera_at(yaw_rad=3.0)
        (track,) = tracker.update((), now + COAST_S - 0.1, away)
        np.testing.assert_allclose(np.linalg.norm(track.velocity_odom_mps), 0.7, atol=0.4)
        assert tracker.update((), now + COAST_S + 0.1, away) == ()


@pytest.mark.parametrize(("noise_m", "least", "most"), [(0.01, 0.0, 0.4), (0.1, 0.6, 1.0)])
def test_standing_means_a_velocity_that_the_sensor_cannot_tell_from_0(
    noise_m: float, least: float, most: float
) -> None:
    """A person who walks at 0.25 m/s is remembered as standing only if the sensor is coarse."""
    standing = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        tracker = PersonTracker(TrackerConfig(position_noise_floor_m=noise_m), view=VIEW)
        for step in range(40):
            now = step * PERIOD_S
            place = rng.normal((4.0, 0.25 * now), noise_m)
            tracker.update([observe(place, now, covariance_odom_m2=noise_m**2)], now, CAMERA)
        away = camera_at(yaw_rad=3.0)
        standing.append(bool(tracker.update((), now + COAST_S + 0.1, away)))
    assert least <= np.mean(standing) <= most


angles = st.floats(-math.pi, math.pi)


@given(turn=angles, ranges=st.tuples(st.floats(0.5, 10.0), st.floats(0.5, 10.0)), aside=angles)
def test_occlusion_depends_on_bearing_and_distance_only(
    turn: float, ranges: tuple[float, float], aside: float
) -> None:
    far, near = ranges
    at = np.array([[far * math.cos(turn), far * math.sin(turn)]])
    front = np.array([[near * math.cos(turn + aside), near * math.sin(turn + aside)]])
    (share,) = unoccluded_share(at, front, np.zeros(2), 0.25)
    assert 0.0 <= share <= 1.0
    if near + 0.25 > far or abs(aside) > math.asin(0.25 / near) + math.asin(min(0.25 / far, 1.0)):
        assert share == 1.0
    shift = np.array([3.0, -7.0])
    moved = unoccluded_share(at + shift, front + shift, shift, 0.25)
    assert moved[0] == pytest.approx(share, abs=1e-9)


def test_two_people_side_by_side_hide_a_third_behind_them() -> None:
    pair = np.array([[2.5, -0.16], [2.5, 0.16]])
    middle = np.array([[5.0, 0.0]])
    assert unoccluded_share(middle, pair, np.zeros(2), 0.25)[0] == 0.0
    assert 0.0 < unoccluded_share(middle, pair[:1], np.zeros(2), 0.25)[0] < 0.5


def test_people_in_the_image_and_in_range_are_visible() -> None:
    places = [(4.0, 0.0), (4.0, 2.2), (4.0, 2.4), (-4.0, 0.0), (9.0, 0.0), (7.2, 0.0), (0.3, 0.0)]
    visibility = VIEW.visibility(places, CAMERA)
    assert visibility[[0, 2, 3, 4, 6]].tolist() == [1.0, 0.0, 0.0, 0.0, 0.0]
    assert 0.0 < visibility[1] < 1.0
    assert visibility[5] == pytest.approx(0.5)
    # A camera that looks up at the ceiling sees nobody.
    assert VIEW.visibility(places, camera_at(pitch_rad=-1.2)).max() == 0.0
    turned = camera_at(1.0, 2.0, 2.1)
    world = np.array([[math.cos(2.1), -math.sin(2.1)], [math.sin(2.1), math.cos(2.1)]])
    there = np.asarray(places) @ world.T + (1.0, 2.0)
    np.testing.assert_allclose(VIEW.visibility(there, turned), visibility, atol=1e-9)


def test_a_lens_with_distortion_has_one_visible_interval_of_bearings() -> None:
    lens = Camera(640, 480, 400.0, 400.0, 320.0, 240.0, np.array([-0.35, 0.12, 0.0, 0.0, 0.0]))
    bearings = np.linspace(-1.5, 1.5, 301)
    places = 4.0 * np.column_stack((np.cos(bearings), np.sin(bearings)))
    seen = CameraView(lens).visibility(places, CAMERA) > 0.0
    assert seen.any()
    assert np.abs(np.diff(seen.astype(int))).sum() == 2


def test_bad_views_are_refused_by_name() -> None:
    with pytest.raises(TrackingError, match="max_range_m must lie in"):
        CameraView(LENS, max_range_m=0.0)
    with pytest.raises(TrackingError, match="side_margin must lie in"):
        CameraView(LENS, side_margin=0.7)
    with pytest.raises(TrackingError, match="min_range_m must lie in"):
        CameraView(LENS, max_range_m=2.0, min_range_m=3.0)
    with pytest.raises(TrackingError, match="camera must be a Camera, got str"):
        CameraView("camera.yaml")  # type: ignore[arg-type]
    with pytest.raises(TrackingError, match="positions_odom_m must have shape"):
        VIEW.visibility([1.0, 2.0], CAMERA)
    with pytest.raises(TrackingError, match=r"view must have a method visibility.*got Camera"):
        PersonTracker(view=LENS)  # type: ignore[arg-type]
    assert isinstance(VIEW, View)


@pytest.mark.parametrize("answer", [[0.5, 0.5], [[1.0]], [2.0], [-0.1], [math.nan]])
def test_an_invalid_visibility_is_refused(answer: list[Any]) -> None:
    class InvalidView:
        def visibility(self, _positions: FloatArray, _T: FloatArray) -> FloatArray:
            return np.array(answer)

    tracker = PersonTracker(view=InvalidView())
    now, _ = watch(tracker, (4.0, 0.0))
    with pytest.raises(TrackingError, match=r"one number in \[0, 1\] per position, 1 in all"):
        tracker.update((), now + PERIOD_S, CAMERA)
    assert tracker.last_stamp_s == now
