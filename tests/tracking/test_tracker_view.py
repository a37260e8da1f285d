"""Views: people who should have been seen are deleted soon, others are kept."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, camera_at, observe

from perception import Camera
from perception.surround import ring_of_views
from tracking import CameraView, PersonTrack, PersonTracker, SurroundView, TrackerConfig, View

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
MISSED_S, COAST_S, STANDING_S = CONFIG.max_missed_s, CONFIG.max_coast_s, 5.0
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
def test_an_unseen_person_is_kept_for_the_expected_time(case: str) -> None:
    place, velocity, camera, others, expected_s = CASES[case]
    period_s = 0.2 if expected_s == STANDING_S else PERIOD_S
    tracker = PersonTracker(view=VIEW)
    now, tracks = watch(tracker, place, velocity, others_m=others)
    assert tracks[0].status == "confirmed"
    kept_s = kept_for_s(tracker, tracks[0].id, now, camera, others, period_s)
    assert kept_s == pytest.approx(expected_s, rel=0.08, abs=period_s + 1e-9)


def test_no_false_track_stays_at_the_edge_of_the_view() -> None:
    """A person who walks out of the image leaves no track inside it."""
    for edge_m in np.linspace(1.6, 2.3, 4):  # the image ends at 4 m · tan 30° = 2.31 m
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
    stamps_s = [*np.arange(34) * PERIOD_S, *np.arange(36, 190, 4) * PERIOD_S]
    errors, spreads = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        tracker = PersonTracker(TrackerConfig(max_coast_s=10.0), view=VIEW)
        for now in stamps_s:
            T = camera_at(0.6 * now, 0.0)
            ahead = 3.0 - 0.6 * now
            measured = rng.normal((3.0, 1.0), 0.1)
            visible = ahead > 1.74  # as far as the view reaches
            people = [observe(measured, now, T_odom_camera=T)] if visible else []
            tracks = tracker.update(people, now, T)
        (track,) = tracks
        assert track.time_since_seen_s > 7.0
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
    for seed in range(4):
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


@pytest.mark.parametrize(("noise_m", "least", "most"), [(0.05, 0.0, 0.4), (0.2, 0.6, 1.0)])
def test_standing_means_a_velocity_that_the_sensor_cannot_tell_from_0(noise_m, least, most) -> None:
    """A person who walks at 0.25 m/s is remembered as standing only if the sensor is coarse."""
    standing = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        tracker = PersonTracker(TrackerConfig(acceleration_density_m2ps3=0.02), view=VIEW)
        for step in range(40):
            now = step * PERIOD_S
            place = rng.normal((4.0, 0.25 * now), noise_m)
            tracker.update([observe(place, now, covariance_odom_m2=noise_m**2)], now, CAMERA)
        away = camera_at(yaw_rad=3.0)
        standing.append(bool(tracker.update((), now + COAST_S + 0.1, away)))
    assert least <= np.mean(standing) <= most


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


WIDE = Camera.from_fov(800, 600, math.radians(110.0))


def surround(*headings_deg: float) -> SurroundView:
    views = ring_of_views(WIDE, np.radians(headings_deg))
    flat = CameraView(WIDE, max_range_m=10.0)
    return SurroundView((flat,) * len(views), tuple(each.rotation_camera_view for each in views))


@given(st.floats(-math.pi, math.pi), st.floats(0.6, 7.9))
def test_four_views_cover_all_directions(bearing, range_m):
    place = [[range_m * math.cos(bearing), range_m * math.sin(bearing)]]
    assert surround(0, 90, 180, -90).visibility(place, CAMERA)[0] == 1.0


@given(st.floats(-math.pi, math.pi), st.floats(0.6, 12.0))
def test_another_view_never_lowers_the_visibility(bearing, range_m):
    place = [[range_m * math.cos(bearing), range_m * math.sin(bearing)]]
    ahead, more = surround(0), surround(0, 90)
    alone = CameraView(WIDE, max_range_m=10.0).visibility(place, CAMERA)
    assert ahead.visibility(place, CAMERA) == alone
    assert more.visibility(place, CAMERA) >= alone


def test_positive_headings_are_to_the_left() -> None:
    left, right, behind = [[0.0, 2.0]], [[0.0, -2.0]], [[-2.0, 0.0]]
    view = surround(0, 90)
    assert isinstance(view, View)
    assert view.visibility(left, CAMERA)[0] == 1.0
    assert view.visibility(right, CAMERA)[0] == 0.0
    assert view.visibility(behind, CAMERA)[0] == 0.0
    assert view.visibility(np.empty((0, 2)), CAMERA).shape == (0,)


def test_a_person_missed_behind_the_robot_is_deleted_sooner_with_a_view_there() -> None:
    """Only frames that could have shown the person count against the track."""
    kept = {}
    for name, view in (("ahead", surround(0)), ("around", surround(0, 90, 180, -90))):
        tracker = PersonTracker(view=view)
        for step in range(40):
            tracker.update([observe([-3.0, 0.0], 0.05 * step)], 0.05 * step, CAMERA)
        last_s = 39 * 0.05
        stamp_s = last_s
        while tracker.update([], stamp_s := stamp_s + 0.05, CAMERA):
            pass
        kept[name] = stamp_s - last_s
    assert kept["around"] < 1.5
    assert kept["ahead"] > 2.9


# Place and velocity of somebody whom the last frames do not show, and how long they are kept
# without a view: people are expected where people have been seen, and nobody nearer than 3 m.
UNKNOWN_VIEW = {
    "stands where others are": ((5.0, 0.0), (0.0, 0.0), MISSED_S),
    "walks among the others": ((5.0, 1.0), (0.0, -0.5), MISSED_S),
    "walks away": ((6.0, 0.0), (1.2, 0.0), COAST_S),
    "walks out at the side": ((5.0, 1.9), (0.0, 1.2), COAST_S),
    "stands beside the robot": ((2.0, 0.5), (0.0, 0.0), COAST_S),
}


@pytest.mark.parametrize("case", UNKNOWN_VIEW)
def test_without_a_view_people_are_expected_where_people_have_been_seen(case: str) -> None:
    place, velocity, expected_s = UNKNOWN_VIEW[case]
    tracker, rest = PersonTracker(), ((6.0, -0.8), (5.0, -2.0))
    now, tracks = watch(tracker, place, velocity, others_m=rest)
    track = min(tracks, key=lambda one: math.dist(one.position_odom_m, place))
    kept_s = kept_for_s(tracker, track.id, now, CAMERA, rest)
    assert kept_s == pytest.approx(expected_s, rel=0.1, abs=0.11)


def test_a_camera_overhead_sees_people_behind_each_other() -> None:
    high = camera_at(pitch_rad=math.pi / 2.0)
    high[2, 3] = 8.0
    front = ((2.0, 0.0),)
    kept = []
    for camera in (CAMERA, high):
        tracker = PersonTracker(view=Everywhere())
        for step in range(30):
            now = step * PERIOD_S
            shown = [observe(each, now, T_odom_camera=camera) for each in ((5.0, 0.0), *front)]
            tracks = tracker.update(shown, now, camera)
        last = max(tracks, key=lambda track: float(track.position_odom_m[0]))
        kept.append(kept_for_s(tracker, last.id, now, camera, front))
    assert kept == pytest.approx([STANDING_S, MISSED_S], abs=0.11)


@pytest.mark.parametrize("bearing_rad", [0.0, 2.0, math.pi - 0.01, math.pi + 0.01, -2.0])
def test_people_hide_others_in_every_direction(bearing_rad: float) -> None:
    """Also where bearings jump from π to −π: they stand a little to either side of it."""
    ahead = np.array([math.cos(bearing_rad), math.sin(bearing_rad)])
    aside = 0.06 * np.array([-ahead[1], ahead[0]])
    far, front = 5.0 * ahead + aside, (tuple(2.5 * ahead - aside),)
    tracker = PersonTracker(view=Everywhere())
    for step in range(30):
        now = step * PERIOD_S
        tracks = tracker.update([observe(each, now) for each in (far, *front)], now, CAMERA)
    last = max(tracks, key=lambda track: math.hypot(*track.position_odom_m))
    kept_s = kept_for_s(tracker, last.id, now, CAMERA, front)
    assert kept_s == pytest.approx(STANDING_S, rel=0.05)


class Everywhere:
    """A view in which everybody is seen."""

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        return np.ones(len(positions_odom_m))
