"""Somebody who watches the robot come, turns away and walks into its way without a look.

A random search over lapses found it. The robot stops in time only if it is slow near people whose
look it trusts; that is what ``rules.start_reserve`` is for.
"""

from __future__ import annotations

from typing import Any

import pytest

from nav_adapter import AwarenessPolicy
from sim_tests import Scenario, run_crossing


def scene(name: str, lane_half_width_m: float, person: dict[str, Any]) -> Scenario:
    """Return a robot that drives along its lane on an open floor, and a person beside it."""
    return Scenario.model_validate(
        {
            "name": name,
            "duration_s": 7.0,
            "layout": "open",
            "robot": {"goal_x_m": 10.0, "lane_half_width_m": lane_half_width_m},
            "camera": {"horizontal_fov_deg": 120.0, "timing": {"rate_hz": 15.0}},
            "people": [{"name": "worker", "reactions": {"walk_on": 1.0}, **person}],
        }
    )


SETS_OFF = scene(
    "sets_off",
    0.72,
    {
        "route": [{"x_m": 3.99, "y_m": -0.72}, {"x_m": 2.56, "y_m": 0.61}],
        "speed_mps": 1.43,
        "heading_deg": -161.0,
        "social": False,
        "glances": {
            "watches": True,
            "first_glance_delay_s": 0.15,
            "notices_within_m": 15.0,
        },
        "lapse": {"after_look_s": 2.24, "looks_away": True, "halts": True},
    },
)


def without_reserve() -> AwarenessPolicy:
    """Return ``balanced`` as it was when the search found this case."""
    data = AwarenessPolicy.preset("balanced").model_dump(mode="json")
    data["rules"]["start_reserve"] = None
    data["speed"].update(
        aware_human_speed_mps=0.35, watching_above=0.8, watching_human_speed_mps=0.05
    )
    return AwarenessPolicy.model_validate(data)


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["blind", "conservative", "balanced"])
def test_the_robot_does_not_touch_somebody_who_watched_it_and_sets_off(policy):
    result = run_crossing(SETS_OFF, policy=policy, perception="keypoints+scanner", seed=0)
    assert not [contact for contact in result.contacts if contact.by == "robot"]
    # The case is there: the person looked at the robot, walked, and came near.
    (person,) = result.people
    assert person.noticed_s is not None
    assert person.length_m > 1.5
    assert result.min_separation_m < 1.0
    assert max(frame.robot_state.speed_mps for frame in result.frames) > 0.5


@pytest.mark.slow
def test_without_the_reserve_it_does():
    result = run_crossing(
        SETS_OFF, policy=without_reserve(), perception="keypoints+scanner", seed=0
    )
    assert [contact for contact in result.contacts if contact.by == "robot"]


#: Starts at almost 3 m/s², still looks, and is at 1.3 m/s while the track says 0.6 m/s.
STARTS_FAST = scene(
    "starts_fast",
    0.9527603998748455,
    {
        "route": [
            {"x_m": 5.486146876809022, "y_m": 1.5553610861363154},
            {"x_m": 3.964144007150362, "y_m": -0.7469190334528479},
        ],
        "speed_mps": 1.9742981171664247,
        "heading_deg": -156.08928605157666,
        "glances": {
            "watches": True,
            "first_glance_delay_s": 0.1246794061291931,
            "notices_within_m": 15.0,
            "gives_up_after_s": 0.9830687460776963,
            "away_yaw_deg": 8.896565417761892,
        },
        "lapse": {"after_look_s": 2.8271981135289925, "looks_away": False, "halts": True},
    },
)


@pytest.mark.slow
def test_of_a_start_that_the_track_follows_late_the_robot_stands_in_time():
    """The reserve counts the speed of the track as a start already made.

    The person starts at almost 3 m/s², and the reserve is made for 2 m/s² (H19 in docs/safety.md).
    So the margin is used up by 0.07 to 0.30 m in 14 seeds, although the robot brakes fully from the
    first cycle in which the track shows the start. A planner that swings away from the person in
    the last 0.4 s is 0.2 m better off, with corners faster than the limit.
    """
    results = [
        run_crossing(STARTS_FAST, policy=policy, perception="keypoints+scanner", seed=538)
        for policy in ("balanced", without_reserve())
    ]
    kept, bare = results
    assert not [each for each in kept.contacts if each.by == "robot"]
    assert kept.min_margin_m > -0.35
    assert bare.min_margin_m < -0.4
