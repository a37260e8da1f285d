"""Depth images of the bridge: decoded, paired by time, refused with a reason, and lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bridge_scenes import INFO, PATIENCE_S, START_S, Listener, image, odometry

from nav_adapter import NavError
from nav_adapter.ros2 import PerceptionThread, depth_of
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.sensor_msgs import Image
from nav_adapter.ros2.messages.std_msgs import Header
from perception import AwarenessPipeline, Camera, PersonDetection, PersonKeypoints


def depth_image(stamp_s: float, depth: np.ndarray | None = None, *, padding: int = 0) -> Image:
    """Return a depth image of 3 m with noise, another one for each stamp, or one of those given."""
    noise = np.random.default_rng(round(1e6 * stamp_s)).integers(0, 9, (48, 64), np.uint16)
    pixels = 2996 + noise if depth is None else depth
    encoding = "16UC1" if pixels.dtype.kind == "u" else "32FC1"
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(pixels), -1)
    rows = np.pad(rows, [(0, 0), (0, padding)])
    big = int(pixels.dtype.byteorder == ">")
    header = Header(to_time(stamp_s), "camera")
    return Image(header, *pixels.shape, encoding, big, rows.shape[1], rows.tobytes())


class OnePerson:
    """A detector and a pose estimator that see a box without a skeleton."""

    def detect(self, image_rgb):
        return (PersonDetection(np.array([24.0, 8.0, 40.0, 44.0]), 0.9),)

    def estimate(self, image_rgb, *given):
        if len(given) == 2:
            return (None,)
        return (PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), np.zeros(17), "coco"),)


def one_person(camera: Camera) -> AwarenessPipeline:
    one = OnePerson()
    return AwarenessPipeline(camera, detector=one, pose_estimator=one, head_pose_estimator=one)


class DepthListener(Listener):
    """A bridge that has been told about its depth images."""

    def __init__(self) -> None:
        super().__init__(make_pipeline=one_person, with_depth=True)
        self.bridge.on_camera_info(INFO)

    def picture(self, now_s: float) -> float:
        """Send odometry and a picture; return the depth at which its person is placed."""
        self.bridge.on_odometry(odometry(now_s), now_s)
        assert self.bridge.on_image(image(now_s), now_s)
        (seen,) = self.bridge.frame.observations
        return float(seen.position_camera_m[2])


@pytest.mark.parametrize("padding", [0, 6])
@pytest.mark.parametrize("kind", ["<u2", ">u2", "<f4", ">f4"])
def test_depth_is_read_as_it_was_sent(kind: str, padding: int) -> None:
    sent = np.arange(1, 13).reshape(3, 4).astype(kind)
    read = depth_of(depth_image(START_S, sent, padding=padding))
    assert read.dtype == (np.uint16 if kind[1] == "u" else np.float32)
    assert np.array_equal(read, sent)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"encoding": "mono8"}, "must be 16UC1 or 32FC1, got 'mono8'"),
        ({"data": b""}, "need 6144 bytes"),
        ({"step": 64}, "need"),
        ({"width": 0}, "at least one pixel"),
        ({"encoding": "32FC1"}, "need"),
    ],
)
def test_a_depth_image_that_cannot_be_read_is_refused(change, message) -> None:
    with pytest.raises(NavError, match=message):
        depth_of(replace(depth_image(START_S), **change))


@pytest.mark.parametrize("depth", [np.full((48, 64), 2400, np.uint16), np.full((48, 64), 2.4)])
def test_depth_places_people_in_either_unit(depth: np.ndarray) -> None:
    nav = DepthListener()
    sent = depth if depth.dtype == np.uint16 else depth.astype(np.float32)
    without_m = nav.picture(START_S)
    assert nav.bridge.on_depth(depth_image(START_S + 0.1, sent), START_S + 0.1)
    assert nav.picture(START_S + 0.1) == pytest.approx(2.52, abs=0.1)
    assert abs(without_m - 2.52) > 0.5
    assert nav.bridge.counts["depth_images"] == 1
    assert nav.warnings == []


def test_the_nearest_in_time_is_taken_and_none_beyond_50_ms() -> None:
    nav = DepthListener()
    for offset_s, metres in ((0.0, 3.0), (0.033, 2.6), (0.066, 2.2)):
        depth = np.full((48, 64), round(1000 * metres), np.uint16)
        nav.bridge.on_depth(depth_image(START_S + offset_s, depth), START_S + 0.1)
    placed = [nav.picture(START_S + at_s) for at_s in (0.001, 0.05, 0.11)]
    assert placed == pytest.approx([3.12, 2.32, 2.32], rel=0.05)
    before = nav.bridge.counts["depth_images"]
    nav.picture(START_S + 0.2)
    assert nav.bridge.counts["depth_images"] == before


@pytest.mark.parametrize(
    ("depth", "reason"),
    [
        (np.full((48, 32), 3000, np.uint16), "of the image's shape"),
        (np.full((48, 64), 3, np.uint16), "looks like another unit"),
        (np.full((48, 64), 3000.0, np.float32), "looks like millimetres"),
    ],
)
def test_a_bad_depth_image_costs_no_picture(depth: np.ndarray, reason: str) -> None:
    nav = DepthListener()
    for index in range(5):
        now = START_S + 0.05 * index
        nav.bridge.on_depth(depth_image(now, depth + depth.dtype.type(index)), now)
        nav.picture(now)
    assert nav.bridge.counts["frames"] == 5
    assert nav.bridge.counts["depth_images_refused"] == 5
    (said,) = nav.warnings  # once in ten seconds
    assert said.startswith("depth image refused and counted")
    assert reason in said


@pytest.mark.parametrize("buffers", [1, 2, 4])
def test_a_frozen_depth_stream_is_no_depth(buffers: int) -> None:
    nav, without = DepthListener(), DepthListener()
    for index in range(20):
        now = START_S + 0.1 * index
        frozen = depth_image(START_S + index % buffers).data
        used = nav.bridge.on_depth(replace(depth_image(now), data=frozen), now)
        placed_m, alone_m = nav.picture(now), without.picture(now)
        assert used is (index < buffers)
        assert (placed_m == alone_m) is not used
    assert "frozen" in nav.warnings[0]
    assert nav.bridge.counts["depth_images"] == buffers
    nav.bridge.tick(now)
    assert nav.heard["alerts"][-1].status[1].message == "lost: depth images"


def test_one_from_the_future_is_refused_and_counted() -> None:
    nav = DepthListener()
    assert not nav.bridge.on_depth(depth_image(START_S + 1.0), START_S)
    assert nav.bridge.counts["depth_images_from_future"] == 1
    assert "ahead of this computer's clock" in nav.warnings[0]


def test_the_robot_goes_on_without_depth_before_it_comes_and_after() -> None:
    nav = DepthListener()
    states = []
    for tick in range(90):
        now = START_S + 0.05 * tick
        if 20 <= tick < 40 or tick >= 70:
            nav.bridge.on_depth(depth_image(now), now)
        nav.picture(now)
        constraints = nav.bridge.tick(now)
        assert not constraints.stale
        status = nav.heard["alerts"][-1].status[1]
        states.append((status.level, status.message))
    assert (b"\0", "all sensors are at work") in [(bytes([level]), text) for level, text in states]
    assert any("lost: depth images" in text for _, text in states)
    assert states[-1][1] == "all sensors are at work"
    goes_on = ": camera goes on, and distances are less sure"
    lost, back, again, there = nav.warnings
    assert lost == f"depth images: none has come{goes_on}"
    assert "the nearest is 0." in again
    assert again.endswith(goes_on)
    assert back == there == "depth images are back"


@pytest.mark.parametrize(
    ("late_s", "held_s", "said"),
    [
        (0.06, 0.0, "the nearest is 0.060 s before it"),
        (0.7, 0.0, "the nearest is 0.700 s before it"),
        (0.0, 0.09, "the nearest is 0.100 s before it"),  # right, and later than its picture
    ],
)
def test_depth_of_another_time_is_left_out_and_the_cause_is_said(late_s, held_s, said) -> None:
    nav, times = DepthListener(), [START_S + 0.1 * index for index in range(20)]
    for index, now in enumerate(times):
        sent_s = now if held_s == 0.0 else times[index - 1] if index else None
        if sent_s is not None:
            nav.bridge.on_depth(depth_image(sent_s - late_s), now + 0.05)
        placed_m = nav.picture(now)
        assert not nav.bridge.tick(now).stale
    assert placed_m > 0.0
    assert nav.bridge.counts["depth_images"] == 0
    (warning,) = nav.warnings
    assert warning.startswith("depth images: none that has come is within 0.05 s of its picture")
    assert said in warning
    assert warning.endswith("camera goes on, and distances are less sure")


def test_without_the_option_depth_images_are_an_error() -> None:
    with pytest.raises(NavError, match="made without depth images"):
        Listener().bridge.on_depth(depth_image(START_S), START_S)


def test_the_thread_passes_depth_on_before_the_picture_of_its_time() -> None:
    nav = DepthListener()
    nav.bridge.on_odometry(odometry(START_S), START_S)
    thread = PerceptionThread(nav.bridge, lambda: START_S)

    def damaged() -> Image:
        raise NavError("cut off")

    with thread._changed:
        thread.submit(lambda: image(START_S))
        thread.submit_depth(damaged)
        thread.submit_depth(lambda: depth_image(START_S))
    for _ in range(round(PATIENCE_S / 0.01)):
        if nav.bridge.counts["frames"]:
            break
        thread._thread.join(0.01)
    assert thread.close(PATIENCE_S)
    assert nav.bridge.counts["depth_images"] == 1
    assert nav.bridge.counts["depth_images_refused"] == 1
