"""The rate of publishing does not depend on perception, seen from another process."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from rendered_image import odometry, stamped

from nav_adapter.ros2 import PUBLISHED, READ, SLOWEST_MPS, DdsNode, decode
from nav_adapter.ros2.conversions import to_seconds
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.sensor_msgs import Image

SLOW_BRIDGE = Path(__file__).with_name("slow_bridge.py")
PATIENCE_S = 30.0
# The period at which the robot sends odometry and images.
PERIOD_S = 0.02
# docs/nav2/nav2_params.yaml
SOURCE_TIMEOUT_S = 0.5


@contextmanager
def slow_bridge(domain: int, frames_per_s: float) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(SLOW_BRIDGE), str(domain), str(1.0 / frames_per_s)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def drive(node: DdsNode, seconds: float) -> Iterator[tuple[float, str, bytes]]:
    """Send images and odometry, and yield what comes: time, key and bytes."""
    end = time.monotonic() + seconds
    due = time.monotonic()
    while time.monotonic() < end:
        now = time.time()
        node.publish(READ["odom"], odometry(now))
        header = stamped(now, "camera")
        node.publish(READ["image"], Image(header, 48, 64, "rgb8", 0, 192, os.urandom(48 * 192)))
        due += PERIOD_S
        while (left := due - time.monotonic()) > 0.0:
            node.wait(left)
            for key, topic in PUBLISHED.items():
                for cdr in node.take_cdr(topic):
                    yield time.monotonic(), key, cdr


def stamp_of(key: str, cdr: bytes) -> float | None:
    """Return the stamp of a message; None for an empty list of markers."""
    message: Message = decode(PUBLISHED[key].message, cdr)
    if key == "markers":
        return to_seconds(message.markers[0].header.stamp) if message.markers else None
    return to_seconds(message.header.stamp)


def state(cdr: bytes) -> dict[str, str]:
    return {
        pair.key: pair.value for pair in decode(PUBLISHED["alerts"].message, cdr).status[0].values
    }


@pytest.mark.slow
@pytest.mark.parametrize("frames_per_s", [1.0, pytest.param(15.0, marks=pytest.mark.full)])
def test_all_topics_come_at_20_hz_however_slow_the_network_is(
    domain: int, frames_per_s: float
) -> None:
    node = DdsNode(domain)
    seconds = 2.5 if frames_per_s < 2.0 else 6.0
    heard: dict[str, list[tuple[float, bytes]]] = defaultdict(list)
    try:
        for key in ("image", "odom"):
            node.advertise(READ[key])
        for topic in PUBLISHED.values():
            node.subscribe(topic)
        with slow_bridge(domain, frames_per_s) as process:
            # A person in the messages, so that every topic has one.
            assert any(key == "circles" for _, key, _ in drive(node, PATIENCE_S))
            for came_s, key, cdr in drive(node, seconds):
                heard[key].append((came_s, cdr))
            process.terminate()
            _, said = process.communicate(timeout=PATIENCE_S)
            time.sleep(0.1)
            last = node.take(PUBLISHED["speed_limit"])[-1]
    finally:
        node.close()
    assert set(heard) == set(PUBLISHED)
    rates = {}
    for key, messages in heard.items():
        # Polygons and circles have one message per person, all with the stamp of the publication.
        stamps = {stamp_of(key, cdr): came_s for came_s, cdr in messages}
        times = sorted(stamps.values())
        rates[key] = (len(times) - 1) / (times[-1] - times[0])
        assert max(after - before for before, after in pairwise(times)) < SOURCE_TIMEOUT_S

    assert all(18.0 <= rate <= 22.0 for rate in rates.values()), rates
    # The network was as slow as it should be.
    (first_s, first), (last_s, latest) = heard["alerts"][0], heard["alerts"][-1]
    frames = int(state(latest)["frames"]) - int(state(first)["frames"])
    assert 0.5 * frames_per_s <= frames / (last_s - first_s) <= 1.2 * frames_per_s + 1.0 / seconds
    assert process.returncode == 0, said
    assert last.speed_limit == SLOWEST_MPS
