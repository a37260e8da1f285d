"""A bad file or place is told in one line, before networks are asked for."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from awarenav.cli import main

ROBOT = """
footprint_m: [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]
max_speed_mps: 1.5
max_acceleration_mps2: 1.0
max_deceleration_mps2: 1.0
reaction_time_s: 0.3
"""


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with files that are none, and no networks for photographs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "none"))
    image = np.random.default_rng(0).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    assert cv2.imwrite("good.png", image)
    Path("cut.png").write_bytes(Path("good.png").read_bytes()[:300])
    for name in ("empty.jpg", "empty.mcap", "old.jsonl"):
        Path(name).touch()
    Path("all").mkdir()
    for name in ("all/1.png", "all/2.png", "in_the_way"):
        Path(name).write_text("no picture", encoding="utf-8")
    Path("folder.jsonl").mkdir()
    Path("robot.yaml").write_text(ROBOT, encoding="utf-8")
    Path("loop.yaml").symlink_to("loop.yaml")
    Path("dead.jpg").symlink_to("nowhere.jpg")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("estimate empty.jpg", "empty.jpg is empty"),
        ("estimate cut.png", "cut.png is not an image that can be read"),
        ("estimate all", "all/1.png is not an image that can be read"),
        ("estimate dead.jpg", "no such file or folder: dead.jpg; SOURCE is"),
        ("estimate good.png --camera gone.yaml", "cannot read gone.yaml"),
        ("estimate good.png --depth gone", "there is none"),
        ("estimate good.png --out folder.jsonl", "folder.jsonl is a folder"),
        ("estimate good.png --out a.csv", "--out must end in .jsonl"),
        ("estimate good.png --out old.jsonl", "exists already"),
        ("estimate good.png --out in_the_way/a.jsonl", "cannot write to in_the_way"),
        ("estimate good.png --overlay in_the_way/a.png", "cannot write to in_the_way"),
        ("estimate good.png --networks gone.yaml", "cannot read gone.yaml"),
        ("bridge --robot loop.yaml", "cannot read loop.yaml: Too many levels of symbolic links"),
        ("bridge --robot robot.yaml --bag gone.mcap", "there is no such file or folder"),
        ("bridge --robot robot.yaml --bag empty.mcap", "'empty.mcap' seems to be empty"),
        ("bridge --robot robot.yaml --scan s --map good.png", "good.png is not valid YAML"),
        ("policy show loop.yaml", "cannot read loop.yaml: Too many levels of symbolic links"),
    ],
)
def test_a_bad_file_is_told_in_one_line_before_networks(line, message, capsys):
    if line.startswith("bridge"):
        for module in ("cyclonedds", "mcap", "rosbags"):
            pytest.importorskip(module, reason="the extra ros2 is not installed")
    before = {path: path.stat().st_mtime for path in Path().rglob("*.*") if path.is_file()}
    assert main(line.split()) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert message in said
    assert "models fetch" not in said
    assert said.count("did you mean") == 0
    assert {path: path.stat().st_mtime for path in Path().rglob("*.*") if path.is_file()} == before
