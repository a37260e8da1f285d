"""The gait: steps that follow the speed, legs solved exactly, soles that never slide or sink."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests import SimError
from sim_tests.actors.body import Gait, load_worker, skeleton, worker_names
from sim_tests.actors.body._asset import JOINTS
from sim_tests.actors.body._pose import about, product, turned
from sim_tests.actors.body._skeleton import Skeleton, SoleRoll, TwoBones, nearest_look

NAMES = worker_names()
SPEEDS_MPS = (0.5, 0.8, 1.2, 1.6, 2.0)


def _walk(gait: Gait, speed_mps: float, samples: int, cycles: float = 1.0) -> np.ndarray:
    """(samples, 2, 5) ankles in odom of a straight walk along x, and (samples,) hips."""
    stride = float(gait.stride_m(speed_mps))
    feet, hips = [], []
    for k in range(samples):
        walked = cycles * stride * k / samples
        footing = gait.footing(walked, speed_mps)
        feet.append(np.array(footing.feet) + np.array([walked, 0.0, 0.0, 0.0, 0.0]))
        hips.append(footing.hip_height_m)
    return np.array(feet), np.array(hips)


def _shoe(bones: Skeleton, side: str, foot: np.ndarray) -> np.ndarray:
    """(N, V, 3) surface of the shoe for ankles (N, 5)."""
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


def slip_m(shoe: np.ndarray, touching_m: float = 0.004) -> float:
    """How far any point of a sole (N, V, 3) moves over the floor between landing and leaving."""
    worst, touched = 0.0, np.zeros(shoe.shape[1], dtype=bool)
    start = shoe[0, :, :2].copy()
    for frame in shoe:
        touches = frame[:, 2] < touching_m
        new = touches & ~touched
        start[new] = frame[new, :2]
        if touches.any():
            moved = np.linalg.norm(frame[touches, :2] - start[touches], axis=1)
            worst = max(worst, float(moved.max()))
        touched = touches
    return worst


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("speed_mps", SPEEDS_MPS)
def test_soles_neither_slide_nor_sink_nor_float(name: str, speed_mps: float) -> None:
    bones = Skeleton.of(load_worker(name))
    feet, _ = _walk(Gait(bones), speed_mps, 100, cycles=1.5)
    lowest = []
    for side, foot in (("left", feet[:, 0]), ("right", feet[:, 1])):
        shoe = _shoe(bones, side, foot)
        assert slip_m(shoe) < 0.03
        lowest.append(shoe[..., 2].min(axis=1))
        assert lowest[-1].min() > -0.005  # no sole below the floor
    assert np.minimum(*lowest).max() < 0.005  # and always one on it


@given(st.sampled_from(NAMES), st.floats(0.02, 2.0), st.floats(0.0, 1.0))
@settings(max_examples=80, deadline=None)
def test_legs_reach_their_feet_exactly(name: str, speed_mps: float, phase: float) -> None:
    """Hips at the height that the gait gives leave every ankle within reach, knees unlocked."""
    bones = Skeleton.of(load_worker(name))
    gait = Gait(bones)
    footing = gait.footing(phase * float(gait.stride_m(speed_mps)), speed_mps)
    assert 0.8 * gait.standing_height_m < footing.hip_height_m <= gait.standing_height_m + 1e-9
    for side, foot in enumerate(footing.feet):
        drop = footing.hip_height_m - foot[2]
        assert math.hypot(foot[0], drop) < bones.legs[side].reach_m + 0.02


def test_strides_and_cadence_grow_with_speed() -> None:
    gait = Gait(skeleton(None, 1.75))
    speeds = np.linspace(0.1, 2.2, 50)
    strides = gait.stride_m(speeds)
    assert np.all(np.diff(strides) > 0.0)
    assert np.all(np.diff(speeds / strides) > 0.0)
    assert np.all(np.diff(gait.stance_share(speeds)) < 0.0)
    # A comfortable walk: 1.2 m/s in steps of 0.66 m, not quite two a second, 60 to 63 % stance.
    assert float(gait.stride_m(1.2)) == pytest.approx(0.75 * 1.75)
    assert 0.60 <= float(gait.stance_share(1.2)) <= 0.63
    # Step length grows with the 0.42nd power of speed.
    assert float(gait.stride_m(2.0) / gait.stride_m(1.0)) == pytest.approx(2.0**0.42)
    # Larger people take longer strides.
    tall = Gait(skeleton(None, 1.95))
    assert float(tall.stride_m(1.2) / gait.stride_m(1.2)) == pytest.approx(1.95 / 1.75)


def test_a_fixed_stride_is_kept_and_an_impossible_one_refused() -> None:
    bones = skeleton(None, 1.75)
    assert np.all(Gait(bones, 0.9).stride_m(np.array([0.3, 1.0, 1.9])) == 0.9)
    for stride_m in (0.2, 2.0, math.nan):
        with pytest.raises(SimError, match="stride_m"):
            Gait(bones, stride_m)


@pytest.mark.parametrize("speed_mps", [0.05, *SPEEDS_MPS])
def test_a_cycle_is_periodic_and_smooth_and_its_halves_mirror(speed_mps: float) -> None:
    gait = Gait(skeleton(None, 1.75))
    stride = float(gait.stride_m(speed_mps))
    samples = 240
    feet, hips = _walk(gait, speed_mps, samples)
    # The right foot does half a cycle later what the left does now.
    later = np.roll(feet[:, 1], -samples // 2, axis=0)
    later[samples // 2 :, 0] += stride
    np.testing.assert_allclose(later[:, 0] - 0.5 * stride, feet[:, 0, 0], atol=2e-3)
    np.testing.assert_allclose(later[:, [2, 4]], feet[:, 0][:, [2, 4]], atol=2e-3)
    np.testing.assert_allclose(later[:, [1, 3]], -feet[:, 0][:, [1, 3]], atol=2e-3)
    np.testing.assert_allclose(np.roll(hips, samples // 2), hips, atol=2e-3)
    # An ankle covers its way in its swing, never much faster; hips rise by centimetres.
    swing = 1.0 - float(gait.stance_share(speed_mps))
    step = np.diff(feet[:, 0, :3], axis=0, append=feet[:1, 0, :3] + [stride, 0.0, 0.0])
    assert np.linalg.norm(step, axis=1).max() < 1.8 * stride / samples / swing
    assert np.ptp(hips) < 0.07


def test_standing_is_the_limit_of_ever_slower_walking() -> None:
    gait = Gait(skeleton(None, 1.75))
    standing = np.array(gait.footing(0.7, 0.0).feet)
    for phase in np.linspace(0.0, 1.0, 23):
        creeping = np.array(gait.footing(phase * float(gait.stride_m(1e-6)), 1e-6).feet)
        np.testing.assert_allclose(creeping[:, :3], standing[:, :3], atol=0.01)


vectors = st.tuples(*[st.floats(-0.08, 0.08)] * 2, st.floats(-0.5, -0.25))


@given(
    vectors,
    vectors,
    st.floats(-1.2, 1.2),
    st.floats(-0.6, 0.6),
    st.floats(0.4, 0.99),
    # A subnormal turn divides by zero in the determinant, not in the gait.
    st.floats(-0.7, 0.7, allow_subnormal=False),
)
@settings(max_examples=200, deadline=None)
def test_two_bones_bring_their_tip_where_it_is_wanted(
    first: tuple[float, float, float],
    second: tuple[float, float, float],
    forwards_rad: float,
    outwards_rad: float,
    stretched: float,
    twist_rad: float,
) -> None:
    """Joints off the line, targets anywhere: exact, by applying the solution again."""
    bones = TwoBones(first, second, (0.0, 1.0, 0.0))
    target = np.array([math.sin(forwards_rad), math.sin(outwards_rad), -1.0])
    target *= stretched * bones.reach_m / np.linalg.norm(target)
    lateral = (-math.sin(twist_rad), math.cos(twist_rad), 0.0)
    turn, bend = bones.solve(tuple(target.tolist()), lateral)
    lower = turned(product(turn, about(bones.axis, bend)), second)
    tip = np.add(turned(turn, first), lower)
    np.testing.assert_allclose(tip, target, atol=1e-6)
    # The hinge lies in the plane of the target and the wanted direction, on that side of it.
    hinge = np.array(turned(turn, bones.axis))
    assert np.cross(hinge, target) @ lateral == pytest.approx(0.0, abs=1e-6)
    across = np.cross(target, lateral)
    assert np.cross(target, hinge) @ across > 0.0


def test_out_of_reach_is_approached_in_its_direction() -> None:
    bones = TwoBones((0.0, 0.0, -0.4), (0.0, 0.0, -0.4), (0.0, 1.0, 0.0))
    turn, bend = bones.solve((0.6, 0.0, -0.8), (0.0, 1.0, 0.0))
    tip = np.add(
        turned(turn, bones.first_m), turned(product(turn, about(bones.axis, bend)), bones.second_m)
    )
    np.testing.assert_allclose(tip / np.linalg.norm(tip), (0.6, 0.0, -0.8), atol=1e-6)
    assert np.linalg.norm(tip) == pytest.approx(0.8, abs=1e-3)


def test_a_round_sole_rolls_like_a_wheel() -> None:
    """A wheel's hub moves by its radius a radian and stays at its height."""
    angle = np.linspace(0.0, math.tau, 20001)
    wheel = np.column_stack([0.1 * np.cos(angle), np.zeros_like(angle), 0.1 * np.sin(angle)])
    roll = SoleRoll.of(wheel)
    pitch = np.radians([-40.0, -10.0, 0.0, 25.0, 70.0])
    ahead, height = roll.ankle(pitch)
    np.testing.assert_allclose(height, 0.1, atol=1e-6)
    np.testing.assert_allclose(ahead, 0.1 * pitch, atol=1e-5)


def test_a_box_rolls_over_its_edges() -> None:
    """A sole with square ends turns about the toe's edge, or the heel's: they do not move."""
    corners = np.array([[x, 0.0, z] for x in (-0.06, 0.17) for z in (-0.09, 0.0)])
    roll = SoleRoll.of(corners)
    for pitch, edge in ((0.5, (0.17, -0.09)), (-0.4, (-0.06, -0.09))):
        ahead, height = (float(v[0]) for v in roll.ankle(np.array([pitch])))
        x = ahead + math.cos(pitch) * edge[0] + math.sin(pitch) * edge[1]
        z = height + math.cos(pitch) * edge[1] - math.sin(pitch) * edge[0]
        assert x == pytest.approx(edge[0], abs=1e-3)
        assert z == pytest.approx(0.0, abs=1e-4)


def test_arms_swing_against_the_legs_and_thorax_against_the_pelvis() -> None:
    gait = Gait(skeleton(None, 1.75))
    stride = float(gait.stride_m(1.3))
    steps = [gait.footing(stride * k / 60, 1.3) for k in range(60)]
    left_ahead = np.array([s.feet[0][0] - s.feet[1][0] for s in steps])
    arm, pelvis, thorax, sway = (
        np.array([getattr(s, name) for s in steps])
        for name in ("arm_swing_rad", "pelvis_yaw_rad", "thorax_yaw_rad", "sway_m")
    )
    assert np.corrcoef(left_ahead, arm)[0, 1] < -0.8
    assert np.corrcoef(left_ahead, pelvis)[0, 1] < -0.8  # the side of the leg ahead goes ahead
    assert np.corrcoef(pelvis, thorax)[0, 1] < -0.99
    # The weight is over the foot that stands: low where the other one is lifted.
    lifted = np.array([s.feet[1][2] - s.feet[0][2] for s in steps])
    assert np.corrcoef(lifted, sway)[0, 1] > 0.5


def test_statures_choose_the_nearest_look_and_scale_it() -> None:
    for name in NAMES:
        stature = load_worker(name).stature_m
        nearest = load_worker(nearest_look(stature))
        assert abs(nearest.stature_m - stature) < 0.01
    bones = skeleton("amina", 1.8)
    asset = load_worker("amina")
    np.testing.assert_allclose(bones.joints_m, asset.joints_m * 1.8 / asset.stature_m)
    with pytest.raises(SimError, match="nobody"):
        skeleton("nobody", 1.7)
    for stature_m in (1.3, 2.2, math.nan):
        with pytest.raises(SimError, match="stature_m"):
            skeleton(None, stature_m)
