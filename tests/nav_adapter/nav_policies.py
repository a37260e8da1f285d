"""Random policies of every kind, and random robots."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st
from nav_scenes import finite

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.policies import (
    DistanceZones,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    NearCap,
    ObstacleOutline,
    SafetyMargins,
    SpeedRules,
    StandingPeople,
    TableHumanSpeed,
    TableInflation,
    TimeBehaviour,
    WalkingPeople,
)

SHAPES = ["linear", "smoothstep", "logistic", "two_level"]


@st.composite
def ramps(draw: st.DrawFn) -> dict[str, object]:
    low = draw(finite(0.0, 0.98))
    return {
        "unaware_below": low,
        "aware_above": draw(finite(low + 0.01, 1.0)),
        "shape": draw(st.sampled_from(SHAPES)),
        "steepness": draw(finite(1.0, 50.0)),
    }


def tables(low: float, high: float) -> st.SearchStrategy[tuple[tuple[float, float], ...]]:
    def ordered(alphas: list[float], values: list[float]) -> tuple[tuple[float, float], ...]:
        pairs = zip(sorted(alphas), sorted(values, reverse=True), strict=False)
        return tuple((float(alpha), float(value)) for alpha, value in pairs)

    alphas = st.lists(st.integers(0, 1000), min_size=1, max_size=6, unique=True)
    values = st.lists(finite(low, high), min_size=6, max_size=6)
    return st.builds(lambda a, v: ordered([each / 1000 for each in a], v), alphas, values)


@st.composite
def inflations(draw: st.DrawFn) -> InterpolatedInflation | TableInflation:
    if draw(st.booleans()):
        return TableInflation(table_m=draw(tables(0.05, 2.0)))
    aware = draw(finite(0.05, 1.5))
    return InterpolatedInflation(
        unaware_radius_m=aware + draw(finite(0.0, 0.5)), aware_radius_m=aware, **draw(ramps())
    )


@st.composite
def human_speeds(draw: st.DrawFn) -> InterpolatedHumanSpeed | TableHumanSpeed:
    if draw(st.booleans()):
        return TableHumanSpeed(table_mps=draw(tables(0.0, 2.5)))
    aware, ramp = draw(finite(0.0, 1.6)), draw(ramps())
    watching = {}
    above = ramp.get("aware_above", 0.6)
    if ramp.get("shape") != "two_level" and above < 0.99 and draw(st.booleans()):
        watching = {
            "watching_above": draw(finite(above + 0.005, 1.0)),
            "watching_human_speed_mps": draw(finite(0.0, 1.0)) * aware,
        }
    return InterpolatedHumanSpeed(
        unaware_human_speed_mps=aware + draw(finite(0.0, 1.0)),
        aware_human_speed_mps=aware,
        **watching,
        **ramp,
    )


@st.composite
def standing_rules(draw: st.DrawFn, lowest_mps2: float = 0.5) -> StandingPeople:
    acceleration = draw(finite(lowest_mps2, 1.0) | finite(lowest_mps2, 6.0))
    delay = draw(finite(0.0, 0.6))
    return StandingPeople(
        human_acceleration_mps2=acceleration,
        start_delay_s=delay,
        standing_below_mps=draw(finite(0.0, 1.0)) * acceleration * min(delay, 1.0 / acceleration),
        delay_from_tracks=draw(st.booleans()),
    )


@st.composite
def walking_rules(draw: st.DrawFn) -> WalkingPeople:
    return WalkingPeople(
        human_acceleration_mps2=draw(finite(0.5, 6.0)),
        turn_delay_s=draw(st.just(0.0) | finite(0.0, 0.6)),
        velocity_sigmas=draw(finite(0.0, 3.0)),
    )


@st.composite
def policies(draw: st.DrawFn) -> AwarenessPolicy:
    fresh, ahead = draw(finite(0.05, 0.3)), draw(finite(0.0, 1.0))
    stale = fresh + draw(finite(0.0, 1.0))
    zones = DistanceZones(stop_within_m=draw(finite(0, 1)), full_speed_beyond_m=draw(finite(2, 6)))
    cap = NearCap(within_m=draw(finite(0.1, 3.0)), speed_mps=draw(finite(0.1, 1.0)))
    return AwarenessPolicy(
        inflation=draw(inflations()),
        speed=draw(human_speeds()),
        outline=ObstacleOutline(
            unaware_ahead_s=ahead,
            aware_ahead_s=ahead * draw(finite(0.0, 1.0)),
            sweep_s=draw(st.sampled_from([0.0, 0.0, 1.0])),
            **draw(ramps()),
        ),
        rules=SpeedRules(
            turn_within_stop_deg=draw(finite(45.0, 180.0)),
            standing=draw(st.none() | standing_rules()),
            walking=draw(st.none() | walking_rules()),
            zones=draw(st.sampled_from([None, zones])),
            near_cap=draw(st.sampled_from([None, cap])),
        ),
        margins=SafetyMargins(
            minimum_clearance_m=draw(finite(0.1, 0.5)),
            separation_clearance_m=draw(finite(0.0, 0.5)),
            uncertainty_sigmas=draw(finite(0.0, 3.0)),
            unseen_sigmas=draw(finite(0.0, 4.0)),
            maximum_radius_m=draw(st.sampled_from([None, 2.1])),
        ),
        timing=TimeBehaviour(
            shrink_rate_mps=draw(finite(0.1, 2.0)),
            shrink_after_s=draw(finite(0.0, 0.5)),
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
    return RobotProfile(
        footprint_m=np.stack([long * np.cos(angles), wide * np.sin(angles)], axis=1)
        + draw(finite(-0.15, 0.15)),
        max_speed_mps=draw(finite(0.3, 2.5)),
        max_acceleration_mps2=draw(finite(0.3, 2.0)),
        max_deceleration_mps2=draw(finite(0.3, 3.0)),
        reaction_time_s=draw(finite(0.0, 0.8)),
    )
