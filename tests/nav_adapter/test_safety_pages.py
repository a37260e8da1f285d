"""docs/safety.md and docs/planners.md show the figures of the presets."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from paths import ROOT

from nav_adapter import AwarenessPolicy, RobotProfile, RobotState
from nav_adapter.limit import course_of, limit_mps, passing_radius_m
from nav_adapter.reach import Reach

PRESETS = ("blind", "conservative", "balanced", "assertive")
SAFETY = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
PLANNERS = (ROOT / "docs" / "planners.md").read_text(encoding="utf-8")
FOOTPRINT_M = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
ROBOT = RobotProfile(FOOTPRINT_M, 1.5, 1.0, 1.0, 0.3)


def reach(
    name: str, alpha: float, x_m: float = 0.0, y_m: float = 0.0, *, walks: float = 0.0
) -> Reach:
    policy = AwarenessPolicy.preset(name)
    assert policy.reach is not None
    return Reach(
        *(x_m, y_m, walks, 0.0, policy.speed.human_speed_mps(alpha)),
        policy.reach.time_constant_s,
        policy.reach.delay_s,
        margin_m=policy.margins.floor_m,
    )


def numbers(line: str) -> list[float]:
    return [float(each) for each in re.findall(r"\d+\.\d+", line)]


def row(page: str, title: str) -> list[float]:
    """Return the numbers of the one row of a table that begins with a title."""
    (line,) = [line for line in page.splitlines() if line.startswith(f"| {title}")]
    return numbers(line.split("|", 2)[2])


@pytest.mark.parametrize("name", PRESETS)
def test_the_table_of_reaches_is_that_of_the_presets(name: str) -> None:
    (line,) = [line for line in SAFETY.splitlines() if re.match(rf"\| .*`{name}`.*: U \d", line)]
    top, delay, *ways = numbers(line)
    person = reach(name, 0.0)
    assert (top, delay) == (person.speed_mps, person.delay_s)
    assert ways == [round(person.radius_m(t), 2) for t in (0.5, 1.0, 1.5, 2.0)]


def test_an_aware_person_who_walks_may_stop_or_walk_on() -> None:
    walker = reach("balanced", 1.0, walks=1.2)
    assert f"{1.2 * walker.drift_s(100.0):.2f} m from 1.2 m/s" in " ".join(SAFETY.split())
    assert walker.radius_m(2.0) == 0.0
    assert walker.walks_faster
    assert 1.2 * walker.walking_on().drift_s(2.0) == pytest.approx(2.4, abs=0.01)


def test_the_smallest_circles_are_those_of_the_presets() -> None:
    for index, name in enumerate(PRESETS):
        policy = AwarenessPolicy.preset(name)
        for title, alpha in (("has not noticed", 0.0), ("has noticed", 1.0)):
            own_m = row(PLANNERS, f"{title}: radius of the policy")[index]
            assert own_m == policy.inflation.radius_m(alpha)
            smallest_m = passing_radius_m(
                policy.speed.human_speed_mps(alpha),
                policy.reach,
                policy.margins.clearance_m,
                ROBOT,
            )
            shown_m = row(PLANNERS, f"{title}: smallest circle")[index]
            # It is found to within 0.4 %.
            assert shown_m == pytest.approx(smallest_m, abs=0.0101)


def test_the_limits_beside_somebody_are_those_of_the_page() -> None:
    course = course_of(ROBOT, RobotState(0.0, np.zeros(2), 0.0, 1.0, 0.0), math.radians(30.0))
    unaware, aware = (
        limit_mps(reach("balanced", alpha, 0.36, 0.25 + 0.8), course) for alpha in (0.0, 1.0)
    )
    assert "is its maximum, instead of 0.04 m/s" in " ".join(PLANNERS.split())
    assert unaware == pytest.approx(0.04, abs=0.0051)
    assert aware >= ROBOT.max_speed_mps
