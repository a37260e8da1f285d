"""``awarenav bridge`` on rectified topics: the name of the topic chooses the matrix."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
pytest.importorskip("mcap", reason="the extra ros2 is not installed")
pytest.importorskip("rosbags", reason="the extra rosbag is not installed")

from paths import ROOT
from test_bridge_bag import messages, recorded

from awarenav.cli import main
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo

P = (50.0, 0.0, 32.0, 0.0, 0.0, 50.0, 24.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def fisheye(image_topic: str) -> Iterator[tuple[str, float, Message]]:
    """Yield the messages of a robot whose raw images are those of a fisheye."""
    for topic, now_s, message in messages(camera=True):
        sent: Message = message
        if isinstance(message, CameraInfo):
            sent = replace(message, distortion_model="equidistant", d=(0.1,) * 4, p=P)
        yield image_topic if topic == "/camera/image_raw" else topic, now_s, sent


@pytest.mark.parametrize("name", ["image_rect", "image_rect_color", "image_raw"])
def test_rectified_images_of_a_fisheye_are_used_and_raw_ones_refused(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = recorded(tmp_path / "bag", fisheye(f"/camera/{name}"))
    given = ["--robot", str(ROOT / "docs" / "nav2" / "robot.yaml"), "--bag", str(bag)]
    given += ["--image", f"/camera/{name}", "--seconds", "0.4", "--allow-simulator-networks"]
    assert main(["bridge", *given]) == 0
    said = capsys.readouterr().err
    assert f": {0 if name == 'image_raw' else 12} frames" in said
    assert ("use their topic (image_rect)" in said) == (name == "image_raw")
