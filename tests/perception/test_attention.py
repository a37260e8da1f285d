"""The attention cone: the paper's equations, invariances and refusals."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from perception import AttentionCone

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


@given(point, direction, point, half_angle, st.none() | direction)
def test_one_gaze_in_plain_floats_has_the_same_score(apex, gaze, target, angle, up):
    assume(np.linalg.norm(target - apex) > 1e-2)
    assume(up is None or np.linalg.norm(np.cross(gaze, up)) > 1e-3)
    cone = AttentionCone(angle)
    crown = None if up is None else up.tolist()
    in_floats = cone.score_of(apex.tolist(), gaze.tolist(), target.tolist(), crown)
    assert in_floats == pytest.approx(float(cone.scores(apex, gaze, target, up)), abs=1e-9)


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
    # Of several points of the robot the highest score counts.
    parts = cone.score(apexes[7], gazes[7], targets)
    assert parts == max(cone.score(apexes[7], gazes[7], each) for each in targets)


def lowered(down_rad: float, yaw_rad: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return gaze and up of a head that is turned by yaw and then lowered."""
    turn = Rotation.from_euler("ZY", [yaw_rad, down_rad])
    return turn.apply([1.0, 0.0, 0.0]), turn.apply([0.0, 0.0, 1.0])


@given(
    point,
    direction,
    direction,
    point,
    half_angle,
    st.floats(0.1, 10.0),
    st.booleans(),
    st.integers(0, 2**31),
)
def test_a_lowered_head_only_lowers_the_score_however_the_world_lies(
    apex, gaze, up, target, angle, factor, mirrored, seed
):
    assume(np.linalg.norm(target - apex) > 1e-2)
    assume(np.linalg.norm(np.cross(gaze, up)) > 1e-2)
    cone = AttentionCone(angle)
    alpha = cone.score(apex, gaze, target, up)
    assert 0.0 <= alpha <= cone.score(apex, gaze, target)
    assert AttentionCone.printed(angle).score(apex, gaze, target, up) == cone.score(
        apex, gaze, target
    )
    turn = factor * Rotation.random(random_state=seed).as_matrix()
    if mirrored:
        turn = turn @ np.diag([1.0, -1.0, 1.0])
    moved = cone.score(turn @ apex + 3.0, turn @ gaze, turn @ target + 3.0, turn @ up)
    assert moved == pytest.approx(alpha, abs=1e-6)


@given(st.floats(0.0, 1.5), st.floats(0.0, 1.5), st.floats(-1.5, 1.5), st.floats(-0.6, 0.0))
def test_the_score_falls_steadily_as_a_head_is_lowered_below_the_line_to_the_robot(
    first, second, yaw, line
):
    """``line`` is the elevation of the robot from the eyes; the head starts level with it."""
    target = [math.cos(line), 0.0, math.sin(line)]
    level_rad = math.atan2(-target[2], target[0] * math.cos(yaw))

    def at(below_rad: float) -> float:
        gaze, up = lowered(level_rad + below_rad, yaw)
        return AttentionCone().score(np.zeros(3), gaze, target, up)

    less, more = sorted((first, second))
    assert at(more) <= at(less) + 1e-9
    # No step: α changes by no more than the two slopes allow.
    assert at(less) - at(more) <= 8.0 * (more - less) + 1e-9


@pytest.mark.parametrize("yaw_deg", [0.0, 25.0, -40.0])
def test_somebody_who_reads_a_phone_does_not_see_a_robot_3_m_away_but_a_level_head_does(yaw_deg):
    robot_m = [3.0, 0.0, -0.7]  # from the eyes
    cone, yaw = AttentionCone(), math.radians(yaw_deg)

    def at(down_deg: float, **by: AttentionCone) -> float:
        gaze, up = lowered(math.radians(down_deg), yaw)
        return by.get("cone", cone).score(np.zeros(3), gaze, robot_m, up)

    assert at(38.5) < 0.05
    level = at(0.0)
    assert level == at(0.0, cone=AttentionCone.printed())
    assert at(-15.0) < level  # a raised head looks elsewhere too
