"""Command ``python -m benchmarks.bridge.soak``: the bridge over a long time; memory must be flat.

``peers VENDOR [COMINGS]`` lets publishers of ``own`` (Cyclone DDS) or ``ros`` (rclpy, Fast DDS)
come and go in another process; once a publisher is heard, nothing that it sends may be lost.
``day [HOURS]`` passes the messages of so many hours through
:class:`~nav_adapter.ros2.AwarenessBridge`, as fast as they are processed, while sensors come and go
and the clock is set back.
"""

from __future__ import annotations

import math
import os
import random
import select
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import AwarenessBridge, DdsNode, RobotFile, Topic, scanner_inputs
from nav_adapter.ros2.conversions import header, ros_class, to_ros
from nav_adapter.ros2.messages.builtin_interfaces import Time
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import LaserScan
from nav_adapter.ros2.messages.std_msgs import Header

ROBOT = Path(__file__).resolve().parents[2] / "docs" / "nav2" / "robot.yaml"
TOPICS = [Topic(f"odom_{number}", Odometry, reliable=False, depth=50) for number in range(10)]
# Messages of one publisher once it is heard, and times between them and before it leaves.
EACH, PAUSE_S, LEAVE_S = 5, 0.01, 0.05
#: Growth of memory that is not flat, MiB.
FLAT_MIB = 8.0


def memory_mib() -> float:
    """Return the memory that the process holds."""
    pages = Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]
    return int(pages) * os.sysconf("SC_PAGE_SIZE") / 2**20


def publish(vendor: str, comings: int) -> None:
    """Come and go, ten publishers at once; one byte of input says that all of them are heard."""
    advertise = _ros_publishers() if vendor == "ros" else _own_publishers()

    def message(coming: int, number: int) -> Odometry:
        # The sequence of a publisher is its stamp.
        return Odometry(Header(Time(coming, number), "odom"), "base_link")

    for coming in range(comings // len(TOPICS)):
        send, leave = advertise()
        while not select.select([sys.stdin], [], [], PAUSE_S)[0]:
            send(message(coming, 0))
        os.read(sys.stdin.fileno(), 1)
        for number in range(1, EACH + 1):
            send(message(coming, number))
            time.sleep(PAUSE_S)
        # What is still on its way when a publisher leaves is lost with it.
        time.sleep(LEAVE_S)
        leave()
    os._exit(0)


Advertise = Callable[[], tuple[Callable[[Odometry], None], Callable[[], None]]]


def _own_publishers() -> Advertise:
    def advertise() -> tuple[Callable[[Odometry], None], Callable[[], None]]:
        node = DdsNode(int(os.environ["ROS_DOMAIN_ID"]))
        for topic in TOPICS:
            node.advertise(topic)
        return lambda message: [node.publish(topic, message) for topic in TOPICS], node.close

    return advertise


def _ros_publishers() -> Advertise:
    import rclpy  # noqa: PLC0415 - needs ROS

    rclpy.init()
    node = rclpy.create_node("soak")

    def advertise() -> tuple[Callable[[Odometry], None], Callable[[], None]]:
        kind = ros_class(Odometry)
        made = [node.create_publisher(kind, topic.name, topic.depth) for topic in TOPICS]

        def send(message: Odometry) -> None:
            for publisher in made:
                publisher.publish(to_ros(message))

        def leave() -> None:
            for publisher in made:
                node.destroy_publisher(publisher)

        return send, leave

    return advertise


def peers(vendor: str, comings: int) -> bool:
    """Read what the publishers send; return whether memory is flat and nothing is lost."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(random.SystemRandom().randint(1, 200)))
    node = DdsNode(int(os.environ["ROS_DOMAIN_ID"]))
    for topic in TOPICS:
        node.subscribe(topic)
    command = [sys.executable, "-m", "benchmarks.bridge.soak", "publish", vendor, str(comings)]
    heard: dict[str, list[int]] = defaultdict(list)
    present, messages, lost, early_mib = 0, 0, 0, 0.0

    def losses() -> int:
        """Return how many publishers have not been heard to the end, once known."""
        ends = [[n for n in heard[topic.name] if n] for topic in TOPICS]
        return sum(numbers != list(range(1, EACH + 1)) for numbers in ends)

    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        assert process.stdin is not None
        said = -1
        while node.wait(0.5) or process.poll() is None:
            for topic in TOPICS:
                for message in node.take(topic):
                    stamp = message.header.stamp
                    if stamp.sec > present:
                        lost += losses()
                        heard.clear()
                        present = stamp.sec
                        if present == comings // len(TOPICS) // 4:
                            early_mib = memory_mib()
                    heard[topic.name].append(stamp.nanosec)
                    messages += 1
            if len(heard) == len(TOPICS) and said < present:
                said = present
                os.write(process.stdin.fileno(), b"\n")
    lost += losses()
    growth_mib = memory_mib() - early_mib
    print(
        f"{vendor}: {len(TOPICS) * (present + 1)} publishers, {messages} messages, {lost} "
        f"publishers with a loss, memory {early_mib:.1f} + {growth_mib:.1f} MiB"
    )
    return not lost and growth_mib < FLAT_MIB


def day(hours: float, period_s: float = 0.4) -> bool:
    """Pass the messages of hours through a bridge; return whether memory is flat."""
    robot = RobotFile.from_yaml(ROBOT)
    names = ["scan_front", "scan_rear"]
    published: dict[str, int] = defaultdict(int)

    def count(key: str, message: object) -> None:
        published[key] += 1

    bridge = AwarenessBridge(
        AwarenessPolicy.preset("balanced"),
        robot.profile(),
        count,
        with_camera=False,
        scanners=scanner_inputs(names, robot),
        wanted={"speed_limit", "collision_polygons", "alerts"}.__contains__,
    )
    scans = [[_scan(number, name) for number in range(50)] for name in names]
    set_back_s, early_mib, driven = 0.0, 0.0, 0
    steps = round(3600.0 * hours / period_s)
    for step in range(steps):
        real_s = step * period_s
        if step and step % round(3600.0 / period_s) == 0:
            set_back_s += 10.0
            print(f"{real_s / 3600.0:.0f} h  {memory_mib():.1f} MiB", flush=True)
        if step == steps // 8:
            early_mib = memory_mib()
        now_s = 1e9 + real_s - set_back_s
        # Each of the sensors in turn leaves for 5 s of every 40 s.
        gone = int(real_s / 40.0) % 4 if real_s % 40.0 < 5.0 else None
        if gone != 2:
            bridge.on_odometry(Odometry(header(now_s, "odom"), "base_link"), now_s)
        for number, name in enumerate(names):
            if gone not in (number, 3):
                scan = replace(scans[number][step % 50], header=header(now_s, name))
                bridge.on_scan(number, scan, now_s)
        driven += bridge.tick(now_s).speed_limit_mps > 0.0
    growth_mib = memory_mib() - early_mib
    print(
        f"{hours:g} h: {steps} ticks, {published['speed_limit']} limits, {driven / steps:.0%} "
        f"driving, memory {early_mib:.1f} + {growth_mib:.1f} MiB, {bridge.counts}"
    )
    return growth_mib < FLAT_MIB and published["speed_limit"] == steps and 0 < driven < steps


def _scan(number: int, name: str) -> LaserScan:
    """Return one of fifty scans of a round hall with a person who comes and goes."""
    angles = np.radians(np.arange(-135.0, 135.5, 1.5))
    far = 4.0 + 2.0 * math.sin(number / 50.0 * math.tau)
    ranges = 9.0 + 0.01 * np.random.default_rng(number).normal(size=len(angles))
    for side in (-0.1, 0.1):
        ranges[np.abs(angles - side / far) < 0.06 / far] = far
    low, high, step = float(angles[0]), float(angles[-1]), math.radians(1.5)
    head = header(0.0, name)
    return LaserScan(head, low, high, step, 0.0, 0.0, 0.05, 20.0, tuple(ranges.tolist()))


def main(arguments: list[str]) -> int:
    """Run one of the soaks; return 0 if all is well, else 1."""
    match arguments:
        case ["publish", vendor, comings]:
            publish(vendor, int(comings))
        case ["peers", ("own" | "ros") as vendor, *more]:
            return 0 if peers(vendor, int(more[0]) if more else 10_000) else 1
        case ["day", *more]:
            return 0 if day(float(more[0]) if more else 24.0) else 1
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
