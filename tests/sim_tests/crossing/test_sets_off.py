"""Somebody who watches the robot come, turns away and walks into its way without a look.

A random search over lapses found it. The robot stops in time only if it is slow near people whose
look it trusts: ``conservative`` expects them to set off, ``balanced`` to keep to their motion.
"""

from __future__ import annotations

from typing import Any

import pytest

from sim_tests import Scenario, run_crossing
from sim_tests.crossing import named_policy


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
        "glances": {"watches": True, "first_glance_delay_s": 0.15, "notices_within_m": 15.0},
        "lapse": {"after_look_s": 2.24, "looks_away": True, "halts": True},
    },
)


@pytest.mark.slow
@pytest.mark.parametrize("policy", [pytest.param("blind", marks=pytest.mark.full), "conservative"])
def test_the_robot_does_not_touch_somebody_who_watched_it_and_sets_off(policy):
    result = run_crossing(SETS_OFF, policy=policy, perception="keypoints+scanner", seed=0)
    assert not [contact for contact in result.contacts if contact.by == "robot"]
    # The case is there: the person looked at the robot, walked, and came near.
    (person,) = result.people
    assert person.noticed_s is not None
    assert person.length_m > 1.5
    assert result.min_separation_m < 1.0
    assert max(frame.robot_state.speed_mps for frame in result.frames) > 0.4


@pytest.mark.slow
def test_where_looks_count_as_staying_it_is_touched_no_faster_than_by_todays_robot() -> None:
    def fastest_mps(policy: str, perception: str) -> float:
        result = run_crossing(
            SETS_OFF, policy=named_policy(policy)[1], perception=perception, seed=0
        )
        return max((each.robot_speed_mps for each in result.contacts), default=0.0)

    assert fastest_mps("balanced", "keypoints+scanner") <= fastest_mps("scanner", "scanner")
