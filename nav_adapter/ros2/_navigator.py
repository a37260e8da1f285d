"""The bridge for programs without ROS: pictures, scans and states as arrays."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from perception import AwarenessPipeline, Camera
from perception.arrays import ImageRgb, check_image
from perception.laser import LaserScan

from .._constraints import NavConstraints
from .._errors import NavError
from .._policy import AwarenessPolicy
from .._robot import RobotState
from ._bridge import AwarenessBridge
from ._robot_file import RobotFile
from ._scan_input import ScannerInput
from .conversions import header, odometry_of
from .messages import sensor_msgs

_LOG = logging.getLogger("nav_adapter")


class Navigator:
    """From a robot's pictures, scans and odometry to circles, a speed limit and its reason.

    It is the :class:`AwarenessBridge` without messages, so that a program without ROS gets what
    Nav2 gets: pictures that show nothing, silent and frozen sensors, clocks and contradictions are
    its business. Pass on what comes, and ask for :meth:`constraints` at a fixed rate, 20 Hz for
    instance; one thread may do so while another is in :meth:`on_image`. If something is missing,
    late or refused, the limit is 0 and ``limited_by`` says why.

    All times are of one clock that does not go back.

    Args:
        robot: the robot, or its file. The camera's mount must be in it, if there is a camera, and
            each scanner that is mounted in it must be heard.
        policy: a policy, its file, or the name of one that comes with the package.
        camera: None for scanners alone; everybody then counts as unaware.
        simulator_networks: as :class:`~perception.AwarenessPipeline` takes it.
        make_pipeline: makes perception with other networks, for the camera.
        warn: called with each problem; a repeated text is passed on only once.

    Raises:
        NavError: for a robot without camera and scanners, or a file that cannot be used.
        PerceptionError: without networks for photographs, unless ``simulator_networks``.
    """

    def __init__(
        self,
        robot: RobotFile | str | Path,
        policy: AwarenessPolicy | str | Path = "balanced",
        *,
        camera: Camera | None = None,
        simulator_networks: bool = False,
        make_pipeline: Callable[[Camera], AwarenessPipeline] | None = None,
        warn: Callable[[str], None] = _LOG.warning,
    ) -> None:
        if not isinstance(robot, RobotFile):
            robot = RobotFile.from_yaml(robot)
        if not isinstance(policy, AwarenessPolicy):
            policy = AwarenessPolicy.named(policy)
        if camera is not None and robot.camera is None:
            raise NavError("the robot must have the mount of its camera: give it under 'camera'")
        if make_pipeline is None:
            make_pipeline = partial(AwarenessPipeline, simulator_networks=simulator_networks)
        mounts = robot.scanners or ()
        self._bridge = AwarenessBridge(
            policy,
            robot.profile(),
            lambda key, message: None,
            T_base_camera=None if robot.camera is None else robot.camera.T_base_camera(),
            make_pipeline=make_pipeline,
            camera=camera,
            with_camera=camera is not None,
            scanners=[ScannerInput(f"scanner {n}", mount) for n, mount in enumerate(mounts)],
            warn=warn,
            wanted=lambda key: False,
        )

    def on_odometry(self, state: RobotState, now_s: float | None = None) -> None:
        """Take the robot's pose and velocity.

        Args:
            state: in odom.
            now_s: the present time; None for that of the state.
        """
        frames = self._bridge.frames
        message = odometry_of(state, frame_id=frames.odom, child_frame_id=frames.base)
        self._bridge.on_odometry(message, state.stamp_s if now_s is None else now_s)

    def on_image(self, image_rgb: ImageRgb, stamp_s: float, now_s: float | None = None) -> bool:
        """Find the people in a picture; return False if it shows nothing or is refused.

        Args:
            image_rgb: (H, W, 3) uint8, of the camera's size.
            stamp_s: time of the picture; the odometry of that time must have come.
            now_s: the present time; None for that of the picture.

        Raises:
            PerceptionError: for an array that is no picture of the camera.
        """
        camera = self._bridge.camera
        if camera is None:
            raise NavError("the navigator was made without a camera")
        check_image(image_rgb, camera.height_px, camera.width_px)
        message = sensor_msgs.Image(
            header(stamp_s, ""),
            *(camera.height_px, camera.width_px, "rgb8", 0, 3 * camera.width_px),
            np.ascontiguousarray(image_rgb).tobytes(),
        )
        return self._bridge.on_image(message, stamp_s if now_s is None else now_s)

    def on_scan(self, scan: LaserScan, number: int = 0, now_s: float | None = None) -> bool:
        """Find the people in a scan; return False if it shows nothing or is refused.

        Args:
            scan: of the scanner.
            number: of the scanner, from 0, in the order of the robot's file.
            now_s: the present time; None for that of the scan's end.

        Raises:
            NavError: for a number that no scanner has.
        """
        rays = len(scan.ranges_m)
        message = sensor_msgs.LaserScan(
            header(scan.stamp_s, ""),
            scan.angle_min_rad,
            scan.angle_min_rad + (rays - 1) * scan.angle_increment_rad,
            scan.angle_increment_rad,
            scan.time_increment_s,
            0.0,
            scan.range_min_m,
            scan.range_max_m,
            tuple(scan.ranges_m.tolist()),
        )
        return self._bridge.on_scan(number, message, scan.end_s if now_s is None else now_s)

    def constraints(self, now_s: float) -> NavConstraints:
        """Return people, speed limit and reason at the present time, for a planner."""
        return self._bridge.tick(now_s)
