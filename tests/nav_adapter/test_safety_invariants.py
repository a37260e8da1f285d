"""Invariants for any crowd, any robot and any policy, on which docs/safety.md relies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import STEPS_S, Walk, driven, histories, policies, robots
from nav_scenes import (
    SCANNER,
    crowds,
    field_mps,
    finite,
    moved_person,
    moved_robot,
    numbers,
    robot_at,
)
from shapely.geometry import Point

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile
from perception.anthropometry import BODY_RADIUS_M

ROUNDING = 1e-9
# Random histories of crowds, robots and policies take long to generate.
FEW = settings(max_examples=20)


@st.composite
def walks(draw: st.DrawFn) -> Walk:
    """Updates with other people in each of them."""
    steps = draw(st.lists(STEPS_S, min_size=1, max_size=6))
    turns = st.just(0.0) | finite(-1.0, 1.0)
    return [(dt, draw(finite(-1.5, 1.5)), draw(turns), draw(crowds())) for dt in steps]


def run(policy: AwarenessPolicy, robot: RobotProfile, walk: Walk) -> list[NavConstraints]:
    return driven(policy, robot, walk, perceived=False)


@FEW
@given(policy=policies(), robot=robots(), walk=walks())
def test_floor_and_ceiling(policy: AwarenessPolicy, robot: RobotProfile, walk: Walk) -> None:
    margins = policy.margins
    for (*_, people), result in zip(walk, run(policy, robot, walk), strict=True):
        assert {track.id for track in people} <= {o.track_id for o in result.obstacles}
        assert 0.0 <= result.speed_limit_mps <= robot.max_speed_mps
        assert result.reachable_speed_limit_mps >= result.speed_limit_mps
        for obstacle in result.obstacles:
            assert obstacle.radius_m >= BODY_RADIUS_M + margins.clearance_m
            circle = obstacle.polygon.exterior.distance(Point(obstacle.center_odom_m))
            assert circle >= obstacle.radius_m - ROUNDING
            assert obstacle.polygon.contains(Point(obstacle.center_odom_m))


@FEW
@given(policy=policies(), robot=robots(), walk=walks())
def test_never_faster_than_a_protective_field_straight_ahead(policy, robot, walk) -> None:
    """Whatever the policy, the robot stops before the body of somebody in its straight path."""
    result = run(policy, robot, walk)[-1]
    _, speed, _, people = walk[-1]
    along = np.array([np.cos(0.3), np.sin(0.3)]) * (1.0 if speed > -0.05 else -1.0)
    corners = robot.footprint_m[:, 0] * (1.0 if speed > -0.05 else -1.0)
    a, T = robot.max_deceleration_mps2, robot.reaction_time_s
    for track in people:
        ahead_m = float(track.position_odom_m @ along)
        aside_m = abs(
            float(along[0] * track.position_odom_m[1] - along[1] * track.position_odom_m[0])
        )
        gap_m = ahead_m - float(corners.max()) - policy.margins.floor_m
        if ahead_m > 0.0 and aside_m < 0.05:
            bound = -a * T + np.sqrt((a * T) ** 2 + 2.0 * a * max(gap_m, 0.0))
            assert result.speed_limit_mps <= bound + 0.02


@FEW
@given(policy=policies(), robot=robots(), walk=walks())
def test_no_policy_is_looser_than_the_protective_field_alone(policy, robot, walk) -> None:
    """Not in the limit of any update, nor in any radius."""
    field = policy.model_copy(update={"without": SCANNER})
    _assert_ordered(run(policy, robot, walk), run(field, robot, walk))


@FEW
@given(policy=policies(), robot=robots(), walk=histories(10, complete=True), data=st.data())
def test_more_awareness_never_means_more_room_or_less_speed(policy, robot, walk, data) -> None:
    """Over whole histories, with lower bounds that are smaller in every update."""
    share = data.draw(st.lists(finite(0.0, 1.0), min_size=len(walk), max_size=len(walk)))
    lower = [
        (*motion, tuple(replace(t, awareness_lower=s * t.awareness_lower) for t in people))
        for s, (*motion, people) in zip(share, walk, strict=True)
    ]
    _assert_ordered(run(policy, robot, lower), run(policy, robot, walk))


def _assert_ordered(careful: list[NavConstraints], bold: list[NavConstraints]) -> None:
    for a, b in zip(careful, bold, strict=True):
        assert a.speed_limit_mps <= b.speed_limit_mps + ROUNDING
        for wide, narrow in zip(a.obstacles, b.obstacles, strict=True):
            assert wide.radius_m >= narrow.radius_m - ROUNDING
            assert wide.awareness_lower <= narrow.awareness_lower


@FEW
@given(policy=policies(), robot=robots(), walk=histories(10, complete=True))
def test_every_rate_is_bounded(policy: AwarenessPolicy, robot: RobotProfile, walk: Walk) -> None:
    results, rate = run(policy, robot, walk), policy.timing.shrink_rate_mps
    for (dt, speed, *_), before, after in zip(walk[1:], results, results[1:], strict=False):
        for was, now in zip(before.obstacles, after.obstacles, strict=True):
            # A sighting counts for the time since the last one, up to ``fresh_within_s``.
            counted_s = max(dt, policy.timing.fresh_within_s)
            assert now.radius_m >= was.radius_m - rate * counted_s - ROUNDING
        fall = abs(speed) - robot.max_deceleration_mps2 * dt
        assert after.reachable_speed_limit_mps >= fall - ROUNDING
        if before.stale and not after.stale:
            rise = robot.max_acceleration_mps2 * dt
            allowed = max(before.speed_limit_mps, abs(speed)) + rise
            assert after.speed_limit_mps <= allowed + ROUNDING


@settings(max_examples=30)
@given(
    policy=policies(),
    robot=robots(),
    walk=walks(),
    angle=finite(-7.0, 7.0),
    shift=st.tuples(finite(-50, 50), finite(-50, 50)),
    mirrored=st.booleans(),
)
def test_a_turned_shifted_or_mirrored_world_has_the_same_constraints(
    policy, robot, walk, angle, shift, mirrored
):
    twin = replace(robot, footprint_m=robot.footprint_m * [1.0, -1.0 if mirrored else 1.0])
    here, there, now = NavAdapter(policy, robot), NavAdapter(policy, twin), 0.0
    for dt, speed, yaw_radps, people in walk:
        now += dt
        tracks = tuple(replace(track, stamp_s=track.stamp_s + now) for track in people)
        state = replace(robot_at(now, speed_mps=speed), yaw_rate_radps=yaw_radps)
        world = {"angle_rad": angle, "shift_m": np.asarray(shift), "mirrored": mirrored}
        moved = moved_robot(state, **world)
        ours = here.update(tracks, state, now)
        theirs = there.update([moved_person(track, **world) for track in tracks], moved, now)
        for name in ("speed_limit_mps", "fastest_point_limit_mps", "other_way_limit_mps"):
            assert getattr(theirs, name) == pytest.approx(getattr(ours, name), abs=1e-6), name
        assert field_mps(theirs, moved) == pytest.approx(field_mps(ours, state), abs=5e-3)
        assert [alert.kind for alert in theirs.alerts] == [alert.kind for alert in ours.alerts]
        for a, b in zip(ours.obstacles, theirs.obstacles, strict=True):
            assert b.radius_m == pytest.approx(a.radius_m, abs=1e-8)
            assert b.awareness_lower == a.awareness_lower


@FEW
@given(policy=policies(), robot=robots(), walk=walks(), order=st.randoms())
def test_the_order_of_people_does_not_matter(policy, robot, walk, order) -> None:
    shuffled = []
    for dt, speed, yaw_radps, people in walk:
        mixed = list(people)
        order.shuffle(mixed)
        shuffled.append((dt, speed, yaw_radps, tuple(mixed)))
    for one, other in zip(run(policy, robot, walk), run(policy, robot, shuffled), strict=True):
        assert numbers(one) == numbers(other)
        assert one.alerts == other.alerts


@FEW
@given(
    policy=policies(),
    robot=robots(),
    walk=histories(10, complete=True),
    age=finite(0.0, 3.0),
    share=finite(0.0, 1.0),
)
def test_stale_is_never_looser_than_fresh(policy, robot, walk, age, share) -> None:
    """The same history, then one update with people of this age, and a state of a share of it."""
    after = []
    for late in (0.0, age):
        adapter, now = NavAdapter(policy, robot), 0.0
        for dt, speed, _, people in walk:
            now += dt
            tracks = tuple(replace(track, stamp_s=now) for track in people)
            state = robot_at(now, speed_mps=speed)
            adapter.update(tracks, state, now, perception_stamp_s=now)
        # Both adapters are updated at the same time; one gets no new stamp of perception.
        later = now + age
        state = replace(state, stamp_s=later - share * late)
        after.append(adapter.update(tracks, state, later, perception_stamp_s=later - late))
    fresh, old = after
    assert old.stale or age <= policy.timing.stale_after_s
    assert old.speed_limit_mps <= fresh.speed_limit_mps + ROUNDING
    for a, b in zip(fresh.obstacles, old.obstacles, strict=True):
        assert b.radius_m >= a.radius_m - ROUNDING
        assert b.awareness_lower <= a.awareness_lower
