"""A camera and a scanner in one tracker: place, identity, and what is left when one is lost."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fusion_scenes import LASER, REMEMBERS, Rig, both, laser_at, play, seen_by_camera, seen_by_laser
from tracking_scenes import as_bytes, camera_at, nearest

from perception import Camera
from tracking import (
    CameraView,
    PersonTracker,
    ScannerView,
    TrackingError,
)


def stands(x_m: float, y_m: float = 0.0):
    return lambda _now: (x_m, y_m)


def walks(x_m: float, y_m: float, vx: float, vy: float):
    return lambda now: (x_m + vx * now, y_m + vy * now)


@pytest.mark.parametrize(("ratio", "range_m"), [(1.4, 4.5), (1.7, 2.0)])
@pytest.mark.parametrize("first", ["camera", "laser", "together"])
def test_a_child_or_somebody_seated_is_one_track_in_the_right_place(ratio, range_m, first) -> None:
    place = (range_m, 0.3 * range_m)
    start = {"camera": (0.0, 2.0), "laser": (2.0, 0.0), "together": (0.0, 0.0)}[first]
    rig = Rig([stands(*place)], ratios=[ratio], seed=int(10 * ratio))
    tracker, ids = both(), set()
    for stamp_s, people, T, sensor in rig.events(6.0):
        started = stamp_s >= start[sensor == LASER]
        tracks = tracker.update(people if started else [], stamp_s, T, sensor=sensor)
        if stamp_s >= 2.6:
            (track,) = tracks
            ids.add(track.id)
            assert np.linalg.norm(track.position_odom_m - place) <= 0.2
    assert len(ids) == 1
    assert track.status == "confirmed"


def test_a_child_who_walks_is_one_track_beside_an_adult() -> None:
    people = [walks(5.0, -1.5, -0.3, 0.4), walks(5.5, -0.5, -0.3, 0.4)]
    tracker = both()
    rig = Rig(people, ratios=[1.5, 1.0], seed=5)
    for stamp_s, seen, T, sensor in rig.events(5.0):
        tracks = tracker.update(seen, stamp_s, T, sensor=sensor)
        if stamp_s > 1.0:
            assert len(tracks) == 2
            for place in people:
                error = nearest(tracks, place(stamp_s)).position_odom_m - place(stamp_s)
                assert np.linalg.norm(error) <= 0.2


def test_a_child_whom_scans_have_missed_for_long_does_not_stay_two_tracks() -> None:
    # The camera alone starts a track 1.5 times too far away; then the scanner is back.
    place = (3.0, 0.4)
    rig = Rig([stands(*place)], ratios=[1.5], laser_sees=lambda _, now: not 2.0 < now < 3.7)
    tracker, counts = both(), []
    for stamp_s, people, T, sensor in rig.events(9.0):
        tracks = tracker.update(people, stamp_s, T, sensor=sensor)
        counts.append(len(tracks))
        if stamp_s > 6.5:
            (track,) = tracks
            assert np.linalg.norm(track.position_odom_m - place) <= 0.2
    assert max(counts) == 2


def test_two_people_on_one_ray_stay_two_though_scans_miss_the_second() -> None:
    people = [stands(3.0), stands(4.5, 0.1)]
    rig = Rig(people, laser_sees=lambda person, _now: person == 0, seed=4)
    tracker = both()
    for stamp_s, seen, T, sensor in rig.events(8.0):
        tracks = tracker.update(seen, stamp_s, T, sensor=sensor)
        if stamp_s > 1.5:
            assert len([track for track in tracks if track.status != "tentative"]) == 2


def test_a_nearer_person_on_the_ray_of_a_known_one_is_somebody_else() -> None:
    # The scanner knows a person at 5 m. The camera now sees somebody at 2 m, whose legs are hidden.
    tracker = both()
    play(tracker, Rig([stands(5.0)]).events(1.0))
    for tick in range(10):
        now = 1.0 + 0.1 * tick
        tracker.update([seen_by_camera((2.0, 0.0), now)], now, camera_at())
        tracks = tracker.update(
            [seen_by_laser((5.0, 0.0), now + 0.01)], now + 0.01, laser_at(), sensor=LASER
        )
    assert sorted(round(track.position_odom_m[0]) for track in tracks) == [2, 5]


def test_a_face_whose_range_disagrees_is_no_evidence_of_awareness() -> None:
    # It may be the face of somebody behind the person whom the scanner sees.
    look = lambda _person, _now: 0.95  # noqa: E731
    for ratio, aware in ((1.0, True), (1.6, False)):
        tracker = both()
        (track,) = play(tracker, Rig([stands(4.0)], faces=look, ratios=[ratio]).events(2.0))
        assert (track.awareness_lower > 0.5) is aware


def test_a_place_that_jumps_along_the_ray_loses_its_awareness() -> None:
    # The camera alone puts an attentive person at 6 m; then the scanner sees somebody at 4 m.
    tracker = both()
    for tick in range(20):
        now = 0.1 * tick
        (track,) = tracker.update(
            [seen_by_camera((6.0, 0.0), now, awareness=0.95)], now, camera_at()
        )
    assert track.awareness_lower > 0.5
    (track,) = tracker.update([seen_by_laser((4.0, 0.0), now)], now, laser_at(), sensor=LASER)
    assert track.position_odom_m[0] == pytest.approx(4.0, abs=0.1)
    assert track.awareness_lower == 0.0


def test_identity_is_kept_through_the_blind_side_of_the_camera() -> None:
    # They walk past the robot, out of the camera's view for four seconds, and come back.
    def circles(phase: float, radius_m: float):
        return lambda now: (
            radius_m * math.cos(0.5 * now + phase),
            radius_m * math.sin(0.5 * now + phase),
        )

    people = [circles(0.0, 2.0), circles(2.0, 3.0), circles(4.0, 4.0)]
    tracker, ids = both(), {0: set(), 1: set(), 2: set()}
    for stamp_s, seen, T, sensor in Rig(people, seed=2).events(20.0):
        tracks = tracker.update(seen, stamp_s, T, sensor=sensor)
        if stamp_s > 1.0:
            assert len([track for track in tracks if track.status != "tentative"]) == 3
            for index, place in enumerate(people):
                ids[index].add(nearest(tracks, place(stamp_s)).id)
    assert [len(found) for found in ids.values()] == [1, 1, 1]


def test_scans_neither_prove_nor_take_awareness() -> None:
    look = lambda _person, _now: 0.9  # noqa: E731
    rig = Rig([stands(4.0)], faces=look, seed=3, detection=(1.0, 1.0))
    fused, alone = both(), both()
    for stamp_s, people, T, sensor in rig.events(3.0):
        tracks = fused.update(people, stamp_s, T, sensor=sensor)
        scan = sensor == LASER
        expected = alone.predict(stamp_s) if scan else alone.update(people, stamp_s, T)
        for one, other in zip(tracks, expected, strict=False):
            if one.status == other.status == "confirmed":
                assert one.awareness_lower == pytest.approx(other.awareness_lower, abs=1e-12)
    assert tracks[0].awareness_lower > 0.5


@pytest.mark.parametrize("lost", ["camera", LASER])
def test_a_lost_sensor_leaves_the_other_and_says_so(lost: str) -> None:
    people = [stands(3.0, 0.5)]
    tracker = both()
    for stamp_s, seen, T, sensor in Rig(people).events(12.0):
        if sensor == lost and stamp_s > 4.0:
            continue
        tracks = tracker.update(seen, stamp_s, T, sensor=sensor)
        confirmed = [track for track in tracks if track.status == "confirmed"]
        if stamp_s > 1.0:
            assert [track.id for track in tracks] == [1]
    assert len(confirmed) <= 1
    other = LASER if lost == "camera" else "camera"
    assert tracker.silences_s[lost] == pytest.approx(8.0, abs=0.2)
    assert tracker.silences_s[other] == 0.0


def test_the_silence_of_a_sensor_that_never_spoke_is_infinite() -> None:
    tracker = both()
    assert tracker.silences_s == {"camera": math.inf, LASER: math.inf}
    tracker.update([], 1.0, laser_at(), sensor=LASER)
    assert tracker.silences_s == {"camera": math.inf, LASER: 0.0}


@pytest.mark.parametrize("place", [(3.0, 0.5), (-2.0, 0.0)])
@pytest.mark.parametrize("scanner_ends_s", [1.0, 3.0])
def test_nobody_is_forgotten_sooner_than_with_the_camera_alone(place, scanner_ends_s) -> None:
    # The person vanishes from the camera at 3 s, from the scanner before; both go on.
    camera_sees = lambda _p: True  # noqa: E731
    rig = Rig([stands(*place)], camera_sees=camera_sees, seed=8)
    fused = both()
    alone = PersonTracker(view=CameraView(Camera.from_fov(640, 480, math.radians(120.0))))
    for stamp_s, seen, T, sensor in rig.events(10.0):
        ends_s = scanner_ends_s if sensor == LASER else 3.0
        shown = seen if stamp_s < ends_s else []
        kept = fused.update(shown, stamp_s, T, sensor=sensor)
        if sensor == LASER:
            continue
        expected = alone.update(shown, stamp_s, T)
        assert len([t for t in kept if t.status != "tentative"]) >= len(
            [t for t in expected if t.status != "tentative"]
        )
        assert max((t.awareness_lower for t in kept), default=0.0) <= max(
            (t.awareness_lower for t in expected), default=0.0
        )
    assert not kept


def test_a_scan_without_a_person_is_a_miss_for_the_scanner_only() -> None:
    # A pallet hides the legs of somebody whom the camera sees; the scanner's view expects them.
    tracker = both()
    for tick in range(60):
        now = 0.1 * tick
        (track,) = tracker.update([seen_by_camera((3.0, 0.0), now)], now, camera_at())
        tracker.update([], now + 0.05, laser_at(), sensor=LASER)
    assert track.id == 1
    assert track.status == "confirmed"


@pytest.mark.parametrize(
    ("camera_s", "laser_s", "camera_latency_s", "laser_latency_s"),
    [(0.033, 0.025, 0.0, 0.0), (0.1, 0.08, 0.25, 0.01), (0.2, 0.1, 0.4, 0.05), (0.05, 0.1, 0, 0.2)],
)
def test_rates_and_latencies_do_not_matter(camera_s, laser_s, camera_latency_s, laser_latency_s):
    people = [walks(5.0, -2.0, -0.5, 0.7), stands(4.0, 1.5)]
    look = lambda person, _now: 0.9 if person else None  # noqa: E731
    rig = Rig(
        people,
        faces=look,
        camera_s=camera_s,
        laser_s=laser_s,
        camera_latency_s=camera_latency_s,
        laser_latency_s=laser_latency_s,
    )
    events = rig.events(4.0)
    tracker, in_order = both(REMEMBERS), both(REMEMBERS)
    tracks = play(tracker, events)
    assert as_bytes(tracks) == as_bytes(play(in_order, sorted(events, key=lambda e: e[0])))
    assert tracker.refused_late_frames == 0
    assert len(tracks) == 2
    now = tracker.last_stamp_s
    assert now is not None
    for place in people:
        error = nearest(tracks, place(now)).position_odom_m - place(now)
        assert np.linalg.norm(error) <= 0.2


@pytest.mark.parametrize("degrees", [-2.0, 2.0])
def test_a_scanner_that_is_mounted_askew_makes_no_second_person(degrees: float) -> None:
    people = [walks(6.0, -2.0, -0.5, 0.7), stands(5.0, 1.5)]
    tracker = both()
    for stamp_s, seen, T, sensor in Rig(people, yaw_error_rad=math.radians(degrees)).events(5.0):
        tracks = tracker.update(seen, stamp_s, T, sensor=sensor)
        if stamp_s > 1.0:
            assert len(tracks) == 2
            for place in people:
                error = nearest(tracks, place(stamp_s)).position_odom_m - place(stamp_s)
                assert np.linalg.norm(error) <= 0.3


def test_one_sensor_whose_clock_jumps_does_not_restart_the_tracker() -> None:
    tracker = both()
    for tick in range(60):
        now = 0.1 * tick
        tracker.update([seen_by_laser((3.0, 0.0), now)], now, laser_at(), sensor=LASER)
        with pytest.raises(TrackingError, match="jumps ahead"):
            tracker.update([], now + 3600.0, camera_at())
    assert tracker.clock_restarts == 0
    assert tracker.refused_early_frames == 60
    assert [track.id for track in tracker.predict(now)] == [1]


def test_a_clock_that_is_set_restarts_the_tracker_though_frames_are_late() -> None:
    tracker = both()
    play(tracker, Rig([stands(3.0)]).events(2.0))
    for event in Rig([stands(3.0)], camera_latency_s=0.2).events(3.0):
        stamp_s, _, T, sensor = event
        try:
            tracker.update([], stamp_s + 3600.0, T, sensor=sensor)
        except TrackingError:
            continue
    assert tracker.clock_restarts == 1


def test_the_view_of_a_scanner_has_a_range_and_a_field() -> None:
    view = ScannerView(max_range_m=10.0, min_range_m=0.5, field_rad=math.radians(270.0))
    turned = laser_at(1.0, 2.0, math.pi / 2)  # ahead is odom's y
    places = np.array([[1.0, 6.0], [1.0, 11.0], [1.0, 12.5], [1.0, 2.3], [5.0, 2.0], [1.0, -1.0]])
    np.testing.assert_allclose(view.visibility(places, turned), [1.0, 0.5, 0.0, 0.0, 1.0, 0.0])
    upside_down = turned @ np.diag([1.0, -1.0, -1.0, 1.0])
    np.testing.assert_allclose(view.visibility(places, upside_down), [1, 0.5, 0, 0, 1, 0])
    assert ScannerView().visibility(np.array([[-3.0, 0.0]]), laser_at()).tolist() == [1.0]


def test_scans_do_not_make_the_latest_picture_of_a_face_newer() -> None:
    """A camera at 0.0 to 1.0 s sees a face, then none of it; scans go on."""
    tracker, place = both(), (3.0, 0.5)
    for step in range(50):
        now = 0.04 * step
        tracks = tracker.update([seen_by_laser(place, now)], now, laser_at(), sensor=LASER)
        if step % 2 == 0 and now <= 1.0:
            face = seen_by_camera(place, now, awareness=0.9)
            tracks = tracker.update([face], now, camera_at())
        if step > 5:
            (track,) = tracks
            assert track.time_since_seen_s == 0.0
            pictured_s = min(now - now % 0.08, 0.96) if now > 1.0 else 0.08 * (step // 2)
            assert now - track.time_since_face_s == pytest.approx(pictured_s)
    faceless = tracker.update([seen_by_camera(place, 2.0)], 2.0, camera_at())
    assert faceless[0].time_since_face_s == math.inf
