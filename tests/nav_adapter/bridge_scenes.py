"""Bridges whose messages are kept, robots that drive them, and the messages that they read."""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
from nav_scenes import ROBOT
from scan_scenes import scan_message
from scipy.spatial.transform import Rotation

from nav_adapter import AwarenessPolicy, NavConstraints
from nav_adapter.ros2 import (
    SLOWEST_MPS,
    STOP_POLYGON_ID,
    AwarenessBridge,
    CameraMount,
    ScannerInput,
    ScannerMount,
)
from nav_adapter.ros2.conversions import to_time, yaw_quaternion
from nav_adapter.ros2.messages.diagnostic_msgs import DiagnosticStatus
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import AwarenessPipeline, Camera, PersonObservation

START_S = 1000.0
#: For threads and other processes.
PATIENCE_S = 20.0
TIMING = AwarenessPolicy.preset("balanced").timing
MOUNT = CameraMount(position_base_m=[0.2, 0.0, 1.4]).T_base_camera()
INFO = CameraInfo(
    Header(to_time(START_S), "camera"), 48, 64, k=(50.0, 0.0, 32.0, 0.0, 50.0, 24.0, 0.0, 0.0, 1.0)
)
SCANNER_MOUNT = ScannerMount(position_base_m=[0.3, 0.0, 0.2])
FRONT = ScannerInput("scan_front", SCANNER_MOUNT)
REAR = ScannerInput("scan_rear", ScannerMount(position_base_m=[-0.3, 0.0, 0.2], yaw_deg=180.0))
#: In view of the front scanner alone.
PERSON = (2.5, 1.2)


#: The topics that the tests of a robot read; to make the others takes longer than to drive.
NEEDED = frozenset({"speed_limit", "collision_polygons", "alerts"})


class NobodyThere:
    """A detector and a pose estimator that find nobody."""

    def detect(self, image_rgb):
        return ()

    def estimate(self, image_rgb, *_):
        return ()


def nobody(camera: Camera) -> AwarenessPipeline:
    none = NobodyThere()
    return AwarenessPipeline(camera, detector=none, pose_estimator=none, head_pose_estimator=none)


class Seeing:
    """Perception of one person before the camera.

    Args:
        ahead_m: distance, also as a function of the stamp.
        awareness: measured α; None for no face.
        sigma_m: of the place.
    """

    def __init__(
        self,
        ahead_m: float | Callable[[float], float],
        awareness: float | None = None,
        sigma_m: float = 0.1,
    ) -> None:
        self.ahead_m, self.awareness, self.sigma_m = ahead_m, awareness, sigma_m
        self.gone = False

    def process(self, image_rgb, stamp_s, floor=None, *, up_camera=None):
        ahead_m = self.ahead_m(stamp_s) if callable(self.ahead_m) else self.ahead_m
        seen = PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([0.0, 0.2, ahead_m]),
            position_covariance_m2=self.sigma_m**2 * np.eye(3),
            gaze_camera=None,
            awareness=self.awareness,
            awareness_std=None if self.awareness is None else 0.03,
            score=0.9,
        )
        return () if self.gone else (seen,)


def attentive(_: Camera) -> Seeing:
    """Return perception of somebody 3 m ahead who looks at the robot."""
    return Seeing(3.0, 0.95)


class Network:
    """Perception that sees nobody, waits for its gate and fails when told to."""

    def __init__(self) -> None:
        self.open, self.entered = threading.Event(), threading.Event()
        self.open.set()
        self.problem: Exception | None = None
        self.stamps_s: list[float] = []

    def close(self) -> None:
        self.entered.clear()
        self.open.clear()

    def process(self, image_rgb, stamp_s, floor=None, *, up_camera=None):
        self.stamps_s.append(stamp_s)
        self.entered.set()
        assert self.open.wait(PATIENCE_S)
        if self.problem is not None:
            raise self.problem
        return ()


def odometry(stamp_s: float, x: float = 0.0, yaw: float = 0.0, speed: float = 0.5) -> Odometry:
    return Odometry(
        Header(to_time(stamp_s), "odom"),
        "base_link",
        PoseWithCovariance(Pose(Point(x, 0.0, 0.0), yaw_quaternion(yaw))),
        TwistWithCovariance(Twist(Vector3(speed, 0.0, 0.0))),
    )


def tf(parent: str, child: str, T: np.ndarray, stamp_s: float = START_S) -> TFMessage:
    turn = Quaternion(*Rotation.from_matrix(T[:3, :3]).as_quat().tolist())
    move = Transform(Vector3(*T[:3, 3].tolist()), turn)
    return TFMessage((TransformStamped(Header(to_time(stamp_s), parent), child, move),))


def image(stamp_s: float, data: bytes | None = None) -> Image:
    """Return a picture of noise, another one for each stamp, or one of the bytes given."""
    header = Header(to_time(stamp_s), "camera")
    noise = np.random.default_rng(round(1e6 * stamp_s)).bytes(48 * 192)
    return Image(header, 48, 64, "rgb8", 0, 192, noise if data is None else data)


class Listener:
    """A bridge whose published messages are kept."""

    def __init__(self, **settings: Any) -> None:
        self.heard = defaultdict(list)
        self.warnings: list[str] = []
        self.bridge = AwarenessBridge(
            settings.pop("policy", AwarenessPolicy.preset("balanced")),
            ROBOT,
            lambda key, message: self.heard[key].append(message),
            warn=self.warnings.append,
            **{"T_base_camera": MOUNT, "make_pipeline": nobody, **settings},
        )

    def standing(self) -> bool:
        """Return whether the last tick stops the robot, by limit and polygon alike."""
        polygon = self.heard["collision_polygons"][-1]
        assert polygon.polygon.id == STOP_POLYGON_ID
        near = all(abs(corner.x) < 1.0 for corner in polygon.polygon.polygon.points)
        assert near == (self.heard["speed_limit"][-1].speed_limit == SLOWEST_MPS)
        return near

    def details(self) -> dict[str, str]:
        return {pair.key: pair.value for pair in self.heard["alerts"][-1].status[0].values}

    def sensors(self) -> DiagnosticStatus:
        status = self.heard["alerts"][-1].status[1]
        assert status.name == "awarenav: sensors"
        return status


class Robot(Listener):
    """A robot whose sensors send until they are told to be ``silent``."""

    period_s = 0.04
    speed_mps = 0.0

    def __init__(self, *scanners: ScannerInput, people=(), **settings: Any) -> None:
        self.scanners, self.people = scanners, people
        self.silent: set[str] = set()
        super().__init__(scanners=scanners, **{"wanted": NEEDED.__contains__, **settings})
        if settings.get("with_camera", True):
            self.bridge.on_camera_info(INFO)

    def odometry(self, now_s: float) -> Odometry:
        return odometry(now_s, speed=self.speed_mps)

    def scan(self, number: int, now_s: float):
        T = self.scanners[number].mount.T_base_scanner()
        return scan_message(now_s, self.people, T)

    def step(self, now_s: float) -> NavConstraints:
        self.bridge.on_odometry(self.odometry(now_s), now_s)
        if "camera" not in self.silent:
            self.bridge.on_image(image(now_s), now_s)
        for number, scanner in enumerate(self.scanners):
            if scanner.name not in self.silent:
                self.bridge.on_scan(number, self.scan(number, now_s), now_s)
        return self.bridge.tick(now_s)

    def drive(self, start_s: float, seconds: float) -> list[NavConstraints]:
        steps = range(round(seconds / self.period_s))
        return [self.step(start_s + self.period_s * step) for step in steps]


def scanning(*scanners: ScannerInput, **settings: Any) -> Robot:
    """Return a robot that has scanners and no camera."""
    nav = Robot(*(scanners or (FRONT,)), with_camera=False, **settings)
    nav.silent.add("camera")
    return nav
