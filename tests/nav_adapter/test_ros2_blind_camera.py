"""A camera that sends pictures without a view counts as a silent one."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from bridge_scenes import INFO, MOUNT, START_S, Robot, attentive, image, nobody, odometry
from nav_scenes import ROBOT

from nav_adapter import AwarenessPolicy, NavConstraints
from nav_adapter.ros2 import AwarenessBridge
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.sensor_msgs import CompressedImage
from nav_adapter.ros2.messages.std_msgs import Header

HEIGHT, WIDTH = 48, 64
PERIOD_S = Robot.period_s
BLACK = bytes(HEIGHT * WIDTH * 3)
GREY = bytes([118]) * len(BLACK)
FROZEN = image(0.0).data


def jpeg_of(data: bytes, stamp_s: float) -> CompressedImage:
    picture = np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 3)
    coded = cv2.imencode(".jpg", picture)[1].tobytes()
    return CompressedImage(Header(to_time(stamp_s), "camera"), "jpeg", coded)


class BlindedRobot(Robot):
    """A robot whose camera has a view until ``picture`` is set."""

    picture: bytes | None = None
    compressed = False

    def step(self, now_s: float):
        if self.picture is None:
            return super().step(now_s)
        self.silent.add("camera")
        sent = image(now_s, self.picture)
        if self.compressed:
            sent = jpeg_of(self.picture, now_s)
        self.bridge.on_odometry(self.odometry(now_s), now_s)
        self.used = self.bridge.on_image(sent, now_s)
        return super().step(now_s)


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize(
    ("picture", "reason"),
    [(BLACK, "black"), (GREY, "of one colour"), (FROZEN, "the same picture as before")],
)
def test_the_robot_stops_as_if_the_camera_were_silent(picture, reason, compressed) -> None:
    robot, silent = (BlindedRobot(make_pipeline=attentive) for _ in range(2))
    robot.compressed = compressed
    # Faster than a robot creeps that stood when its camera froze.
    robot.speed_mps = silent.speed_mps = 0.5
    assert robot.drive(START_S, 1.0)[-1].speed_limit_mps > 0.3
    # The first of the frozen pictures is a view.
    silent.drive(START_S, 1.0 + PERIOD_S * (picture is FROZEN))
    frames = silent.bridge.counts["frames"]
    robot.picture = picture
    silent.silent.add("camera")
    blind = robot.drive(START_S + 1.0, 2.0)
    unseen = silent.drive(START_S + 1.0 + PERIOD_S * (picture is FROZEN), 2.0)
    for one, other in zip(blind[picture is FROZEN :], unseen, strict=False):
        assert one.speed_limit_mps == pytest.approx(other.speed_limit_mps)
    assert blind[-1].speed_limit_mps == 0.0
    assert robot.warnings == [warning for warning in robot.warnings if reason in warning] != []
    assert robot.bridge.counts["frames"] == frames


@pytest.mark.parametrize(("picture", "reason"), [(BLACK, "black"), (GREY, "of one colour")])
def test_a_camera_that_has_shown_nothing_yet_is_not_one_that_has_sent_nothing(
    picture, reason
) -> None:
    robot = BlindedRobot(make_pipeline=attentive)
    robot.picture = picture
    assert (
        robot.drive(START_S, 0.5)[-1].limited_by
        == f"no usable camera frame yet: the picture is no view: it is {reason}"
    )
    robot.picture = None
    robot.silent.clear()
    assert "camera" not in robot.drive(START_S + 0.5, 0.5)[-1].limited_by


def test_the_camera_is_back_with_its_first_view() -> None:
    robot = BlindedRobot(make_pipeline=attentive)
    robot.drive(START_S, 1.0)
    robot.picture = BLACK
    robot.drive(START_S + 1.0, 1.5)
    robot.picture = None
    robot.silent.clear()
    assert robot.drive(START_S + 2.5, 2.0)[-1].speed_limit_mps > 0.3


def test_the_buffers_of_a_frozen_driver_in_turn_are_no_view() -> None:
    robot = BlindedRobot(make_pipeline=attentive)
    robot.speed_mps = 0.5
    robot.drive(START_S, 1.0)
    used = []
    for step in range(40):
        robot.picture = image(float(step % 3)).data
        limit = robot.step(START_S + 1.0 + step * PERIOD_S).speed_limit_mps
        used.append(robot.used)
    assert used == [True] * 3 + [False] * 37
    assert limit == 0.0


def test_people_in_a_picture_without_a_view_do_not_count() -> None:
    robot = BlindedRobot(make_pipeline=attentive)
    robot.picture = GREY
    assert robot.drive(START_S, 1.0)[-1].obstacles == ()
    assert robot.bridge.counts["frames"] == 0


def test_one_picture_that_is_sent_twice_costs_nothing() -> None:
    limits = []
    for twice in (False, True):
        robot = BlindedRobot(make_pipeline=attentive)
        robot.drive(START_S, 1.0)
        if twice:
            robot.picture = image(START_S + 1.0 - PERIOD_S).data
            robot.step(START_S + 1.0)
            assert not robot.used
            robot.picture = None
            robot.silent.clear()
        limits.append(robot.drive(START_S + 1.0 + PERIOD_S, 1.0)[-1].speed_limit_mps)
    assert limits[1] == pytest.approx(limits[0], abs=0.05)


class Simulated(Robot):
    """A robot that drives as its limit allows; its camera has no noise, and may be frozen."""

    x_m = speed_mps = 0.0
    frozen_from_m = np.inf

    def odometry(self, now_s: float):
        return odometry(now_s, x=self.x_m, speed=self.speed_mps)

    def step(self, now_s: float):
        self.silent.add("camera")
        self.bridge.on_odometry(self.odometry(now_s), now_s)
        shown = np.random.default_rng(round(1e4 * max(min(self.x_m, self.frozen_from_m), 0.0)))
        self.bridge.on_image(image(now_s, shown.bytes(len(BLACK))), now_s)
        constraints = super().step(now_s)
        dv = PERIOD_S
        self.speed_mps = max(min(self.speed_mps + dv, constraints.speed_limit_mps), 0.0)
        self.x_m += self.speed_mps * PERIOD_S
        return constraints


def stood(robot: Simulated, ticks: int) -> NavConstraints:
    """Return the last constraints of a robot to which nobody sends a command."""
    for tick in range(ticks):
        robot.speed_mps = robot.x_m = 0.0
        constraints = robot.step(START_S + PERIOD_S * tick)
    return constraints


def test_a_simulated_camera_without_noise_lets_a_standing_robot_start() -> None:
    robot = Simulated()
    constraints = stood(robot, 100)
    assert constraints.speed_limit_mps == 0.25
    assert constraints.limited_by.startswith("unseen")
    assert "may creep until it has moved" in robot.warnings[-1]
    assert len(robot.warnings) == 2
    limits = [each.speed_limit_mps for each in robot.drive(START_S + 100 * PERIOD_S, 4.0)]
    assert limits[-1] == 1.5
    assert robot.x_m > 2.0


@pytest.mark.parametrize("frozen_from_m", [0.0, 0.3, 1.0])
def test_a_frozen_camera_stops_a_robot_within_a_few_centimetres(frozen_from_m) -> None:
    robot = Simulated()
    robot.frozen_from_m = frozen_from_m
    stood(robot, 50)
    constraints = robot.drive(START_S + 50 * PERIOD_S, 6.0)
    assert constraints[-1].speed_limit_mps == 0.0
    # From a stand, the 5 cm that show it, and until the data are stale; else as for a silent one.
    assert robot.x_m - frozen_from_m < (0.5 if frozen_from_m == 0.0 else 2.5)


def test_a_look_in_a_picture_that_repeats_is_no_evidence() -> None:
    robot = Simulated(make_pipeline=attentive)
    assert 0.0 < stood(robot, 100).speed_limit_mps <= 0.25
    (track,) = robot.bridge.tracks
    assert track.awareness_lower < 0.05


def test_a_policy_without_creeping_has_no_such_start() -> None:
    policy = AwarenessPolicy.preset("balanced").model_copy(update={"without": ("unseen",)})
    robot = Simulated()
    robot.bridge = AwarenessBridge(
        policy, ROBOT, lambda key, message: None, T_base_camera=MOUNT, make_pipeline=nobody
    )
    robot.bridge.on_camera_info(INFO)
    assert stood(robot, 100).speed_limit_mps == 0.0
