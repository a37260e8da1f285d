"""Findings of ``awarenav doctor`` about recordings with one thing wrong at a time."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from awarenav.cli import main
from nav_adapter import RobotState
from nav_adapter.ros2.conversions import odometry_of, to_time, yaw_quaternion
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image, LaserScan
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

pytest.importorskip("rosbags", reason="the extra 'rosbag' is not installed")
pytest.importorskip("cyclonedds", reason="the extra 'ros2' is not installed")

from recorded_messages import recorded
from rosbags.rosbag2 import StoragePlugin

START_S, PERIOD_S, COUNT = 1000.0, 0.05, 60
SPEED_MPS = 0.5
STEP_RAD = math.radians(1.0)
ANGLES_RAD = math.radians(-135.0) + STEP_RAD * np.arange(271)
OPTICAL = Quaternion(-0.5, 0.5, -0.5, 0.5)
K = (300.0, 0.0, 160.0, 0.0, 300.0, 120.0, 0.0, 0.0, 1.0)
P = (250.0, 0.0, 150.0, 0.0, 0.0, 255.0, 110.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def transform(parent: str, child: str, place: Vector3, turn: Quaternion, stamp_s: float = START_S):
    header = Header(to_time(stamp_s), parent)
    return TFMessage((TransformStamped(header, child, Transform(place, turn)),))


class Drive:
    """A recording of a robot that drives to the left at 0.5 m/s; its parts may be changed."""

    scanner_yaw_rad = 0.0
    tf_ahead_m = 0.0
    twist = Vector3(SPEED_MPS)
    heading_rad = 0.5 * math.pi
    image_topic = ""
    camera_turn = OPTICAL
    projection = P
    mounts_topic = "/tf_static"
    ranges: Callable[[np.ndarray], np.ndarray] = staticmethod(lambda ranges: ranges)

    def messages(self):
        yaw = yaw_quaternion(self.scanner_yaw_rad)
        yield self.mounts_topic, 0.0, transform("base_link", "laser", Vector3(0.3, 0.0, 0.2), yaw)
        mast = Vector3(0.2, 0.0, 1.4)
        yield self.mounts_topic, 0.0, transform("base_link", "cam_link", mast, self.camera_turn)
        rng = np.random.default_rng(0)
        for k in range(COUNT):
            time_s, stamp = PERIOD_S * k, to_time(START_S + PERIOD_S * k)
            ahead = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)])
            x, y = (SPEED_MPS * time_s * ahead).tolist()
            turn = yaw_quaternion(self.heading_rad)
            pose = PoseWithCovariance(Pose(Point(x, y), turn))
            twist = TwistWithCovariance(Twist(self.twist))
            yield "/odom", time_s, Odometry(Header(stamp, "odom"), "base_link", pose, twist)
            place = Vector3(*((SPEED_MPS * time_s + self.tf_ahead_m) * ahead).tolist())
            yield "/tf", time_s, transform("odom", "base_link", place, turn, START_S + time_s)
            ranges = self.ranges(4.0 + 0.01 * rng.normal(size=len(ANGLES_RAD)))
            scan = LaserScan(
                Header(stamp, "laser"), float(ANGLES_RAD[0]), float(ANGLES_RAD[-1]), STEP_RAD,
                0.0, PERIOD_S, 0.05, 20.0, tuple(ranges.tolist()),
            )  # fmt: skip
            yield "/scan", time_s, scan
            if self.image_topic and k < 2:
                header, noise = Header(stamp, "cam_link"), rng.bytes(240 * 960)
                yield self.image_topic, time_s, Image(header, 240, 320, "rgb8", 0, 960, noise)
                yield (
                    f"{self.image_topic.rpartition('/')[0]}/camera_info", time_s,
                    CameraInfo(
                        header, 240, 320, "plumb_bob", (-0.1, 0.0, 0.0, 0.0, 0.0), K,
                        p=self.projection,
                    ),
                )  # fmt: skip

    def record(self, path: Path) -> Path:
        found = ((topic, START_S + time_s, each) for topic, time_s, each in self.messages())
        return recorded(path, found, StoragePlugin.MCAP)


def findings(capsys, path: Path, *options: str) -> dict[str, list[tuple[str, str]]]:
    """Return severity and text of the findings, by subject."""
    main(["doctor", str(path), "--out", "none", "--json", *options])
    found: dict[str, list[tuple[str, str]]] = {}
    for each in json.loads(capsys.readouterr().out):
        found.setdefault(each["subject"], []).append((each["severity"], each["text"]))
    return found


@pytest.fixture
def drive() -> Drive:
    return Drive()


def test_a_good_recording_without_images_and_brakes(capsys, tmp_path, drive) -> None:
    found = findings(capsys, drive.record(tmp_path / "bag"))
    assert [severity for severity, _ in found["scanners"]] == ["fine"]
    assert [severity for severity, _ in found["odometry"]] == ["fine"]
    assert found["images"] == [("warning", "the recording has none")]
    assert "brakes" not in found


@pytest.mark.parametrize(
    ("nothing", "yaw_deg"), [(math.nan, 0), (0.0, 40), (-math.inf, 0), (65.535, 40)]
)
def test_a_blind_sector_is_named_in_the_frame_of_the_robot(
    capsys, tmp_path, drive, nothing, yaw_deg
) -> None:
    drive.scanner_yaw_rad = math.radians(yaw_deg)
    sector = np.abs(ANGLES_RAD) <= math.radians(45.0)
    drive.ranges = lambda ranges: np.where(sector, nothing, ranges)
    ((severity, text),) = findings(capsys, drive.record(tmp_path / "bag"))["scanners"]
    assert severity == "error"
    assert f"/scan: in {COUNT} of {COUNT} scans" in text
    sides_deg = [int(each) for each in re.findall(r"(-?\d+)°", text)[:2]]
    assert sides_deg == pytest.approx([yaw_deg - 45, yaw_deg + 45], abs=1)
    assert "in 'base_link'" in text


@pytest.mark.parametrize(
    ("ranges", "word"),
    [
        (lambda ranges: np.full_like(ranges, np.inf), "meet nothing"),
        (lambda ranges: np.full_like(ranges, 3.0), "frozen"),
        (lambda ranges: 1000.0 * ranges, "metres"),
    ],
    ids=["nothing", "frozen", "millimetres"],
)
def test_a_scanner_that_measures_nothing(capsys, tmp_path, drive, ranges, word) -> None:
    drive.ranges = ranges
    ((severity, text),) = findings(capsys, drive.record(tmp_path / "bag"))["scanners"]
    assert (severity, word in text) == ("error", True)


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"tf_ahead_m": 0.6}, ("odometry and tf contradict each other", "0.60 m")),
        # A twist in the odom frame: the robot heads along y of odom.
        ({"twist": Vector3(0.0, SPEED_MPS)}, ("poses and twists contradict", "in frame 'odom'")),
    ],
    ids=["tf", "twist"],
)
def test_odometry_that_contradicts_others(capsys, tmp_path, drive, change, parts) -> None:
    vars(drive).update(change)
    ((severity, text),) = findings(capsys, drive.record(tmp_path / "bag"))["odometry"]
    assert severity == "error"
    assert all(part in text for part in parts)
    assert "mm/s" not in text


@pytest.mark.parametrize(
    ("topic", "said"),
    [("/cam/image_rect", "P applies"), ("/cam/image_raw", "P is not used")],
)
def test_which_matrix_counts_is_said(capsys, tmp_path, drive, topic, said) -> None:
    drive.image_topic = topic
    found = findings(capsys, drive.record(tmp_path / "bag"), "--frames", "2")
    ((_, text),) = found["calibration"]
    assert said in text
    assert "images" not in found


def test_images_in_a_body_frame(capsys, tmp_path, drive) -> None:
    drive.image_topic, drive.camera_turn = "/cam/image_raw", Quaternion()
    found = findings(capsys, drive.record(tmp_path / "bag"), "--frames", "1")
    (text,) = [text for severity, text in found["images"] if severity == "error"]
    assert "'cam_link'" in text
    assert "'base_link'" in text
    assert "cam_optical_frame" in text


def test_images_that_cannot_be_used_hide_nothing_else(capsys, tmp_path, drive) -> None:
    drive.image_topic, drive.projection = "/cam/image_rect", (0.0,) * 12
    drive.ranges, drive.tf_ahead_m = np.zeros_like, 0.6
    found = findings(capsys, drive.record(tmp_path / "bag"), "--frames", "1")
    assert [severity for severity, _ in found["scanners"]] == ["error"]
    assert [severity for severity, _ in found["odometry"]] == ["error"]
    ((severity, text),) = found["images"]
    assert (severity, "projection matrix P" in text) == ("error", True)


class Braking(Drive):
    """A recording of a robot that drives on a curve at 1 m/s, coasts, and brakes."""

    def __init__(
        self, braking_mps2: float, curvature_radpm: float = 0.0, off_rad: float = 0.0
    ) -> None:
        self.braking_mps2, self.curvature_radpm = braking_mps2, curvature_radpm
        # It turns so far off its curve, and back if ``returns``.
        self.off_rad, self.returns = off_rad, False
        # Changes of the messages, and noise of the speed.
        self.change: Callable[[list[Odometry]], list[Odometry]] = list
        self.noise_mps = 0.005

    def messages(self):
        rng, speed_mps, heading_rad, place_m = np.random.default_rng(0), 1.0, 3.0, np.zeros(2)
        odometry = []
        for k in range(300):
            brakes = k >= 100 and speed_mps > 0.0
            off_rad = -self.off_rad if self.returns and speed_mps < 0.48 else self.off_rad
            rate_radps = self.curvature_radpm * speed_mps + brakes * off_rad * self.braking_mps2
            stamp_s, noise = START_S + 0.02 * k, rng.normal(size=2)
            state = RobotState(
                *(stamp_s, place_m, heading_rad, speed_mps + self.noise_mps * noise[0]),
                rate_radps + 0.005 * noise[1],
            )
            odometry.append(odometry_of(state))
            place = Vector3(*place_m.tolist())
            turn = yaw_quaternion(heading_rad)
            yield "/tf", 0.02 * k, transform("odom", "base_link", place, turn, stamp_s)
            speed_mps = max(speed_mps - 0.02 * (self.braking_mps2 if brakes else 0.02), 0.0)
            heading_rad += 0.02 * rate_radps
            way = 0.02 * speed_mps
            place_m = place_m + way * np.array([math.cos(heading_rad), math.sin(heading_rad)])
        for k, message in enumerate(self.change(odometry)):
            yield "/odom", 0.02 * k, message


def said_of_brakes(capsys, path: Path) -> tuple[float, float, float, str]:
    """Return weakest and hardest braking, the angle off the curve, and all of the text."""
    ((_, text),) = findings(capsys, path)["brakes"]
    values = re.findall(r"by ([\d.]+) to ([\d.]+) m/s².* ([\d.]+)°", text)[0]
    return *map(float, values), text


@pytest.mark.parametrize(("braking_mps2", "curvature_radpm"), [(0.4, -0.5), (1.5, 0.0)])
@pytest.mark.parametrize(("off_rad", "returns"), [(0.0, False), (0.5, False), (0.8, True)])
def test_how_the_robot_brakes(
    capsys, tmp_path, braking_mps2: float, curvature_radpm: float, off_rad: float, returns: bool
) -> None:
    """Coasting is no braking, a curve before it is no turn, and who turns back has turned."""
    drive = Braking(braking_mps2, curvature_radpm, off_rad)
    drive.returns = returns
    weakest, hardest, off_deg, text = said_of_brakes(capsys, drive.record(tmp_path / "bag"))
    assert "braked 1 time," in text
    assert weakest == hardest == pytest.approx(braking_mps2, abs=0.15)
    assert off_deg == pytest.approx(math.degrees(off_rad * (0.48 if returns else 0.96)), abs=5.0)
    assert ("brakes_on_curve: true held" in text) == (off_rad == 0.0)


def again_and_swapped(odometry: list[Odometry]) -> list[Odometry]:
    """Return messages of which some come twice, with another twist, and some late."""
    stopped = replace(odometry[-1], twist=TwistWithCovariance(Twist(Vector3(0.5))))
    return [odometry[1], odometry[0], *odometry[2:], odometry[-1], stopped, odometry[-3]]


def with_dropouts(odometry: list[Odometry]) -> list[Odometry]:
    """Return messages of which some say that the robot stands."""
    still = TwistWithCovariance(Twist(Vector3()))
    return [
        replace(each, twist=still) if 10 < k < 80 and k % 9 == 0 else each
        for k, each in enumerate(odometry)
    ]


@pytest.mark.parametrize(
    ("change", "noise_mps"),
    [(again_and_swapped, 0.005), (with_dropouts, 0.005), (list, 0.04)],
)
def test_brakes_of_poor_odometry(capsys, tmp_path, change, noise_mps: float) -> None:
    drive = Braking(0.8)
    drive.change, drive.noise_mps = change, noise_mps
    weakest, hardest, off_deg, text = said_of_brakes(capsys, drive.record(tmp_path / "bag"))
    assert "braked 1 time," in text
    assert weakest == hardest == pytest.approx(0.8, abs=0.15)
    assert off_deg <= 5.0
