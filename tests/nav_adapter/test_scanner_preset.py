"""The simulator's preset ``scanner``: a field sized by the robot's speed, the same for all."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from nav_scenes import ROBOT, finite, person, robot_at, settled_update

from awarenav.policies.command import show
from nav_adapter import AwarenessPolicy, NavAdapter, RobotState
from nav_adapter.policies import ProtectiveField, SpeedRules
from nav_adapter.proof import check_robot
from perception.anthropometry import BODY_RADIUS_M
from sim_tests.crossing import named_policy

SCANNER = named_policy("scanner")[1]
FRONT_M, HALF_WIDTH_M = 0.3625, 0.25
EDGE_M = HALF_WIDTH_M + BODY_RADIUS_M + 0.10


def limit_mps(
    position: tuple[float, float],
    *,
    velocity: tuple[float, float] = (0.0, 0.0),
    alpha: float = 0.0,
    state: RobotState | None = None,
    sigma_m: float = 0.0,
) -> float:
    track = person(position=position, velocity=velocity, awareness_lower=alpha, sigma_m=sigma_m)
    driving = robot_at(speed_mps=0.5) if state is None else state
    return settled_update((track,), policy=SCANNER, state=driving).speed_limit_mps


@given(
    distance=finite(0.7, 3.0),
    walking=finite(0.0, 2.5),
    course=finite(-math.pi, math.pi),
    alpha=finite(0.0, 1.0),
)
def test_the_field_is_the_stopping_distance_and_a_supplement_for_everybody(
    distance: float, walking: float, course: float, alpha: float
) -> None:
    velocity = walking * math.cos(course), walking * math.sin(course)
    found = limit_mps((distance, 0.0), velocity=velocity, alpha=alpha)
    field_m = distance - FRONT_M - BODY_RADIUS_M
    if field_m <= 0.1:
        assert found == 0.0
    elif found < ROBOT.max_speed_mps:
        assert found * 0.3 + found**2 / 2.0 + 0.1 == pytest.approx(field_m, abs=1e-9)
    else:
        # The whole field at 1.5 m/s.
        assert field_m >= 1.675 - 1e-9


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_field_is_as_wide_as_the_robot_and_a_supplement(side: float) -> None:
    assert limit_mps((1.0, side * (EDGE_M - 0.01))) < 1.0
    assert limit_mps((1.0, side * (EDGE_M + 0.01))) == ROBOT.max_speed_mps
    # Two standard deviations of the position widen it.
    assert limit_mps((1.0, side * (EDGE_M + 0.19)), sigma_m=0.1) < 1.0
    assert limit_mps((1.0, side * (EDGE_M + 0.21)), sigma_m=0.1) == ROBOT.max_speed_mps


def test_the_field_leads_the_way_the_robot_drives() -> None:
    ahead, behind, left = (1.2, 0.0), (-1.2, 0.0), (0.0, 1.2)
    forward, back = robot_at(speed_mps=0.5), robot_at(speed_mps=-0.5)
    sideways = replace(robot_at(), velocity_base_mps=np.array([0.0, 0.5]))
    slowed = [
        [limit_mps(place, state=state) < ROBOT.max_speed_mps for place in (ahead, behind, left)]
        for state in (forward, back, sideways)
    ]
    assert slowed == [[True, False, False], [False, True, False], [False, False, True]]
    turned = robot_at(heading_rad=math.pi / 2, speed_mps=0.5)
    assert limit_mps(left, state=turned) == pytest.approx(limit_mps(ahead), abs=1e-12)
    assert limit_mps(ahead, state=turned) == ROBOT.max_speed_mps
    # A standing robot may start off ahead.
    assert limit_mps(ahead, state=robot_at()) < ROBOT.max_speed_mps


def test_someone_beside_the_tail_is_in_the_field_and_someone_behind_it_is_not() -> None:
    assert limit_mps((-FRONT_M - 0.29, 0.5)) < ROBOT.max_speed_mps
    assert limit_mps((-FRONT_M - 0.31, 0.5)) == ROBOT.max_speed_mps


@pytest.mark.parametrize("alpha", [0.0, 0.5, 1.0])
def test_everybody_is_an_obstacle_of_the_same_size_without_alerts(alpha: float) -> None:
    adapter = NavAdapter(SCANNER, ROBOT)
    for stamp_s in np.arange(0.0, 2.0, 0.1).tolist():
        walker = person(
            stamp_s, position=(3.0 - stamp_s, 0.0), velocity=(-1.0, 0.0), awareness_lower=alpha
        )
        result = adapter.update([walker], robot_at(stamp_s, speed_mps=0.5), stamp_s)
        assert [obstacle.radius_m for obstacle in result.obstacles] == [0.45]
        assert result.alerts == ()


def test_people_who_walk_stop_and_turn_keep_their_ids() -> None:
    """A human speed of 0 does not make every step somebody new."""
    adapter = NavAdapter(SCANNER, ROBOT)
    position, stamp_s = np.array([5.0, 2.0]), 0.0
    for velocity in ([0.0, 0.0], [-1.5, 0.0], [0.0, 0.0], [0.0, -1.5], [0.0, 1.5]) * 2:
        for _ in range(5):
            stamp_s += 0.1
            position = position + 0.1 * np.array(velocity)
            track = person(stamp_s, position=position, velocity=velocity)
            result = adapter.update([track], robot_at(stamp_s), stamp_s)
            assert [obstacle.track_id for obstacle in result.obstacles] == [1]


def test_the_scanner_is_outside_the_order_of_the_other_presets() -> None:
    """Faster than the boldest near a walker, with more room than the boldest for the aware."""
    walker = person(position=(2.5, 0.0), velocity=(-1.2, 0.0))
    aware = person(position=(2.5, 0.0), awareness_lower=1.0)
    bold = AwarenessPolicy.preset("assertive")

    def limit(policy: AwarenessPolicy) -> float:
        state = robot_at(speed_mps=0.5)
        return settled_update((walker,), policy=policy, state=state).speed_limit_mps

    def radius(policy: AwarenessPolicy) -> float:
        return policy.inflation.radius_m(aware.awareness_lower)

    assert limit(SCANNER) > limit(bold) + 0.5
    assert radius(SCANNER) > radius(bold)


def test_the_field_holds_for_people_who_stand_and_for_nobody_else() -> None:
    assert check_robot(ROBOT, human_speed_mps=0.0).contacts == 0
    # A person who walks at 1.6 m/s reaches the robot that keeps this limit.
    limit = limit_mps((2.0, 0.0), velocity=(-1.6, 0.0))
    stops_s = ROBOT.reaction_time_s + limit / ROBOT.max_deceleration_mps2
    way_m = limit * ROBOT.reaction_time_s + limit**2 / 2.0 + 1.6 * stops_s
    assert way_m > 2.0 - FRONT_M - BODY_RADIUS_M


def test_the_scanner_has_none_of_the_rules_about_people() -> None:
    rules = SCANNER.rules
    assert (rules.standing, rules.walking, rules.start_reserve) == (None, None, None)
    assert SCANNER.standing_window_s is None
    assert SCANNER.timing.lost_rise_mps2 is None
    assert SCANNER.noticed is None
    assert SCANNER.filter.noticed_memory_s == 0.0
    assert SCANNER.margins.maximum_radius_m is None


def test_other_policies_know_no_field() -> None:
    for name in ("blind", "conservative", "balanced", "assertive"):
        assert AwarenessPolicy.preset(name).rules.protective_field is None
    with pytest.raises(ValueError, match="beside_m"):
        SpeedRules(protective_field=ProtectiveField(beside_m=-0.1))


def test_help_names_every_preset() -> None:
    for name in ("blind", "conservative", "balanced", "assertive"):
        assert name in (show.epilog or "")
        AwarenessPolicy.preset(name)
