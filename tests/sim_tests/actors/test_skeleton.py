"""The skeleton: two-bone inverse kinematics, rolling soles, and scaling to a stature."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests import SimError
from sim_tests.actors.body import load_worker, skeleton, worker_names
from sim_tests.actors.body._quaternions import axis_angle, multiply, rotate
from sim_tests.actors.body._skeleton import SoleRoll, TwoBoneLimb

vectors = st.tuples(*[st.floats(-0.08, 0.08)] * 2, st.floats(-0.5, -0.25))


@given(
    vectors,
    vectors,
    st.floats(-1.2, 1.2),
    st.floats(-0.6, 0.6),
    st.floats(0.4, 0.99),
    # A subnormal angle would divide by zero in the assertions, not in the solution.
    st.floats(-0.7, 0.7, allow_subnormal=False),
)
@settings(max_examples=60, deadline=None)
def test_two_bone_ik_brings_the_tip_to_its_target(
    first: tuple[float, float, float],
    second: tuple[float, float, float],
    forwards_rad: float,
    outwards_rad: float,
    stretched: float,
    twist_rad: float,
) -> None:
    """For bones off the line and targets anywhere; checked by forward kinematics."""
    bones = TwoBoneLimb(first, second, (0.0, 1.0, 0.0))
    target = np.array([math.sin(forwards_rad), math.sin(outwards_rad), -1.0])
    target *= stretched * bones.reach_m / np.linalg.norm(target)
    lateral = (-math.sin(twist_rad), math.cos(twist_rad), 0.0)
    turn, bend = bones.solve(tuple(target.tolist()), lateral)
    lower = rotate(multiply(turn, axis_angle(bones.axis, bend)), second)
    tip = np.add(rotate(turn, first), lower)
    np.testing.assert_allclose(tip, target, atol=1e-6)
    # The hinge lies in the plane of target and lateral direction, on the lateral side.
    hinge = np.array(rotate(turn, bones.axis))
    assert np.cross(hinge, target) @ lateral == pytest.approx(0.0, abs=1e-6)
    across = np.cross(target, lateral)
    assert np.cross(target, hinge) @ across > 0.0


def test_a_square_sole_rolls_over_its_edges() -> None:
    """A sole with square ends turns about its toe edge or its heel edge, which does not move."""
    corners = np.array([[x, 0.0, z] for x in (-0.06, 0.17) for z in (-0.09, 0.0)])
    roll = SoleRoll.from_surface(corners)
    for pitch, edge in ((0.5, (0.17, -0.09)), (-0.4, (-0.06, -0.09))):
        ahead, height = (float(v[0]) for v in roll.ankle(np.array([pitch])))
        x = ahead + math.cos(pitch) * edge[0] + math.sin(pitch) * edge[1]
        z = height + math.cos(pitch) * edge[1] - math.sin(pitch) * edge[0]
        assert x == pytest.approx(edge[0], abs=1e-3)
        assert z == pytest.approx(0.0, abs=1e-4)


def test_the_look_of_nearest_stature_is_chosen_and_scaled() -> None:
    for name in worker_names():
        stature = load_worker(name).stature_m
        nearest = skeleton(None, stature).asset
        assert abs(nearest.stature_m - stature) < 0.01
    bones = skeleton("amina", 1.8)
    asset = load_worker("amina")
    np.testing.assert_allclose(bones.joints_m, asset.joints_m * 1.8 / asset.stature_m)
    with pytest.raises(SimError, match="nobody"):
        skeleton("nobody", 1.7)
    for stature_m in (0.99, 2.2, math.nan):
        with pytest.raises(SimError, match="stature_m"):
            skeleton(None, stature_m)
