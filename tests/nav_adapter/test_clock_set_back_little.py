"""A clock that is set back by less than ``max_lag_s``: old awareness costs no clearance.

The tracker cannot tell its frames from late ones, and puts them back in time. The awareness of the
last frames before stays until the new stamps have passed them, and somebody who walks has a second
track for a while.
"""

from __future__ import annotations

import numpy as np
import pytest
from nav_scenes import ROBOT, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError
from perception import PersonObservation
from tracking import PersonTracker

PERIOD_S = 0.05
SET_BACK_AT_S = 4.0
POLICY = AwarenessPolicy()
T_ODOM_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.4], [0.0, 0.0, 0.0, 1.0]]
)
AGES_S = [0.1, 0.2, 0.3, 0.4, 0.49]


def observed(place_m: tuple[float, float], stamp_s: float, awareness: float) -> PersonObservation:
    x, y = place_m
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=np.array([-y, 0.2, x]),
        position_covariance_m2=np.eye(3) * 0.05**2,
        gaze_camera=None,
        awareness=awareness,
        awareness_std=0.07,
        score=0.9,
    )


def drive(
    back_s: float, walking_mps: float, *, everywhere: bool
) -> dict[float, NavConstraints | None]:
    """Return the constraints by the time since the clock was set back; None where refused.

    Somebody watches the robot up to that instant and then looks away. ``everywhere`` is False if
    only the camera's clock is set back.
    """
    tracker, adapter = PersonTracker(), NavAdapter(POLICY, ROBOT)
    results: dict[float, NavConstraints | None] = {}
    for step in range(round((SET_BACK_AT_S + 2.0) / PERIOD_S)):
        true_s = step * PERIOD_S
        late = true_s >= SET_BACK_AT_S
        stamp_s = true_s - back_s if late else true_s
        now = stamp_s if everywhere else true_s
        place = (4.0, walking_mps * (true_s - SET_BACK_AT_S))
        frame = observed(place, stamp_s, 0.05 if late else 0.95)
        tracks = tracker.update([frame], stamp_s, T_ODOM_CAMERA)
        try:
            result = adapter.update(tracks, robot_at(now), now)
        except NavError:
            result = None
        results[round(true_s - SET_BACK_AT_S, 3)] = result
    assert tracker.refused_late_frames == 0
    return results


def most_aware(constraints: NavConstraints) -> float:
    return max(obstacle.awareness_lower for obstacle in constraints.obstacles)


@pytest.mark.parametrize("walking_mps", [0.0, 0.6, 1.2])
@pytest.mark.parametrize("back_s", AGES_S)
def test_with_the_clock_of_the_camera_awareness_ends_after_fresh_within_s(
    back_s: float, walking_mps: float
) -> None:
    results = drive(back_s, walking_mps, everywhere=False)
    in_time = drive(0.0, walking_mps, everywhere=False)
    before = results[-PERIOD_S]
    assert before is not None
    assert most_aware(before) > 0.6
    for age_s, result in results.items():
        if age_s <= POLICY.timing.fresh_within_s + 1e-9:
            continue
        fresh = in_time[age_s]
        assert result is not None
        assert fresh is not None
        assert most_aware(result) < POLICY.speed.unaware_below
        assert result.speed_limit_mps <= fresh.speed_limit_mps + 1e-6
        assert min(obstacle.radius_m for obstacle in result.obstacles) >= 1.0


@pytest.mark.parametrize("walking_mps", [0.0, 0.6, 1.2])
@pytest.mark.parametrize("back_s", AGES_S)
def test_with_the_clock_of_the_robot_nobody_is_aware_once_it_has_caught_up(
    back_s: float, walking_mps: float
) -> None:
    """Until then there are no constraints."""
    results = drive(back_s, walking_mps, everywhere=True)
    in_time = drive(0.0, walking_mps, everywhere=True)
    refused = [age_s for age_s, result in results.items() if result is None]
    assert refused[0] == 0.0
    assert back_s - 2.1 * PERIOD_S <= refused[-1] < back_s
    for age_s, result in results.items():
        fresh = in_time[age_s]
        if age_s <= POLICY.timing.fresh_within_s + PERIOD_S or result is None:
            continue
        assert fresh is not None
        assert result.speed_limit_mps <= fresh.speed_limit_mps + 0.02
        assert min(obstacle.radius_m for obstacle in result.obstacles) >= 1.0
