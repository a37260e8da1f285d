"""Starts a Nav2 for a crossing, brings it up, and ends with it; it runs in a ROS environment.

``python -m benchmarks.nav2.launch RPP --face limit``, from the root of the checkout. ``OVERLAY`` is
the folder with Nav2's programs; without it they are those of ``/opt/ros/$ROS_DISTRO``.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from .parameters import CONTROLLERS, FACES, parameters

#: Servers with their packages, in the order in which they are brought up.
SERVERS: Final = {
    "controller_server": "nav2_controller",
    "planner_server": "nav2_planner",
    "velocity_smoother": "nav2_velocity_smoother",
    "collision_monitor": "nav2_collision_monitor",
    "behavior_server": "nav2_behaviors",
}
#: Those that filter the commands of the others.
FILTERS: Final = ("velocity_smoother", "collision_monitor")
#: Those that only behaviours need.
BEHAVING: Final = ("behavior_server",)
# As in nav2_bringup.
_REMAPPED: Final = ("controller_server", "velocity_smoother", "behavior_server")
_REMAPPING: Final = ("-r", "cmd_vel:=cmd_vel_nav")
# No limit, in a message of Nav2's.
_NONE: Final = 0.0
#: Actions that a goal pose can start, and their types.
BEHAVIOURS: Final = {
    "spin": "Spin",
    "backup": "BackUp",
    "drive_on_heading": "DriveOnHeading",
    "follow_path": "FollowPath",
}
_TURN_RAD: Final = 3.1
_WAY_M: Final = 1.5
_ALLOWED_S: Final = 60


Processes = dict[str, "subprocess.Popen[bytes]"]


def start(settings: dict[str, Any], log: Path, *, without: Sequence[str]) -> Processes:
    """Start the servers with these parameters, and return their processes by name."""
    prefix = Path(os.environ.get("OVERLAY") or f"/opt/ros/{os.environ.get('ROS_DISTRO', 'jazzy')}")
    file = log.with_suffix(".yaml")
    file.write_text(json.dumps(settings))  # JSON is YAML
    environment = dict(os.environ)
    if "OVERLAY" in os.environ:
        # ROS from wheels leaves the symbols of Python to the program.
        import sysconfig  # noqa: PLC0415

        library = Path(sysconfig.get_config_var("LIBDIR")) / sysconfig.get_config_var("INSTSONAME")
        found = next(iter(Path("/usr/lib").glob(f"*/{library.name}")), library)
        environment["LD_PRELOAD"] = str(found)
    output = log.open("wb")
    started = {}
    for name in [each for each in SERVERS if each not in without]:
        program = prefix / "lib" / SERVERS[name] / name
        words = [str(program), "--ros-args", "--params-file", str(file)]
        words += _REMAPPING if name in _REMAPPED and FILTERS[0] not in without else ()
        started[name] = subprocess.Popen(
            words, env=environment, stdout=output, stderr=subprocess.STDOUT
        )
    return started


def bring_up(node: Any, processes: Processes) -> None:
    """Configure all servers; activate them once there is a robot.

    Costmaps wait for its transforms for a time by its clock, which begins far from 0.
    """
    import rclpy  # noqa: PLC0415
    from lifecycle_msgs.msg import Transition  # noqa: PLC0415
    from lifecycle_msgs.srv import ChangeState  # noqa: PLC0415
    from rosgraph_msgs.msg import Clock  # noqa: PLC0415

    ticks: list[Any] = []
    clock = node.create_subscription(Clock, "/clock", ticks.append, 1)
    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        while transition == Transition.TRANSITION_ACTIVATE and not ticks:
            rclpy.spin_once(node, timeout_sec=0.2)
            _refuse_dead(processes)
        for name in processes:
            client = node.create_client(ChangeState, f"/{name}/change_state")
            while not client.wait_for_service(timeout_sec=0.5):
                _refuse_dead(processes)
            future = client.call_async(ChangeState.Request(transition=Transition(id=transition)))
            while not future.done():
                rclpy.spin_once(node, timeout_sec=0.2)
                _refuse_dead(processes)
            if not future.result().success:
                raise SystemExit(f"{name} refuses transition {transition}; see its log")
    node.destroy_subscription(clock)


def _refuse_dead(processes: Processes) -> None:
    for name, process in processes.items():
        if process.poll() is not None:
            raise SystemExit(f"{name} has ended with status {process.returncode}; see its log")


def keep_lower(node: Any) -> None:
    """Publish the lower of the limits of the bridge and of the speed filter."""
    from nav2_msgs.msg import SpeedLimit  # noqa: PLC0415

    limits: dict[str, float] = {}
    out = node.create_publisher(SpeedLimit, "lower_speed_limit", 10)

    def take(topic: str, message: Any) -> None:
        value = message.speed_limit
        limits[topic] = value * 1.5 / 100.0 if message.percentage and value else value
        known = [each for each in limits.values() if each != _NONE]
        out.publish(SpeedLimit(speed_limit=min(known, default=_NONE)))

    for topic in ("speed_limit", "mask_speed_limit"):
        node.create_subscription(SpeedLimit, topic, lambda m, t=topic: take(t, m), 10)


def behave(node: Any, name: str, speed_mps: float) -> None:
    """Do one behaviour at the first goal pose, in place of a navigator, and print how it ended."""
    from geometry_msgs.msg import PoseStamped  # noqa: PLC0415
    from nav2_msgs import action  # noqa: PLC0415
    from rclpy.action import ActionClient  # noqa: PLC0415

    kind = getattr(action, BEHAVIOURS[name])
    client = ActionClient(node, kind, name)
    began: list[float] = []

    def begin(pose: Any) -> None:
        if began:
            return
        began.append(time.monotonic())
        goal = kind.Goal()
        if name == "follow_path":
            goal.path.header = pose.header
            for x_m in range(int(pose.pose.position.x) + 1):
                goal.path.poses.append(PoseStamped(header=pose.header))
                goal.path.poses[-1].pose.position.x = float(x_m)
        else:
            goal.time_allowance.sec = _ALLOWED_S
            if name == "spin":
                goal.target_yaw = _TURN_RAD
            else:
                goal.target.x, goal.speed = _WAY_M, speed_mps
        client.send_goal_async(goal).add_done_callback(
            lambda sent: sent.result().get_result_async().add_done_callback(end)
        )

    def end(future: Any) -> None:
        found, after_s = future.result(), time.monotonic() - began[0]
        said = {"status": found.status, "error": found.result.error_code, "after_s": after_s}
        print(json.dumps(said), flush=True)

    node.create_subscription(PoseStamped, "goal_pose", begin, 1)


def main() -> int:
    """Run until it is ended."""
    import rclpy  # noqa: PLC0415

    parser = argparse.ArgumentParser(prog="benchmarks.nav2.launch", description=__doc__)
    parser.add_argument("controller", choices=CONTROLLERS)
    parser.add_argument("--face", choices=FACES, default="limit")
    parser.add_argument(
        "--bare", action="store_true", help="no velocity smoother and no collision monitor"
    )
    parser.add_argument(
        "--set",
        nargs="*",
        action="extend",
        default=[],
        metavar="SERVER.PARAMETER=VALUE",
        help="parameters that differ, such as behavior_server.max_rotational_vel=1.0",
    )
    parser.add_argument("--behaviour", choices=BEHAVIOURS, help="do it at the first goal_pose")
    parser.add_argument("--speed", type=float, default=0.25, help="of BackUp and DriveOnHeading")
    parser.add_argument("--log", type=Path, default=Path(tempfile.gettempdir()) / "nav2.log")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    settings = parameters(options.controller, options.face)
    for each in options.set:
        name, _, value = each.partition("=")
        *groups, last = name.split(".")
        values = settings
        for group in groups:
            values = values[group]
            values = values.get("ros__parameters", values)
        values[last] = json.loads(value)
    without = [*(FILTERS if options.bare else ()), *(() if options.behaviour else BEHAVING)]
    processes = start(settings, options.log, without=without)
    try:
        rclpy.init()
        node = rclpy.create_node("nav2_launch")
        if options.face == "mask":
            keep_lower(node)
        bring_up(node, processes)
        if options.behaviour:
            behave(node, options.behaviour, options.speed)
        print(f"{options.controller} with {options.face} is active", flush=True)
        while True:
            rclpy.spin_once(node, timeout_sec=0.2)
            _refuse_dead(processes)
    except KeyboardInterrupt:
        return 0
    finally:
        for each in processes.values():
            each.terminate()
        ends = time.monotonic() + 5.0
        for each in processes.values():
            try:
                each.wait(max(ends - time.monotonic(), 0.1))
            except subprocess.TimeoutExpired:
                each.kill()


if __name__ == "__main__":
    sys.exit(main())
