"""Topics over DDS and MCAP recordings: other processes, other libraries, quality of service."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from local_dds import own_domain
from mcap.reader import make_reader
from ros2_scenes import DEFINITIONS, STAMP_S, everything, plain
from rosbags.highlevel import AnyReader

from nav_adapter import NavError
from nav_adapter.ros2 import PUBLISHED, READ, DdsNode, McapRecorder, Topic, decode, encode, renamed
from nav_adapter.ros2.messages import definition, ros_type
from nav_adapter.ros2.messages.nav2_msgs import SpeedLimit
from nav_adapter.ros2.messages.sensor_msgs import Image

RECEIVER = Path(__file__).with_name("ros2_receiver.py")
PATIENCE_S = 20.0


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    return own_domain(monkeypatch)


@pytest.fixture
def node(domain: int) -> Iterator[DdsNode]:
    made = DdsNode(domain)
    yield made
    made.close()


def until(condition, node: DdsNode | None = None) -> bool:
    end = time.monotonic() + PATIENCE_S
    while not condition() and time.monotonic() < end:
        if node is None:
            time.sleep(0.01)
        else:
            node.wait(0.01)
    return bool(condition())


def test_another_process_with_its_own_types_receives_every_topic(node: DdsNode) -> None:
    wanted = {topic.name: ros_type(topic.message) for topic in PUBLISHED.values()}
    for topic in PUBLISHED.values():
        node.advertise(topic)
    command = [sys.executable, str(RECEIVER), str(PATIENCE_S), json.dumps(wanted)]
    command += [json.dumps(DEFINITIONS)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            assert until(lambda: all(node.readers_of(topic) for topic in PUBLISHED.values()))
            sent: dict[str, list] = defaultdict(list)
            for key, message in everything():
                cdr = node.publish(PUBLISHED[key], message)
                # As decoded: some fields are rounded to single precision.
                sent[PUBLISHED[key].name].append(plain(decode(type(message), cdr)))
            received: dict[str, list] = defaultdict(list)
            for _ in range(sum(map(len, sent.values()))):
                line = json.loads(process.stdout.readline())
                received[line["topic"]].append(_unsigned(line["message"], line["topic"]))
        finally:
            process.kill()
    assert received == sent
    assert set(received) == set(wanted)


def _unsigned(message: dict, topic: str) -> dict:
    if topic.endswith("grid"):
        message["data"] = [each % 256 for each in message["data"]]
    return message


def test_a_late_subscriber_gets_the_grid_and_nothing_else(node: DdsNode, domain: int) -> None:
    for key, message in everything():
        node.advertise(PUBLISHED[key])
        node.publish(PUBLISHED[key], message)
    late = DdsNode(domain)
    try:
        for topic in PUBLISHED.values():
            late.subscribe(topic)
        assert until(lambda: late.wait(0.01))
        assert until(lambda: all(node.readers_of(topic) for topic in PUBLISHED.values()))
        (grid,) = late.take(PUBLISHED["grid"])
        assert grid == dict(everything())["grid"] or encode(grid) == encode(
            dict(everything())["grid"]
        )
        assert not any(late.take(t) for key, t in PUBLISHED.items() if key != "grid")
    finally:
        late.close()


def test_waiting_ends_with_a_message_or_after_the_timeout(node: DdsNode, domain: int) -> None:
    topic = PUBLISHED["speed_limit"]
    node.subscribe(topic)
    assert node.wait(0.0) is False
    node.advertise(topic)
    assert until(lambda: node.readers_of(topic))
    threading.Timer(0.05, lambda: node.publish(topic, SpeedLimit(speed_limit=0.5))).start()
    assert node.wait(PATIENCE_S) is True
    assert node.take(topic) == [SpeedLimit(speed_limit=0.5)]
    assert node.take(topic) == []


def test_a_topic_that_does_not_wake_is_read_all_the_same(node: DdsNode, domain: int) -> None:
    quiet, loud = PUBLISHED["speed_limit"], replace(PUBLISHED["speed_limit"], name="loud")
    node.subscribe(quiet, wakes=False)
    node.subscribe(loud)
    for topic in (quiet, loud):
        node.advertise(topic)
        assert until(lambda topic=topic: node.readers_of(topic))
    node.publish(quiet, SpeedLimit(speed_limit=0.5))
    assert node.wait(0.1) is False
    assert node.take(quiet) == [SpeedLimit(speed_limit=0.5)]
    node.publish(loud, SpeedLimit(speed_limit=0.4))
    assert node.wait(PATIENCE_S) is True


@pytest.mark.parametrize("number", [-1, 233])
def test_an_invalid_domain_is_refused(number: int) -> None:
    with pytest.raises(NavError, match="0 to 232"):
        DdsNode(number)


def test_a_topic_has_only_one_type(node: DdsNode) -> None:
    node.advertise(Topic("x", SpeedLimit))
    with pytest.raises(NavError, match="SpeedLimit here, not Image"):
        node.subscribe(Topic("x", Image))


@pytest.mark.parametrize("name", ["", "/", "a//b", "1odom", "a/2b", "odom!", "ødom", "a b"])
def test_names_that_ros_does_not_allow_are_refused(name: str) -> None:
    with pytest.raises(NavError, match="topic"):
        renamed(READ["odom"], name)


def test_a_leading_slash_is_removed_from_a_name() -> None:
    assert renamed(READ["odom"], "/robot_1/odom").name == "robot_1/odom"


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    with McapRecorder(path) as recorder:
        for tick in range(3):
            stamp_s = STAMP_S + 0.1 * tick
            for key, message in everything(stamp_s):
                recorder.write(PUBLISHED[key], encode(message), stamp_s)
    return path


def sent_messages() -> list[tuple[str, object]]:
    return [
        (f"/{PUBLISHED[key].name}", plain(decode(type(message), encode(message))))
        for tick in range(3)
        for key, message in everything(STAMP_S + 0.1 * tick)
    ]


def test_rosbags_reads_every_message_with_the_schemas_in_the_file(recording: Path) -> None:
    with AnyReader([recording]) as reader:
        read = [
            (connection.topic, plain(reader.deserialize(raw, connection.msgtype)))
            for connection, _, raw in reader.messages()
        ]
        offered = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}
        kinds = {each.topic: each.msgtype for each in reader.connections}
    assert sorted(read, key=str) == sorted(sent_messages(), key=str)
    assert offered["/awarenav/people_grid"].durability.name == "TRANSIENT_LOCAL"
    assert offered["/speed_limit"].durability.name == "VOLATILE"
    assert all(each.reliability.name == "RELIABLE" for each in offered.values())
    assert kinds == {f"/{t.name}": ros_type(t.message) for t in PUBLISHED.values()}


def test_the_mcap_library_reads_profile_schemas_and_index(recording: Path) -> None:
    with recording.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert reader.get_header().profile == "ros2"
        messages = list(reader.iter_messages())
    assert summary is not None
    assert summary.statistics.message_count == len(sent_messages()) == len(messages)
    for schema in summary.schemas.values():
        topic = next(t for t in PUBLISHED.values() if ros_type(t.message) == schema.name)
        assert schema.encoding == "ros2msg"
        assert schema.data.decode() == definition(topic.message)
    assert {each.message_encoding for each in summary.channels.values()} == {"cdr"}
    stamps = [message.log_time for _, _, message in messages]
    assert stamps == sorted(stamps)
    assert stamps[0] == round(STAMP_S * 1e9)


def test_a_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NavError, match="cannot write"):
        McapRecorder(tmp_path / "nowhere" / "run.mcap")
