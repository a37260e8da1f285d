"""Frames that show nothing are marked, and reach no tracker."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numbered_images import CAMERA, NumberReader, numbered
from test_estimate import estimate

from awarenav.records import read_records
from awarenav.tracks._recording import read_recording
from awarenav.tracks._tracking import track_recording


def folder_of(path: Path, images: list[np.ndarray]) -> Path:
    path.mkdir()
    CAMERA.to_yaml(path / "camera.yaml")
    for number, image in enumerate(images):
        assert cv2.imwrite(str(path / f"{number:06d}.png"), image[..., ::-1])
    return path


def recorded(tmp_path: Path, name: str, images: list[np.ndarray]) -> list[dict]:
    out = tmp_path / f"{name}.jsonl"
    source = folder_of(tmp_path / name, images)
    assert estimate(NumberReader(), source, "--out", out, "--tracks") == 0
    return read_records(out)


BLACK, GREY = np.zeros_like(numbered(0)), np.full_like(numbered(0), 64)


@pytest.mark.parametrize(
    ("picture", "reason"),
    [(BLACK, "black"), (GREY, "of one colour"), (numbered(5), "the same picture as before")],
)
def test_a_frame_without_a_view_is_marked_and_changes_no_track(tmp_path, capsys, picture, reason):
    images = [numbered(number) for number in range(6)]
    seen = recorded(tmp_path, "seen", images)
    blind = recorded(tmp_path, "blind", [*images, picture])
    assert blind[:6] == seen
    assert [record.get("no_view") for record in blind] == [*[None] * 6, reason]
    (before,), (after,) = seen[-1]["tracks"], blind[-1]["tracks"]
    assert after["id"] == before["id"]
    assert after["time_since_seen_s"] == 1.0
    assert after["awareness_lower"] <= before["awareness_lower"]
    assert f"no view in 1 of 7 frames: {reason}" in capsys.readouterr().err


def test_tracks_of_the_file_leave_such_frames_out(tmp_path):
    images = [numbered(number) for number in (0, 1, 2, 2, 3, 3, 4)]
    recorded(tmp_path, "doubled", [BLACK, *images, GREY])
    recording = read_recording(tmp_path / "doubled.jsonl")
    names = [frame.name for frame in recording.frames]
    assert names == [f"{number:06d}.png" for number in (1, 2, 3, 5, 7)]
    assert any("4 frames left out whose picture shows nothing" in r for r in recording.remarks)
    (history,) = track_recording(recording).histories
    assert history.seen_frames == 5


def test_a_continued_file_has_the_same_marks(tmp_path):
    source = folder_of(tmp_path / "set", [numbered(number) for number in (0, 1, 1, 2, 2)])
    whole, parts = tmp_path / "whole.jsonl", tmp_path / "parts.jsonl"
    assert estimate(NumberReader(), source, "--out", whole) == 0
    assert estimate(NumberReader(), source, "--out", parts, "--frames", 2) == 0
    assert estimate(NumberReader(), source, "--out", parts, "--resume") == 0
    assert parts.read_bytes() == whole.read_bytes()
    assert [frame.get("no_view") is None for frame in read_records(parts)] == [1, 1, 0, 1, 0]
