"""A camera that is rolled: the bridge finds the same people in the base frame."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from paths import ROOT
from rendered_image import odometry

from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import AwarenessBridge, CameraMount, RobotFile
from perception import AwarenessPipeline
from perception.turn import QuarterTurn

ROBOT = ROOT / "docs" / "nav2" / "robot.yaml"


def tracked(scene, T_base_camera):
    bridge = AwarenessBridge(
        AwarenessPolicy.preset("balanced"),
        RobotFile.from_yaml(ROBOT).profile(),
        lambda key, message: None,
        T_base_camera=T_base_camera,
        camera=scene.camera,
        make_pipeline=partial(AwarenessPipeline, simulator_networks=True),
    )
    for tick in range(4):
        now = 1000.0 + 0.1 * tick
        bridge.on_odometry(odometry(now))
        assert bridge.on_image(scene.image(now), now)
    return bridge.frame.tracks, bridge.tick(now).speed_limit_mps


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_the_same_people_and_limit_come_from_a_camera_that_is_rolled(scene, quarters):
    tracks, limit_mps = tracked(scene, scene.T_base_camera)
    assert len(tracks) == 1
    turn, rolled = QuarterTurn(quarters), RolledScene(scene, quarters)
    T = scene.T_base_camera.copy()
    T[:3, :3] = T[:3, :3] @ turn.rotation_camera_view.T
    found, rolled_limit_mps = tracked(rolled, T)
    assert len(found) == 1
    np.testing.assert_allclose(found[0].position_odom_m, tracks[0].position_odom_m, atol=0.005)
    assert found[0].awareness == pytest.approx(tracks[0].awareness, abs=0.05)
    assert rolled_limit_mps == pytest.approx(limit_mps, abs=0.01)


class RolledScene:
    """A scene whose camera is rolled: its pictures are turned the other way."""

    def __init__(self, scene, quarters: int) -> None:
        self._scene, self._quarters = scene, -quarters
        self.camera = QuarterTurn(-quarters % 4).camera(scene.camera)

    def image(self, stamp_s: float):
        upright = self._scene.bgr
        self._scene.bgr = np.ascontiguousarray(np.rot90(upright, self._quarters))
        try:
            return self._scene.image(stamp_s)
        finally:
            upright[0, 0, 0] += 1
            self._scene.bgr = upright


@pytest.mark.parametrize(("roll_deg", "quarters"), [(0, 0), (90, 3), (180, 2), (-90, 1), (20, 0)])
def test_the_roll_of_the_robot_file_is_clockwise_from_behind(roll_deg, quarters):
    mount = CameraMount(position_base_m=[0, 0, 1], yaw_deg=30, pitch_down_deg=10, roll_deg=roll_deg)
    T = mount.T_base_camera()
    assert QuarterTurn.upright(T[2, :3]) == QuarterTurn(quarters)
    level = CameraMount(position_base_m=[0, 0, 1], yaw_deg=30, pitch_down_deg=10).T_base_camera()
    np.testing.assert_allclose(T[:3, 2], level[:3, 2], atol=1e-12)
    if roll_deg == 90:  # its right side is down
        np.testing.assert_allclose(T[:3, 0], level[:3, 1], atol=1e-12)
