"""The speed field is a lower bound of what the adapter says when the robot gets there."""

from __future__ import annotations

from collections.abc import Sequence
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
from nav_adapter.exporters import limited_by_at, speed_limit_at, time_cost
from nav_adapter.policies import ProtectiveField, StartReserve
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
def scenes(draw: st.DrawFn) -> Scene:
    policy = draw(policies())
    rules = policy.rules.model_copy(
        update={
            "start_reserve": draw(
                st.none()
                | st.builds(
                    StartReserve,
                    human_acceleration_mps2=finite(0.5, 4.0),
                    start_delay_s=finite(0.0, 0.5),
                )
            ),
            "protective_field": draw(
                st.sampled_from([None, None, None, ProtectiveField(beside_m=0.2)])
            ),
        }
    )
    policy = policy.model_copy(update={"rules": rules})
    robot = replace(
        draw(robots()), drive=draw(st.sampled_from([None, "differential", "holonomic"]))
    )
    people = draw(crowds())
    after_s = draw(st.just(0.0) | finite(0.0, 2.0))
    top = robot.max_speed_mps
    speed = draw(st.sampled_from([0.0, 0.03]) | finite(-0.7 * top, 0.7 * top))
    # A differential robot that moves sideways is a fault, with a test of its own.
    lateral = draw(st.sampled_from([0.0, 0.0, 0.05]))
    if robot.drive != "differential":
        lateral = draw(st.just(lateral) | finite(-0.7 * top, 0.7 * top))
    state = RobotState(
        after_s - draw(st.just(0.0) | finite(0.0, 0.4)),
        np.array(draw(st.tuples(finite(-3, 3), finite(-3, 3)))),
        draw(finite(-4.0, 4.0)),
        speed,
        draw(finite(-1.5, 1.5)),
        np.array([speed, lateral]),
    )
    missing = draw(st.integers(0, min(1, len(people))))
    return Scene(policy, robot, people, missing, after_s, state, draw(st.booleans()))


def known_of(state: RobotState, known: int) -> dict[str, Any]:
    """Return what the field is told of the robot: nothing, or more and more."""
    velocity = state.velocity_base_mps
    both = [[[state.speed_mps, 0.0]]] if velocity is None else [[velocity.tolist()]]
    everything = {
        "headings_odom_rad": [[state.heading_odom_rad]],
        "speeds_mps": both,
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


@settings(max_examples=250)
@given(scene=scenes())
def test_the_field_is_never_above_the_limit_of_a_robot_that_gets_there(scene: Scene) -> None:
    # The adapter's own formula may overflow to an infinite limit for a person who hardly moves.
    with np.errstate(over="ignore"):
        now, then = drive(scene)
    limits = [field_at(scene, now, known) for known in range(4)]
    for limit_mps in limits:
        assert 0.0 <= limit_mps <= then.speed_limit_mps + 1e-9
    # Telling more never lowers the field.
    assert limits == sorted(limits)


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
def test_for_people_who_stand_the_field_is_the_limit(scene: Scene) -> None:
    with np.errstate(over="ignore"):
        now, then = drive(scene)
    # At first sight people count as unaware, and fewer do so later.
    timing = scene.policy.timing
    known_s = 4 * min(0.1, timing.fresh_within_s) if timing.stale_after_s > 0.1 else 0.0
    if known_s < timing.shrink_after_s + 1e-6 or scene.after_s == 0.0:
        return
    limit_mps = field_at(scene, now, 3)
    assert limit_mps == pytest.approx(then.speed_limit_mps, rel=0.01, abs=2e-3)
