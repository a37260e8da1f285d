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
from pathlib import Path
from typing import Any, Final

from .parameters import CONTROLLERS, FACES, parameters

#: Servers with their packages, in the order in which they are brought up.
SERVERS: Final = {
    "controller_server": "nav2_controller",
    "planner_server": "nav2_planner",
    "velocity_smoother": "nav2_velocity_smoother",
    "collision_monitor": "nav2_collision_monitor",
}
#: Those that plan; the others filter the commands.
BARE: Final = ("controller_server", "planner_server")
# As in nav2_bringup.
_REMAPPED: Final = ("controller_server", "velocity_smoother")
_REMAPPING: Final = ("-r", "cmd_vel:=cmd_vel_nav")
# No limit, in a message of Nav2's.
_NONE: Final = 0.0


Processes = dict[str, "subprocess.Popen[bytes]"]


def start(controller: str, face: str, log: Path, *, bare: bool) -> Processes:
    """Start the servers, and return their processes by name."""
    prefix = Path(os.environ.get("OVERLAY") or f"/opt/ros/{os.environ.get('ROS_DISTRO', 'jazzy')}")
    settings = log.with_suffix(".yaml")
    settings.write_text(json.dumps(parameters(controller, face)))  # JSON is YAML
    environment = dict(os.environ)
    if "OVERLAY" in os.environ:
        # ROS from wheels leaves the symbols of Python to the program.
        import sysconfig  # noqa: PLC0415

        library = Path(sysconfig.get_config_var("LIBDIR")) / sysconfig.get_config_var("INSTSONAME")
        found = next(iter(Path("/usr/lib").glob(f"*/{library.name}")), library)
        environment["LD_PRELOAD"] = str(found)
    output = log.open("wb")
    started = {}
    for name in BARE if bare else SERVERS:
        program = prefix / "lib" / SERVERS[name] / name
        words = [str(program), "--ros-args", "--params-file", str(settings)]
        words += () if bare or name not in _REMAPPED else _REMAPPING
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


def main() -> int:
    """Run until it is ended."""
    import rclpy  # noqa: PLC0415

    parser = argparse.ArgumentParser(prog="benchmarks.nav2.launch", description=__doc__)
    parser.add_argument("controller", choices=CONTROLLERS)
    parser.add_argument("--face", choices=FACES, default="limit")
    parser.add_argument(
        "--bare", action="store_true", help="no velocity smoother and no collision monitor"
    )
    parser.add_argument("--log", type=Path, default=Path(tempfile.gettempdir()) / "nav2.log")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    processes = start(options.controller, options.face, options.log, bare=options.bare)
    try:
        rclpy.init()
        node = rclpy.create_node("nav2_launch")
        if options.face == "mask":
            keep_lower(node)
        bring_up(node, processes)
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
