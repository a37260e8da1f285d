"""The detector: whom it reports, once each; candidates of two scanners, and as observations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laser_scenes import laser_scan, points_of, pose, two_legs

from perception.laser import (
    LaserScan,
    LegDetector,
    LegDetectorConfig,
    PersonCandidate,
    Scanner,
    StaticMap,
    merge_candidates,
    observations_of,
)
from tracking import PersonTracker, SensorConfig, TrackerConfig

ONCE = LegDetectorConfig(learn=False)
POST = (2.0, 0.5, 0.08)
PAIR = 22


class Says:
    """A classifier that gives pairs one score and single clusters another."""

    def __init__(self, single: float, pair: float, width_dm: float = 2.0) -> None:
        self.single, self.pair, self.width_dm = single, pair, width_dm

    def __call__(self, features):
        out = np.zeros((len(features), 5), dtype=np.float32)
        narrow = (features[:, 2] < self.width_dm) & (features[:, 13] < self.width_dm)
        out[:, 0] = narrow * np.where(features[:, PAIR] > 0.5, self.pair, self.single)
        out[:, 1], out[:, 3:] = 0.05, (0.1, 0.2)
        return out


def places(found) -> np.ndarray:
    return np.array([each.position_odom_m for each in found]).reshape(-1, 2)


def watched(detector: LegDetector, circles, start_s: float, end_s: float):
    found = ()
    for stamp in np.arange(start_s, end_s - 1e-9, 0.1):
        scan = laser_scan(circles, noise=0.01, seed=int(1e3 * stamp), stamp_s=stamp)
        found = detector.detect(points_of(scan))
    return found


@settings(max_examples=10, deadline=None)
@given(st.floats(0.8, 3.5), st.floats(-1.8, 1.8), st.floats(-3.0, 3.0), st.integers(0, 1000))
def test_somebody_on_two_legs_is_found_where_they_stand(distance, bearing, heading, seed) -> None:
    where = np.array([distance * math.cos(bearing), distance * math.sin(bearing)])
    # Seen from the side one leg may hide the other.
    facing = bearing + 0.4 * math.sin(heading)
    scan = laser_scan(two_legs(*where, facing), noise=0.01, seed=seed)
    found = LegDetector(ONCE).detect(points_of(scan))
    assert len(found) == 1
    np.testing.assert_allclose(found[0].position_odom_m, where, atol=0.12)
    assert found[0].score > 0.5


@settings(max_examples=8, deadline=None)
@given(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-3.1, 3.1))
def test_moving_robot_and_people_together_moves_the_candidates(x, y, yaw) -> None:
    scan = laser_scan([*two_legs(2.0, 0.5, 0.3), *two_legs(1.5, -1.5, -1.0)], noise=0.01)
    home = LegDetector(ONCE).detect(points_of(scan))
    moved = LegDetector(ONCE).detect(points_of(scan, (x, y, yaw)))
    assert len(home) == len(moved) == 2
    R = pose(0.0, 0.0, yaw)[:2, :2]
    for one, other in zip(home, moved, strict=True):
        np.testing.assert_allclose(
            other.position_odom_m, R @ one.position_odom_m + (x, y), atol=2e-3
        )
        np.testing.assert_allclose(
            other.covariance_m2, R @ one.covariance_m2 @ R.T, rtol=0.1, atol=1e-5
        )
        assert other.score == pytest.approx(one.score, abs=0.02)
        assert other.kind == one.kind


def test_a_pair_is_preferred_to_its_legs_and_reported_once() -> None:
    scan = laser_scan(two_legs(2.0, 0.0, 0.0))
    (found,) = LegDetector(ONCE, classifier=Says(0.9, 0.8)).detect(points_of(scan))
    assert found.kind == "two_legs"
    np.testing.assert_allclose(found.position_odom_m, [2.0, 0.0], atol=0.02)
    # 0.1 m along the ray, 0.2 m across it.
    np.testing.assert_allclose(found.covariance_m2, np.diag([0.01, 0.04]), atol=1e-3)


def test_two_people_beside_each_other_stay_two() -> None:
    scan = laser_scan([*two_legs(2.0, 0.35), *two_legs(2.0, -0.35)])
    found = LegDetector(ONCE).detect(points_of(scan))
    assert sorted(places(found)[:, 1].round(1).tolist()) == pytest.approx([-0.35, 0.35], abs=0.1)


def test_the_threshold_and_the_range_leave_people_out() -> None:
    scan = laser_scan(two_legs(3.0, 0.0))
    says = Says(0.0, 0.6)
    near, far = (
        laser_scan(two_legs(x, 0.0), low=-20.0, step=1e-3, room=(-15.0, -15.0, 15.0, 15.0))
        for x in (9.5, 10.5)
    )
    for seen, config, count in (
        (scan, ONCE, 1),
        (scan, replace(ONCE, score_threshold=0.7), 0),
        (near, ONCE, 1),
        (far, ONCE, 0),
    ):
        assert len(LegDetector(config, classifier=says).detect(points_of(seen))) == count


def test_what_the_map_holds_is_no_person() -> None:
    occupied = np.zeros((40, 40), dtype=bool)
    occupied[int(1.5 / 0.1), int(3.0 / 0.1)] = True  # the cell at (2.0, 0.5)
    known = StaticMap(occupied, (-1.0, -1.0), 0.1, margin_m=0.1)
    scan = laser_scan([POST, *two_legs(1.5, -1.0)])
    says = Says(0.9, 0.0)
    assert len(LegDetector(ONCE, classifier=says).detect(points_of(scan))) == 2
    found = LegDetector(ONCE, classifier=says, static_map=known).detect(points_of(scan))
    assert (places(found)[:, 1] < 0.0).all()
    assert len(found) == 1


def test_a_post_that_always_stood_there_is_learned_and_somebody_who_comes_is_not() -> None:
    detector = LegDetector(classifier=Says(0.7, 0.0))
    assert len(watched(detector, [POST], 0.0, 4.0)) == 0
    found = watched(detector, [POST, (1.5, -1.0, 0.06)], 4.0, 12.0)
    np.testing.assert_allclose(places(found), [[1.5, -1.0]], atol=0.1)


def test_somebody_who_stood_there_from_the_start_is_kept() -> None:
    found = watched(LegDetector(), two_legs(2.0, 0.5, 0.25), 0.0, 15.0)
    np.testing.assert_allclose(places(found), [[2.0, 0.5]], atol=0.1)


def test_somebody_who_was_watched_from_afar_is_found_when_the_robot_comes() -> None:
    """From 8 m legs look like posts; what was learned there must not hide the person nearby."""
    detector = LegDetector()
    person = two_legs(4.0, 0.2, 0.3)
    found = ()
    for tick in range(110):
        x = -4.0 + max(0.0, 0.1 * (tick - 60))
        scan = laser_scan(person, noise=0.015, seed=tick, stamp_s=0.1 * tick, origin=(x, 0.0))
        found = detector.detect(points_of(scan, (x, 0.0, 0.0)))
    np.testing.assert_allclose(places(found), [[4.0, 0.2]], atol=0.15)


def test_what_comes_and_has_the_size_of_a_trolley_is_one() -> None:
    trolley = x, y, radius = 2.0, 1.5, 0.4
    # Parked from the start it is none.
    assert watched(LegDetector(classifier=Says(0.0, 0.0)), [trolley], 0.0, 3.0) == ()
    detector = LegDetector(classifier=Says(0.0, 0.0))
    watched(detector, [], 0.0, 2.0)
    (found,) = watched(detector, [trolley], 2.0, 3.0)
    assert found.kind == "trolley"
    assert np.linalg.eigvalsh(found.covariance_m2).min() >= 0.2
    # Whoever pushes it is placed behind what is seen of it, as near as they may be: farther away
    # would cost clearance.
    ray = np.array([x, y]) / math.hypot(x, y)
    near = math.hypot(x, y) - radius
    behind = found.position_odom_m @ ray - near
    assert 0.3 < behind < 0.3 + 0.5 * radius
    assert abs(ray[0] * found.position_odom_m[1] - ray[1] * found.position_odom_m[0]) < 0.05
    # Its surface lies within one and a half standard deviations, somebody 1 m behind it as well.
    std = math.sqrt(ray @ found.covariance_m2 @ ray)
    assert behind <= 1.5 * std
    assert 1.0 - behind <= 1.5 * std


@pytest.mark.parametrize("ranges", [[np.nan] * 9, [np.inf] * 9, [-np.inf] * 9])
def test_a_scan_of_nothing_is_nobody(ranges) -> None:
    scan = LaserScan(0.0, 0.0, 0.01, ranges, 0.05, 20.0)
    assert LegDetector().detect(points_of(scan)) == ()


def candidate(x: float, y: float, score: float = 0.9, kind: str = "two_legs", std: float = 0.1):
    return PersonCandidate(1.0, (x, y), std**2 * np.eye(2), score, kind)


def test_two_scanners_report_a_person_once_and_more_surely_never() -> None:
    ahead, behind = candidate(2.0, 0.0, 0.7, std=0.1), candidate(2.0, 0.2, 0.9, std=0.2)
    alone = candidate(-3.0, 0.0)
    merged = merge_candidates([[ahead, alone], [behind]])
    assert [each.score for each in merged] == [0.9, 0.9]
    np.testing.assert_allclose(places(merged), [[-3.0, 0.0], [2.0, 0.04]], atol=1e-9)
    np.testing.assert_allclose(merged[1].covariance_m2, 0.01 * np.eye(2), atol=1e-12)
    # Neither two of one scan nor two apart.
    assert len(merge_candidates([[candidate(2.0, 0.0), candidate(2.0, 0.3)], []])) == 2
    assert len(merge_candidates([[candidate(2.0, 0.0)], [candidate(2.0, 0.6)]])) == 2


def test_a_trolley_beside_somebodys_legs_is_theirs() -> None:
    trolley = candidate(2.8, 0.0, 0.5, "trolley", 0.5)
    (merged,) = merge_candidates([[trolley], [candidate(2.0, 0.0)]])
    assert merged.kind == "two_legs"
    np.testing.assert_allclose(merged.position_odom_m, [2.0, 0.0])


@given(st.permutations(range(4)), st.floats(0.05, 0.3))
def test_the_order_of_the_scanners_does_not_matter(order, gap) -> None:
    groups = [[candidate(k * gap, 0.0, 0.5 + 0.1 * k)] for k in range(2)]
    groups += [[candidate(5.0, k * gap, 0.6 + 0.1 * k)] for k in range(2)]
    home = merge_candidates(groups)
    mixed = merge_candidates([groups[k] for k in order])
    np.testing.assert_allclose(places(mixed), places(home), atol=1e-9)


# --- candidates as observations -------------------------------------------------------------------


SPREAD = np.array([[0.010, 0.004], [0.004, 0.030]])


def spread_out(x: float, y: float, stamp_s: float = 5.0) -> PersonCandidate:
    return PersonCandidate(stamp_s, (x, y), SPREAD, 0.8, "one_leg")


@given(
    st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-3.1, 3.1), st.booleans(), st.data()
)
def test_the_pose_brings_them_back_to_odom(x, y, yaw, upside_down, data) -> None:
    T = Scanner.mounted(x, y, 0.2, yaw, upside_down=upside_down).T_base_scanner
    where = data.draw(st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)))
    (made,) = observations_of([spread_out(*where)], T)
    back = T[:3, :3] @ made.position_camera_m + T[:3, 3]
    np.testing.assert_allclose(back, [*where, 1.3], atol=1e-9)
    spread = T[:3, :3] @ made.position_covariance_m2 @ T[:3, :3].T
    np.testing.assert_allclose(spread[:2, :2], SPREAD, atol=1e-12)
    assert (made.stamp_s, made.score) == (5.0, 0.8)
    assert made.gaze_camera is made.awareness is made.awareness_std is None


def test_the_tracker_finds_them_where_they_are() -> None:
    tracker = PersonTracker(sensors={"laser": SensorConfig(alignment_std_rad=0.0)})
    T = Scanner.mounted(1.0, 2.0, 0.2, math.radians(135.0), upside_down=True).T_base_scanner
    for tick in range(20):
        stamp_s = 0.04 * tick
        seen = observations_of([spread_out(3.0, -1.0, stamp_s)], T)
        tracks = tracker.update(seen, stamp_s, T, sensor="laser")
    (track,) = tracks
    assert track.status == "confirmed"
    np.testing.assert_allclose(track.position_odom_m, [3.0, -1.0], atol=1e-6)


def test_candidates_of_two_scans_share_a_stamp_at_the_price_of_certainty() -> None:
    here, older = observations_of([spread_out(1.0, 0.0), spread_out(2.0, 0.0, 4.9)], np.eye(4), 5.0)
    assert here.stamp_s == older.stamp_s == 5.0
    np.testing.assert_allclose(here.position_covariance_m2[:2, :2], SPREAD, atol=1e-12)
    grown = SPREAD + 0.1**2 * np.eye(2)
    np.testing.assert_allclose(older.position_covariance_m2[:2, :2], grown, atol=1e-12)
    tracker = PersonTracker(TrackerConfig())
    assert len(tracker.update((here, older), 5.0, np.eye(4))) == 2
