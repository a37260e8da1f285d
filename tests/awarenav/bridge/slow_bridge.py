"""A bridge whose network takes a while: ``python slow_bridge.py DOMAIN SECONDS_PER_FRAME``.

It runs until SIGTERM and ends with a stop, as ``awarenav bridge`` does.
"""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path
from typing import NoReturn

import numpy as np

from awarenav.bridge._loop import BridgeInputs, BridgeLoop, TopicPublisher
from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import PUBLISHED, READ, AwarenessBridge, CameraMount, DdsNode, RobotFile
from perception import Camera, PersonObservation

ROBOT = Path(__file__).parents[3] / "docs" / "nav2" / "robot.yaml"
CAMERA = Camera(64, 48, 50.0, 50.0, 32.0, 24.0)


class SlowNetwork:
    """A pipeline that sees one person 4 m ahead, after a while."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds

    def process(self, image_rgb, stamp_s, floor=None, *, up_camera=None):
        time.sleep(self._seconds)
        return (
            PersonObservation(
                stamp_s=stamp_s,
                position_camera_m=np.array([0.0, 0.2, 4.0]),
                position_covariance_m2=np.diag([0.01, 0.01, 0.01]),
                gaze_camera=np.array([0.0, 0.0, -1.0]),
                awareness=0.9,
                awareness_std=0.05,
                score=0.9,
                box_xyxy_px=None,
            ),
        )


def main(domain: int, seconds_per_frame: float) -> None:
    node = DdsNode(domain)
    publisher = TopicPublisher(node, PUBLISHED, None)
    bridge = AwarenessBridge(
        AwarenessPolicy.preset("balanced"),
        RobotFile.from_yaml(ROBOT).profile(),
        publisher.publish,
        T_base_camera=CameraMount(position_base_m=[0.2, 0.0, 1.4]).T_base_camera(),
        make_pipeline=lambda camera: SlowNetwork(seconds_per_frame),
        camera=CAMERA,
        wanted=publisher.wants,
    )
    loop = BridgeLoop(node, bridge, BridgeInputs(READ["image"], READ["odom"]), 20.0)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        loop.run()
    except KeyboardInterrupt:
        bridge.stop(time.time(), "the end")
    finally:
        loop.close()
        node.close()


def _interrupt(number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
