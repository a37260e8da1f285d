"""The attention cone: the paper's equations, invariances and refusals."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from perception import AttentionCone, PerceptionError

coordinate = st.floats(-10.0, 10.0, allow_nan=False)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)
direction = (
    st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda v: np.linalg.norm(v) > 1e-2)
)
half_angle = st.floats(0.1, 1.5)


@given(point, direction, point, half_angle)
def test_score_is_the_papers_equations(apex, gaze, target, angle):
    unit = gaze / np.linalg.norm(gaze)
    d = (target - apex) @ unit  # eq. (1)
    d_perpendicular = np.linalg.norm((target - apex) - d * unit)  # eq. (2)
    radius = d * math.tan(angle)
    assume(abs(d_perpendicular - radius) > 1e-9)
    inside = d > 0 and d_perpendicular <= radius
    expected = 1 - d_perpendicular / radius if inside else 0.0  # eq. (3)
    assert AttentionCone(angle).score(apex, gaze, target) == pytest.approx(expected, abs=1e-9)


@given(point, direction, point, half_angle)
def test_one_gaze_in_plain_floats_has_the_same_score(apex, gaze, target, angle):
    cone = AttentionCone(angle)
    in_floats = cone.score_of(apex.tolist(), gaze.tolist(), target.tolist())
    assert in_floats == pytest.approx(float(cone.scores(apex, gaze, target)), abs=1e-12)


def test_one_gaze_in_plain_floats_needs_a_direction():
    with pytest.raises(PerceptionError, match="length 0"):
        AttentionCone().score_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


@given(point, direction, point, half_angle, st.floats(0.1, 10.0), st.integers(0, 2**31))
def test_score_is_invariant_to_motion_scale_and_gaze_length(
    apex, gaze, target, angle, factor, seed
):
    cone = AttentionCone(angle)
    alpha = cone.score(apex, gaze, target)
    assert 0.0 <= alpha <= 1.0
    # For a target at the apex, its direction is determined by rounding.
    assume(np.linalg.norm(target - apex) > 1e-2)
    turn = Rotation.random(random_state=seed).as_matrix()
    moved = cone.score(turn @ apex + 3.0, turn @ gaze, turn @ target + 3.0)
    assert moved == pytest.approx(alpha, abs=1e-6)
    # α depends on angles only.
    assert cone.score(factor * apex, factor * gaze, factor * target) == pytest.approx(
        alpha, abs=1e-6
    )


@given(half_angle, st.floats(0.0, 1.5), st.floats(0.0, 1.5))
def test_score_falls_with_the_angle_off_axis_and_ends_at_the_edge(angle, first, second):
    cone = AttentionCone(angle)

    def at(off_axis):
        return cone.score(np.zeros(3), [1, 0, 0], [math.cos(off_axis), math.sin(off_axis), 0])

    near, far = sorted((first, second))
    assert at(near) >= at(far) - 1e-12
    assert at(0.0) == 1.0
    assert at(min(angle * 1.001, math.pi)) == pytest.approx(0.0, abs=1e-9)
    assert at(angle * 0.999) > 0.0


@pytest.mark.parametrize(
    ("off_axis_deg", "alpha"), [(0.0, 1.0), (48.82, 0.34), (11.74, 0.88), (60.0, 0.0), (180.0, 0.0)]
)
def test_default_cone_at_the_papers_values(off_axis_deg, alpha):
    angle = math.radians(off_axis_deg)
    target = [math.cos(angle), math.sin(angle), 0.0]
    score = AttentionCone().score([0, 0, 0], [1, 0, 0], target)
    assert score == pytest.approx(alpha, abs=0.001)


def test_scores_of_many_people_at_once_equal_those_one_by_one():
    rng = np.random.default_rng(0)
    apexes, gazes, targets = rng.normal(size=(3, 50, 3))
    cone = AttentionCone()
    each = [cone.score(a, g, t) for a, g, t in zip(apexes, gazes, targets, strict=True)]
    np.testing.assert_allclose(cone.score(apexes, gazes, targets), each)
    one_target = cone.score(apexes, gazes, targets[0])
    assert one_target.shape == (50,)
    assert one_target[7] == cone.score(apexes[7], gazes[7], targets[0])


def test_the_highest_score_of_several_points_of_the_robot_counts():
    cone = AttentionCone()
    parts = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert cone.score([0, 0, 0], [0, 1, 0], parts) == 1.0
    assert cone.score([0, 0, 0], [0, 0, 1], parts) == 0.0
