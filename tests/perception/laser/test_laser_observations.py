"""Candidates as observations: the tracker puts people where the scanner found them."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from perception.laser import PersonCandidate, Scanner, observations_of
from tracking import PersonTracker, SensorConfig, TrackerConfig

SPREAD = np.array([[0.010, 0.004], [0.004, 0.030]])


def candidate(x: float, y: float, stamp_s: float = 5.0, score: float = 0.8) -> PersonCandidate:
    return PersonCandidate(stamp_s, (x, y), SPREAD, score, "one_leg")


@given(
    st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-3.1, 3.1), st.booleans(), st.data()
)
def test_the_pose_brings_them_back_to_odom(x, y, yaw, upside_down, data) -> None:
    T = Scanner.mounted(x, y, 0.2, yaw, upside_down=upside_down).T_base_scanner
    where = data.draw(st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)))
    (made,) = observations_of([candidate(*where)], T)
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
        seen = observations_of([candidate(3.0, -1.0, stamp_s)], T)
        tracks = tracker.update(seen, stamp_s, T, sensor="laser")
    (track,) = tracks
    assert track.status == "confirmed"
    np.testing.assert_allclose(track.position_odom_m, [3.0, -1.0], atol=1e-6)


def test_candidates_of_two_scans_share_a_stamp_at_the_price_of_certainty() -> None:
    here, older = observations_of([candidate(1.0, 0.0), candidate(2.0, 0.0, 4.9)], np.eye(4), 5.0)
    assert here.stamp_s == older.stamp_s == 5.0
    np.testing.assert_allclose(here.position_covariance_m2[:2, :2], SPREAD, atol=1e-12)
    grown = SPREAD + 0.1**2 * np.eye(2)
    np.testing.assert_allclose(older.position_covariance_m2[:2, :2], grown, atol=1e-12)
    tracker = PersonTracker(TrackerConfig())
    assert len(tracker.update((here, older), 5.0, np.eye(4))) == 2


def test_nobody_is_nobody() -> None:
    assert observations_of((), np.eye(4)) == ()
