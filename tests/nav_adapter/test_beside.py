"""Beside people who stand, the limit is a continuous function of the clearance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy
from nav_adapter.reach import Reach
from perception.anthropometry import BODY_RADIUS_M

KEEPS = replace(ROBOT, brakes_on_curve=True)
FULL_MPS = ROBOT.max_speed_mps
#: What the finest steps of time leave open.
FINEST_MPS = 0.02
ALONG_M = np.linspace(-0.6, 2.4, 9).tolist()


def limit_mps(
    name: str,
    gap_m: float,
    along_m: float = 0.5,
    *,
    alpha: float = 1.0,
    sigma_m: float = 0.05,
    speed_mps: float = 0.8,
    keeps: bool = True,
) -> float:
    """Return the limit of a robot that drives straight on, with ``gap_m`` between side and body."""
    beside_m = ROBOT.half_width_m + BODY_RADIUS_M + gap_m
    stands = person(position=(along_m, beside_m), sigma_m=sigma_m, awareness_lower=alpha)
    return settled_update(
        [stands],
        policy=AwarenessPolicy.preset(name),
        robot=KEEPS if keeps else ROBOT,
        state=robot_at(speed_mps=speed_mps),
    ).speed_limit_mps


def lowest_mps(name: str, gap_m: float, sigma_m: float = 0.05, alpha: float = 1.0) -> float:
    """Return the lowest limit on the way past somebody, who has noticed the robot with α = 1."""
    return min(limit_mps(name, gap_m, along_m, sigma_m=sigma_m, alpha=alpha) for along_m in ALONG_M)


@pytest.mark.parametrize("sigma_m", [0.0, 0.05])
@pytest.mark.parametrize("name", ["balanced", "assertive"])
def test_the_robot_passes_whoever_has_noticed_it_with_the_clearance(name, sigma_m) -> None:
    clearance_m = AwarenessPolicy.preset(name).margins.clearance_m + 2.0 * sigma_m
    assert lowest_mps(name, clearance_m - 0.01, sigma_m) == 0.0
    assert lowest_mps(name, clearance_m + 0.002, sigma_m) >= 0.3
    assert lowest_mps(name, 0.2 + 2.0 * sigma_m, sigma_m) < FULL_MPS
    assert lowest_mps(name, 0.6, sigma_m) == FULL_MPS


def test_the_limit_beside_somebody_aware_at_a_forearms_distance() -> None:
    assert lowest_mps("balanced", 0.3) == pytest.approx(0.8, abs=0.05)
    assert lowest_mps("conservative", 0.3) < 0.1


PRESETS = st.sampled_from(["balanced", "assertive", "conservative", "blind"])
ALPHAS = finite(0.0, 1.0)


@settings(max_examples=20)
@given(name=PRESETS, alpha=ALPHAS, sigma_m=st.sampled_from([0.0, 0.05]), more_m=finite(0.001, 0.7))
def test_a_centimetre_more_room_is_worth_a_tenth_of_a_metre_per_second_at_most(
    name, alpha, sigma_m, more_m
):
    """r grows with a speed of U (1 − e^{−(t + δ)/τ}) or more, and the time of a stop with v / a.

    It holds for the whole way past. At one place, the limit is free at once where the robot is past
    the person in time at any speed.
    """
    policy = AwarenessPolicy.preset(name)
    gap_m = policy.margins.clearance_m + 2.0 * sigma_m + more_m
    near, far = (lowest_mps(name, each, sigma_m, alpha) for each in (gap_m, gap_m + 0.01))
    rules, T = policy.reach, ROBOT.reaction_time_s
    grows_mps = policy.speed.human_speed_mps(alpha) * -math.expm1(
        -(T + rules.delay_s) / rules.time_constant_s
    )
    most_mps = 0.01 * ROBOT.max_deceleration_mps2 / grows_mps
    assert -FINEST_MPS <= far - near <= min(most_mps + FINEST_MPS, 0.1)


@settings(max_examples=25)
@given(
    name=PRESETS,
    alpha=ALPHAS,
    along_m=finite(-0.8, 2.5),
    gap_m=finite(0.0, 1.0),
    more_m=finite(0.0, 0.5),
    speed_mps=finite(0.0, 1.5),
)
def test_more_room_is_never_slower(name, alpha, along_m, gap_m, more_m, speed_mps) -> None:
    near, far = (
        limit_mps(name, each, along_m, alpha=alpha, speed_mps=speed_mps)
        for each in (gap_m, gap_m + more_m)
    )
    assert near <= far + FINEST_MPS


@settings(max_examples=25)
@given(
    name=PRESETS,
    alphas=st.tuples(ALPHAS, ALPHAS).map(sorted),
    along_m=finite(-0.8, 2.5),
    gap_m=finite(0.0, 1.0),
)
def test_less_awareness_and_a_robot_that_may_turn_are_slower(name, alphas, along_m, gap_m) -> None:
    less, more = (limit_mps(name, gap_m, along_m, alpha=alpha) for alpha in alphas)
    assert less <= more + 1e-9
    assert limit_mps(name, gap_m, along_m, alpha=alphas[1], keeps=False) <= more + 1e-9


@given(
    top=finite(0.0, 1.5),
    less=finite(0.0, 1.5),
    clearance_m=finite(0.1, 0.5),
    ahead_s=finite(0.0, 3.0),
    sooner_s=finite(0.0, 1.0),
)
def test_reach_and_clearance_grow_with_time_and_u_and_cover_both(
    top, less, clearance_m, ahead_s, sooner_s
):
    """Together they are max(C, r + λ C), which is r + C for somebody unaware."""
    margins = AwarenessPolicy().margins.model_copy(update={"clearance_m": clearance_m})

    def both_m(speed_mps: float, time_s: float) -> float:
        within_m = margins.within_m(speed_mps, 1.5)
        reach = Reach(*(0.0,) * 4, speed_mps, 0.54, 0.15, 0.0, margins.floor_m, within_m)
        grown_m = reach.radius_m(time_s) + reach.margin_after_m(time_s) - BODY_RADIUS_M
        share_m = speed_mps / 1.5 * clearance_m
        assert grown_m == pytest.approx(max(clearance_m, reach.radius_m(time_s) + share_m))
        assert grown_m >= reach.radius_m(time_s) - 1e-12
        return grown_m

    found = both_m(top, ahead_s)
    assert both_m(min(top, less), ahead_s) <= found + 1e-12
    assert both_m(top, max(ahead_s - sooner_s, 0.0)) <= found + 1e-12
    unaware_m = 1.5 * (ahead_s + 0.15 + 0.54 * math.expm1(-(ahead_s + 0.15) / 0.54))
    assert both_m(1.5, ahead_s) == pytest.approx(unaware_m + clearance_m)
