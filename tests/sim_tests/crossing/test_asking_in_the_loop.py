"""Requests for attention in closed loop: what they win, and that silence costs nothing."""

from __future__ import annotations

from functools import cache

import numpy as np

from nav_adapter import AwarenessPolicy
from nav_adapter.policies import AttentionRules
from sim_tests import CrossingResult, run_crossing
from sim_tests.crossing import STANDING_SPEED_MPS

BALANCED = AwarenessPolicy.preset("balanced")


@cache
def crossing(population: str, *, asks: bool = True) -> CrossingResult:
    policy = BALANCED.model_copy(update={"attention": AttentionRules() if asks else None})
    return run_crossing("busy_in_aisle", policy=policy, seed=0, population=population)


def requests(result: CrossingResult) -> list[tuple[float, int]]:
    return [
        (frame.t_s, alert.track_id)
        for frame in result.frames
        for alert in frame.constraints.alerts
        if alert.kind == "attention"
    ]


def test_where_nobody_answers_or_startles_the_robot_drives_as_one_that_does_not_ask() -> None:
    deaf, silent = (crossing("answers=0,startles=0", asks=asks) for asks in (True, False))
    assert requests(deaf)
    assert not requests(silent)
    assert [frame.command for frame in deaf.frames] == [frame.command for frame in silent.frames]
    assert deaf.time_to_goal_s == silent.time_to_goal_s


def test_a_worker_who_answers_is_passed_sooner() -> None:
    answered, in_vain = (crossing(f"answers={share},startles=0") for share in (1, 0))
    assert answered.time_to_goal_s is not None
    assert in_vain.time_to_goal_s is not None
    assert answered.time_to_goal_s < in_vain.time_to_goal_s - 0.2
    looks = [
        [frame.t_s for frame in result.frames if frame.truth[0].since_look_s <= 0.0]
        for result in (answered, in_vain)
    ]
    assert looks[1] == []
    assert max(requests(answered))[0] < looks[0][0]


def test_somebody_who_startles_into_the_path_is_not_met_by_a_moving_robot() -> None:
    startled = crossing("startles=1,startles_into_path=1,answers=0")
    assert requests(startled)
    places_m = [frame.truth[0].position_odom_m for frame in startled.frames]
    assert max(float(np.hypot(*(place - places_m[0]))) for place in places_m) > 0.3
    moving = [each for each in startled.contacts if each.robot_speed_mps > STANDING_SPEED_MPS]
    assert moving == []
