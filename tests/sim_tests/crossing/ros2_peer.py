"""A little ROS 2 robot stack of our own, over DDS: it steers to the goal within the speed limit."""

from __future__ import annotations

import math
import threading
from typing import Any

from nav_adapter.ros2 import PUBLISHED, READ, DdsNode, Topic
from nav_adapter.ros2.messages.geometry_msgs import PoseStamped, Twist, TwistStamped, Vector3
from nav_adapter.ros2.messages.rosgraph_msgs import Clock

ODOM = Topic("odom", READ["odom"].message)
GOAL = Topic("goal_pose", PoseStamped)
TAPPED = {
    "clock": Topic("clock", Clock, depth=100),
    "tf": Topic("tf", READ["tf"].message, depth=100),
    "tf_static": READ["tf_static"],
    "map": READ["map"],
    "scan": READ["scan"],
    "scan_2": READ["scan_2"],
    "image": READ["image"],
    "camera_info": READ["camera_info"],
}


class Peer:
    """A stack that answers each odometry message by one command.

    Args:
        domain: ``ROS_DOMAIN_ID``.
        kind: of the commands, Twist or TwistStamped.
        obeys: it keeps the limit that it hears, and drives no faster than 1.2 m/s without one.
        silent_after_s: seconds after its first command, by the stamps of the odometry.
        reads_goal: it reads goal_pose.
        tap: it keeps what it hears on :data:`TAPPED`.
    """

    def __init__(
        self,
        domain: int,
        kind: type = Twist,
        *,
        obeys: bool = True,
        silent_after_s: float = math.inf,
        reads_goal: bool = True,
        tap: bool = False,
    ) -> None:
        self._node, self._kind, self._obeys = DdsNode(domain), kind, obeys
        self._silent_after_s, self._reads_goal = silent_after_s, reads_goal
        self._command = Topic("cmd_vel", kind)
        self._goal: Any = None
        self._limit_mps = 1.2
        self._first_s = math.nan
        self.limits_mps: list[float] = []
        self.heard: dict[str, list[Any]] = {name: [] for name in TAPPED if tap}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Peer:
        self._node.advertise(self._command)
        self._node.subscribe(ODOM)
        for topic in [PUBLISHED["speed_limit"], *([GOAL] if self._reads_goal else [])]:
            self._node.subscribe(topic, wakes=False)
        for name in self.heard:
            self._node.subscribe(TAPPED[name], wakes=False)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self._node.close()

    def _run(self) -> None:
        while not self._ended.is_set():
            self._node.wait(0.05)
            for goal in self._node.take(GOAL) if self._reads_goal else ():
                self._goal, self._limit_mps = goal.pose.position, 1.2
            for limit in self._node.take(PUBLISHED["speed_limit"]):
                self.limits_mps.append(limit.speed_limit)
                self._limit_mps = min(limit.speed_limit, 1.2)
            for name, kept in self.heard.items():
                kept.extend(self._node.take(TAPPED[name]))
            for odom in self._node.take(ODOM):
                if self._goal is not None:
                    self._drive(odom)

    def _drive(self, odom: Any) -> None:
        stamp_s = odom.header.stamp.sec + 1e-9 * odom.header.stamp.nanosec
        if math.isnan(self._first_s):
            self._first_s = stamp_s
        if stamp_s - self._first_s > self._silent_after_s:
            return
        pose = odom.pose.pose
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        dx, dy = self._goal.x - pose.position.x, self._goal.y - pose.position.y
        left_m = math.hypot(dx, dy)
        speed = min(self._limit_mps if self._obeys else 1.2, max(left_m - 0.1, 0.0))
        turn = math.remainder(math.atan2(dy, dx) - yaw, math.tau) if left_m > 0.3 else 0.0
        twist = Twist(Vector3(x=speed), Vector3(z=max(-0.5, min(0.5, turn))))
        message = twist if self._kind is Twist else TwistStamped(odom.header, twist)
        self._node.publish(self._command, message)
