"""A standing robot with scanners and a camera, for the tests of the bridge."""

from __future__ import annotations

import numpy as np
from scan_scenes import scan_message
from test_ros2_bridge import INFO, Listener, image, odometry

from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import ScannerInput, ScannerMount
from nav_adapter.ros2.messages.diagnostic_msgs import DiagnosticStatus
from perception import PersonObservation

PERIOD_S = 0.04
TIMING = AwarenessPolicy.preset("balanced").timing
MOUNT = ScannerMount(position_base_m=[0.3, 0.0, 0.2])
FRONT = ScannerInput("scan_front", MOUNT)
REAR = ScannerInput("scan_rear", ScannerMount(position_base_m=[-0.3, 0.0, 0.2], yaw_deg=180.0))
PERSON = (2.5, 1.2)


class Attentive:
    """Perception of one person 3 m ahead of the robot who looks at it."""

    def process(self, image_rgb, stamp_s, *, floor=None):
        return (
            PersonObservation(
                stamp_s=stamp_s,
                position_camera_m=np.array([0.0, 0.2, 3.0]),
                position_covariance_m2=np.diag([0.01, 0.01, 0.01]),
                gaze_camera=None,
                awareness=0.95,
                awareness_std=0.03,
                score=0.9,
            ),
        )


class Robot(Listener):
    """A standing robot whose sensors send until they are told to be silent."""

    def __init__(self, *scanners: ScannerInput, people=(), **settings) -> None:
        self.scanners, self.people = scanners, people
        self.silent: set[str] = set()
        super().__init__(scanners=scanners, **settings)
        if settings.get("with_camera", True):
            self.bridge.on_camera_info(INFO)

    def step(self, now_s: float):
        self.bridge.on_odometry(odometry(now_s, speed=0.0), now_s)
        if "camera" not in self.silent:
            self.bridge.on_image(image(now_s), now_s)
        for number, scanner in enumerate(self.scanners):
            if scanner.name not in self.silent:
                T = scanner.mount.T_base_scanner()
                self.bridge.on_scan(number, scan_message(now_s, self.people, T), now_s)
        return self.bridge.tick(now_s)

    def drive(self, start_s: float, seconds: float) -> list:
        return [self.step(start_s + PERIOD_S * tick) for tick in range(round(seconds / PERIOD_S))]

    def sensors(self) -> DiagnosticStatus:
        status = self.heard["alerts"][-1].status[1]
        assert status.name == "awarenav: sensors"
        return status

    def details(self) -> dict[str, str]:
        return {pair.key: pair.value for pair in self.heard["alerts"][-1].status[0].values}
