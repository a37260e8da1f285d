"""Random policies of every kind, a custom one, random robots, and histories of people."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from nav_scenes import SCANNER, crowds, finite, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile
from nav_adapter.policies import (
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    ReachRules,
    SafetyMargins,
    TimeBehaviour,
)
from tracking import PersonTrack


class Own:
    """A custom policy with given values."""

    def __init__(
        self, radius: Callable[[float], float] = lambda _: 0.7, speed: float | None = 1.0
    ) -> None:
        self._radius, self._speed = radius, speed

    def radius_m(self, awareness_lower: float) -> float:
        return self._radius(awareness_lower)

    def human_speed_mps(self, awareness_lower: float) -> float | None:
        return self._speed


@st.composite
def ramps(draw: st.DrawFn) -> dict[str, float]:
    low = draw(finite(0.0, 0.98))
    return {"unaware_below": low, "aware_above": draw(finite(low + 0.01, 1.0))}


@st.composite
def inflations(draw: st.DrawFn) -> InterpolatedInflation:
    aware = draw(finite(0.05, 1.5))
    return InterpolatedInflation(
        unaware_radius_m=aware + draw(finite(0.0, 0.5)), aware_radius_m=aware, **draw(ramps())
    )


@st.composite
def human_speeds(draw: st.DrawFn) -> InterpolatedHumanSpeed:
    aware = draw(st.just(0.0) | finite(0.0, 1.6))
    return InterpolatedHumanSpeed(
        unaware_human_speed_mps=aware + draw(finite(0.0, 1.0)),
        aware_human_speed_mps=aware,
        **draw(ramps()),
    )


@st.composite
def reach_rules(draw: st.DrawFn) -> ReachRules:
    return ReachRules(
        time_constant_s=draw(finite(0.1, 1.5)),
        delay_s=draw(st.just(0.0) | finite(0.0, 0.6)),
        turn_deg=draw(st.just(0.0) | finite(0.0, 60.0) | finite(0.0, 180.0)),
    )


WITHOUT = st.sampled_from([(), (), (), SCANNER, *((each,) for each in (*SCANNER, "unseen"))])


@st.composite
def policies(draw: st.DrawFn) -> AwarenessPolicy:
    fresh = draw(finite(0.05, 0.3))
    stale = fresh + draw(finite(0.0, 1.0))
    return AwarenessPolicy(
        inflation=draw(inflations()),
        speed=draw(human_speeds()),
        reach=draw(reach_rules()),
        without=draw(WITHOUT),
        noticed_counts_as=draw(st.none() | finite(0.0, 1.0)),
        margins=SafetyMargins(
            clearance_m=draw(finite(0.1, 0.5)),
            uncertainty_sigmas=draw(finite(0.0, 3.0)),
            unseen_sigmas=draw(finite(0.0, 4.0)),
        ),
        timing=TimeBehaviour(
            shrink_rate_mps=draw(finite(0.1, 2.0)),
            lost_rise_mps2=draw(st.none() | finite(0.1, 2.0)),
            fresh_within_s=fresh,
            stale_after_s=stale,
            stop_after_s=stale + draw(finite(0.0, 1.0)),
        ),
    )


@st.composite
def robots(draw: st.DrawFn) -> RobotProfile:
    count = draw(st.integers(3, 6))
    angles = np.arange(count) * (2.0 * math.pi / count)
    long, wide = draw(finite(0.2, 0.8)), draw(finite(0.2, 0.8))
    corners = np.stack([long * np.cos(angles), wide * np.sin(angles)], axis=1)
    corners += draw(finite(-0.45, 0.45)) * min(long, wide)  # about the origin
    if draw(st.booleans()):
        ahead_m = draw(finite(-0.15, 0.15))
        corners = np.array([[long, wide], [-long, wide], [-long, -wide], [long, -wide]])
        corners[:, 0] += ahead_m
    return RobotProfile(
        footprint_m=corners,
        max_speed_mps=draw(finite(0.3, 2.5)),
        max_acceleration_mps2=draw(finite(0.3, 2.0)),
        max_deceleration_mps2=draw(finite(0.3, 3.0)),
        reaction_time_s=draw(finite(0.0, 0.8)),
        brakes_on_curve=draw(st.booleans()),
    )


#: Time step, speed and yaw rate of the robot, and its people relative to the stamp.
Walk = list[tuple[float, float, float, tuple[PersonTrack, ...]]]
STEPS_S = st.sampled_from([0.05, 0.1, 0.25, 0.7])


@st.composite
def histories(draw: st.DrawFn, most_steps: int, *, complete: bool = False) -> Walk:
    """The same people in every update, who look, notice and coast.

    Some disappear and come back, unless it is ``complete``.
    """
    people = draw(crowds(max_size=2))
    walk = []
    for dt in draw(st.lists(STEPS_S, min_size=2, max_size=most_steps)):
        present = tuple(
            replace(
                track,
                stamp_s=-draw(st.sampled_from([0.0, 0.0, 0.03])),
                status=draw(st.sampled_from(["confirmed", "confirmed", "coasting"])),
                time_since_seen_s=draw(st.sampled_from([0.0, 0.0, 0.0, 0.4])),
                awareness_lower=draw(st.sampled_from([0.0, 0.15, 0.55, 0.9]) | finite(0.0, 1.0)),
                noticed=draw(st.sampled_from([0.0, 0.9])),
            )
            for track in people
            if complete or draw(st.integers(0, 9))
        )
        yaw_radps = draw(st.just(0.0) | finite(-1.0, 1.0))
        walk.append((dt, draw(finite(-1.5, 1.5)), yaw_radps, present))
    return walk


def driven(
    policy: AwarenessPolicy, robot: RobotProfile, walk: Walk, *, perceived: bool = True
) -> list[NavConstraints]:
    """Return the constraints of every update; perception is up to date if ``perceived``."""
    adapter, now, results = NavAdapter(policy, robot), 0.0, []
    for dt, speed_mps, yaw_radps, people in walk:
        now += dt
        tracks = tuple(replace(track, stamp_s=track.stamp_s + now) for track in people)
        state = replace(
            robot_at(now, heading_rad=0.3, speed_mps=speed_mps), yaw_rate_radps=yaw_radps
        )
        stamp_s = now if perceived else None
        results.append(adapter.update(tracks, state, now, perception_stamp_s=stamp_s))
    return results
