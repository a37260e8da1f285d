"""The bridge as an rclpy node, for computers with ROS 2: the same topics, with ROS's clock.

Run it with ``python -m nav_adapter.ros2.node --ros-args -p robot_file:=robot.yaml``. The executor's
thread publishes at a fixed rate; perception has threads of its own. Parameters:
``robot_file`` (required), ``policy`` (``balanced``), ``prediction_file`` (of ``awarenav tracks
calibrate``; by default none), ``rate_hz`` (20.0), ``scanners`` (number of laser scanners, 0 to 2),
``use_camera`` (true), ``use_map`` (false), ``use_footprint`` (false), ``compressed`` (false),
``depth`` (false; whether the camera has depth images),
``percentage`` (false), ``detector_file`` and ``pose_file`` (files, or names of networks that are
fetched; by default the fetched set ``real``), ``allow_simulator_networks`` (false; with true, the
default is the shipped networks, which have seen renders only and are refused without it),
``odom_frame``, ``base_frame``, ``camera_frame``; for Nav2's speed filter
``speed_mask_hz`` (0.0; masks per second, 0 for none), ``speed_mask_size_m`` (10.0) and
``speed_mask_resolution_m`` (0.1). Topics are renamed by ROS's
remapping. rclpy comes with ROS 2, or from wheels for trying it (docs/nav2.md, With ROS). The module
can be imported without it; the node then raises an error that says what is missing.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from perception import AwarenessPipeline, Camera
from perception.arrays import finite_number
from perception.errors import AwarenavError
from perception.named import NetworkChoice, admit_networks
from tracking.prediction import PredictionModel

from .._errors import NavError
from .._policy import AwarenessPolicy
from ._bridge import AwarenessBridge
from ._outgoing import Frames
from ._robot_file import RobotFile
from ._scan_input import scanner_inputs
from ._speed_mask import SpeedMaskSettings
from ._threads import PerceptionThread, ScanThread
from ._topics import MASK_TOPICS, PUBLISHED, READ, Topic, is_rectified
from .conversions import from_ros, ros_class, to_ros
from .messages import Message, ros_type
from .messages.geometry_msgs import PolygonStamped
from .messages.nav_msgs import OccupancyGrid, Odometry
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image, LaserScan
from .messages.tf2_msgs import TFMessage

try:
    import rclpy
    from rclpy.exceptions import InvalidParameterTypeException
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
    from rclpy.signals import SignalHandlerOptions
except ImportError:  # AwarenessNode says what is missing
    rclpy = None
    Node = object

_LONGEST_WAIT_S: Final = 0.1
_TOPICS: Final = {**PUBLISHED, **MASK_TOPICS}


class AwarenessNode(Node):  # type: ignore[misc, valid-type, unused-ignore]
    """Reads camera, scanners and odometry; publishes :data:`~nav_adapter.ros2.PUBLISHED`.

    A topic whose message package is not installed (``people_msgs``, ``costmap_converter_msgs``,
    ``vision_msgs``) is left out with a warning; ``nav2_msgs`` is required.

    Raises:
        NavError: without rclpy or ``nav2_msgs``, or for a wrong parameter.
        TrackingError: for a file of ``prediction_file`` that cannot be used.
    """

    def __init__(self) -> None:
        if rclpy is None:
            raise NavError(
                "the node needs rclpy: source ROS 2's setup.bash, take it from wheels "
                "(docs/nav2.md, With ROS), or use `awarenav bridge`, which needs no ROS"
            )
        super().__init__("awarenav")
        robot_file = self._parameter("robot_file", "")
        if not robot_file:
            raise NavError("robot_file must name the robot's file: -p robot_file:=robot.yaml")
        robot = RobotFile.from_yaml(robot_file)
        rate_hz = finite_number(
            "rate_hz", self._parameter("rate_hz", 20.0), NavError, minimum=1.0, maximum=200.0
        )
        policy = self._parameter("policy", "balanced")
        calibration = self._parameter("prediction_file", "")
        use_camera = self._parameter("use_camera", True)
        use_depth = use_camera and self._parameter("depth", False)
        compressed = use_camera and self._parameter("compressed", False)
        image = READ["compressed" if compressed else "image"]
        scans = self._scan_topics(self._parameter("scanners", 0))
        self._publishers_by_key: dict[str, Any] = {}
        for key, topic in PUBLISHED.items():
            self._advertise(key, topic)
        self._bridge = AwarenessBridge(
            AwarenessPolicy.named(policy),
            robot.profile(),
            self._publish,
            frames=Frames(
                self._parameter("odom_frame", "odom"),
                self._parameter("base_frame", "base_link"),
                self._parameter("camera_frame", ""),
            ),
            T_base_camera=None if robot.camera is None else robot.camera.T_base_camera(),
            prediction=PredictionModel.from_calibration(calibration) if calibration else None,
            percentage=self._parameter("percentage", False),
            speed_mask=self._speed_mask(),
            make_pipeline=_pipelines(
                self._parameter("detector_file", ""),
                self._parameter("pose_file", ""),
                allowed=self._parameter("allow_simulator_networks", False) or not use_camera,
            ),
            with_camera=use_camera,
            rectified=use_camera and is_rectified(self.resolve_topic_name(image.name)),
            with_depth=use_depth,
            scanners=scanner_inputs([topic.name for topic in scans], robot),
            warn=self.get_logger().warning,
            wanted=self._wanted,
        )
        bridge, now_s = self._bridge, self._now_s
        self._perception = perception = PerceptionThread(bridge, now_s)
        self._subscribe(READ["odom"], lambda m: bridge.on_odometry(from_ros(Odometry, m), now_s()))
        self._subscribe(READ["tf"], partial(self._transforms, static=False))
        self._subscribe(READ["tf_static"], partial(self._transforms, static=True))
        if self._parameter("use_footprint", False):
            self._subscribe(
                READ["footprint"],
                lambda m: bridge.on_footprint(from_ros(PolygonStamped, m), now_s()),
            )
        use_map = bool(scans) and self._parameter("use_map", False)
        if use_camera:
            self._subscribe(READ["camera_info"], self._calibration)
            kind: Any = CompressedImage if compressed else Image
            self._subscribe(image, lambda m: perception.submit(lambda: from_ros(kind, m)))
        if use_depth:
            self._subscribe(
                READ["depth"], lambda m: perception.submit_depth(lambda: from_ros(Image, m))
            )
        self._scans = thread = ScanThread(bridge, now_s) if scans else None
        if thread is not None:
            for number, topic in enumerate(scans):
                self._subscribe(
                    topic,
                    lambda m, n=number: thread.submit(n, lambda: from_ros(LaserScan, m)),
                )
            if use_map:
                self._subscribe(
                    READ["map"], lambda m: thread.submit_map(lambda: from_ros(OccupancyGrid, m))
                )
        self.create_timer(1.0 / rate_hz, lambda: bridge.tick(now_s()))

    def stop(self) -> None:
        """Publish a stop and end perception, before the node ends."""
        self._bridge.stop(self._now_s(), "the awarenav node has ended")
        if self._scans is not None:
            self._scans.close()
        self._perception.close()

    def _calibration(self, message: Any) -> None:
        if self._bridge.camera is None:
            self._perception.calibrate(lambda: from_ros(CameraInfo, message))

    def _transforms(self, message: Any, *, static: bool) -> None:
        self._bridge.on_transforms(from_ros(TFMessage, message), self._now_s(), static=static)

    def _publish(self, key: str, message: Message) -> None:
        publisher = self._publishers_by_key.get(key)
        if publisher is not None:
            publisher.publish(to_ros(message))

    def _wanted(self, key: str) -> bool:
        publisher = self._publishers_by_key.get(key)
        return publisher is not None and (
            _TOPICS[key].transient_local or publisher.get_subscription_count() > 0
        )

    def _advertise(self, key: str, topic: Topic) -> None:
        try:
            kind = ros_class(topic.message)
        except ImportError as problem:
            if key == "speed_limit":
                raise NavError(f"the node needs nav2_msgs: {problem}") from problem
            self.get_logger().warning(f"{ros_type(topic.message)}: {problem}; not published")
            return
        self._publishers_by_key[key] = self.create_publisher(kind, topic.name, _qos(topic))

    def _speed_mask(self) -> SpeedMaskSettings | None:
        """Advertise the speed mask if it is asked for, and return its settings."""
        rate_hz = self._parameter("speed_mask_hz", 0.0)
        size_m = self._parameter("speed_mask_size_m", 10.0)
        resolution_m = self._parameter("speed_mask_resolution_m", 0.1)
        if rate_hz == 0.0:
            return None
        for key, topic in MASK_TOPICS.items():
            self._advertise(key, topic)
        # Its name after remapping.
        name = self._publishers_by_key["speed_mask"].topic_name
        return SpeedMaskSettings(rate_hz, size_m, resolution_m, name)

    def _scan_topics(self, count: Any) -> tuple[Topic, ...]:
        known = (READ["scan"], READ["scan_2"])
        if count not in range(len(known) + 1):
            raise NavError(f"scanners must be 0, 1 or 2, got {count!r}")
        return known[:count]

    def _subscribe(self, topic: Topic, callback: Any) -> None:
        self.create_subscription(ros_class(topic.message), topic.name, callback, _qos(topic))

    def _parameter(self, name: str, default: Any) -> Any:
        try:
            return self.declare_parameter(name, default).value
        except InvalidParameterTypeException as problem:
            raise NavError(str(problem)) from problem

    def _now_s(self) -> float:
        # The nearest number, as for a recording.
        return float(self.get_clock().now().nanoseconds / 1e9)


def main() -> int:
    """Run the node until Ctrl-C or SIGTERM; return 0, or 2 for bad input."""
    if rclpy is not None:
        # rclpy's own signal handlers would shut ROS down before the last stop is published.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    # What ros2 launch sends to a process that does not end on Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        node = AwarenessNode()
    except AwarenavError as problem:
        print(f"awarenav node: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 0  # nothing was published yet
    try:
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        # Waiting hears no signal, and lasts forever while simulated time stands still.
        while rclpy.ok():
            executor.spin_once(timeout_sec=_LONGEST_WAIT_S)
    except KeyboardInterrupt:
        pass
    finally:
        if rclpy.ok():
            node.stop()
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _pipelines(
    detector_file: str, pose_file: str, *, allowed: bool
) -> Callable[[Camera], AwarenessPipeline]:
    """Return a function that makes a pipeline with these networks, which are loaded here.

    Networks of renders must be ``allowed``.
    """
    given = {"detector": detector_file, "pose": pose_file}
    default = NetworkChoice.default(simulator=allowed)
    choice = default.model_copy(update={role: file for role, file in given.items() if file})
    networks = choice.load()
    admit_networks(
        networks,
        rendered=False,
        allowed=allowed,
        or_else="set detector_file and pose_file to others, or allow_simulator_networks to true",
    )
    return partial(AwarenessPipeline.of, networks)


def _qos(topic: Topic) -> Any:
    return QoSProfile(
        depth=topic.depth,
        reliability=(
            ReliabilityPolicy.RELIABLE if topic.reliable else ReliabilityPolicy.BEST_EFFORT
        ),
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if topic.transient_local else DurabilityPolicy.VOLATILE
        ),
    )


if __name__ == "__main__":
    sys.exit(main())
