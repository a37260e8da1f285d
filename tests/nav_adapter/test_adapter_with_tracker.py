"""The adapter with the real tracker: one attentive person, and the loss of the camera."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from nav_scenes import ROBOT, policy_radius_m, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from perception import PersonObservation
from tracking import PersonTrack, PersonTracker, TrackerConfig

PERIOD_S = 0.05
POLICY = AwarenessPolicy()

# On the robot's mast, looking along odom x: optical z forward, x right, y down.
T_ODOM_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.4], [0.0, 0.0, 0.0, 1.0]]
)


def frame(now: float, awareness: float) -> PersonObservation:
    return PersonObservation(
        stamp_s=now,
        position_camera_m=np.array([0.0, 0.2, 3.0]),
        position_covariance_m2=np.diag([0.03, 0.03, 0.08]) ** 2,
        gaze_camera=np.array([0.0, 0.0, -1.0]),
        awareness=awareness,
        awareness_std=0.05,
        score=0.9,
    )


def watch(seconds: float, awareness: float) -> tuple[PersonTracker, NavAdapter, NavConstraints]:
    tracker = PersonTracker(TrackerConfig(awareness=POLICY.filter))
    adapter = NavAdapter(POLICY, ROBOT)
    for step in range(round(seconds / PERIOD_S)):
        now = step * PERIOD_S
        tracks = tracker.update((frame(now, awareness),), now, T_ODOM_CAMERA)
        result = adapter.update(tracks, robot_at(now), now)
    return tracker, adapter, result


LOSSES: dict[str, Callable[[PersonTracker, float], tuple[PersonTrack, ...]]] = {
    "predict": lambda tracker, now: tracker.predict(now),
    "empty frames": lambda tracker, now: tracker.update((), now, T_ODOM_CAMERA),
}


@pytest.mark.parametrize("seen_s", [0.1, 0.2, 0.6, 3.0])
@pytest.mark.parametrize("loss", [*LOSSES, "repeated tracks"])
def test_losing_the_camera_for_a_second_never_shrinks_a_radius(loss: str, seen_s: float) -> None:
    tracker, adapter, before = watch(seen_s, 0.95)
    lost = before.stamp_s
    last_tracks = tracker.predict(lost)
    for step in range(1, round(1.0 / PERIOD_S) + 1):
        now = lost + step * PERIOD_S
        tracks = LOSSES[loss](tracker, now) if loss in LOSSES else last_tracks
        after = adapter.update(tracks, robot_at(now), now)
        for a in before.obstacles:
            # A person seen only for a moment may be dropped, but must not shrink.
            for b in (o for o in after.obstacles if o.track_id == a.track_id):
                assert b.radius_m >= a.radius_m
                assert b.awareness_lower <= a.awareness_lower
        if seen_s > 0.15:
            assert len(after.obstacles) == 1
        before = after
    assert all(o.radius_m >= policy_radius_m(POLICY, 0.0) for o in before.obstacles)


def test_an_attentive_person_lets_the_robot_pass_faster_and_nearer_than_a_distracted_one() -> None:
    attentive, distracted = watch(3.0, 0.95)[2], watch(3.0, 0.0)[2]
    assert attentive.obstacles[0].awareness_lower > POLICY.inflation.aware_above
    nearer_m = policy_radius_m(POLICY, 0.0) - policy_radius_m(POLICY, 1.0)
    assert attentive.obstacles[0].radius_m < distracted.obstacles[0].radius_m - 0.9 * nearer_m
    assert attentive.speed_limit_mps > 1.3 * distracted.speed_limit_mps
    assert distracted.limited_by == "track 1: reach"
