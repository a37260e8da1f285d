"""Times the bridge from outside, started as a user starts it."""

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

from ._drivers import RobotDrivers

ROBOT = Path(__file__).parents[2] / "docs" / "nav2" / "robot.yaml"
_LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/>'
    "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
    '<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
_TIMEOUT_S = 120.0
# Time between images that is long enough for each to be answered before the next is sent.
_REPLY_WAIT_S = 0.4


@dataclass(frozen=True, slots=True)
class BridgeFigures:
    """Measured figures of the bridge.

    Attributes:
        frames_per_s: images per second that the bridge processed.
        publications_per_s: publications per second meanwhile.
        latency_ms: median time from sending an image to the publication that counts on it, one
            image at a time. It includes the wait for that publication, up to 1 / rate.
        cpu_ms: processor time of the bridge per image, publications and waiting included.
        people: number of people that the bridge confirmed.
    """

    frames_per_s: float
    publications_per_s: float
    latency_ms: float
    cpu_ms: float
    people: int


def measure(
    folder: Path, seconds: float, rate_hz: float, cores: int, compressed: bool
) -> BridgeFigures:
    """Send an image again and again to a bridge that shares ``cores`` cores with the sender.

    Raises:
        SimError: the bridge ends, or confirms no person within two minutes.
    """
    os.environ["CYCLONEDDS_URI"] = _LOOPBACK
    domain = random.SystemRandom().randint(1, 200)
    if hasattr(os, "sched_setaffinity"):  # Linux; child processes inherit it
        os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:cores]))
    drivers = RobotDrivers(folder, domain, compressed)
    try:
        with _bridge(folder, domain, compressed) as process:
            people = _wait_for_people(drivers, process, rate_hz)
            # Images sent so far do not count.
            before = drivers.receive_until(time.monotonic() + _REPLY_WAIT_S)
            cpu_before_s, began_s = _cpu_s(process.pid), time.monotonic()
            received = before[-1:]
            due_s = began_s
            while due_s < began_s + seconds:
                drivers.send_image()
                due_s += 1.0 / rate_hz
                received += drivers.receive_until(due_s)
            frames = received[-1][1] - received[0][1]
            took_s = time.monotonic() - began_s
            cpu_s = _cpu_s(process.pid) - cpu_before_s
            return BridgeFigures(
                frames_per_s=frames / took_s,
                publications_per_s=(len(received) - 1) / took_s,
                latency_ms=1e3 * _median_latency_s(drivers),
                cpu_ms=1e3 * cpu_s / max(frames, 1),
                people=people,
            )
    finally:
        drivers.close()


@contextmanager
def _bridge(folder: Path, domain: int, compressed: bool) -> Iterator[subprocess.Popen[str]]:
    file = folder / "robot.yaml"
    # Without a camera mount, which comes over tf, as on most robots.
    RobotFile.from_yaml(ROBOT).model_copy(update={"camera": None}).to_yaml(file)
    arguments = ["--robot", str(file), "--domain", str(domain)]
    if compressed:
        arguments += ["--compressed", "--image", "camera/image_raw/compressed"]
    command = [sys.executable, "-m", "awarenav", "bridge", "--allow-simulator-networks", *arguments]
    with (folder / "bridge.log").open("w") as log:
        process = subprocess.Popen(command, stderr=log, text=True)
        try:
            yield process
        finally:
            process.terminate()
            process.wait(_TIMEOUT_S)


def _wait_for_people(drivers: RobotDrivers, process: subprocess.Popen[str], rate_hz: float) -> int:
    """Send until every person in the image is confirmed; return how many were confirmed."""
    end_s = time.monotonic() + _TIMEOUT_S
    best = 0
    while time.monotonic() < end_s:
        if process.poll() is not None:
            raise SimError(f"the bridge ended with status {process.returncode}")
        drivers.send_calibration()
        drivers.send_image()
        drivers.node.wait(1.0 / rate_hz)
        for cdr in drivers.node.take_cdr(PUBLISHED["people"]):
            seen = decode(People, cdr).people
            best = max(best, sum(each.reliability == 1.0 for each in seen))
        if best >= max(1, drivers.people):
            return best
    if best:
        return best
    raise SimError(f"the bridge confirmed nobody within {_TIMEOUT_S:g} s")


def _median_latency_s(drivers: RobotDrivers, images: int = 15) -> float:
    """Return the median time from an image to its first publication, one image at a time."""
    frames = drivers.receive_until(time.monotonic() + _REPLY_WAIT_S)[-1][1]
    waits_s = []
    for _ in range(images):
        # Images must not keep step with the publications.
        drivers.receive_until(time.monotonic() + random.uniform(0.0, 0.05))
        sent_s = time.monotonic()
        drivers.send_image()
        received = drivers.receive_until(sent_s + _REPLY_WAIT_S)
        waits_s += [came_s - sent_s for came_s, count in received if count > frames][:1]
        frames = received[-1][1] if received else frames
    if not waits_s:
        raise SimError(f"no image came back within {_REPLY_WAIT_S:g} s")
    return float(np.median(waits_s))


def _cpu_s(pid: int) -> float:
    """Return the processor time of a process so far, s; NaN where ``/proc`` is missing."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return float("nan")
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
