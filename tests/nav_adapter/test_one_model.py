"""One model: the limits of update, field, twists and brute force on arcs agree in any world."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from limit_worlds import drawn_robot
from nav_scenes import ROBOT, field_mps, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile, RobotState
from nav_adapter.motion import clip_twists, clip_twists_ahead, twist_envelope
from nav_adapter.rigid import Motion
from nav_adapter.rules import CREEPING_MPS
from perception.arrays import FloatArray
from tracking import PersonTrack

POLICY = AwarenessPolicy.preset("balanced")
DIFFERENTIAL = replace(ROBOT, drive="differential")
STATES = [120, pytest.param(1000, marks=pytest.mark.full)]


def drawn_state(rng: np.random.Generator, robot: RobotProfile) -> RobotState:
    speed = rng.uniform(0.1, 1.0) * robot.max_speed_mps * rng.choice([1.0, 1.0, -1.0])
    return RobotState(
        0.0, rng.uniform(-3.0, 3.0, 2), rng.uniform(-3.0, 3.0), speed, rng.uniform(-1.0, 1.0)
    )


def drawn_people(
    rng: np.random.Generator, count: int, near_m: FloatArray, fastest_mps: float
) -> list[PersonTrack]:
    found = []
    for index in range(count):
        (bearing, way), distance = rng.uniform(-math.pi, math.pi, 2), rng.uniform(0.6, 5.0)
        speed, alpha = rng.uniform(0.0, fastest_mps), float(rng.choice([0.0, 0.4, 1.0]))
        found.append(
            person(
                track_id=index,
                position=near_m + distance * np.array([math.cos(bearing), math.sin(bearing)]),
                velocity=(speed * math.cos(way), speed * math.sin(way)),
                awareness_lower=alpha,
                sigma_m=0.02,
            )
        )
    return found


@pytest.mark.parametrize("count", STATES, ids=str)
def test_field_and_update_agree_for_robots_that_turn(count: int) -> None:
    rng, apart = np.random.default_rng(3), []
    for index in range(count):
        robot = drawn_robot(rng)
        state = drawn_state(rng, robot)
        walking = 1.5 * (index % 2)
        people = drawn_people(rng, 1 + index % 3, state.position_odom_m, walking)
        now = settled_update(people, policy=POLICY, robot=robot, state=state)
        apart.append(now.speed_limit_mps - field_mps(now, state))
        assert apart[-1] >= -1e-6, index
    # For people who stand and are seen: equal, but where somebody just comes to the robot's way.
    standing = np.array(apart[::2])
    assert np.mean(standing <= 0.01) >= 0.9
    assert np.mean(standing <= 0.2) >= 0.99


def meets_on_an_arc(
    robot: RobotProfile, state: RobotState, track: PersonTrack, speed_mps: float
) -> bool:
    """Return whether the robot meets a reach while it moves, on its arc or one turned off it.

    The footprint is moved along the arcs themselves, at small steps of time and angle.
    """
    rules, a, T = POLICY.reach, robot.max_deceleration_mps2, robot.reaction_time_s
    t = np.linspace(0.0, T + speed_mps / a, 60)[:-1]
    late = np.maximum(t - T, 0.0)
    way = speed_mps * t - 0.5 * a * late**2
    since = t + rules.delay_s
    top = POLICY.speed.human_speed_mps(track.awareness_lower)
    radius = top * (since + rules.time_constant_s * np.expm1(-since / rules.time_constant_s))
    within_m = POLICY.margins.within_m(top, POLICY.speed.human_speed_mps(0.0))
    for turned_rad in np.radians(rules.turn_deg) * np.linspace(-1.0, 1.0, 9):
        heading = state.heading_odom_rad + turned_rad
        start = Motion(*state.position_odom_m, heading, state.speed_mps, 0.0, state.yaw_rate_radps)
        for each, reach_m in zip(way.tolist(), radius.tolist(), strict=True):
            motion = start.at(each / abs(state.speed_mps))
            dx = track.position_odom_m[0] - motion.x_m
            dy = track.position_odom_m[1] - motion.y_m
            cos, sin = math.cos(motion.heading_rad), math.sin(motion.heading_rad)
            x, y = cos * dx + sin * dy, cos * dy - sin * dx
            (front, half), rear = robot.footprint_m.max(axis=0), robot.footprint_m[:, 0].min()
            if state.speed_mps < 0.0:
                x, front, rear = -x, -rear, -front
            if x < rear:
                continue
            gap = math.hypot(max(x - front, 0.0), max(abs(y) - half, 0.0))
            if gap < reach_m + POLICY.margins.floor_m - min(reach_m, within_m) - 1e-6:
                return True
    return False


@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.full)], ids=str)
def test_within_the_limit_no_arc_meets_a_reach(count: int) -> None:
    rng, limited = np.random.default_rng(4), 0
    for index in range(count):
        robot = drawn_robot(rng)
        state = drawn_state(rng, robot)
        (track,) = drawn_people(rng, 1, state.position_odom_m, 0.0)
        now = settled_update([track], policy=POLICY, robot=robot, state=state)
        speed_mps = min(abs(state.speed_mps), now.speed_limit_mps)
        limited += speed_mps < abs(state.speed_mps)
        if speed_mps > 0.01:
            assert not meets_on_an_arc(robot, state, track, speed_mps), index
    assert limited > count // 10


def ahead_alone(bearing_rad: float, half_rad: float) -> float | None:
    """Return the stamp of what a camera of 90° sees that looks ahead."""
    off = abs(math.remainder(bearing_rad, 2.0 * math.pi))
    return 0.0 if off + half_rad <= math.pi / 4 + 1e-9 else None


@pytest.mark.parametrize(
    ("speed", "left", "limit"),
    [(1.0, 0.0, 1.5), (-1.0, 0.0, CREEPING_MPS), (0.0, 0.8, CREEPING_MPS), (0.0, 0.0, 1.5)],
)
def test_a_robot_creeps_where_no_sensor_sees(speed: float, left: float, limit: float) -> None:
    robot = replace(ROBOT, drive="holonomic")
    state = replace(robot_at(speed_mps=speed), velocity_base_mps=[speed, left])
    now = NavAdapter(POLICY, robot).update((), state, 0.0, seen_stamp_s=ahead_alone)
    assert now.speed_limit_mps == limit
    assert now.limited_by.startswith("unseen: ") is (limit < 1.5)
    assert field_mps(now, state) == limit
    for twist in ([-0.8, 0.0, 0.0], [0.8, 0.0, 0.0]):
        most = 0.8 if twist[0] > 0.0 and limit == 1.5 else CREEPING_MPS
        for clipped in (
            clip_twists(now, twist),
            clip_twists_ahead(now, state, twist, 0.1, slack_mps=0.0),
            clip_twists_ahead(now, state, [twist], 0.1, slack_mps=0.0)[0],
        ):
            assert abs(clipped[0]) <= most + 1e-9


@pytest.mark.parametrize("clock_s", [0.0, 1000.0])
def test_what_was_seen_too_long_ago_is_unseen_and_without_knowledge_all_is_seen(clock_s) -> None:
    def seen(bearing_rad: float, half_rad: float) -> float | None:
        return None if ahead_alone(bearing_rad, half_rad) is None else clock_s

    adapter = NavAdapter(POLICY, ROBOT)
    state = replace(robot_at(speed_mps=1.0), stamp_s=clock_s)
    late = replace(state, stamp_s=clock_s + POLICY.timing.stale_after_s + 0.1)
    assert adapter.update((), state, clock_s, seen_stamp_s=seen).speed_limit_mps == 1.5
    stale = adapter.update((), late, late.stamp_s, seen_stamp_s=seen)
    assert stale.limited_by.startswith("unseen: ")
    left_out = POLICY.model_copy(update={"without": ("unseen",)})
    for policy, told in ((POLICY, None), (left_out, lambda *_: None)):
        free = NavAdapter(policy, ROBOT).update((), state, clock_s, seen_stamp_s=told)
        assert free.speed_limit_mps == 1.5


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10**6),
    speed=st.sampled_from([0.0, 0.5, -0.5]),
    v=finite(-1.5, 1.5),
    w=finite(-2.0, 2.0),
)
def test_twists_of_the_envelope_are_not_clipped(seed, speed, v, w) -> None:
    rng = np.random.default_rng(seed)
    state = robot_at(speed_mps=speed)
    people = drawn_people(rng, 2, state.position_odom_m, 1.0)
    now = settled_update(people, policy=POLICY, robot=DIFFERENTIAL, state=state)
    rows = twist_envelope(now)
    if (rows[:, :2] @ [v, w] >= rows[:, 2]).all():
        assert clip_twists(now, [v, w]) == pytest.approx([v, w], abs=1e-9)
    v, _ = clip_twists(now, [v, 0.0]).tolist()
    w = now.yaw_rate_limit_radps(v)
    if math.isfinite(w) and v * speed >= 0.0:  # the yaw rate is for the way that it moves
        assert clip_twists(now, [v, w]) == pytest.approx([v, w], abs=1e-6)
