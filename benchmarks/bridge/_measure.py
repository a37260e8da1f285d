"""Starts the bridge as a user does, and times it from outside."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nav_adapter.ros2 import PUBLISHED, RobotFile, decode
from nav_adapter.ros2.messages.people_msgs import People
from sim_tests import SimError

from ._robot import Robot

ROBOT = Path(__file__).parents[2] / "docs" / "nav2" / "robot.yaml"
_LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/>'
    "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
    '<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
_PATIENCE_S = 120.0
# Long enough apart that each picture is done before the next.
_SLOW_S = 0.4


@dataclass(frozen=True, slots=True)
class BridgeFigures:
    """What was measured.

    Attributes:
        frames_per_s: pictures that came back as a speed limit, a second.
        latency_ms: median from sending a picture to hearing its speed limit, one at a time.
        cpu_ms: processor time of the bridge a picture, publications and waiting included.
        people: whom the bridge had confirmed.
    """

    frames_per_s: float
    latency_ms: float
    cpu_ms: float
    people: int


def measure(
    folder: Path, seconds: float, rate_hz: float, cores: int, compressed: bool
) -> BridgeFigures:
    """Send a picture again and again to a bridge that shares ``cores`` cores with the sender.

    Raises:
        SimError: the bridge ends, or confirms nobody within two minutes.
    """
    os.environ["CYCLONEDDS_URI"] = _LOOPBACK
    domain = random.SystemRandom().randint(1, 200)
    if hasattr(os, "sched_setaffinity"):  # Linux; what is started inherits it
        os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:cores]))
    robot = Robot(folder, domain, compressed)
    try:
        with _bridge(folder, domain, compressed) as process:
            people = _confirmed(robot, process, rate_hz)
            # What answers the pictures sent up to here does not count.
            robot.listen(time.monotonic() + _SLOW_S)
            cpu_before_s, began_s = _cpu_s(process.pid), time.monotonic()
            frames = 0
            due_s = began_s
            while due_s < began_s + seconds:
                robot.show()
                due_s += 1.0 / rate_hz
                frames += len(robot.listen(due_s))
            took_s = time.monotonic() - began_s
            cpu_s = _cpu_s(process.pid) - cpu_before_s
            return BridgeFigures(
                frames / took_s, 1e3 * _latency_s(robot), 1e3 * cpu_s / max(frames, 1), people
            )
    finally:
        robot.close()


@contextmanager
def _bridge(folder: Path, domain: int, compressed: bool) -> Iterator[subprocess.Popen[str]]:
    file = folder / "robot.yaml"
    # Without a mount: it comes over tf, as on most robots.
    RobotFile.from_yaml(ROBOT).model_copy(update={"camera": None}).to_yaml(file)
    # A timer of 1 Hz publishes nothing as long as pictures come: each speed limit is a picture's.
    arguments = ["--robot", str(file), "--domain", str(domain), "--rate", "1"]
    if compressed:
        arguments += ["--compressed", "--image", "camera/image_raw/compressed"]
    command = [sys.executable, "-m", "awarenav", "bridge", *arguments]
    with (folder / "bridge.log").open("w") as log:
        process = subprocess.Popen(command, stderr=log, text=True)
        try:
            yield process
        finally:
            process.terminate()
            process.wait(_PATIENCE_S)


def _confirmed(robot: Robot, process: subprocess.Popen[str], rate_hz: float) -> int:
    """Send until everybody in the picture is confirmed, and return how many that are."""
    end_s = time.monotonic() + _PATIENCE_S
    best = 0
    while time.monotonic() < end_s:
        if process.poll() is not None:
            raise SimError(f"the bridge has ended with status {process.returncode}")
        robot.say_where_the_camera_is()
        robot.show()
        robot.node.wait(1.0 / rate_hz)
        for cdr in robot.node.take_cdr(PUBLISHED["people"]):
            seen = decode(People, cdr).people
            best = max(best, sum(each.reliability == 1.0 for each in seen))
        if best >= max(1, robot.people):
            return best
    if best:
        return best
    raise SimError(f"the bridge has confirmed nobody within {_PATIENCE_S:g} s")


def _latency_s(robot: Robot, pictures: int = 15) -> float:
    robot.listen(time.monotonic() + _SLOW_S)
    waits_s = []
    for _ in range(pictures):
        sent_s = time.monotonic()
        robot.show()
        heard = robot.listen(sent_s + _SLOW_S)
        if heard:
            waits_s.append(heard[0] - sent_s)
    if not waits_s:
        raise SimError(f"no picture came back within {_SLOW_S:g} s")
    return float(np.median(waits_s))


def _cpu_s(pid: int) -> float:
    """Processor time of a process so far, s; NaN where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return float("nan")
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
