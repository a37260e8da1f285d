"""The client of Nav2's actions: a process of its own with rclpy, which this process need not have.

It is run by its path, and imports nothing of the project. Lines of JSON come in: ``{"do":
"begin"}``, ``{"do": "go", "x": …, "y": …, "yaw": …, "path": [[x, y], …]}`` and ``{"do": "stop"}``.
Lines ``{"missing": "…"}``, empty once nothing is, and ``{"refused": "…"}`` go out.
"""

import json
import math
import queue
import sys
import threading
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import ComputePathToPose, FollowPath, NavigateToPose
from nav2_msgs.srv import ClearEntireCostmap
from nav_msgs.msg import Path
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter

# As long as bt_navigator's default tree.
REPLAN_S = 1.0


class Client(Node):  # type: ignore[misc]
    """Sends goals: to ``navigate_to_pose``, or paths to ``follow_path``.

    Paths are those of the planner server, a new one every second; straight ones without it.
    """

    def __init__(self, kind: str) -> None:
        super().__init__(
            "awarenav_seat", parameter_overrides=[Parameter("use_sim_time", value=True)]
        )
        self.follows = kind == "follow_path"
        self.drive = ActionClient(self, FollowPath if self.follows else NavigateToPose, kind)
        self.plan = ActionClient(self, ComputePathToPose, "compute_path_to_pose")
        self.clear = [
            self.create_client(ClearEntireCostmap, f"{each}_costmap/clear_entirely_{each}_costmap")
            for each in ("local", "global")
        ]
        self.wanted: dict[str, Any] = {}
        self.sent_goal: Any = None
        self.asked = self.planning = False
        self.create_timer(REPLAN_S, self.replan)

    def begin(self) -> None:
        """Forget the goal, clear the costmaps."""
        self.stop()
        for each in self.clear:
            if each.service_is_ready():
                each.call_async(ClearEntireCostmap.Request())

    def missing(self) -> str:
        """Return what is not there yet."""
        if not self.drive.server_is_ready():
            return f"no action server {self.drive._action_name} (is it started and active?)"
        return ""

    def go(self, wanted: dict[str, Any]) -> None:
        """Send a goal."""
        self.wanted, self.asked = wanted, False
        self.replan()
        if not self.follows:
            self.send(NavigateToPose.Goal(pose=self.pose(wanted["x"], wanted["y"], wanted["yaw"])))

    def replan(self) -> None:
        """Ask for a new path, or send the straight one again after it was given up."""
        if not (self.wanted and self.follows):
            return
        if not self.plan.server_is_ready():
            if not self.asked:
                self.send_straight()
        elif not self.planning:
            self.planning = True
            pose = self.pose(self.wanted["x"], self.wanted["y"], self.wanted["yaw"])
            self.plan.send_goal_async(ComputePathToPose.Goal(goal=pose)).add_done_callback(
                self.planned
            )

    def planned(self, future: Any) -> None:
        """Wait for a path that is being planned."""
        handle = future.result()
        if not handle.accepted:
            self.planning = False
            say(refused="compute_path_to_pose")
            return
        handle.get_result_async().add_done_callback(self.found)

    def found(self, future: Any) -> None:
        """Send the path that was planned."""
        self.planning = False
        path = future.result().result.path
        if self.wanted and len(path.poses) > 1:
            self.send(FollowPath.Goal(path=path))

    def send_straight(self) -> None:
        path = Path()
        path.header.frame_id = "map"
        path.header.stamp = self.get_clock().now().to_msg()
        path.poses = [self.pose(x, y, self.wanted["yaw"]) for x, y in self.wanted["path"]]
        self.send(FollowPath.Goal(path=path))

    def send(self, goal: Any) -> None:
        """Send a goal; it takes the place of the one before."""
        self.asked = True
        self.drive.send_goal_async(goal).add_done_callback(self.sent)

    def sent(self, future: Any) -> None:
        """Keep the handle of a goal."""
        handle = future.result()
        if not handle.accepted:
            self.asked = False
            say(refused=self.drive._action_name)
            return
        self.sent_goal = handle
        handle.get_result_async().add_done_callback(lambda _: self.ended(handle))

    def ended(self, handle: Any) -> None:
        """Note that a goal has ended, unless another took its place."""
        if handle is self.sent_goal:
            self.sent_goal, self.asked = None, False

    def stop(self) -> None:
        """Cancel the goal."""
        self.wanted = {}
        if self.sent_goal is not None:
            self.sent_goal.cancel_goal_async()

    def pose(self, x: float, y: float, yaw: float) -> PoseStamped:
        """Return a pose in the map."""
        made = PoseStamped()
        made.header.frame_id = "map"
        made.header.stamp = self.get_clock().now().to_msg()
        made.pose.position.x, made.pose.position.y = float(x), float(y)
        made.pose.orientation.z, made.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        return made


def say(**line: Any) -> None:
    """Tell the seat something."""
    print(json.dumps(line), flush=True)


def main() -> None:
    """Serve until the input ends."""
    rclpy.init()
    client = Client(sys.argv[1])
    lines: queue.Queue[str | None] = queue.Queue()

    def read() -> None:
        for line in sys.stdin:
            lines.put(line)
        lines.put(None)

    threading.Thread(target=read, daemon=True).start()
    said: str | None = None
    waits = False
    while True:
        rclpy.spin_once(client, timeout_sec=0.02)
        while not lines.empty():
            line = lines.get()
            if line is None:
                client.stop()
                rclpy.spin_once(client, timeout_sec=0.1)
                return
            asked = json.loads(line)
            if asked["do"] == "begin":
                client.begin()
                said, waits = None, True
            elif asked["do"] == "go":
                client.go(asked)
            else:
                client.stop()
        if waits:
            missing = client.missing()
            if missing != said:
                say(missing=missing)
                said = missing
            waits = bool(missing)


if __name__ == "__main__":
    main()
