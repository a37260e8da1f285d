"""Fast people: awareness counts less for brisk walkers, and not at all for runners."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from nav_scenes import ROBOT, finite, person, settled_update

from nav_adapter import AwarenessPolicy, max_speed_mps
from nav_adapter.policies import SpeedRules
from perception.anthropometry import BODY_RADIUS_M

# Without the reserve for people who set off: these are tests of speed and separation.
POLICY = AwarenessPolicy(rules=SpeedRules())
UNAWARE_MPS = POLICY.speed.human_speed_mps(0.0)
AWARE_MPS = POLICY.speed.human_speed_mps(1.0)
# The person's distance straight ahead, and the front end of the footprint.
AHEAD_M, FRONT_M = 3.0, float(ROBOT.footprint_m[:, 0].max())


def limit_mps(
    walking_mps: float, course_rad: float, alpha: float = 1.0, policy: AwarenessPolicy = POLICY
) -> float:
    """Return the limit for a person 3 m ahead; a course of 0 is straight away from the robot."""
    velocity = walking_mps * math.cos(course_rad), walking_mps * math.sin(course_rad)
    track = person(position=(AHEAD_M, 0.0), velocity=velocity, awareness_lower=alpha)
    return settled_update((track,), policy=policy).speed_limit_mps


def limit_for(human_mps: float) -> float:
    """Return the limit of speed and separation with this human speed."""
    limit = max_speed_mps(
        AHEAD_M - FRONT_M - BODY_RADIUS_M,
        human_mps,
        deceleration_mps2=ROBOT.max_deceleration_mps2,
        reaction_time_s=ROBOT.reaction_time_s,
        clearance_m=POLICY.margins.separation_clearance_m,
    )
    return min(ROBOT.max_speed_mps, float(limit))


@pytest.mark.parametrize("course_deg", [90.0, 110.0, 134.0])
def test_a_brisk_walker_counts_as_turning_to_the_robot(course_deg: float) -> None:
    """At the speed assumed for unaware people the whole 45° counts, for every α."""
    off_rad = math.radians(180.0 - course_deg - 45.0)
    expected = limit_for(UNAWARE_MPS * math.cos(off_rad))
    assert limit_mps(UNAWARE_MPS, math.radians(course_deg)) == pytest.approx(expected, abs=1e-12)


@given(share=finite(0.75, 1.0), course=finite(math.pi / 2, math.pi))
def test_the_turn_grows_with_the_pace_from_three_quarters_of_the_unaware_speed(
    share: float, course: float
) -> None:
    """None at 0.75 of the speed assumed of an unaware person, the whole 45° at that speed."""
    turn_rad = math.radians(45.0) * (share - 0.75) / 0.25
    off_rad = max(math.pi - course - turn_rad, 0.0)
    closing_mps = max(AWARE_MPS, share * UNAWARE_MPS * math.cos(off_rad))
    found = limit_mps(share * UNAWARE_MPS, course)
    assert found == pytest.approx(limit_for(closing_mps), abs=1e-9)


@given(walking=finite(0.0, 1.2), course=finite(math.pi / 2, math.pi))
def test_at_normal_pace_only_the_closing_speed_counts(walking: float, course: float) -> None:
    closing_mps = max(AWARE_MPS, -walking * math.cos(course))
    assert limit_mps(walking, course) == pytest.approx(limit_for(closing_mps), abs=1e-12)


@given(course=finite(-math.pi, math.pi), faster=finite(1.25, 2.5))
def test_for_a_runner_awareness_does_not_count(course: float, faster: float) -> None:
    running_mps = faster * UNAWARE_MPS
    assert limit_mps(running_mps, course) == pytest.approx(limit_for(running_mps), abs=1e-12)


@given(
    course=finite(math.pi / 2, math.pi),
    slow=finite(0.0, 3.0),
    more=finite(0.0, 1.0),
    alpha=finite(0.0, 1.0),
)
def test_a_faster_person_never_raises_the_limit(
    course: float, slow: float, more: float, alpha: float
) -> None:
    assert limit_mps(slow + more, course, alpha) <= limit_mps(slow, course, alpha) + 1e-12


@given(
    course=finite(-math.pi, math.pi),
    walking=finite(0.0, 3.0),
    alpha=finite(0.0, 1.0),
    turns=finite(0.0, 180.0),
    more=finite(0.0, 180.0),
)
def test_a_larger_turn_never_raises_the_limit_or_lowers_it_below_the_unaware_one(
    course: float, walking: float, alpha: float, turns: float, more: float
) -> None:
    def policy(turn_deg: float) -> AwarenessPolicy:
        rules = SpeedRules(people_turn_deg=min(turn_deg, 180.0))
        return POLICY.model_copy(update={"rules": rules})

    narrow = limit_mps(walking, course, alpha, policy(turns))
    wide = limit_mps(walking, course, alpha, policy(turns + more))
    assert wide <= narrow + 1e-12
    # The rule limits awareness only: unaware people are assumed to walk at the robot anyway.
    assert wide >= limit_mps(walking, course, 0.0, policy(0.0)) - 1e-12
