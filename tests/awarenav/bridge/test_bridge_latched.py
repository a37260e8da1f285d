"""Publishers of maps and static transforms that send once, and whom nobody can hear later."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from awarenav.bridge import _loop
from awarenav.cli import main
from nav_adapter.ros2 import READ, DdsNode, renamed
from nav_adapter.ros2.messages.nav_msgs import MapMetaData, OccupancyGrid
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

TF_STATIC = renamed(READ["tf_static"], "robot1/tf_static")


@pytest.mark.parametrize("transient_local", [False, True])
def test_a_reader_knows_publishers_that_it_cannot_hear(domain: int, transient_local: bool) -> None:
    robot, reader = DdsNode(domain), DdsNode(domain)
    robot.advertise(replace(READ["map"], transient_local=transient_local))
    reader.subscribe(READ["map"])
    end = time.monotonic() + 3.0
    while time.monotonic() < end and not reader.has_unfit_publisher(READ["map"]):
        if transient_local and robot.readers_of(READ["map"]):
            break
        time.sleep(0.02)
    assert reader.has_unfit_publisher(READ["map"]) is not transient_local
    reader.close()
    robot.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("map_latched", "tf_latched", "texts"),
    [
        (False, True, ["the publisher of /map: its durability is volatile"]),
        (None, False, ["no map yet on /map after 1 s", "the publisher of /robot1/tf_static: its"]),
        (True, True, []),
    ],
    ids=["volatile map", "no map and volatile tf", "both as they should be"],
)
def test_a_bridge_says_why_a_latched_topic_is_silent(
    domain: int,
    robot_file: Path,
    map_latched: bool | None,
    tf_latched: bool,
    texts: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_loop, "_LATCHED_AFTER_S", 1.0)
    robot = DdsNode(domain)
    tf_static = replace(TF_STATIC, transient_local=tf_latched)
    robot.advertise(tf_static)
    robot.publish(tf_static, TFMessage())
    if map_latched is not None:
        sent = replace(READ["map"], transient_local=map_latched)
        robot.advertise(sent)
        info = MapMetaData(resolution=0.05, width=1, height=1)
        robot.publish(sent, OccupancyGrid(Header(frame_id="map"), info, b"\0"))
    given = ["--domain", str(domain), "--robot", str(robot_file), "--no-camera", "--scan", "scan"]
    given += ["--map", "map", "--tf", "/robot1/tf", "--seconds", "1.5"]
    assert main(["bridge", *given]) == 0
    robot.close()
    said = capsys.readouterr().err
    for text in texts:
        assert said.count(text) == 1
    assert said.count("durability") == len(texts)
