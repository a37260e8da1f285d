"""Scans in a thread of their own: they wait for no network, and keep their order."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from scan_scenes import scan_message
from test_ros2_bridge import INFO, START_S, Listener, image, odometry

from nav_adapter import NavError
from nav_adapter.ros2 import PerceptionThread, ScannerInput, ScannerMount, ScanThread
from nav_adapter.ros2.messages.nav_msgs import OccupancyGrid
from perception.laser import LegDetector

PATIENCE_S = 20.0
SCANNERS = tuple(
    ScannerInput(name, ScannerMount(position_base_m=[0.3, 0.0, 0.2])) for name in ("one", "two")
)
PERSON = (2.5, 1.2)


class Gate:
    """A pipeline that sees nobody and waits until it is let through."""

    def __init__(self) -> None:
        self.open, self.entered = threading.Event(), threading.Event()

    def process(self, image_rgb, stamp_s, *, floor=None):
        self.entered.set()
        assert self.open.wait(PATIENCE_S)
        return ()


class WaitingDetector(LegDetector):
    """A leg detector that waits for its gate, notes the order of the scans, and can fail."""

    def __init__(self) -> None:
        super().__init__()
        self.open, self.entered = threading.Event(), threading.Event()
        self.open.set()
        self.order: list[tuple[int, float]] = []
        self.problem: Exception | None = None

    def detect(self, points, scanner=0):
        self.entered.set()
        assert self.open.wait(PATIENCE_S)
        self.order.append((scanner, points.stamp_s))
        if self.problem is not None:
            raise self.problem
        return super().detect(points, scanner)


class Threaded(Listener):
    def __init__(self) -> None:
        self.gate, self.detector = Gate(), WaitingDetector()
        super().__init__(
            scanners=SCANNERS,
            make_pipeline=lambda camera: self.gate,
            make_detector=lambda: self.detector,
        )
        self.now_s = START_S
        self.images = PerceptionThread(self.bridge, lambda: self.now_s)
        self.scans = ScanThread(self.bridge, lambda: self.now_s)

    def at(self, now_s: float) -> None:
        self.now_s = now_s
        self.bridge.on_odometry(odometry(now_s, speed=0.0), now_s)

    def until(self, condition) -> None:
        waiting = threading.Event()
        for _ in range(int(PATIENCE_S / 0.005)):
            if condition():
                return
            waiting.wait(0.005)
        raise AssertionError("waited in vain")

    def count(self, name: str) -> int:
        return self.bridge.counts[name]

    def scan(self, stamp_s: float, number: int = 0) -> None:
        """Send a scan and wait until it is processed."""
        before = self.count("scans")
        self.scans.submit(number, lambda: scan_message(stamp_s, [PERSON]))
        self.until(lambda: self.count("scans") > before)


@contextmanager
def threaded() -> Iterator[Threaded]:
    nav = Threaded()
    try:
        nav.at(START_S)
        nav.images.calibrate(lambda: INFO)
        nav.until(lambda: nav.bridge.camera is not None)
        yield nav
    finally:
        nav.gate.open.set()
        nav.detector.open.set()
        assert nav.scans.close(PATIENCE_S)
        assert nav.images.close(PATIENCE_S)


def test_scans_go_on_while_a_network_takes_its_time_and_the_late_image_still_counts() -> None:
    with threaded() as nav:
        nav.images.submit(lambda: image(START_S))
        assert nav.gate.entered.wait(PATIENCE_S)
        for tick in range(15):
            nav.at(START_S + 0.04 * tick)
            nav.scan(nav.now_s)
        (track,) = nav.bridge.tracks
        assert track.status == "confirmed"
        assert np.linalg.norm(track.position_odom_m - PERSON) < 0.1
        # 0.56 s late: the scans since then are computed again.
        nav.gate.open.set()
        nav.until(lambda: nav.count("frames") == 1)
        assert nav.count("frames_refused_by_tracker") == 0
        (after,) = nav.bridge.tracks
        assert after.id == track.id
        assert after.stamp_s == track.stamp_s


def test_an_image_that_is_a_second_late_is_refused_and_the_camera_counts_as_lost() -> None:
    with threaded() as nav:
        nav.gate.open.set()
        nav.images.submit(lambda: image(START_S))
        nav.until(lambda: nav.count("frames") == 1)
        nav.gate.open.clear()
        nav.gate.entered.clear()
        nav.at(START_S + 0.04)
        nav.images.submit(lambda: image(START_S + 0.04))
        assert nav.gate.entered.wait(PATIENCE_S)
        for tick in range(2, 30):
            nav.at(START_S + 0.04 * tick)
            nav.scan(nav.now_s)
            nav.scan(nav.now_s, 1)
        nav.gate.open.set()
        nav.until(lambda: nav.count("frames_refused_by_tracker") == 1)
        assert nav.count("frames") == 1
        assert not nav.bridge.tick(nav.now_s).stale
        assert nav.heard["alerts"][-1].status[1].message == "lost: camera"
        assert "at most max_lag_s = 1 s late" in "".join(nav.warnings)


def test_publishing_does_not_wait_for_the_leg_detector() -> None:
    with threaded() as nav:
        nav.gate.open.set()
        nav.images.submit(lambda: image(START_S))
        nav.scan(START_S, 0)
        nav.scan(START_S, 1)
        nav.until(lambda: nav.count("frames") == 1)
        nav.detector.open.clear()
        nav.detector.entered.clear()
        nav.scans.submit(0, lambda: scan_message(START_S + 0.04))
        assert nav.detector.entered.wait(PATIENCE_S)
        for tick in range(1, 20):
            nav.at(START_S + 0.05 * tick)
            assert nav.bridge.tick(nav.now_s).stamp_s == nav.now_s


def test_scans_keep_their_order_and_the_oldest_are_dropped_and_counted() -> None:
    with threaded() as nav:
        nav.detector.open.clear()
        nav.scans.submit(0, lambda: scan_message(START_S))
        assert nav.detector.entered.wait(PATIENCE_S)
        nav.at(START_S + 0.5)
        sent = [(tick % 2, START_S + 0.04 * tick) for tick in range(1, 13)]
        for number, stamp_s in sent:
            nav.scans.submit(number, lambda stamp_s=stamp_s: scan_message(stamp_s))
        nav.detector.open.set()
        nav.until(lambda: nav.count("scans") == 9)
        assert nav.count("scans_dropped") == 4
        wanted = [(0, START_S), *sent[-8:]]
        assert [number for number, _ in nav.detector.order] == [number for number, _ in wanted]
        stamps_s = [stamp_s for _, stamp_s in nav.detector.order]
        assert stamps_s == pytest.approx([stamp_s for _, stamp_s in wanted])


def test_an_error_and_a_message_that_cannot_be_decoded_do_not_end_the_thread() -> None:
    def damaged():
        raise NavError("/scan: received bytes are not a scan")

    with threaded() as nav:
        nav.detector.problem = RuntimeError("out of memory")
        nav.scans.submit(0, lambda: scan_message(START_S))
        nav.until(lambda: nav.count("perception_failures") == 1)
        assert nav.warnings == ["perception failed: RuntimeError: out of memory"]
        nav.scans.submit(1, damaged)
        nav.until(lambda: nav.count("scans_refused") == 1)
        assert nav.warnings[-1] == (
            "two: scan refused and counted: /scan: received bytes are not a scan"
        )
        nav.scans.submit_map(OccupancyGrid)
        nav.until(lambda: nav.warnings[-1].startswith("map: a map must have"))
        nav.scans.submit_map(damaged)
        nav.until(lambda: nav.warnings[-1] == "/scan: received bytes are not a scan")
        nav.detector.problem = None
        nav.scan(START_S)


def test_the_clock_may_be_set_while_a_scan_is_processed() -> None:
    with threaded() as nav:
        nav.detector.open.clear()
        nav.scans.submit(0, lambda: scan_message(START_S, [PERSON]))
        assert nav.detector.entered.wait(PATIENCE_S)
        nav.bridge.tick(START_S)
        for tick in range(25):
            nav.at(START_S - 100.0 + 0.05 * tick)
            nav.bridge.tick(nav.now_s)
        assert nav.count("clock_restarts") == 1
        nav.detector.open.set()
        nav.scan(START_S - 98.8)
        # The scan of the old clock is not used.
        assert nav.count("scans") == 1
        (track,) = nav.bridge.tracks
        assert track.stamp_s == pytest.approx(START_S - 98.8)
