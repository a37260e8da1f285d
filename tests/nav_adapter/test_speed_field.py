"""The speed field is a lower bound of what the adapter says when the robot gets there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import robots
from nav_scenes import ROBOT, SCANNER, crowds, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import SpeedMap, speed_limit_at, time_cost
from nav_adapter.policies import ReachRules
from tracking import PersonTrack

BEFORE_S = (0.4, 0.3, 0.2, 0.1, 0.0)
STEP_S = 0.04


@dataclass(frozen=True)
class Scene:
    """A policy, a robot, people as of 0 s and a robot state as of ``after_s``.

    The first ``missing`` people are last reported 0.1 s before 0 s. ``coasts`` says whether people
    out of sight are never seen again.
    """

    policy: AwarenessPolicy
    robot: RobotProfile
    people: tuple[PersonTrack, ...]
    missing: int
    after_s: float
    state: RobotState
    coasts: bool
    told: int


def at(track: PersonTrack, time_s: float, *, coasts: bool = False) -> PersonTrack:
    """Return the track of somebody who does as predicted, and is seen as at 0 s or coasts."""
    moved = replace(
        track,
        stamp_s=track.stamp_s + time_s,
        position_odom_m=track.position_odom_m + time_s * track.velocity_odom_mps,
    )
    if not coasts or track.status != "coasting" or time_s <= 0.0:
        return moved
    F = np.eye(4)
    F[0, 2] = F[1, 3] = time_s
    covariance = F @ track.covariance_odom @ F.T
    return replace(
        moved,
        covariance_odom=0.5 * (covariance + covariance.T),
        time_since_seen_s=track.time_since_seen_s + time_s,
    )


def drive(scene: Scene) -> tuple[NavConstraints, NavConstraints]:
    """Return the adapter's constraints at 0 s and when the robot has got there."""
    adapter = NavAdapter(scene.policy, scene.robot)
    present = scene.people[scene.missing :]
    for ago_s in BEFORE_S:
        tracks = scene.people if ago_s >= 0.1 else present
        state = replace(scene.state, stamp_s=scene.state.stamp_s - scene.after_s - ago_s)
        now = adapter.update([at(track, -ago_s) for track in tracks], state, -ago_s)
    then, steps = now, int(np.ceil(scene.after_s / STEP_S))
    for step in range(1, steps + 1):
        time_s = scene.after_s * step / steps
        tracks = [at(track, time_s, coasts=scene.coasts) for track in present]
        state = replace(scene.state, stamp_s=scene.state.stamp_s - scene.after_s + time_s)
        then = adapter.update(tracks, state, time_s)
    return now, then


@st.composite
def walking_policies(draw: st.DrawFn) -> AwarenessPolicy:
    policy = AwarenessPolicy.preset(
        draw(st.sampled_from(["balanced", "conservative", "assertive", "blind"]))
    )
    reach = ReachRules(
        time_constant_s=draw(finite(0.1, 1.0)),
        delay_s=draw(finite(0.0, 0.5)),
        turn_deg=draw(st.sampled_from([0.0, 30.0, 120.0]) | finite(0.0, 180.0)),
    )
    fresh_s = draw(finite(0.12, 0.3))
    changes = {
        "reach": reach,
        "without": draw(st.sampled_from([(), (), (), SCANNER])),
        "timing": policy.timing.model_copy(update={"fresh_within_s": fresh_s}),
    }
    return policy.model_copy(update=changes)


@st.composite
def scenes(draw: st.DrawFn, known: int | None = None) -> Scene:
    """Scenes with a robot that moves as it likes; with a heading alone it drives straight on."""
    drives = st.sampled_from([None, "differential", "holonomic"])
    robot = replace(draw(robots()), drive=draw(drives))
    after_s = draw(st.just(0.0) | finite(0.0, 2.0))
    top = robot.max_speed_mps
    told = draw(st.integers(0, 3)) if known is None else known
    speed, lateral = draw(finite(0.05, top)), 0.0
    if told != 1:  # a heading without a speed stands for driving forwards
        speed = draw(st.sampled_from([0.0, 0.03, -0.04]) | finite(-0.7 * top, 0.7 * top))
        # A robot that cannot move sideways but does is a fault, with a test of its own.
        lateral = draw(st.sampled_from([0.0, 0.0, 0.02]))
        if robot.moves_sideways is not False:
            lateral = draw(st.just(lateral) | finite(-0.7 * top, 0.7 * top))
    state = RobotState(
        after_s - draw(st.just(0.0) | finite(0.0, 0.4)),
        np.array(draw(st.tuples(finite(-3, 3), finite(-3, 3)))),
        draw(finite(-4.0, 4.0)),
        speed,
        draw(finite(-3.0, 3.0)) if told in (0, 3) else 0.0,
        np.array([speed, lateral]),
    )
    people = draw(crowds())
    missing = draw(st.integers(0, min(1, len(people))))
    return Scene(
        draw(walking_policies()), robot, people, missing, after_s, state, draw(st.booleans()), told
    )


def field_at(scene: Scene, now: NavConstraints) -> float:
    """Return the field at the robot's pose, told as much of the robot as the scene says."""
    state = scene.state
    assert state.velocity_base_mps is not None
    forward, left = state.velocity_base_mps.tolist()
    told: dict[str, Any] = {
        "headings_odom_rad": [[state.heading_odom_rad]],
        "speeds_mps": [[[forward, left]]] if left else [[forward]],
        "yaw_rates_radps": [[state.yaw_rate_radps]],
    }
    limits = speed_limit_at(
        now,
        state.position_odom_m[None, None],
        dt_s=1.0,
        first_s=scene.after_s,
        **dict(list(told.items())[: scene.told]),
    )
    assert limits.shape == (1, 1)
    return float(limits[0, 0])


@settings(max_examples=50)
@given(scene=scenes())
def test_the_field_is_never_above_the_limit_of_a_robot_that_gets_there(scene: Scene) -> None:
    now, then = drive(scene)
    assert 0.0 <= field_at(scene, now) <= then.speed_limit_mps + 1e-9


def test_for_people_who_stand_and_are_seen_the_field_is_the_limit() -> None:
    rng, shares = np.random.default_rng(4), []
    for _ in range(20):
        policy = AwarenessPolicy.preset(str(rng.choice(["balanced", "conservative", "blind"])))
        people = [
            person(
                track_id=index,
                position=rng.uniform(-5.0, 5.0, 2).tolist(),
                awareness_lower=float(rng.choice([0.0, 0.5, 1.0])),
                sigma_m=float(rng.choice([0.0, 0.1])),
            )
            for index in range(rng.integers(1, 4))
        ]
        places, headings = rng.uniform(-4.0, 4.0, (12, 1, 2)), rng.uniform(-4.0, 4.0, (12, 1))
        speeds = rng.uniform(-1.2, 1.2, (12, 1))
        now = settled_update(people, policy=policy)
        field = speed_limit_at(now, places, headings, dt_s=1.0, speeds_mps=speeds)
        for place, heading, speed, limit in zip(places, headings, speeds, field, strict=True):
            state = robot_at(
                position=place[0].tolist(), heading_rad=float(heading[0]), speed_mps=float(speed[0])
            )
            there = settled_update(people, policy=policy, state=state).speed_limit_mps
            if there >= 0.2:
                shares.append(limit[0] / there)
    assert len(shares) > 75
    assert max(shares) <= 1.0
    # But for a few poses at which a person just comes to the edge of the robot's way, or just not.
    assert np.quantile(shares, 0.04) > 0.9
    assert np.median(shares) > 0.999


@settings(max_examples=30)
@given(scene=scenes(known=0), shift=st.tuples(finite(-0.5, 0.5), finite(-0.5, 0.5)))
def test_a_cell_of_the_map_holds_for_a_robot_anywhere_in_it(scene, shift) -> None:
    cell_m = 0.3
    now, then = drive(scene)
    chart = SpeedMap.around(
        now,
        scene.state.position_odom_m + np.array(shift),
        size_m=1.8,
        resolution_m=cell_m,
        times_s=(scene.after_s,),
    )
    at_robot = (scene.state.position_odom_m - chart.origin_odom_m) / cell_m
    column, row = np.floor(at_robot).astype(int)
    assert chart.limits_mps[row, column] <= then.speed_limit_mps + 1e-9
    percent = int(chart.percent[row, column])
    if percent == 0:
        assert then.speed_limit_mps == scene.robot.max_speed_mps
    elif percent > 1:  # a stop is 1
        assert percent * scene.robot.max_speed_mps <= 100.0 * then.speed_limit_mps + 1e-6


def test_lost_and_stale_people_count_as_in_the_adapter() -> None:
    policy = AwarenessPolicy.preset("balanced")
    adapter = NavAdapter(policy, ROBOT)
    for time_s in np.arange(0.0, 0.5, 0.05).tolist():
        adapter.update([person(time_s, position=(2.0, 0.0))], robot_at(time_s), time_s)
    for time_s in np.arange(0.5, 2.0, 0.05).tolist():
        now = adapter.update([], robot_at(time_s), time_s)
    assert now.limited_by == "track 1: lost"
    here = np.zeros((1, 2, 2))
    field = speed_limit_at(now, here, dt_s=0.5)
    assert field[0, 0] == pytest.approx(now.speed_limit_mps, rel=1e-4)
    assert field[0, 1] == pytest.approx(now.speed_limit_mps + 0.5 * 0.7, rel=1e-4)
    dead = adapter.watchdog(now.stamp_s + 2.0)
    assert speed_limit_at(dead, here, dt_s=0.5).tolist() == [[0.0, 0.0]]
    back = adapter.update([], robot_at(4.1), 4.1)
    assert back.limited_by == "recovery after stale data"
    rising = speed_limit_at(back, here, dt_s=0.5)
    assert rising[0] == pytest.approx([back.speed_limit_mps, back.speed_limit_mps + 0.5], abs=1e-3)


def test_a_differential_robot_that_moves_sideways_is_stopped() -> None:
    robot = replace(ROBOT, drive="differential")
    now = settled_update([], robot=robot)
    here, told = np.zeros((1, 1, 2)), {"dt_s": 0.1, "speeds_mps": [[[0.5, 0.3]]]}
    assert speed_limit_at(now, here, **told).tolist() == [[0.0]]


def test_awareness_counts_for_as_long_as_asked() -> None:
    policy = AwarenessPolicy.preset("balanced")
    aware = settled_update([person(position=(2.5, 0.0), awareness_lower=1.0)], policy=policy)
    unaware = settled_update([person(position=(2.5, 0.0))], policy=policy)
    here = np.zeros((1, 4, 2))
    mixed = speed_limit_at(aware, here, dt_s=0.5, aware_for_s=0.6)[0]
    before, after = (speed_limit_at(each, here, dt_s=0.5)[0] for each in (aware, unaware))
    assert mixed[:2] == pytest.approx(before[:2], rel=1e-3)
    assert mixed[2:] == pytest.approx(after[2:], rel=1e-3)
    assert mixed[2] < mixed[1]


def random_people(rng: np.random.Generator, count: int) -> list[PersonTrack]:
    """Return people who walk anywhere; every second one is aware."""
    return [
        person(
            track_id=index,
            position=rng.uniform(-4, 4, 2).tolist(),
            velocity=rng.uniform(-1.2, 1.2, 2).tolist(),
            awareness_lower=float(index % 2),
        )
        for index in range(count)
    ]


def test_every_shape_of_the_poses_gives_the_same_limits() -> None:
    rng = np.random.default_rng(1)
    now = settled_update(random_people(rng, 8), policy=AwarenessPolicy.preset("balanced"))
    places, headings = rng.uniform(-5, 5, (300, 40, 2)), rng.uniform(-3, 3, (300, 40))
    speeds = rng.uniform(-1, 1, (300, 40))
    all_at_once = speed_limit_at(now, places, headings, dt_s=0.1, speeds_mps=speeds)
    for index in (0, 7, 299):
        one = slice(index, index + 1)
        alone = speed_limit_at(now, places[one], headings[one], dt_s=0.1, speeds_mps=speeds[one])
        assert alone[0] == pytest.approx(all_at_once[index], rel=1e-4, abs=1e-4)
    nobody = speed_limit_at(settled_update([]), places, dt_s=0.1)
    assert nobody.shape == (300, 40)
    assert (nobody == ROBOT.max_speed_mps).all()
    assert speed_limit_at(now, places[:0], dt_s=0.1).shape == (0, 40)


def test_time_cost_prefers_the_wider_way_and_is_finite() -> None:
    now = settled_update([person(position=(3.0, 0.0))], policy=AwarenessPolicy.preset("balanced"))
    x = np.linspace(0.0, 6.0, 31)
    ways = np.stack(
        [np.stack([x, np.zeros(31)], 1), np.stack([x, 3.0 * np.sin(np.pi * x / 6.0)], 1)]
    )
    through, around = time_cost(now, ways, dt_s=0.2)
    assert 4.0 < around < through < np.inf
    with_stop, _ = time_cost(now, ways, dt_s=0.2, slowest_mps=0.0)
    assert with_stop == np.inf
    free = time_cost(settled_update([]), ways[:1], dt_s=0.2)
    assert free == pytest.approx([6.0 / ROBOT.max_speed_mps])
    standing = time_cost(now, np.zeros((1, 5, 2)), dt_s=0.2, slowest_mps=0.0)
    assert standing.tolist() == [0.0]
