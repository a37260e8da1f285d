"""The steady-state limit is the adapter's, also where it counts from the circle about the base."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nav_scenes import ROBOT, person, settled_update
from shapely.geometry import MultiPoint, Point

from nav_adapter import AwarenessPolicy
from nav_adapter.policies import SpeedRules, StandingPeople, StartReserve, WalkingPeople
from nav_adapter.settled import settled_speed_limit_mps
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

OUTLINES = {
    "rectangle": ROBOT.footprint_m,
    "base at the rear": ROBOT.footprint_m + np.array([0.3, 0.0]),
    "slanted front": [[0.2, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.5, -0.3]],
    "corner ahead": [[0.5, 0.0], [0.0, 0.3], [-0.4, 0.0], [0.0, -0.3]],
    "corner ahead and aside": [[0.5, 0.1], [-0.4, 0.3], [-0.4, -0.3], [0.2, -0.3]],
}
RULES: dict[str, dict[str, Any]] = {
    "walking": {"walking": WalkingPeople()},
    "at once": {"walking": WalkingPeople(turn_delay_s=0.0, human_acceleration_mps2=1.0)},
    "standing too": {
        "walking": WalkingPeople(human_acceleration_mps2=1.0),
        "standing": StandingPeople(),
    },
    "of the presets": {"walking": WalkingPeople(), "start_reserve": StartReserve()},
    "late reserve": {
        "walking": WalkingPeople(),
        "start_reserve": StartReserve(start_delay_s=0.4),
    },
    "reserve for slower starts": {
        "walking": WalkingPeople(human_acceleration_mps2=4.0, turn_delay_s=0.0),
        "start_reserve": StartReserve(human_acceleration_mps2=3.0, start_delay_s=0.4),
    },
}


def from_adapter(
    policy: AwarenessPolicy, outline: FloatArray, ahead_m: FloatArray, alpha: float
) -> list[float]:
    robot = replace(ROBOT, footprint_m=outline)
    people = [person(position=(x, 0.0), awareness_lower=alpha) for x in ahead_m.tolist()]
    return [settled_update([each], policy=policy, robot=robot).speed_limit_mps for each in people]


@pytest.mark.parametrize("rules", list(RULES))
@pytest.mark.parametrize("shape", list(OUTLINES))
def test_the_limit_is_that_of_the_adapter(shape: str, rules: str) -> None:
    outline, robot = OUTLINES[shape], replace(ROBOT, footprint_m=OUTLINES[shape])
    plain = AwarenessPolicy(rules=SpeedRules(start_reserve=RULES[rules].get("start_reserve")))
    policy = AwarenessPolicy(rules=SpeedRules(**RULES[rules]))
    ahead_m = np.linspace(0.9, 5.0, 15)
    hull = MultiPoint(outline).convex_hull
    gap_m = np.array([hull.distance(Point(x, 0.0)) for x in ahead_m]) - BODY_RADIUS_M
    raised = 0
    for alpha in (0.0, 0.4, 1.0):
        settled = settled_speed_limit_mps(policy, robot, gap_m, alpha)
        assert settled == pytest.approx(from_adapter(policy, outline, ahead_m, alpha), abs=1e-9)
        raised += int((settled > settled_speed_limit_mps(plain, robot, gap_m, alpha)).sum())
    assert raised > 5


def test_a_person_within_the_outline_stops_the_robot() -> None:
    policy = AwarenessPolicy.preset("balanced")
    within = settled_speed_limit_mps(policy, ROBOT, [-0.5, -BODY_RADIUS_M, np.nan], 0.0)
    assert within.tolist() == [0.0, 0.0, 0.0]
