"""Invariants for any crowd, any robot and any policy, on which docs/safety.md relies."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import separation_model
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from nav_policies import policies, robots, standing_rules
from nav_scenes import (
    crowds,
    finite,
    moved_person,
    moved_robot,
    numbers,
    robot_at,
    settled_update,
)
from shapely.geometry import Point

from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    RobotProfile,
    RobotState,
    max_speed_mps,
)
from nav_adapter.policies import StandingPeople
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

PRESETS = ("blind", "conservative", "balanced", "assertive")
ROUNDING = 1e-9
# Random histories of crowds, robots and policies take long to generate.
FEW = settings(max_examples=20)

Walk = list[tuple[float, float, tuple[PersonTrack, ...]]]


@st.composite
def walks(draw: st.DrawFn) -> Walk:
    """Updates: time step, speed of the robot, and people relative to the stamp."""
    steps = draw(st.lists(st.sampled_from([0.05, 0.1, 0.25, 0.7]), min_size=1, max_size=6))
    return [(dt, draw(finite(-1.5, 1.5)), draw(crowds())) for dt in steps]


@st.composite
def followed(draw: st.DrawFn) -> Walk:
    """The same few people in every update, mostly seen, so that awareness has an effect."""
    people = draw(crowds(max_size=2))
    steps = draw(st.lists(st.sampled_from([0.05, 0.1, 0.25, 0.7]), min_size=2, max_size=10))
    return [
        (
            dt,
            draw(finite(-1.5, 1.5)),
            tuple(
                replace(
                    track,
                    stamp_s=0.0,
                    status=draw(st.sampled_from(["confirmed", "confirmed", "coasting"])),
                    time_since_seen_s=draw(st.sampled_from([0.0, 0.0, 0.0, 0.4])),
                    awareness_lower=draw(finite(0.0, 1.0)),
                )
                for track in people
            ),
        )
        for dt in steps
    ]


def run(
    policy: AwarenessPolicy, robot: RobotProfile, walk: Walk, *, perceived: bool = False
) -> list[NavConstraints]:
    adapter, now, results = NavAdapter(policy, robot), 0.0, []
    for dt, speed, people in walk:
        now += dt
        tracks = tuple(replace(track, stamp_s=track.stamp_s + now) for track in people)
        state = robot_at(now, heading_rad=0.3, speed_mps=speed)
        stamp_s = now if perceived else None
        results.append(adapter.update(tracks, state, now, perception_stamp_s=stamp_s))
    return results


@FEW
@given(policy=policies(), robot=robots(), walk=walks())
def test_floor_and_ceiling(policy: AwarenessPolicy, robot: RobotProfile, walk: Walk) -> None:
    margins = policy.margins
    for (_, _, people), result in zip(walk, run(policy, robot, walk), strict=True):
        assert {track.id for track in people} <= {o.track_id for o in result.obstacles}
        assert 0.0 <= result.speed_limit_mps <= robot.max_speed_mps
        assert result.reachable_speed_limit_mps >= result.speed_limit_mps
        for obstacle in result.obstacles:
            assert obstacle.radius_m >= BODY_RADIUS_M + margins.minimum_clearance_m
            assert obstacle.radius_m <= (margins.maximum_radius_m or np.inf)
            circle = obstacle.polygon.exterior.distance(Point(obstacle.center_odom_m))
            assert circle >= obstacle.radius_m - ROUNDING
            assert obstacle.polygon.contains(Point(obstacle.center_odom_m))


@FEW
@given(policy=policies(), robot=robots(), walk=walks())
def test_never_faster_than_speed_and_separation_straight_ahead(
    policy: AwarenessPolicy, robot: RobotProfile, walk: Walk
) -> None:
    """People in the driving direction count in full, whatever the rules."""
    last = walk[-1]
    ahead = [
        track
        for track in last[2]
        if (last[1] > 0.0) == bool(_ahead(track) > 0.0) and abs(_ahead(track)) > 0.1
    ]
    result = run(policy, robot, walk)[-1]
    standing, start = policy.rules.standing, {}
    # People who walk away do not come at all while they turn round.
    human_mps = 0.0 if policy.rules.walking is not None else policy.speed.human_speed_mps(1.0)
    if standing is not None:
        # As if everybody stood.
        start = {
            "human_acceleration_mps2": standing.human_acceleration_mps2,
            "start_delay_s": standing.start_delay_s,
        }
    shown = {obstacle.track_id: obstacle for obstacle in result.obstacles}
    for track in ahead:
        # A looser bound than the adapter's: from the robot's centre.
        distance = float(np.linalg.norm(track.position_odom_m))
        bound = max_speed_mps(
            distance - BODY_RADIUS_M,
            human_mps,
            deceleration_mps2=robot.max_deceleration_mps2,
            reaction_time_s=robot.reaction_time_s,
            clearance_m=policy.margins.separation_clearance_m,
            **start,
        )
        assert shown[track.id].awareness_lower <= track.awareness_lower
        assert result.speed_limit_mps <= bound + ROUNDING


@st.composite
def scenes(draw: st.DrawFn) -> tuple[AwarenessPolicy, RobotProfile, RobotState, Any]:
    """A policy, a robot in motion in any direction, and a crowd, as of 0 s."""
    speed, lateral = draw(finite(-1.5, 1.5)), draw(st.just(0.0) | finite(-1.5, 1.5))
    state = RobotState(
        -draw(st.just(0.0) | finite(0.0, 0.4)),
        np.array(draw(st.tuples(finite(-3, 3), finite(-3, 3)))),
        draw(finite(-4.0, 4.0)),
        speed,
        draw(finite(-1.5, 1.5)),
        np.array([speed, lateral]),
    )
    return draw(policies()), draw(robots()), state, draw(crowds())


def _assert_equal_to_the_model(
    scene: tuple[AwarenessPolicy, RobotProfile, RobotState, Any],
) -> None:
    policy, robot, state, people = scene
    result = settled_update(people, policy=policy, robot=robot, state=state, perceived=True)
    shown = {obstacle.track_id: obstacle.awareness_lower for obstacle in result.obstacles}
    # Frames have shown each person for this time since the first update.
    # Where the 0.1 s between updates count as silence, each sighting is the first.
    stale_after_s = policy.timing.stale_after_s
    assume(abs(stale_after_s - 0.1) > 1e-6)
    silent = result.stale or stale_after_s < 0.1
    known_s = 0.0 if silent else 4 * min(0.1, policy.timing.fresh_within_s)
    known = known_s > policy.timing.shrink_after_s - 1e-6
    alphas = [shown[track.id] if known else 0.0 for track in people]
    # With hysteresis the speed depends on more than the last lower bound.
    held = getattr(policy.speed, "shape", "") == "two_level"
    known = known and not result.stale
    expected = separation_model.limit_mps(policy, robot, state, people, alphas, 0.0, known=known)
    if not held:
        assert result.speed_limit_mps <= expected + 1e-6
    bound = separation_model.limit_mps(policy, robot, state, people, [1.0] * len(people), 0.0)
    assert result.speed_limit_mps <= bound + 1e-6
    if not held and result.limited_by.endswith(("speed and separation", "robot maximum")):
        assert result.speed_limit_mps == pytest.approx(expected, abs=1e-6)


@settings(max_examples=100)
@given(scene=scenes())
def test_the_limit_is_that_of_a_second_implementation(scene: Any) -> None:
    """By bisection, with shapely's geometry: ``separation_model``."""
    _assert_equal_to_the_model(scene)


@settings(max_examples=60)
@given(scene=scenes(), rule=standing_rules(0.1), unseen_s=st.sampled_from([0.0, 0.0, 0.05]))
def test_the_limit_is_that_of_a_second_implementation_for_people_who_stand(
    scene: Any, rule: StandingPeople, unseen_s: float
) -> None:
    policy, robot, state, people = scene
    rule = rule.model_copy(update={"standing_below_mps": 0.2})
    rules = policy.rules.model_copy(update={"standing": rule, "zones": None, "near_cap": None})
    calm = tuple(
        replace(
            track,
            stamp_s=0.1 * track.stamp_s,
            status="confirmed",
            time_since_seen_s=unseen_s,
            velocity_odom_mps=0.02 * track.velocity_odom_mps,
            covariance_odom=1e-4 * track.covariance_odom,
        )
        for track in people
    )
    _assert_equal_to_the_model((policy.model_copy(update={"rules": rules}), robot, state, calm))


@pytest.mark.full
@settings(max_examples=5000)
@given(scene=scenes())
def test_the_limit_is_that_of_a_second_implementation_in_5000_crowds(scene: Any) -> None:
    _assert_equal_to_the_model(scene)


def _ahead(track: PersonTrack) -> float:
    return float(track.position_odom_m @ [np.cos(0.3), np.sin(0.3)])


@FEW
@given(policy=policies(), robot=robots(), walk=followed(), data=st.data())
def test_more_awareness_never_means_more_room_or_less_speed(
    policy: AwarenessPolicy, robot: RobotProfile, walk: Walk, data: st.DataObject
) -> None:
    """Over whole histories, with lower bounds that are smaller in every update."""
    share = data.draw(st.lists(finite(0.0, 1.0), min_size=len(walk), max_size=len(walk)))
    lower = [
        (dt, v, tuple(replace(t, awareness_lower=s * t.awareness_lower) for t in people))
        for s, (dt, v, people) in zip(share, walk, strict=True)
    ]
    _assert_ordered(run(policy, robot, lower), run(policy, robot, walk))


@FEW
@given(robot=robots(), walk=followed())
def test_presets_are_ordered(robot: RobotProfile, walk: Walk) -> None:
    results = [run(AwarenessPolicy.preset(name), robot, walk) for name in PRESETS]
    for more, less in pairwise(results):
        _assert_ordered(more, less)


def _assert_ordered(careful: list[NavConstraints], bold: list[NavConstraints]) -> None:
    for a, b in zip(careful, bold, strict=True):
        assert a.speed_limit_mps <= b.speed_limit_mps + ROUNDING
        for wide, narrow in zip(a.obstacles, b.obstacles, strict=True):
            assert wide.radius_m >= narrow.radius_m - ROUNDING
            assert wide.awareness_lower <= narrow.awareness_lower


@FEW
@given(policy=policies(), robot=robots(), walk=followed())
def test_every_rate_is_bounded(policy: AwarenessPolicy, robot: RobotProfile, walk: Walk) -> None:
    results, rate = run(policy, robot, walk), policy.timing.shrink_rate_mps
    for (dt, speed, _), before, after in zip(walk[1:], results, results[1:], strict=False):
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


@FEW
@given(
    policy=policies(),
    robot=robots(),
    walk=walks(),
    angle=finite(-7.0, 7.0),
    shift=st.tuples(finite(-50, 50), finite(-50, 50)),
)
def test_rotating_and_shifting_the_world_changes_no_constraint(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    walk: Walk,
    angle: float,
    shift: tuple[float, float],
) -> None:
    here, there, now = NavAdapter(policy, robot), NavAdapter(policy, robot), 0.0
    for dt, speed, people in walk:
        now += dt
        tracks = tuple(replace(track, stamp_s=track.stamp_s + now) for track in people)
        state = robot_at(now, speed_mps=speed)
        ours = here.update(tracks, state, now)
        theirs = there.update(
            [moved_person(track, angle, np.asarray(shift)) for track in tracks],
            moved_robot(state, angle, np.asarray(shift)),
            now,
        )
        assert theirs.speed_limit_mps == pytest.approx(ours.speed_limit_mps, abs=1e-6)
        assert [alert.kind for alert in theirs.alerts] == [alert.kind for alert in ours.alerts]
        for a, b in zip(ours.obstacles, theirs.obstacles, strict=True):
            assert b.radius_m == pytest.approx(a.radius_m, abs=1e-8)
            assert b.awareness_lower == a.awareness_lower


@FEW
@given(policy=policies(), robot=robots(), walk=walks(), order=st.randoms())
def test_the_order_of_people_does_not_matter(
    policy: AwarenessPolicy, robot: RobotProfile, walk: Walk, order: object
) -> None:
    shuffled = []
    for dt, speed, people in walk:
        mixed = list(people)
        order.shuffle(mixed)
        shuffled.append((dt, speed, tuple(mixed)))
    for one, other in zip(run(policy, robot, walk), run(policy, robot, shuffled), strict=True):
        assert numbers(one) == numbers(other)
        assert one.alerts == other.alerts


@FEW
@given(policy=policies(), robot=robots(), walk=followed(), age=finite(0.0, 3.0))
def test_stale_is_never_looser_than_fresh(
    policy: AwarenessPolicy, robot: RobotProfile, walk: Walk, age: float
) -> None:
    """The same history, then one update with data of this age."""
    after = []
    for late in (0.0, age):
        adapter, now = NavAdapter(policy, robot), 0.0
        for dt, speed, people in walk:
            now += dt
            tracks = tuple(replace(track, stamp_s=now) for track in people)
            state = robot_at(now, speed_mps=speed)
            adapter.update(tracks, state, now, perception_stamp_s=now)
        # Both adapters are updated at the same time; one gets no new stamp of perception.
        later = now + age
        after.append(adapter.update(tracks, state, later, perception_stamp_s=later - late))
    fresh, old = after
    assert old.stale or age <= policy.timing.stale_after_s
    assert old.speed_limit_mps <= fresh.speed_limit_mps + ROUNDING
    for a, b in zip(fresh.obstacles, old.obstacles, strict=True):
        assert b.radius_m >= a.radius_m - ROUNDING
        assert b.awareness_lower <= a.awareness_lower
