from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

pytest.importorskip("rerun", reason="the extra viz is not installed")

from rendered_image import RenderedImage, odometry

from awarenav.bridge._rerun import RerunRecorder, cone_lines
from awarenav.errors import AwarenavError
from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import AwarenessBridge, RobotFile
from perception import AttentionCone

ROBOT = ROOT / "docs" / "nav2" / "robot.yaml"


def test_a_rerun_recording_has_inputs_and_outputs_of_the_bridge(
    scene: RenderedImage, tmp_path: Path
) -> None:
    path = tmp_path / "run.rrd"
    bridge = AwarenessBridge(
        AwarenessPolicy.preset("balanced"),
        RobotFile.from_yaml(ROBOT).profile(),
        lambda key, message: None,
        T_base_camera=scene.T_base_camera,
        camera=scene.camera,
    )
    with RerunRecorder(path, AttentionCone().half_angle_rad) as recorder:
        for tick in range(4):
            now = 1000.0 + 0.1 * tick
            bridge.on_odometry(odometry(now))
            assert bridge.on_image(scene.image(now), now)
            recorder.draw_frame(bridge)
            recorder.draw(bridge, bridge.tick(now))
    with pytest.raises(AwarenavError, match="there is no folder"):
        RerunRecorder(tmp_path / "nowhere" / "run.rrd", 1.0)
    data = path.read_bytes()
    assert data.startswith(b"RRF")
    for entity in (
        "camera/image/keypoints",
        "world/cones",
        "world/tracks",
        "radius_m/",
        "limit_mps",
    ):
        assert entity.encode() in data


def test_a_cone_is_drawn_about_the_gaze_with_its_half_angle() -> None:
    apex, gaze = np.array([1.0, 2.0, 1.6]), np.array([0.6, 0.0, 0.8])
    for direction in (gaze, np.array([0.0, 0.0, 1.0])):
        rim, *edges, axis = cone_lines(apex, direction, np.pi / 3.0)
        off = rim - apex
        assert np.allclose(np.linalg.norm(off, axis=1), 1.0)
        assert np.allclose(off @ direction, 0.5)
        assert all(np.array_equal(edge[0], apex) for edge in edges)
        assert np.allclose(axis[1] - apex, direction)
