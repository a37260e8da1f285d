"""The gait: strides that follow the speed, feet within reach, soles that never slide or sink."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worker_looks import LOOKS, slip_m

from sim_tests.actors.body import JOINTS, Gait, load_worker, skeleton, worker_names

NAMES = worker_names()
SPEEDS_MPS = (0.5, 1.2, 2.0)


def _walk(gait: Gait, speed_mps: float, samples: int, cycles: float = 1.0) -> np.ndarray:
    """Return (samples, 2, 5) ankles in odom and (samples,) hip heights of a walk along x."""
    stride = float(gait.stride_m(speed_mps))
    feet, hips = [], []
    for k in range(samples):
        walked = cycles * stride * k / samples
        gait_pose = gait.pose(walked, speed_mps)
        feet.append(np.array(gait_pose.feet) + np.array([walked, 0.0, 0.0, 0.0, 0.0]))
        hips.append(gait_pose.hip_height_m)
    return np.array(feet), np.array(hips)


def _shoe(gait: Gait, side: str, foot: np.ndarray) -> np.ndarray:
    """Return (N, V, 3) the surface of the shoe for ankles (N, 5)."""
    bones = gait.skeleton
    ankle = JOINTS.index(f"{side}_ankle")
    skin = bones.asset.levels[1]
    points = (skin.vertices_m[skin.weights[:, ankle] > 0.98] - bones.asset.joints_m[ankle]) * (
        bones.scale
    )
    x, y, z = points.T
    cos, sin = np.cos(foot[:, 4:5]), np.sin(foot[:, 4:5])
    ahead, up = cos * x + sin * z, cos * z - sin * x
    cos, sin = np.cos(foot[:, 3:4]), np.sin(foot[:, 3:4])
    return foot[:, None, :3] + np.stack([cos * ahead - sin * y, sin * ahead + cos * y, up], axis=-1)


@pytest.mark.parametrize("name", LOOKS)
@pytest.mark.parametrize("speed_mps", SPEEDS_MPS)
def test_soles_do_not_slide_sink_or_float(name: str, speed_mps: float) -> None:
    gait = Gait(skeleton(name, load_worker(name).stature_m))
    feet, _ = _walk(gait, speed_mps, 100, cycles=1.5)
    lowest = []
    for side, foot in (("left", feet[:, 0]), ("right", feet[:, 1])):
        shoe = _shoe(gait, side, foot)
        assert slip_m(shoe) < 0.03
        lowest.append(shoe[..., 2].min(axis=1))
        assert lowest[-1].min() > -0.005  # no sole below the floor
    assert np.minimum(*lowest).max() < 0.005  # and always one sole on the floor


@given(st.sampled_from(NAMES), st.booleans(), st.floats(0.02, 2.0), st.floats(0.0, 1.0))
@settings(max_examples=30, deadline=None)
def test_legs_reach_their_feet_exactly(
    name: str, child: bool, speed_mps: float, phase: float
) -> None:
    """At the hip height of the gait both ankles are within reach with unlocked knees."""
    bones = skeleton(name, 1.0 if child else load_worker(name).stature_m)
    gait = Gait(bones)
    gait_pose = gait.pose(phase * float(gait.stride_m(speed_mps)), speed_mps)
    assert 0.8 * gait.standing_height_m < gait_pose.hip_height_m <= gait.standing_height_m + 1e-9
    for side, foot in enumerate(gait_pose.feet):
        drop = gait_pose.hip_height_m - foot[2]
        assert math.hypot(foot[0], drop) < bones.legs[side].reach_m + 0.02


def test_strides_and_cadence_grow_with_speed() -> None:
    gait = Gait(skeleton(None, 1.75))
    speeds = np.linspace(0.1, 2.2, 50)
    strides = gait.stride_m(speeds)
    assert np.all(np.diff(strides) > 0.0)
    assert np.all(np.diff(speeds / strides) > 0.0)
    assert np.all(np.diff(gait.stance_share(speeds)) < 0.0)
    # A comfortable walk: 1.2 m/s in steps of 0.66 m, 1.8 steps per second, 60 to 63 % stance.
    assert float(gait.stride_m(1.2)) == pytest.approx(0.75 * 1.75)
    assert 0.60 <= float(gait.stance_share(1.2)) <= 0.63
    # Step length grows with the 0.42nd power of speed.
    assert float(gait.stride_m(2.0) / gait.stride_m(1.0)) == pytest.approx(2.0**0.42)
    # Larger people take longer strides.
    tall = Gait(skeleton(None, 1.95))
    assert float(tall.stride_m(1.2) / gait.stride_m(1.2)) == pytest.approx(1.95 / 1.75)
