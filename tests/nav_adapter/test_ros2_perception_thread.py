"""Perception in a thread of its own: publishing goes on while it is slow, fails or hangs."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from test_ros2_bridge import INFO, START_S, Listener, image, odometry

from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import PerceptionThread

PATIENCE_S = 20.0
TIMING = AwarenessPolicy.preset("balanced").timing


class Network:
    """A pipeline that sees nobody, waits for its gate and fails when told to."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.open.set()
        self.entered = threading.Event()
        self.problem: Exception | None = None
        self.stamps_s: list[float] = []

    def process(self, image_rgb, stamp_s, *, floor=None):
        self.stamps_s.append(stamp_s)
        self.entered.set()
        assert self.open.wait(PATIENCE_S)
        if self.problem is not None:
            raise self.problem
        return ()


class Threaded(Listener):
    """A bridge with a thread for its perception, and a clock that is set by hand."""

    def __init__(self) -> None:
        self.network = Network()
        super().__init__(make_pipeline=lambda camera: self.network)
        self.now_s = START_S
        self.changed = threading.Condition()
        self.thread = PerceptionThread(self.bridge, lambda: self.now_s, on_frame=self._notify)

    def _notify(self) -> None:
        with self.changed:
            self.changed.notify_all()

    def until(self, condition: Callable[[], bool]) -> None:
        with self.changed:
            for _ in range(int(PATIENCE_S / 0.01)):
                if condition():
                    return
                self.changed.wait(0.01)
        raise AssertionError("waited in vain")

    def send(self, now_s: float) -> None:
        """Send odometry and an image."""
        self.now_s = now_s
        self.bridge.on_odometry(odometry(now_s), now_s)
        self.thread.submit(lambda: image(now_s))

    def tick(self, now_s: float):
        self.now_s = now_s
        self.bridge.on_odometry(odometry(now_s), now_s)
        return self.bridge.tick(now_s)

    def frames(self) -> int:
        return self.bridge.counts["frames"]


@contextmanager
def threaded() -> Iterator[Threaded]:
    nav = Threaded()
    try:
        nav.thread.calibrate(lambda: INFO)
        nav.send(START_S)
        nav.until(lambda: nav.frames() == 1)
        assert nav.tick(START_S).limited_by == "robot maximum"
        yield nav
    finally:
        nav.network.open.set()
        assert nav.thread.close(PATIENCE_S)


def test_publishing_goes_on_while_a_network_hangs_until_the_robot_stops() -> None:
    with threaded() as nav:
        nav.network.entered.clear()
        nav.network.open.clear()
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
        values = {pair.key: pair.value for pair in nav.heard["alerts"][-1].status[0].values}
        assert float(values["frame_age_s"]) == pytest.approx(2.0)
        nav.network.open.set()
        nav.until(lambda: nav.frames() == 2)
        nav.send(START_S + 2.05)
        nav.until(lambda: nav.frames() == 3)
        assert not nav.tick(START_S + 2.05).stale


def test_an_error_in_perception_is_seen_and_publishing_goes_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with threaded() as nav, caplog.at_level(logging.ERROR, logger="nav_adapter"):
        nav.network.problem = RuntimeError("out of memory")
        for tick in range(1, 40):
            nav.send(START_S + 0.05 * tick)
            nav.until(lambda want=tick: nav.bridge.counts["perception_failures"] == want)
            constraints = nav.tick(START_S + 0.05 * tick)
        assert nav.standing()
        assert "perception is" in constraints.limited_by
        # Once on the terminal and once with the traceback; the diagnostics have the count.
        assert nav.warnings == ["perception failed: RuntimeError: out of memory"]
        (record,) = caplog.records
        assert record.exc_info is not None
        assert record.exc_info[1] is nav.network.problem
        values = {pair.key: pair.value for pair in nav.heard["alerts"][-1].status[0].values}
        assert values["perception_failures"] == "39"
        nav.network.problem = None
        nav.send(START_S + 2.0)
        nav.until(lambda: nav.frames() == 2)
        assert not nav.tick(START_S + 2.0).stale


def test_of_the_waiting_images_only_the_newest_is_processed() -> None:
    with threaded() as nav:
        nav.network.entered.clear()
        nav.network.open.clear()
        nav.send(START_S + 0.1)
        assert nav.network.entered.wait(PATIENCE_S)
        for tick in range(2, 9):
            nav.send(START_S + 0.1 * tick)
        nav.network.open.set()
        nav.until(lambda: nav.frames() == 3)
        assert nav.network.stamps_s == pytest.approx([START_S, START_S + 0.1, START_S + 0.8])


def test_closing_waits_for_the_frame_in_hand_and_leaves_one_that_hangs() -> None:
    nav = Threaded()
    nav.thread.calibrate(lambda: INFO)
    nav.network.open.clear()
    nav.send(START_S)
    assert nav.network.entered.wait(PATIENCE_S)
    assert not nav.thread.close(timeout_s=0.05)
    # The stop does not wait for the network either.
    assert nav.bridge.stop(START_S, "the end").speed_limit_mps == 0.0
    assert nav.standing()
    nav.network.open.set()
    assert nav.thread.close(PATIENCE_S)
    nav.send(START_S + 0.1)
    assert nav.network.stamps_s == [START_S]


def test_the_clock_may_be_set_while_an_image_is_processed() -> None:
    with threaded() as nav:
        nav.network.entered.clear()
        nav.network.open.clear()
        nav.send(START_S + 0.05)
        assert nav.network.entered.wait(PATIENCE_S)
        for tick in range(25):
            nav.tick(START_S - 100.0 + 0.05 * tick)
        assert nav.bridge.counts["clock_restarts"] == 1
        # The image is of the old clock: it is not used.
        nav.network.open.set()
        nav.network.entered.clear()
        nav.send(START_S - 98.0)
        nav.until(lambda: nav.frames() == 2)
        assert nav.network.stamps_s[-2:] == [START_S + 0.05, START_S - 98.0]
        assert nav.bridge.frame is not None
        assert nav.bridge.frame.stamp_s == START_S - 98.0
        assert nav.tick(START_S - 98.0).limited_by == "robot maximum"


def test_an_error_of_the_adapter_stops_the_robot_and_publishing_goes_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
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
