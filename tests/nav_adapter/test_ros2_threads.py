"""Perception in threads of its own: publishing goes on while it is slow, fails or hangs."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from bridge_scenes import (
    INFO,
    PATIENCE_S,
    PERSON,
    SCANNER_MOUNT,
    START_S,
    TIMING,
    Listener,
    Network,
    image,
    odometry,
)
from scan_scenes import scan_message

from nav_adapter import NavConstraints, NavError
from nav_adapter.ros2 import PerceptionThread, ScannerInput, ScanThread
from nav_adapter.ros2.messages.nav_msgs import OccupancyGrid
from perception.laser import LegDetector

SCANNERS = tuple(ScannerInput(name, SCANNER_MOUNT) for name in ("one", "two"))


class WaitingDetector(LegDetector):
    """A leg detector that waits for its gate, notes the order of the scans, and can fail."""

    def __init__(self) -> None:
        super().__init__()
        self.gate = Network()
        self.order: list[tuple[int, float]] = []

    def detect(self, points, scanner=0):
        self.order.append((scanner, points.stamp_s))
        self.gate.process(None, points.stamp_s)
        return super().detect(points, scanner)


class Threaded(Listener):
    """A bridge with threads for its perception, and a clock that is set by hand."""

    def __init__(self, *scanners: ScannerInput) -> None:
        self.network, self.detector = Network(), WaitingDetector()
        super().__init__(
            scanners=scanners,
            make_pipeline=lambda camera: self.network,
            make_detector=lambda: self.detector,
        )
        self.now_s = START_S
        self.changed = threading.Condition()
        self.images = PerceptionThread(self.bridge, lambda: self.now_s, on_frame=self._notify)
        self.scans = ScanThread(self.bridge, lambda: self.now_s)

    def _notify(self) -> None:
        with self.changed:
            self.changed.notify_all()

    def until(self, condition: Callable[[], bool]) -> None:
        with self.changed:
            for _ in range(int(PATIENCE_S / 0.005)):
                if condition():
                    return
                self.changed.wait(0.005)
        raise AssertionError("waited in vain")

    def count(self, name: str) -> int:
        return self.bridge.counts[name]

    def at(self, now_s: float) -> None:
        """Set the clock, and send the odometry of a robot that stands."""
        self.now_s = now_s
        self.bridge.on_odometry(odometry(now_s, speed=0.0), now_s)

    def send(self, now_s: float) -> None:
        """Send odometry and an image."""
        self.at(now_s)
        self.images.submit(lambda: image(now_s))

    def scan(self, stamp_s: float, number: int = 0) -> None:
        """Send a scan and wait until it is processed."""
        before = self.count("scans")
        self.scans.submit(number, lambda: scan_message(stamp_s, [PERSON]))
        self.until(lambda: self.count("scans") > before)

    def tick(self, now_s: float) -> NavConstraints:
        self.at(now_s)
        return self.bridge.tick(now_s)


@contextmanager
def threaded(*scanners: ScannerInput) -> Iterator[Threaded]:
    nav = Threaded(*scanners)
    try:
        nav.at(START_S)
        nav.images.calibrate(lambda: INFO)
        nav.until(lambda: nav.bridge.camera is not None)
        if not scanners:
            nav.send(START_S)
            nav.until(lambda: nav.count("frames") == 1)
            assert nav.tick(START_S).limited_by == "robot maximum"
        yield nav
    finally:
        nav.network.open.set()
        nav.detector.gate.open.set()
        assert nav.scans.close(PATIENCE_S)
        assert nav.images.close(PATIENCE_S)


def test_publishing_goes_on_while_a_network_hangs_until_the_robot_stops() -> None:
    with threaded() as nav:
        nav.network.close()
        nav.send(START_S + 0.05)
        assert nav.network.entered.wait(PATIENCE_S)
        before = len(nav.heard["speed_limit"])
        for tick in range(2, 41):
            now = START_S + 0.05 * tick
            constraints = nav.tick(now)
            assert constraints.stamp_s == now
            assert constraints.stale is (now - START_S > TIMING.stale_after_s + 1e-9)
            assert nav.standing() is (now - START_S > TIMING.stop_after_s + 1e-9)
        assert len(nav.heard["speed_limit"]) == before + 39
        assert "perception is" in constraints.limited_by
        assert float(nav.details()["frame_age_s"]) == pytest.approx(2.0)
        nav.network.open.set()
        nav.until(lambda: nav.count("frames") == 2)
        nav.send(START_S + 2.05)
        nav.until(lambda: nav.count("frames") == 3)
        assert not nav.tick(START_S + 2.05).stale


def test_an_error_in_perception_is_seen_and_publishing_goes_on(caplog) -> None:
    with threaded() as nav, caplog.at_level(logging.ERROR, logger="nav_adapter"):
        nav.network.problem = RuntimeError("out of memory")
        for tick in range(1, 40):
            nav.send(START_S + 0.05 * tick)
            nav.until(lambda want=tick: nav.count("perception_failures") == want)
            constraints = nav.tick(START_S + 0.05 * tick)
        assert nav.standing()
        assert "perception is" in constraints.limited_by
        # Once on the terminal and once with the traceback; the diagnostics have the count.
        assert nav.warnings == ["perception failed: RuntimeError: out of memory"]
        (record,) = caplog.records
        assert record.exc_info is not None
        assert record.exc_info[1] is nav.network.problem
        assert nav.details()["perception_failures"] == "39"
        nav.network.problem = None
        nav.send(START_S + 2.0)
        nav.until(lambda: nav.count("frames") == 2)
        assert not nav.tick(START_S + 2.0).stale


def test_of_the_waiting_images_only_the_newest_is_processed() -> None:
    with threaded() as nav:
        nav.network.close()
        nav.send(START_S + 0.1)
        assert nav.network.entered.wait(PATIENCE_S)
        for tick in range(2, 9):
            nav.send(START_S + 0.1 * tick)
        nav.network.open.set()
        nav.until(lambda: nav.count("frames") == 3)
        assert nav.network.stamps_s == pytest.approx([START_S, START_S + 0.1, START_S + 0.8])


def test_closing_waits_for_the_frame_in_hand_and_leaves_one_that_hangs() -> None:
    nav = Threaded()
    nav.images.calibrate(lambda: INFO)
    nav.network.open.clear()
    nav.send(START_S)
    assert nav.network.entered.wait(PATIENCE_S)
    assert not nav.images.close(timeout_s=0.05)
    # The stop does not wait for the network either.
    assert nav.bridge.stop(START_S, "the end").speed_limit_mps == 0.0
    assert nav.standing()
    nav.network.open.set()
    assert nav.images.close(PATIENCE_S)
    nav.send(START_S + 0.1)
    assert nav.network.stamps_s == [START_S]


def test_the_clock_may_be_set_while_an_image_is_processed() -> None:
    with threaded() as nav:
        nav.network.close()
        nav.send(START_S + 0.05)
        assert nav.network.entered.wait(PATIENCE_S)
        for tick in range(25):
            nav.tick(START_S - 100.0 + 0.05 * tick)
        assert nav.count("clock_restarts") == 1
        # The image is of the old clock: it is not used.
        nav.network.open.set()
        nav.network.entered.clear()
        nav.send(START_S - 98.0)
        nav.until(lambda: nav.count("frames") == 2)
        assert nav.network.stamps_s[-2:] == [START_S + 0.05, START_S - 98.0]
        assert nav.bridge.frame is not None
        assert nav.bridge.frame.stamp_s == START_S - 98.0
        assert nav.tick(START_S - 98.0).limited_by == "robot maximum"


def test_an_error_of_the_adapter_stops_the_robot_and_publishing_goes_on(monkeypatch, caplog):
    with threaded() as nav, caplog.at_level(logging.ERROR, logger="nav_adapter"):
        adapter = nav.bridge._adapter

        def broken(*_, **__):
            raise ArithmeticError("no intersection")

        monkeypatch.setattr(adapter, "update", broken)
        for tick in range(1, 4):
            constraints = nav.tick(START_S + 0.05 * tick)
            assert nav.standing()
            assert constraints.limited_by == (
                "the adapter failed: ArithmeticError: no intersection"
            )
        assert len(caplog.records) == 1
        monkeypatch.undo()
        assert nav.tick(START_S + 0.2).limited_by != constraints.limited_by


def test_scans_go_on_while_a_network_takes_its_time_and_the_late_image_still_counts() -> None:
    with threaded(*SCANNERS) as nav:
        nav.network.close()
        nav.images.submit(lambda: image(START_S))
        assert nav.network.entered.wait(PATIENCE_S)
        for tick in range(15):
            nav.at(START_S + 0.04 * tick)
            nav.scan(nav.now_s)
        (track,) = nav.bridge.tracks
        assert track.status == "confirmed"
        assert np.linalg.norm(track.position_odom_m - PERSON) < 0.1
        # 0.56 s late: the scans since then are computed again.
        nav.network.open.set()
        nav.until(lambda: nav.count("frames") == 1)
        assert nav.count("frames_refused_by_tracker") == 0
        (after,) = nav.bridge.tracks
        assert after.id == track.id
        assert after.stamp_s == track.stamp_s


def test_an_image_that_is_a_second_late_is_refused_and_the_camera_counts_as_lost() -> None:
    with threaded(*SCANNERS) as nav:
        nav.images.submit(lambda: image(START_S))
        nav.until(lambda: nav.count("frames") == 1)
        nav.network.close()
        nav.at(START_S + 0.04)
        nav.images.submit(lambda: image(START_S + 0.04))
        assert nav.network.entered.wait(PATIENCE_S)
        for tick in range(2, 30):
            nav.at(START_S + 0.04 * tick)
            nav.scan(nav.now_s)
            nav.scan(nav.now_s, 1)
        nav.network.open.set()
        nav.until(lambda: nav.count("frames_refused_by_tracker") == 1)
        assert nav.count("frames") == 1
        assert not nav.bridge.tick(nav.now_s).stale
        assert nav.heard["alerts"][-1].status[1].message == "lost: camera"
        assert "at most max_lag_s = 1 s late" in "".join(nav.warnings)


def test_publishing_does_not_wait_for_the_leg_detector() -> None:
    with threaded(*SCANNERS) as nav:
        nav.images.submit(lambda: image(START_S))
        nav.scan(START_S, 0)
        nav.scan(START_S, 1)
        nav.until(lambda: nav.count("frames") == 1)
        nav.detector.gate.close()
        nav.scans.submit(0, lambda: scan_message(START_S + 0.04))
        assert nav.detector.gate.entered.wait(PATIENCE_S)
        for tick in range(1, 20):
            nav.at(START_S + 0.05 * tick)
            assert nav.bridge.tick(nav.now_s).stamp_s == nav.now_s


def test_scans_keep_their_order_and_the_oldest_are_dropped_and_counted() -> None:
    with threaded(*SCANNERS) as nav:
        nav.detector.gate.close()
        nav.scans.submit(0, lambda: scan_message(START_S))
        assert nav.detector.gate.entered.wait(PATIENCE_S)
        nav.at(START_S + 0.5)
        sent = [(tick % 2, START_S + 0.04 * tick) for tick in range(1, 13)]
        for number, stamp_s in sent:
            nav.scans.submit(number, lambda stamp_s=stamp_s: scan_message(stamp_s))
        nav.detector.gate.open.set()
        nav.until(lambda: nav.count("scans") == 9)
        assert nav.count("scans_dropped") == 4
        wanted = [(0, START_S), *sent[-8:]]
        assert [number for number, _ in nav.detector.order] == [number for number, _ in wanted]
        stamps_s = [stamp_s for _, stamp_s in nav.detector.order]
        assert stamps_s == pytest.approx([stamp_s for _, stamp_s in wanted])


def test_an_error_and_a_message_that_cannot_be_decoded_do_not_end_the_thread() -> None:
    def damaged():
        raise NavError("/scan: received bytes are not a scan")

    with threaded(*SCANNERS) as nav:
        nav.detector.gate.problem = RuntimeError("out of memory")
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
        nav.detector.gate.problem = None
        nav.scan(START_S)


def test_the_clock_may_be_set_while_a_scan_is_processed() -> None:
    with threaded(*SCANNERS) as nav:
        nav.detector.gate.close()
        nav.scans.submit(0, lambda: scan_message(START_S, [PERSON]))
        assert nav.detector.gate.entered.wait(PATIENCE_S)
        nav.bridge.tick(START_S)
        for tick in range(25):
            nav.at(START_S - 100.0 + 0.05 * tick)
            nav.bridge.tick(nav.now_s)
        assert nav.count("clock_restarts") == 1
        nav.detector.gate.open.set()
        nav.scan(START_S - 98.8)
        # The scan of the old clock is not used.
        assert nav.count("scans") == 1
        (track,) = nav.bridge.tracks
        assert track.stamp_s == pytest.approx(START_S - 98.8)
