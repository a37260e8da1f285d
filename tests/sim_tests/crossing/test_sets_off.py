"""Somebody who watches the robot come, turns away and walks into its way without a look.

A random search over lapses found it. The robot stops in time only if it is slow near people whose
look it trusts; that is what ``rules.start_reserve`` is for.
"""

from __future__ import annotations

import pytest

from nav_adapter import AwarenessPolicy
from sim_tests import Scenario, run_crossing

SETS_OFF = Scenario.model_validate(
    {
        "name": "sets_off",
        "duration_s": 7.0,
        "layout": "open",
        "robot": {"goal_x_m": 10.0, "lane_half_width_m": 0.72},
        "camera": {"horizontal_fov_deg": 120.0, "timing": {"rate_hz": 15.0}},
        "people": [
            {
                "name": "worker",
                "route": [{"x_m": 3.99, "y_m": -0.72}, {"x_m": 2.56, "y_m": 0.61}],
                "speed_mps": 1.43,
                "heading_deg": -161.0,
                "social": False,
                "glances": {
                    "watches": True,
                    "first_glance_delay_s": 0.15,
                    "notices_within_m": 15.0,
                },
                "reactions": {"walk_on": 1.0},
                "lapse": {"after_look_s": 2.24, "looks_away": True, "halts": True},
            }
        ],
    }
)


def without_reserve() -> AwarenessPolicy:
    """Return ``balanced`` as it was when the search found this case."""
    data = AwarenessPolicy.preset("balanced").model_dump(mode="json")
    data["rules"]["start_reserve"] = None
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
