"""The speed field is a lower bound of what the adapter says when the robot gets there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import policies, robots
from nav_scenes import ROBOT, crowds, finite, person, robot_at, settled_update

from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    NavError,
    RobotProfile,
    RobotState,
)
from nav_adapter.exporters import SpeedMap, limited_by_at, speed_limit_at, time_cost
from nav_adapter.ros2 import speed_mask
from tracking import PersonTrack

BEFORE_S = tuple(round(0.1 * step, 1) for step in range(20, -1, -1))
STEP_S = 0.04


@dataclass(frozen=True)
class Scene:
    """A policy, a robot, people as of 0 s and a robot state as of ``after_s``.

    The first ``missing`` people are last reported ``gone_s`` before 0 s, so that they are held or
    lost. ``coasts`` says whether people out of sight are never seen again.
    """

    policy: AwarenessPolicy
    robot: RobotProfile
    people: tuple[PersonTrack, ...]
    missing: int
    gone_s: float
    after_s: float
    state: RobotState
    coasts: bool


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
        tracks = scene.people if ago_s >= scene.gone_s else present
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
def scenes(draw: st.DrawFn) -> Scene:
    policy = draw(policies())
    drive = draw(st.sampled_from([None, "differential", "ackermann", "holonomic"]))
    radius_m = 1.5 if drive == "ackermann" else None
    robot = replace(draw(robots()), drive=drive, min_turning_radius_m=radius_m)
    people = draw(crowds())
    after_s = draw(st.just(0.0) | finite(0.0, 2.0))
    top = robot.max_speed_mps
    speed = draw(st.sampled_from([0.0, 0.03]) | finite(-0.7 * top, 0.7 * top))
    # A robot that cannot move sideways but does is a fault, with a test of its own.
    lateral = draw(st.sampled_from([0.0, 0.0, 0.05]))
    if robot.moves_sideways is not False:
        lateral = draw(st.just(lateral) | finite(-0.7 * top, 0.7 * top))
    state = RobotState(
        after_s - draw(st.just(0.0) | finite(0.0, 0.4)),
        np.array(draw(st.tuples(finite(-3, 3), finite(-3, 3)))),
        draw(finite(-4.0, 4.0)),
        speed,
        draw(st.just(0.0) | finite(-1.5, 1.5)),
        np.array([speed, lateral]),
    )
    missing = draw(st.integers(0, min(1, len(people))))
    gone_s = draw(st.sampled_from([0.1, 0.1, 0.5, 1.4]))
    return Scene(policy, robot, people, missing, gone_s, after_s, state, draw(st.booleans()))


def known_of(state: RobotState, known: int) -> dict[str, Any]:
    """Return what the field is told of the robot: nothing, or more and more."""
    assert state.velocity_base_mps is not None
    forward, left = state.velocity_base_mps.tolist()
    speeds = [[[forward, left]]] if left else [[forward]]
    everything = {
        "headings_odom_rad": [[state.heading_odom_rad]],
        "speeds_mps": speeds,
        "yaw_rates_radps": [[state.yaw_rate_radps]],
    }
    return dict(list(everything.items())[:known])


def field_at(scene: Scene, now: NavConstraints, known: int) -> float:
    limits = speed_limit_at(
        now,
        scene.state.position_odom_m[None, None],
        dt_s=1.0,
        first_s=scene.after_s,
        **known_of(scene.state, known),
    )
    assert limits.shape == (1, 1)
    return float(limits[0, 0])


def is_a_box(robot: RobotProfile) -> bool:
    """Return whether the circle holds the rectangle about the footprint, which ``update`` takes."""
    x, y = np.abs(robot.footprint_m).max(axis=0)
    return bool(np.hypot(x, y) <= robot.circumscribed_radius_m + 1e-9)


def is_in_the_path(constraints: NavConstraints) -> bool:
    """Return whether the rectangle of the protective field decides, whose corners are farther."""
    return constraints.limited_by.endswith("in the path")


def may_be_told_less(scene: Scene, known: int) -> bool:
    """Return whether what the field is not told is what it assumes: forwards, and straight on."""
    if known == 0:
        return is_a_box(scene.robot)
    state = scene.state
    # A robot that stands may start either way.
    forwards = state.speed_mps >= 0.05 and state.lateral_mps == 0.0
    straight = state.yaw_rate_radps == 0.0
    return known == 3 or (straight and (known == 2 or forwards))


def moves(state: RobotState) -> bool:
    return abs(state.speed_mps) >= 0.05 or abs(state.lateral_mps) > 0.1


@settings(max_examples=250)
@given(scene=scenes())
def test_the_field_is_never_above_the_limit_of_a_robot_that_gets_there(scene: Scene) -> None:
    now, then = drive(scene)
    limits = {
        known: field_at(scene, now, known) for known in range(4) if may_be_told_less(scene, known)
    }
    if is_in_the_path(then):
        limits.pop(0, None)
    for known, limit_mps in limits.items():
        assert 0.0 <= limit_mps <= then.speed_limit_mps + 1e-9, known
    # Without a heading it holds for every one. At a stand the field is coarser.
    if moves(scene.state) and 0 in limits:
        assert limits[0] <= min(limits.values()) + 1e-9


@st.composite
def standing_scenes(draw: st.DrawFn) -> Scene:
    """Scenes with people who stand and are seen in every frame."""
    scene = draw(scenes())
    people = tuple(
        replace(
            track,
            status="confirmed",
            velocity_odom_mps=np.zeros(2),
            time_since_seen_s=0.0,
            stamp_s=draw(st.sampled_from([0.0, 0.0, -0.04])),
            awareness_lower=draw(st.sampled_from([0.0, 0.5, 1.0])),
        )
        for track in scene.people
    )
    state = replace(scene.state, stamp_s=scene.after_s - draw(st.sampled_from([0.0, 0.0, 0.03])))
    return replace(scene, people=people, missing=0, state=state)


@settings(max_examples=150)
@given(scene=standing_scenes())
def test_for_people_who_stand_the_field_is_within_a_tenth_of_the_limit(scene: Scene) -> None:
    now, then = drive(scene)
    if not moves(scene.state):
        return
    # After silence people count as unaware at first, and fewer do so later.
    if scene.policy.timing.stale_after_s <= 0.1 or scene.policy.timing.fresh_within_s <= 0.1:
        return
    limit_mps = field_at(scene, now, 3)
    # For people behind the coarse steps of the field cost more, and near 0 up to 0.1 m/s.
    x_mps, y_mps = scene.state.velocity_odom_mps
    for track in scene.people:
        x_m, y_m = track.position_odom_m - scene.state.position_odom_m
        if then.limited_by.startswith(f"track {track.id}:") and x_m * x_mps + y_m * y_mps <= 0.0:
            return
    assert 0.9 * then.speed_limit_mps - 0.1 <= limit_mps <= then.speed_limit_mps + 1e-9


@settings(max_examples=60)
@given(scene=scenes(), shift=st.tuples(finite(-0.5, 0.5), finite(-0.5, 0.5)))
def test_a_cell_of_the_map_holds_for_a_robot_anywhere_in_it(
    scene: Scene, shift: tuple[float, float]
) -> None:
    if not is_a_box(scene.robot):
        return
    cell_m = 0.3
    now, then = drive(scene)
    if is_in_the_path(then):
        return
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


def test_the_reasons_are_those_of_the_adapter() -> None:
    policy = AwarenessPolicy.preset("balanced")
    people = [
        person(position=(6.0, 0.0), awareness_lower=1.0),
        person(track_id=2, position=(9.0, 0.0)),
    ]
    places = np.array([[0.0, 0.0], [4.5, 0.0], [4.5, 2.0], [7.5, 0.0], [-9.0, 0.0]])
    told = {
        "headings_odom_rad": np.zeros((5, 1)),
        "speeds_mps": np.full((5, 1), 0.5),
        "dt_s": 0.1,
    }
    for rules in (policy.reach, None):
        chosen = policy.model_copy(update={"reach": rules})
        now = settled_update(people, policy=chosen)
        limits = speed_limit_at(now, places[:, None], **told)
        reasons = limited_by_at(now, places[:, None], **told)
        for place, limit, reason in zip(places, limits[:, 0], reasons[:, 0], strict=True):
            there = settled_update(
                people, policy=chosen, state=robot_at(position=place.tolist(), speed_mps=0.5)
            )
            assert 0.9 * there.speed_limit_mps <= limit <= there.speed_limit_mps
            assert reason == there.limited_by
        rule = "in the path" if rules is None else "reach"
        assert {reason.partition(": ")[2] for reason in reasons[:, 0]} == {rule, ""}


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
    assert limited_by_at(now, here, dt_s=0.5).tolist() == [["track 1: lost"] * 2]
    dead = adapter.watchdog(now.stamp_s + 2.0)
    assert speed_limit_at(dead, here, dt_s=0.5).tolist() == [[0.0, 0.0]]
    assert limited_by_at(dead, here, dt_s=0.5).tolist() == [["stale data"] * 2]
    back = adapter.update([], robot_at(4.1), 4.1)
    assert back.limited_by == "recovery after stale data"
    rising = speed_limit_at(back, here, dt_s=0.5)
    assert rising[0] == pytest.approx([back.speed_limit_mps, back.speed_limit_mps + 0.5], abs=1e-3)


def test_a_differential_robot_that_moves_sideways_is_stopped() -> None:
    robot = replace(ROBOT, drive="differential")
    now = settled_update([], robot=robot)
    here, told = np.zeros((1, 1, 2)), {"dt_s": 0.1, "speeds_mps": [[[0.5, 0.3]]]}
    assert speed_limit_at(now, here, **told).tolist() == [[0.0]]
    assert limited_by_at(now, here, **told)[0, 0].startswith("robot: moves sideways")


def test_awareness_counts_for_as_long_as_asked() -> None:
    policy = AwarenessPolicy.preset("balanced")
    aware = settled_update([person(position=(2.5, 0.0), awareness_lower=1.0)], policy=policy)
    unaware = settled_update([person(position=(2.5, 0.0))], policy=policy)
    here = np.zeros((1, 4, 2))
    mixed = speed_limit_at(aware, here, dt_s=0.5, aware_for_s=0.6)[0]
    assert mixed[:2].tolist() == speed_limit_at(aware, here, dt_s=0.5)[0, :2].tolist()
    assert mixed[2:].tolist() == speed_limit_at(unaware, here, dt_s=0.5)[0, 2:].tolist()
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


def test_bad_input_is_refused() -> None:
    now, here = settled_update([person()]), np.zeros((2, 3, 2))
    by_hand = NavConstraints(0.0, (), 1.0, "robot maximum", False)
    for constraints, places, told, message in (
        (by_hand, here, {}, "must come from NavAdapter.update"),
        (now, here[0], {}, "positions_odom_m"),
        (now, here + np.nan, {}, "positions_odom_m"),
        (now, here, {"dt_s": 0.0}, "dt_s"),
        (now, here, {"first_s": -1.0}, "first_s"),
        (now, here, {"headings_odom_rad": np.zeros(3)}, "headings_odom_rad"),
        (now, here, {"speeds_mps": np.zeros((2, 3, 3))}, "speeds_mps"),
        (now, here, {"yaw_rates_radps": np.zeros((3, 2))}, "yaw_rates_radps"),
        (now, here, {"aware_for_s": -1.0}, "aware_for_s"),
    ):
        with pytest.raises(NavError, match=message):
            speed_limit_at(constraints, places, **{"dt_s": 0.1, **told})
    with pytest.raises(NavError, match="slowest_mps"):
        time_cost(now, here, dt_s=0.1, slowest_mps=-1.0)
    with pytest.raises(NavError, match="times_s"):
        SpeedMap.around(now, [0, 0], times_s=(-1.0,))
    with pytest.raises(NavError, match="1 to 4000000 cells"):
        SpeedMap.around(now, [0, 0], resolution_m=0.001)
    stop = NavConstraints(0.0, (), 0.0, "no data", True)
    assert speed_limit_at(stop, here, dt_s=0.1).max() == 0.0


def test_the_mask_is_what_nav2_reads() -> None:
    now = settled_update([person(position=(1.0, 0.0))])
    chart = SpeedMap.around(now, [0.0, 0.0], size_m=12.0, resolution_m=0.1)
    mask, info = speed_mask(chart, "/mask", frame_id="odom")
    assert (mask.info.width, mask.info.height, info.filter_mask_topic) == (120, 120, "/mask")
    values = np.frombuffer(mask.data, np.int8).reshape(120, 120)
    assert values.min() == 0
    assert values.max() <= 100
    percent = info.base + info.multiplier * values.astype(float)
    allowed_mps = np.where(values == 0, ROBOT.max_speed_mps, percent / 100.0 * 1.5)
    # A stop is the lowest value that Nav2 reads as a limit.
    assert (allowed_mps <= np.maximum(chart.limits_mps, 0.015) + 1e-9).all()
    assert (allowed_mps >= chart.limits_mps - 0.015 - 1e-9).all()
    row, column = 60, 70
    assert mask.info.origin.position.x + 0.1 * column == pytest.approx(1.0)
    assert values[row, column] == 1


@settings(max_examples=25)
@given(scene=scenes(), seed=st.integers(0, 2**32 - 1), known=st.integers(0, 3))
def test_many_poses_give_the_limits_of_few_to_the_last_bit(
    scene: Scene, seed: int, known: int
) -> None:
    # With many poses, each person is computed only where they may allow less than others do.
    now, _ = drive(scene)
    rng, shape = np.random.default_rng(seed), (50, 82)
    places = rng.normal(0.0, 4.0, (*shape, 2))
    # The same extent of all parts gives the same rounding.
    places[:, 0], places[:, 1] = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    top = scene.robot.max_speed_mps
    everything = {
        "headings_odom_rad": rng.uniform(-3.0, 3.0, shape),
        "speeds_mps": rng.uniform(-top, top, shape),
        "yaw_rates_radps": rng.uniform(-1.0, 1.0, shape),
    }
    told = dict(list(everything.items())[:known])
    times = {"dt_s": 0.05, "aware_for_s": 2.0}
    at_once = speed_limit_at(now, places, **told, **times)
    for start in range(0, 50, 25):
        part = slice(start, start + 25)
        some = {name: values[part] for name, values in told.items()}
        expected = speed_limit_at(now, places[part], **some, **times)
        if known == 0:
            assert (at_once[part] == expected).all()
        else:
            assert at_once[part] == pytest.approx(expected, rel=1e-6, abs=1e-6)
