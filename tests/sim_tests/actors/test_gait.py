"""The gait: strides that follow the speed, feet within reach, soles that never slide or sink."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worker_looks import LOOKS, slip_m

from sim_tests.actors.body import JOINTS, Gait, OnlineFootsteps, load_worker, skeleton, worker_names
from sim_tests.actors.body._footsteps import steady_walk
from sim_tests.actors.body._skeleton import Skeleton

NAMES = worker_names()
SPEEDS_MPS = (0.5, 1.2, 2.0)


def _walk(gait: Gait, speed_mps: float, start_s: float = 2.0, duration_s: float = 3.0) -> list:
    """Return the poses, 60 per second, of a walk along x from standing, and the body's places."""
    feet, poses = OnlineFootsteps(gait, 0.0, 0.0, 0.0), []
    for k in range(round(60.0 * (start_s + duration_s))):
        x = speed_mps * k / 60.0
        pose = feet.step(1.0 / 60.0, (x, 0.0, 0.0), (speed_mps, 0.0, 0.0), (0.0, 0.0))
        if k >= 60.0 * start_s:
            poses.append((x, pose))
    return poses


def _gait(look: str | None, stature_m: float) -> tuple[Gait, Skeleton]:
    bones = skeleton(look, stature_m)
    return Gait(bones), bones


def _shoe(bones: Skeleton, side: str, foot: np.ndarray) -> np.ndarray:
    """Return (N, V, 3) the surface of the shoe for ankles (N, 5)."""
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
    gait, bones = _gait(name, load_worker(name).stature_m)
    feet = np.array([pose.feet for _, pose in _walk(gait, speed_mps)])
    lowest = []
    for side, foot in (("left", feet[:, 0]), ("right", feet[:, 1])):
        shoe = _shoe(bones, side, foot)
        assert slip_m(shoe) < 0.03
        lowest.append(shoe[..., 2].min(axis=1))
        assert lowest[-1].min() > -0.005  # no sole below the floor
    assert np.minimum(*lowest).max() < 0.005  # and always one sole on the floor


@given(st.sampled_from(NAMES), st.booleans(), st.floats(0.1, 2.0), st.floats(0.0, 4.0))
@settings(max_examples=30, deadline=None)
def test_legs_reach_their_feet_exactly(name, child, speed_mps, walked_m) -> None:
    """At the hip height of the gait both ankles are within reach with unlocked knees."""
    gait, bones = _gait(name, 1.0 if child else load_worker(name).stature_m)
    pose = steady_walk(gait, walked_m, speed_mps)
    highest = gait.standing.hip_height_m
    assert 0.75 * highest < pose.hip_height_m <= highest + 1e-9
    for side, foot in enumerate(pose.feet):
        drop = pose.hip_height_m - foot[2]
        assert math.hypot(foot[0], drop) < bones.legs[side].reach_m + 0.02


def test_a_steady_walk_is_periodic_and_one_too_slow_to_walk_stands() -> None:
    gait, _ = _gait(None, 1.75)
    assert steady_walk(gait, 3.0, 0.0) is gait.standing is steady_walk(gait, 0.3, 0.04)
    stride_m = gait.stride_m(1.2)
    ahead = []
    for share in np.linspace(0.0, 0.95, 20).tolist():
        pose = steady_walk(gait, share * stride_m, 1.2)
        again = steady_walk(gait, (share + 3.0) * stride_m, 1.2)
        np.testing.assert_allclose(again.feet, pose.feet, atol=1e-6)
        ahead.append([foot[0] for foot in pose.feet])
    # Each foot swings once per cycle, from behind the body to ahead of it.
    forwards = np.diff([*ahead, ahead[0]], axis=0) > 0.0
    assert (np.count_nonzero(forwards[1:] & ~forwards[:-1], axis=0) <= 1).all()
    assert np.min(ahead) < -0.2
    assert np.max(ahead) > 0.2


def test_strides_and_cadence_grow_with_speed() -> None:
    gait, _ = _gait(None, 1.75)
    speeds = np.linspace(0.1, 2.2, 50)
    strides = np.array([gait.stride_m(speed) for speed in speeds.tolist()])
    assert np.all(np.diff(strides) > 0.0)
    assert np.all(np.diff(speeds / strides) > 0.0)
    assert np.all(np.diff([gait.stance_share(speed) for speed in speeds.tolist()]) < 0.0)
    # A comfortable walk: 1.2 m/s in steps of 0.66 m, 1.8 steps per second, 60 to 63 % stance.
    assert gait.stride_m(1.2) == pytest.approx(0.75 * 1.75)
    assert 0.60 <= gait.stance_share(1.2) <= 0.63
    # Step length grows with the 0.42nd power of speed.
    assert gait.stride_m(2.0) / gait.stride_m(1.0) == pytest.approx(2.0**0.42)
    # Larger people take longer strides.
    tall, _ = _gait(None, 1.95)
    assert tall.stride_m(1.2) / gait.stride_m(1.2) == pytest.approx(1.95 / 1.75)
