import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests._script import GazeKey, WorkerScript


def script(path, **keys):
    return WorkerScript(path=[{"t_s": t, "x_m": x, "y_m": y} for t, x, y in path], **keys)


WALK = script([(0, 0, 0), (2, 2, 0), (5, 2, 3), (6, 2, 3)])


def test_the_walk_passes_its_waypoints_at_their_times():
    for t, x, y in [(0, 0, 0), (2, 2, 0), (5, 2, 3), (6, 2, 3)]:
        np.testing.assert_allclose(WALK.motion(t).position_odom_m, [x, y], atol=1e-6)


@given(st.floats(0.05, 5.9))
def test_velocity_is_the_derivative_of_position_and_walked_the_length(t_s):
    step = 0.02
    before, after = WALK.motion(t_s - step), WALK.motion(t_s + step)
    moved = after.position_odom_m - before.position_odom_m
    np.testing.assert_allclose(moved / (2 * step), WALK.motion(t_s).velocity_odom_mps, atol=0.08)
    assert after.walked_m - before.walked_m == pytest.approx(np.linalg.norm(moved), abs=2e-3)


@given(st.floats(-10.0, 20.0))
def test_before_and_after_the_walk_the_worker_stands(t_s):
    motion = WALK.motion(t_s)
    assert np.isfinite(motion.position_odom_m).all()
    if t_s < 0 or t_s > 6:
        assert not motion.velocity_odom_mps.any()


def test_the_body_faces_the_way_it_walks_unless_told():
    assert WALK.motion(0.5).heading_odom_rad == pytest.approx(0.0, abs=0.05)
    assert WALK.motion(4.0).heading_odom_rad == pytest.approx(math.pi / 2, abs=0.05)
    backwards = script([(0, 0, 0), (4, 4, 0)], heading=[{"t_s": 0.0, "heading_deg": 180.0}])
    assert backwards.motion(2.0).heading_odom_rad == pytest.approx(math.pi)


def test_gaze_at_the_robot_follows_the_robot():
    watching = script([(0, 0, 0)], gaze=[{"t_s": 0.0, "look": "robot", "yaw_deg": 10.0}])
    for azimuth in (-2.0, 0.4, 2.5):
        angle, elevation = watching.gaze_angles(1.0, 0.3, (azimuth, -0.1))
        assert angle == pytest.approx(azimuth + math.radians(10.0))
        assert elevation == pytest.approx(-0.1)


def test_the_head_turns_smoothly_between_keys_and_holds_outside():
    keys = [GazeKey(t_s=1.0, yaw_deg=0.0), GazeKey(t_s=2.0, yaw_deg=60.0)]
    turning = script([(0, 0, 0)], gaze=keys)
    angles = [turning.gaze_angles(t, 0.0, (0.0, 0.0))[0] for t in np.linspace(0.0, 3.0, 301)]
    assert angles[0] == 0.0
    assert angles[-1] == pytest.approx(math.radians(60.0))
    assert np.all(np.diff(angles) >= 0.0)
    assert np.max(np.diff(angles)) / 0.01 < math.radians(60.0) * 1.6


def test_the_head_turns_through_the_front_not_through_the_back():
    """From a robot on the right behind to one on the left behind, relative to the body."""
    keys = [
        GazeKey(t_s=0.0, look="ahead", yaw_deg=-120.0),
        GazeKey(t_s=1.0, look="ahead", yaw_deg=120.0),
    ]
    angle, _ = script([(0, 0, 0)], gaze=keys).gaze_angles(0.5, 0.0, (0.0, 0.0))
    assert angle == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        {"path": []},
        {"path": [(1, 0, 0), (1, 1, 0)]},
        {"path": [(2, 0, 0), (1, 1, 0)]},
        {"path": [(0, math.nan, 0)]},
    ],
)
def test_impossible_walks_are_refused(change):
    with pytest.raises(ValueError, match="path"):
        script(**change)


def test_unknown_keys_are_refused_with_the_nearest_name():
    with pytest.raises(ValueError, match="did you mean 'yaw_deg'"):
        GazeKey.model_validate({"t_s": 0.0, "yaw": 3.0})


def test_a_copied_script_walks_its_own_path():
    WALK.motion(1.0)
    moved = WALK.model_copy(update={"path": (WALK.path[0].model_copy(update={"x_m": 9.0}),)})
    assert moved.motion(1.0).position_odom_m[0] == 9.0
