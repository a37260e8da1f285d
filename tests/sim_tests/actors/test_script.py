"""Scripts of workers: walk, heading, gaze and activities."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.actors.behaviour import WorkerScript
from sim_tests.actors.body import Activity


def script(path, **keys):
    return WorkerScript(path=[{"t_s": t, "x_m": x, "y_m": y} for t, x, y in path], **keys)


WALK = script([(0, 0, 0), (2, 2, 0), (5, 2, 3), (6, 2, 3)])


def test_the_walk_passes_its_waypoints_at_their_times():
    for t, x, y in [(0, 0, 0), (2, 2, 0), (5, 2, 3), (6, 2, 3)]:
        np.testing.assert_allclose(WALK.motion(t).position_odom_m, [x, y], atol=1e-6)


@given(st.floats(0.05, 5.9))
def test_velocity_is_the_derivative_of_position_and_walked_is_the_path_length(t_s):
    step = 0.02
    before, after = WALK.motion(t_s - step), WALK.motion(t_s + step)
    moved = after.position_odom_m - before.position_odom_m
    np.testing.assert_allclose(moved / (2 * step), WALK.motion(t_s).velocity_odom_mps, atol=0.08)
    assert after.walked_m - before.walked_m == pytest.approx(np.linalg.norm(moved), abs=2e-3)


def test_the_body_faces_along_the_walk_without_heading_keys():
    assert WALK.motion(0.5).heading_odom_rad == pytest.approx(0.0, abs=0.05)
    assert WALK.motion(4.0).heading_odom_rad == pytest.approx(math.pi / 2, abs=0.05)
    backwards = script([(0, 0, 0), (4, 4, 0)], heading=[{"t_s": 0.0, "heading_deg": 180.0}])
    assert backwards.motion(2.0).heading_odom_rad == pytest.approx(math.pi)


def test_a_gaze_key_at_the_robot_follows_the_robot():
    watching = script([(0, 0, 0)], gaze=[{"t_s": 0.0, "look": "robot", "yaw_deg": 10.0}])
    for azimuth in (-2.0, 0.4, 2.5):
        angle, elevation = watching.gaze_angles(1.0, 0.3, (azimuth, -0.1))
        assert angle == pytest.approx(azimuth + math.radians(10.0))
        assert elevation == pytest.approx(-0.1)


def test_the_head_turns_through_the_front_not_through_the_back():
    """From a robot behind on the right to one behind on the left."""
    keys = [
        {"t_s": 0.0, "look": "ahead", "yaw_deg": -120.0},
        {"t_s": 1.0, "look": "ahead", "yaw_deg": 120.0},
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


def test_activities_change_in_six_tenths_of_a_second():
    busy = script(
        [(0, 0, 0)],
        activities=[
            {"t_s": 1.0, "activity": "phone"},
            {"t_s": 3.0, "activity": "carry_box"},
        ],
    )
    assert busy.activity(-5.0).held == "phone"  # the first holds before its time as well
    assert busy.activity(2.9) == Activity("phone", "phone", 1.0)
    halfway = busy.activity(3.3)
    assert (halfway.name, halfway.before) == ("carry_box", "phone")
    assert halfway.share == pytest.approx(0.5)
    assert busy.activity(3.6 + 1e-9) == Activity("carry_box", "phone", 1.0)
    assert WALK.activity(2.0) == Activity()
    shares = [busy.activity(t).share for t in np.linspace(3.0, 3.6, 61)]
    assert np.all(np.diff(shares) > 0.0)
    assert np.max(np.diff(shares)) < 0.03
    with pytest.raises(ValueError, match=r"activities must have increasing t_s at least 0\.6 s"):
        script(
            [(0, 0, 0)],
            activities=[{"t_s": 1.0, "activity": "phone"}, {"t_s": 1.2, "activity": "none"}],
        )


def test_feet_stand_before_the_first_and_after_the_last_waypoint():
    for t_s in (-1e6, -3.0, 8.0, 1e6):
        feet = np.array(WALK.motion(t_s).feet.feet)
        assert np.ptp(feet[:, 2]) < 1e-9
        np.testing.assert_allclose(feet[:, 4], 0.0, atol=1e-9)
        centre = WALK.motion(t_s).position_odom_m
        assert np.linalg.norm(feet[:, :2].mean(axis=0) - centre) < 0.05
