"""A robot whose publishers leave, come back, change and contradict one another, and its bridge."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from paths import ROOT
from scan_scenes import scan_message

from nav_adapter.ros2 import PUBLISHED, READ, SLOWEST_MPS, DdsNode, RobotFile, ScannerMount, Topic
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.std_msgs import Header

PATIENCE_S, PERIOD_S = 40.0, 0.05
HEARD = ("speed_limit", "alerts")
ODOM, SCAN = READ["odom"], READ["scan"]


class Peer(Protocol):
    """The robot's side of the topics."""

    def send(self, name: str, topic: Topic, message: Message) -> None:
        """Send by the publisher of this name, which comes with its first message."""

    def leave(self, name: str) -> None:
        """End a publisher."""

    def hear(self, key: str) -> list[Message]:
        """Return what the bridge has published since the last call."""


class OwnPeer:
    """A peer with this project's DDS, each publisher in a participant of its own."""

    def __init__(self, domain: int) -> None:
        self._domain = domain
        self._publishers: dict[str, DdsNode] = {}
        self._reader = DdsNode(domain)
        for key in HEARD:
            self._reader.subscribe(PUBLISHED[key])

    def send(self, name: str, topic: Topic, message: Message) -> None:
        if name not in self._publishers:
            self._publishers[name] = DdsNode(self._domain)
            self._publishers[name].advertise(topic)
        self._publishers[name].publish(topic, message)

    def leave(self, name: str) -> None:
        self._publishers.pop(name).close()

    def hear(self, key: str) -> list[Message]:
        return self._reader.take(PUBLISHED[key])

    def close(self) -> None:
        for node in (*self._publishers.values(), self._reader):
            node.close()


def one_scanner(path: Path) -> Path:
    """Write the file of a robot with one scanner and return its path."""
    docs = RobotFile.from_yaml(ROOT / "docs" / "nav2" / "robot.yaml")
    mount = ScannerMount(position_base_m=[0.3, 0.0, 0.2])
    docs.model_copy(update={"scanners": [mount]}).to_yaml(path)
    return path


@contextmanager
def running(*command: str) -> Iterator[subprocess.Popen[str]]:
    """Run a program of Python that has to end well on an interrupt."""
    program = [sys.executable, "-m", *command]
    with subprocess.Popen(program, stderr=subprocess.PIPE, text=True, cwd=ROOT) as process:
        try:
            yield process
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert process.returncode == 0, said
    assert "Traceback" not in said


class Drive:
    """A robot that stands and sends odometry and scans, as told."""

    def __init__(self, peer: Peer, program: subprocess.Popen[str]) -> None:
        self.peer, self._program = peer, program
        self.late_s = {"odom": 0.0, "scan": 0.0}
        self.senders = {"odom": ODOM, "scan": SCAN}
        self.limit_mps, self.reason = 0.0, ""

    def until(self, condition: Callable[[], bool]) -> None:
        """Send until a condition holds; every change of a sensor has to show in time."""
        end = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < end, (self.limit_mps, self.reason)
            self.step()

    def step(self) -> None:
        """Send once from every sender and hear what came."""
        for name, topic in self.senders.items():
            stamp_s = time.time() - self.late_s.get(name, 0.0)
            message: Message = scan_message(stamp_s)
            if topic.message is Odometry:
                message = Odometry(Header(to_time(stamp_s), "odom"), "base_link")
            self.peer.send(name, topic, message)
        time.sleep(PERIOD_S)
        assert self._program.poll() is None
        for message in self.peer.hear("speed_limit"):
            self.limit_mps = message.speed_limit
        for message in self.peer.hear("alerts"):
            self.reason = message.status[0].message

    def without(self, name: str) -> Topic:
        """End a publisher and return its topic."""
        self.peer.leave(name)
        return self.senders.pop(name)

    def stands(self, reason: str) -> Callable[[], bool]:
        return lambda: self.limit_mps == SLOWEST_MPS and reason in self.reason

    def drives(self) -> bool:
        return self.limit_mps > SLOWEST_MPS


def live_through(peer: Peer, domain: int, robot_file: Path) -> None:
    """Run the bridge among publishers in every kind of trouble; it has to go on by itself."""
    arguments = ("--robot", str(robot_file), "--no-camera", "--scan", "scan")
    with running("awarenav", "bridge", "--domain", str(domain), *arguments) as program:
        drive = Drive(peer, program)
        drive.until(drive.drives)
        for name in ("odom", "scan"):
            topic = drive.without(name)
            drive.until(drive.stands("old"))
            # Back again, with another quality of service.
            drive.senders[name] = replace(topic, reliable=not topic.reliable)
            drive.until(drive.drives)
        # Both at once; the newcomer stays.
        drive.senders["odom again"] = replace(ODOM, depth=1)
        for _ in range(10):
            drive.step()
        drive.without("odom")
        drive.until(drive.drives)
        # Another clock: first behind, then ahead.
        for late_s in (100.0, -100.0):
            drive.without("odom again")
            drive.late_s["odom again"] = late_s
            drive.senders["odom again"] = ODOM
            drive.until(drive.stands(""))
            drive.late_s["odom again"] = 0.0
            drive.until(drive.drives)
        # Another type on the topic of the scans.
        drive.without("scan")
        drive.senders["odometry for scans"] = replace(ODOM, name=SCAN.name)
        drive.until(drive.stands("old"))
        drive.without("odometry for scans")
        drive.senders["scan"] = SCAN
        drive.until(drive.drives)
