"""``awarenav bridge --bag``: the bridge on a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
pytest.importorskip("mcap", reason="the extra ros2 is not installed")
pytest.importorskip("rosbags", reason="the extra rosbag is not installed")

from paths import ROOT
from recorded_messages import recorded
from robot_recording import PERSON, START_S, messages
from rosbags.highlevel import AnyReader

from awarenav.cli import main
from nav_adapter.ros2 import RobotFile
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.geometry_msgs import Point32, Polygon, PolygonStamped
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo
from nav_adapter.ros2.messages.std_msgs import Header
from tracking.prediction import PredictionModel


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of one scanner for 3 s."""
    return recorded(tmp_path_factory.mktemp("scans") / "bag", messages())


@pytest.fixture
def scans(robot_file: Path) -> list[str]:
    """The command that reads it."""
    return ["bridge", "--robot", str(robot_file), "--scan", "scan", "--no-camera"]


def published(path: Path) -> list[tuple[float, str, object]]:
    with AnyReader([path]) as reader:
        return [
            (stamp_ns * 1e-9, connection.topic, reader.deserialize(raw, connection.msgtype))
            for connection, stamp_ns, raw in reader.messages()
        ]


def test_a_recording_gives_the_people_and_limits_of_its_time(
    bag: Path, scans: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outputs = []
    for name in ("one.mcap", "two.mcap"):
        out = tmp_path / name
        only = ["--only", "speed_limit", "--only", "people", "--record", str(out)]
        assert main([*scans, "--bag", str(bag), *only]) == 0
        outputs.append(out)
    said = capsys.readouterr().err
    assert "replayed 3.0 s: 0 frames, 75 scans, 0 scans refused" in said
    found = published(outputs[0])
    limits = [(at, each.speed_limit) for at, topic, each in found if topic == "/speed_limit"]
    stamps = [at for at, _ in limits]
    np.testing.assert_allclose(stamps, START_S + 0.05 * np.arange(60), atol=1e-6)
    assert limits[0][1] == 0.01
    assert 0.1 < limits[-1][1] < 1.4
    (person,) = [each for _, topic, each in found if topic == "/people"][-1].people
    assert np.hypot(person.position.x - PERSON[0], person.position.y - PERSON[1]) < 0.1
    # The same recording gives the same, byte for byte.
    assert outputs[0].read_bytes() == outputs[1].read_bytes()


def test_a_recorded_footprint_lowers_the_limit(scans: list[str], tmp_path: Path) -> None:
    """It comes after a second, in odom, as Nav2's local costmap publishes it."""
    corners = tuple(Point32(x, y, 0.0) for x in (-0.4, 1.2) for y in (-0.3, 0.3))
    loaded = PolygonStamped(Header(to_time(START_S + 1.0), "odom"), Polygon(corners))
    topic = "/local_costmap/published_footprint"
    bag = recorded(tmp_path / "bag", [*messages(), (topic, START_S + 1.05, loaded)])
    limits = []
    for more in ([], ["--footprint", topic]):
        out = tmp_path / f"{len(more)}.mcap"
        given = ["--bag", str(bag), "--only", "speed_limit", "--record", str(out), *more]
        assert main([*scans, *given]) == 0
        limits.append([each.speed_limit for *_, each in published(out)])
    assert limits[1][:20] == limits[0][:20]
    assert limits[1][-1] < limits[0][-1] - 0.1


def test_a_replay_has_the_speed_mask_at_its_rate(
    bag: Path, scans: list[str], robot_file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "mask.mcap"
    arguments = [*scans, "--bag", str(bag), "--record", str(out)]
    arguments += ["--topic", "speed_mask=robot_1/mask"]
    arguments += ["--only", "speed_limit", "--only", "speed_mask", "--only", "speed_mask_info"]
    sizes = ["--speed-mask-size", "6", "--speed-mask-resolution", "0.2"]
    assert main([*arguments, "--speed-mask", "4", *sizes]) == 0
    found = published(out)
    (info,) = [each for _, topic, each in found if topic == "/awarenav/speed_mask_info"]
    assert (info.filter_mask_topic, info.type) == ("/robot_1/mask", 1)
    masks = [(at, each) for at, topic, each in found if topic == "/robot_1/mask"]
    stamps = np.array([at for at, _ in masks])
    assert 8 <= len(stamps) <= 12
    np.testing.assert_allclose(np.diff(stamps), 0.25, atol=1e-6)
    values = np.asarray(masks[-1][1].data, np.int8).reshape(30, 30)
    x, y = (round((each + 3.0) / 0.2) for each in PERSON)
    assert values[y, x] == 1  # a stop where the person stands
    limit = [each.speed_limit for _, topic, each in found if topic == "/speed_limit"][-1]
    # The cell of the robot holds for every heading, and until the next mask.
    assert 1 < values[15, 15] <= 100.0 * limit / RobotFile.from_yaml(robot_file).max_speed_mps
    assert values[0, 0] == 0  # far from the person: no limit


def test_a_calibrated_prediction_leaves_the_limit(
    bag: Path, scans: list[str], tmp_path: Path
) -> None:
    arguments = [*scans, "--bag", str(bag), "--seconds", "1.5", "--only", "speed_limit"]
    limits = []
    for factor in (None, 2.0):
        out, more = tmp_path / f"{factor}.mcap", []
        if factor is not None:
            calibration = tmp_path / f"{factor}.yaml"
            PredictionModel(horizons_s=(1.0,), std_factors=(factor,)).to_yaml(calibration)
            more = ["--prediction", str(calibration)]
        assert main([*arguments, *more, "--record", str(out)]) == 0
        found = published(out)
        limits.append([each.speed_limit for _, topic, each in found if topic == "/speed_limit"])
    assert limits[0] == limits[1] != []


def test_what_a_map_file_holds_is_nobody(
    bag: Path, scans: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pixels = np.full((40, 60), 254, np.uint8)  # 6 x 4 m from the origin
    column, row = (round(each / 0.1) for each in PERSON)
    pixels[40 - row - 3 : 40 - row + 3, column - 3 : column + 3] = 0
    cv2.imwrite(str(tmp_path / "hall.pgm"), pixels)
    hall = tmp_path / "hall.yaml"
    hall.write_text(
        "image: hall.pgm\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    arguments = [*scans, "--bag", str(bag), "--only", "people", "--map", str(hall)]

    def people(*more: str) -> int:
        out = tmp_path / f"{len(more)}.mcap"
        assert main([*arguments, "--record", str(out), *more]) == 0
        return max(len(each.people) for _, topic, each in published(out) if topic == "/people")

    assert people("--map-frame", "odom") == 0
    assert "the map is used" in capsys.readouterr().err
    # Nothing in the recording tells where the frame of a localisation is.
    assert people() == 1
    assert "the map is not used: no transform between 'map'" in capsys.readouterr().err
    (tmp_path / "hall.pgm").unlink()
    assert main(arguments) == 2
    assert "cannot read the map's image" in capsys.readouterr().err


def test_a_recording_with_a_camera_is_replayed_as_far_as_is_asked(
    tmp_path: Path, robot_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = recorded(tmp_path / "bag", messages(camera=True))
    arguments = ["--robot", str(robot_file), "--bag", str(bag), "--seconds", "1"]
    assert main(["bridge", *arguments, "--scan", "scan"]) == 2
    assert "detector, pose and head networks have seen renders only" in capsys.readouterr().err
    arguments.append("--allow-simulator-networks")
    assert main(["bridge", *arguments, "--scan", "scan"]) == 0
    said = capsys.readouterr().err
    assert "trust no awareness" in said
    assert "replayed 1.0 s: 25 frames, 25 scans, 0 scans refused" in said


def test_depth_images_of_a_recording_are_read_and_a_bad_one_is_reported(
    tmp_path: Path, robot_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = recorded(tmp_path / "bag", messages(camera=True, depth=True))
    arguments = ["--robot", str(robot_file), "--bag", str(bag), "--seconds", "1"]
    arguments += ["--depth", "/camera/depth", "--allow-simulator-networks"]
    assert main(["bridge", *arguments]) == 0
    said = capsys.readouterr().err
    assert "replayed 1.0 s: 25 frames, 23 depth images, 1 depth images refused" in said
    assert said.count("depth image refused and counted: the encoding of a depth image") == 1


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--depth", "none"], "no topic /none of type sensor_msgs/msg/Image"),
        (["--no-camera", "--scan", "scan_2"], "no topic /scan_2 of type sensor_msgs/msg/LaserScan"),
        (["--scan", "odom", "--no-camera"], "no topic /odom of type sensor_msgs/msg/LaserScan"),
        (["--scan", "scan"], "no topic /camera/image_raw of type sensor_msgs/msg/Image"),
    ],
)
def test_a_topic_that_the_recording_lacks_is_refused(
    tmp_path: Path,
    robot_file: Path,
    arguments: list[str],
    text: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bag = recorded(tmp_path / "bag", messages(camera="--depth" in arguments))
    given = ["--robot", str(robot_file), "--bag", str(bag), "--allow-simulator-networks"]
    assert main(["bridge", *given, *arguments]) == 2
    said = capsys.readouterr().err
    assert text in said
    assert "; it has /" in said
    assert "/odom (nav_msgs/msg/Odometry)" in said


P = (50.0, 0.0, 32.0, 0.0, 0.0, 50.0, 24.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def fisheye(image_topic: str) -> Iterator[tuple[str, float, Message]]:
    """Yield the messages of a robot whose raw images are those of a fisheye."""
    for topic, now_s, message in messages(camera=True):
        sent: Message = message
        if isinstance(message, CameraInfo):
            sent = replace(message, distortion_model="equidistant", d=(0.1,) * 4, p=P)
        yield image_topic if topic == "/camera/image_raw" else topic, now_s, sent


@pytest.mark.parametrize("name", ["image_rect", "image_raw"])
def test_rectified_images_of_a_fisheye_are_used_and_raw_ones_refused(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = recorded(tmp_path / "bag", fisheye(f"/camera/{name}"))
    given = ["--robot", str(ROOT / "docs" / "nav2" / "robot.yaml"), "--bag", str(bag)]
    given += ["--image", f"/camera/{name}", "--seconds", "0.4", "--allow-simulator-networks"]
    assert main(["bridge", *given]) == 0
    said = capsys.readouterr().err
    assert f": {0 if name == 'image_raw' else 10} frames" in said
    assert ("use their topic (image_rect)" in said) == (name == "image_raw")
