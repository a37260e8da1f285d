"""MCAP recordings, read by other libraries."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
pytest.importorskip("mcap", reason="the extra ros2 is not installed")

from mcap.reader import make_reader
from ros2_scenes import STAMP_S, everything, plain
from rosbags.highlevel import AnyReader

from nav_adapter import NavError
from nav_adapter.ros2 import PUBLISHED, McapRecorder, decode, encode
from nav_adapter.ros2.messages import definition, ros_type


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


def test_foxgloves_decoder_reads_it_too(recording: Path) -> None:
    factory = pytest.importorskip(
        "mcap_ros2.decoder", reason="mcap-ros2-support is not installed"
    ).DecoderFactory()
    with recording.open("rb") as stream:
        decoded = list(make_reader(stream, decoder_factories=[factory]).iter_decoded_messages())
    assert len(decoded) == len(sent_messages())
    limits = [m.speed_limit for _, channel, _, m in decoded if channel.topic == "/speed_limit"]
    assert limits == [dict(sent_messages())["/speed_limit"]["speed_limit"]] * 3


def test_a_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NavError, match="cannot write"):
        McapRecorder(tmp_path / "nowhere" / "run.mcap")
