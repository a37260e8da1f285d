"""Detections that leave something open: who is who, and how far away."""

from __future__ import annotations

from dataclasses import replace

from fusion_scenes import LASER, both, laser_at, seen_by_camera, seen_by_laser
from tracking_scenes import camera_at

from tracking import AwarenessFilterConfig, TrackerConfig


def test_whoever_may_be_a_stranger_has_not_noticed_the_robot() -> None:
    places = [(4.0, -1.5), (4.0, 1.5)]

    def noticed(*weak_y_m: float) -> float:
        tracker = both(TrackerConfig(awareness=AwarenessFilterConfig(noticed_memory_s=3.0)))
        for frame in range(30):
            now = 0.1 * frame
            scan = [seen_by_laser(place, now) for place in places]
            tracker.update(scan, now, laser_at(), sensor=LASER)
            looks = [seen_by_camera(place, now + 0.02, awareness=0.95) for place in places]
            tracker.update(looks, now + 0.02, camera_at())
        now += 0.12
        weak = [replace(seen_by_camera((4.0, y_m), now), score=0.2) for y_m in weak_y_m]
        looks = [seen_by_camera(places[0], now, awareness=0.95)]
        first, second = tracker.update([*looks, *weak], now, camera_at())
        assert first.noticed > 0.5
        return second.noticed

    assert noticed(1.5) > 0.5
    assert noticed(1.35, 1.65) == 0.0


def test_a_camera_that_puts_a_person_too_far_away_moves_no_scanned_place() -> None:
    tracker = both()
    for frame in range(30):
        now = 0.1 * frame
        tracker.update([seen_by_laser((4.0, 0.5), now)], now, laser_at(), sensor=LASER)
        (track,) = tracker.update([seen_by_camera((4.0, 0.5), now)], now, camera_at())
    (before,) = tracker.predict(now + 0.1)
    (after,) = tracker.update(
        [seen_by_camera((4.0, 0.5), now + 0.1, ratio=1.4)], now + 0.1, camera_at()
    )
    assert after.id == track.id
    assert after.time_since_seen_s == 0.0
    # The match is by the ray alone, and tells next to nothing of the range.
    assert 0.0 < after.position_odom_m[0] - before.position_odom_m[0] < 0.05
    assert 0.8 < after.covariance_odom[0, 0] / before.covariance_odom[0, 0] < 1.0
