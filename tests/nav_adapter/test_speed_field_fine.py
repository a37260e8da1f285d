"""The limits ahead in fine steps of time: those of ``update``, not merely a lower bound."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from nav_scenes import crowds, finite, person, robot_at, settled_update

from nav_adapter import NavConstraints, RobotState
from nav_adapter.exporters import speed_limit_at
from nav_adapter.motion import clip_twists_ahead
from tracking import PersonTrack

ROUNDING = 1e-6


def limit_mps(constraints: NavConstraints, state: RobotState, fine: bool) -> float:
    limits = speed_limit_at(
        constraints,
        state.position_odom_m[None, None],
        [[state.heading_odom_rad]],
        dt_s=0.05,
        speeds_mps=[[state.speed_mps]],
        fine=fine,
    )
    return float(limits[0, 0])


@pytest.mark.parametrize("alpha", [0.0, 1.0])
@pytest.mark.parametrize("speed_mps", [0.5, 0.0, -0.5])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.0, -1.2), (-1.0, 0.3)])
@pytest.mark.parametrize("place", [(2.0, 1.1), (1.2, -0.9), (3.0, 0.4), (-0.6, 0.9)])
def test_fine_steps_give_the_limit_of_the_adapter(
    place: tuple[float, float], velocity: tuple[float, float], speed_mps: float, alpha: float
) -> None:
    state = robot_at(speed_mps=speed_mps)
    track = person(position=place, velocity=velocity, awareness_lower=alpha)
    constraints = settled_update([track], state=state)
    fine_mps = limit_mps(constraints, state, fine=True)
    assert fine_mps == pytest.approx(constraints.speed_limit_mps, rel=0.01)
    assert fine_mps <= constraints.speed_limit_mps + ROUNDING


@settings(max_examples=60, deadline=None)
@given(crowds(), finite(0.0, 1.5), finite(-3.0, 3.0))
def test_fine_limits_lie_between_coarse_ones_and_those_of_the_adapter(
    tracks: tuple[PersonTrack, ...], speed_mps: float, heading_rad: float
) -> None:
    state = robot_at(heading_rad=heading_rad, speed_mps=speed_mps)
    constraints = settled_update(tracks, state=state)
    coarse_mps, fine_mps = (limit_mps(constraints, state, fine) for fine in (False, True))
    assert coarse_mps <= fine_mps + 1e-3
    assert fine_mps <= constraints.speed_limit_mps + ROUNDING


def test_a_robot_beside_somebody_who_stands_uses_its_limit() -> None:
    state = robot_at(speed_mps=0.5)
    constraints = settled_update([person(position=(0.2, 1.4))], state=state)
    assert 0.3 < constraints.speed_limit_mps < 1.0
    wanted = np.array([constraints.speed_limit_mps, 0.0])
    clipped = clip_twists_ahead(constraints, state, wanted, 0.05, slack_mps=0.0)
    assert clipped[0] > 0.97 * constraints.speed_limit_mps
