"""The navigator is the bridge with arrays: what it says is what the bridge says of messages."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from bridge_scenes import FRONT, INFO, SCANNER_MOUNT, START_S, Robot, attentive, image, nobody
from nav_scenes import ROBOT
from scan_scenes import scan_message

import awarenav
from nav_adapter import NavError, RobotState
from nav_adapter.ros2 import RobotFile, camera_of, laser_scan_of
from perception import PerceptionError

CAMERA = camera_of(INFO)
PEOPLE = [(3.2, -0.2), (1.0, 2.5)]
SETTINGS = {
    "footprint_m": ROBOT.footprint_m.tolist(),
    "max_speed_mps": 1.5,
    "max_acceleration_mps2": 1.0,
    "max_deceleration_mps2": 1.0,
    "reaction_time_s": 0.3,
    "camera": {"position_base_m": [0.2, 0.0, 1.4]},
}
CAMERA_ALONE = RobotFile(**SETTINGS)
BOTH = RobotFile(**SETTINGS, scanners=[SCANNER_MOUNT])


def picture(stamp_s: float) -> np.ndarray:
    return np.frombuffer(image(stamp_s).data, np.uint8).reshape(48, 64, 3)


def standing(stamp_s: float, speed_mps: float = 0.0) -> RobotState:
    return RobotState(stamp_s, [0.0, 0.0], 0.0, speed_mps, 0.0)


def test_it_says_what_the_bridge_says():
    bridge = Robot(FRONT, people=PEOPLE, make_pipeline=attentive)
    nav = awarenav.Navigator(BOTH, camera=CAMERA, make_pipeline=attentive)
    for step in range(40):
        now_s = START_S + 0.04 * step
        expected = bridge.step(now_s)
        nav.on_odometry(standing(now_s))
        nav.on_image(picture(now_s), now_s)
        message = scan_message(now_s, PEOPLE, SCANNER_MOUNT.T_base_scanner())
        nav.on_scan(laser_scan_of(message), now_s=now_s)
        found = nav.constraints(now_s)
        assert found.speed_limit_mps == expected.speed_limit_mps
        assert found.limited_by == expected.limited_by
        np.testing.assert_array_equal(awarenav.circles(found), awarenav.circles(expected))
    assert len(found.obstacles) == 2
    assert not found.stale


def test_a_picture_that_shows_nothing_ends_in_a_stop_with_its_reason(caplog):
    nav = awarenav.Navigator(CAMERA_ALONE, camera=CAMERA, make_pipeline=nobody)
    black = np.zeros((48, 64, 3), np.uint8)
    with caplog.at_level(logging.WARNING, "nav_adapter"):
        for step in range(60):
            now_s = START_S + 0.04 * step
            nav.on_odometry(standing(now_s))
            covered = step >= 20
            assert nav.on_image(black if covered else picture(now_s), now_s) != covered
            limit_mps = nav.constraints(now_s).speed_limit_mps
            if step == 19:
                assert limit_mps > 0.0
            if covered and now_s - START_S > 0.76 + 0.52:  # the last view is older than 0.5 s
                assert limit_mps <= 0.25
    assert limit_mps == 0.0
    assert any("black" in record.message for record in caplog.records)


def test_without_odometry_or_pictures_it_says_what_is_missing():
    nav = awarenav.Navigator(CAMERA_ALONE, camera=CAMERA, make_pipeline=nobody)
    assert nav.constraints(START_S).limited_by == "no odometry yet"
    nav.on_odometry(standing(START_S))
    found = nav.constraints(START_S)
    assert found.speed_limit_mps == 0.0
    assert "camera" in found.limited_by


def test_what_it_cannot_be_made_of_is_refused():
    with pytest.raises(NavError, match="mount of its camera"):
        awarenav.Navigator(CAMERA_ALONE.model_copy(update={"camera": None}), camera=CAMERA)
    with pytest.raises(NavError, match="did you mean 'balanced'"):
        awarenav.Navigator(CAMERA_ALONE, "balancd", camera=CAMERA, make_pipeline=nobody)
    with pytest.raises(PerceptionError, match="simulator_networks=True"):
        awarenav.Navigator(CAMERA_ALONE, camera=CAMERA)
    nav = awarenav.Navigator(CAMERA_ALONE, camera=CAMERA, make_pipeline=nobody)
    with pytest.raises(PerceptionError, match="48"):
        nav.on_image(np.zeros((24, 32, 3), np.uint8), START_S)
    with pytest.raises(NavError, match="scanners"):
        nav.on_scan(laser_scan_of(scan_message(START_S)))
