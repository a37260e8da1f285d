"""Recordings as the field sends them: names, missing files, and clocks that disagree."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
pytest.importorskip("mcap", reason="the extra ros2 is not installed")
pytest.importorskip("rosbags", reason="the extra rosbag is not installed")

import robot_recording
from recorded_messages import recorded
from robot_recording import MOUNTED, START_S
from rosbags import rosbag1
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from awarenav.cli import main
from nav_adapter.ros2.messages.geometry_msgs import Vector3
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

TICKS = 25
messages = partial(robot_recording.messages, ticks=TICKS)


@pytest.fixture
def replay(robot_file: Path, capsys: pytest.CaptureFixture[str]):
    """Return a function that replays a recording and returns exit status and messages."""

    def run(bag: Path, *more: str, scan: str = "scan") -> tuple[int, str]:
        given = ["bridge", "--robot", str(robot_file), "--no-camera", "--scan", scan]
        status = main([*given, "--bag", str(bag), *more])
        return status, capsys.readouterr().err

    return run


USED = f"{TICKS} scans, 0 scans refused"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("bags") / "bag", messages())


def test_a_folder_without_metadata_is_read_as_the_files_in_it(
    folder: Path, tmp_path: Path, replay
) -> None:
    lone = tmp_path / "lone"
    lone.mkdir()
    shutil.copy(folder / "bag.db3", lone)
    assert USED in replay(lone)[1]
    assert USED in replay(lone / "bag.db3")[1]
    (lone / "metadata.yaml").write_bytes(bytes(300))  # the robot was switched off
    assert USED in replay(lone)[1]
    shutil.copy(folder / "bag.db3", lone / "other.db3")
    status, said = replay(lone)
    assert status == 2
    assert "holds several recordings: give one of bag.db3, other.db3" in said


def test_the_files_of_a_split_recording_are_one(tmp_path: Path, replay) -> None:
    found, split = messages(), tmp_path / "split"
    split.mkdir()
    for number, part in enumerate((found[:20], found[20:])):
        made = recorded(tmp_path / f"part_{number}", part)
        shutil.copy(made / f"part_{number}.db3", split / f"drive_{number}.db3")
    assert USED in replay(split)[1]


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_a_compressed_file_beside_its_metadata_is_read(
    mode: CompressionMode, tmp_path: Path, replay
) -> None:
    bag = recorded(tmp_path / "bag", messages(), compression=mode)
    (file,) = (each for each in bag.iterdir() if each.name != "metadata.yaml")
    assert USED in replay(file)[1]
    (bag / "metadata.yaml").unlink()
    status, said = replay(file)
    assert status == 2
    assert "only with the metadata.yaml beside" in said


def test_recordings_that_cannot_be_read_say_why(tmp_path: Path, replay) -> None:
    bag = recorded(tmp_path / "bag", messages(), plugin=StoragePlugin.MCAP)
    whole = (bag / "bag.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "cut.bag").write_bytes(b"#ROSBAG V2.0\n")
    (tmp_path / "pictures").mkdir()
    for name, text in (
        ("cut.mcap", "its recorder was not ended: `mcap recover`"),
        ("cut.bag", "its recorder was not ended: try `rosbag reindex`"),
        ("pictures", "no metadata.yaml, and no .db3, .mcap or .bag"),
        ("none", "there is no such file or folder"),
    ):
        status, said = replay(tmp_path / name)
        assert status == 2
        assert f"cannot read the recording {tmp_path / name}" in said
        assert text in said


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"stamps_s": 12.0}, "/odom: the stamps are 988.0 s behind the times of recording"),
        ({"stamps_s": START_S - 3.0}, "/odom: the stamps are 3.0 s behind"),
        ({"stamps_s": START_S + 0.2}, "/odom: the stamps are 0.200 s ahead of the times"),
        ({"back_s": 5.0}, "/odom: the stamps go back by 5.0 s at 1000.5 s"),
    ],
    ids=["simulated time", "behind", "ahead", "back"],
)
def test_stamps_of_another_clock_are_named_once(change, text: str, tmp_path: Path, replay) -> None:
    status, said = replay(recorded(tmp_path / "bag", messages(**change)))
    assert status == 0
    assert said.count(text) == 1
    assert said.count(": the stamps ") == 1


def test_static_transforms_hold_from_the_start(tmp_path: Path, replay) -> None:
    """Also where the recorder found their topic last; the first of several is the one."""
    late = messages(static_s=START_S + 3.0)
    assert USED in replay(recorded(tmp_path / "late", late))[1]
    (moved,) = MOUNTED.transforms
    tilted = replace(moved.transform, translation=Vector3(0.0, 0.0, 9.0))
    again = TFMessage((replace(moved, transform=tilted),))
    two = [*messages(), ("/tf_static", START_S + 5.0, again)]
    out = []
    for name, found in (("one", messages()), ("two", two)):
        record = tmp_path / f"{name}.mcap"
        bag = recorded(tmp_path / name, found)
        replay(bag, "--seconds", "0.75", "--record", str(record))
        out.append(record.read_bytes())
    assert out[0] == out[1]


def test_transforms_may_have_a_topic_of_their_own(tmp_path: Path, replay) -> None:
    bag = recorded(tmp_path / "bag", messages("/robot1/"))
    asked = ("--odom", "robot1/odom")
    _, said = replay(bag, *asked, scan="robot1/scan")
    assert "the recording has no /tf; it has /robot1/tf_static: --tf robot1/tf" in said
    for given in ("/robot1/tf", "robot1/tf/", "robot1/tf_static"):
        assert USED in replay(bag, *asked, "--tf", given, scan="robot1/scan")[1]


def test_no_other_robots_transforms_are_advised(tmp_path: Path, replay) -> None:
    found = [*messages("/robot1/"), *messages("/robot2/"), *messages()[1:]]
    bag = recorded(tmp_path / "bag", sorted(found, key=lambda each: each[1]))
    both = "the recording has no /tf; it has /robot1/tf_static, /robot2/tf_static"
    assert f"{both}: --tf robot2/tf\n" in replay(bag, "--odom", "robot2/odom")[1]
    assert f"{both}\n" in replay(bag)[1]


def ros1_messages(prefix: str, store) -> Iterator[tuple[str, float, object]]:
    """Yield the messages of :func:`messages` as those of ROS 1."""
    kinds = store.types

    def header(stamp_s: float, frame: str):
        sec, nanosec = divmod(round(stamp_s * 1e9), 1_000_000_000)
        time = kinds["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        return kinds["std_msgs/msg/Header"](seq=0, stamp=time, frame_id=frame)

    vector, turn = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]
    move = kinds["geometry_msgs/msg/Transform"](vector(0.3, 0.0, 0.2), turn(0.0, 0.0, 0.0, 1.0))
    mounted = kinds["geometry_msgs/msg/TransformStamped"](
        header(START_S, "base_link"), "scanner", move
    )
    yield f"{prefix}tf_static", START_S, kinds["tf2_msgs/msg/TFMessage"]([mounted])
    place = kinds["geometry_msgs/msg/Pose"](
        kinds["geometry_msgs/msg/Point"](0.0, 0.0, 0.0), turn(0.0, 0.0, 0.0, 1.0)
    )
    still = kinds["geometry_msgs/msg/Twist"](vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0))
    zeros = np.zeros(36)
    for _, at_s, message in messages():
        if isinstance(message, Odometry):
            yield (
                f"{prefix}odom",
                at_s,
                kinds["nav_msgs/msg/Odometry"](
                    header(at_s, "odom"),
                    "base_link",
                    kinds["geometry_msgs/msg/PoseWithCovariance"](place, zeros),
                    kinds["geometry_msgs/msg/TwistWithCovariance"](still, zeros),
                ),
            )
        elif not isinstance(message, TFMessage):
            yield (
                f"{prefix}scan",
                at_s,
                kinds["sensor_msgs/msg/LaserScan"](
                    header(at_s - 0.01, "scanner"),
                    message.angle_min,
                    message.angle_max,
                    message.angle_increment,
                    0.0,
                    0.05,
                    0.05,
                    20.0,
                    np.array(message.ranges, np.float32),
                    np.zeros(0, np.float32),
                ),
            )


@pytest.mark.parametrize(("prefix", "slash"), [("", ""), ("", "/"), ("/", ""), ("robot1/", "/")])
def test_topics_of_ros_1_without_a_slash_are_the_same(
    prefix: str, slash: str, tmp_path: Path, replay
) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    text = "geometry_msgs/TransformStamped[] transforms"
    store.register(get_types_from_msg(text, "tf2_msgs/msg/TFMessage"))
    connections: dict[str, object] = {}
    with rosbag1.Writer(tmp_path / "drive.bag") as writer:
        for topic, at_s, message in ros1_messages(prefix, store):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            raw = store.serialize_ros1(message, kind)
            writer.write(connections[topic], round(1e9 * at_s), raw)
    name = f"{slash}{prefix.strip('/')}/".lstrip("/") if prefix.strip("/") else slash
    asked = ["--odom", f"{name}odom", "--tf", f"{name}tf"]
    assert USED in replay(tmp_path / "drive.bag", *asked, scan=f"{name}scan")[1]
