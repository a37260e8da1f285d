"""JSON Lines of frames: what is written is read back, and a cut line loses nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from awarenav.errors import AwarenavError
from awarenav.records import read_records, record_line, write_records

FRAMES = [
    {"frame": f"{k:06d}.png", "stamp_s": k / 20, "T_odom_camera": [[1.0]], "people": []}
    for k in range(5)
]


def test_records_survive_writing_and_reading(tmp_path: Path) -> None:
    path = tmp_path / "truth.jsonl"
    write_records(path, FRAMES)
    assert read_records(path) == FRAMES
    assert [entry.name for entry in tmp_path.iterdir()] == ["truth.jsonl"]


@pytest.mark.parametrize("cut", [1, 7, 40])
def test_an_incomplete_last_line_is_left_out_and_the_others_are_read(
    tmp_path: Path, cut: int
) -> None:
    path = tmp_path / "truth.jsonl"
    write_records(path, FRAMES)
    text = path.read_text("utf-8").rstrip("\n")
    path.write_text(text[:-cut], "utf-8")
    assert read_records(path) == FRAMES[:-1]


def test_a_broken_line_in_the_middle_is_refused_by_number(tmp_path: Path) -> None:
    path = tmp_path / "truth.jsonl"
    lines = [record_line(frame) for frame in FRAMES]
    lines[2] = lines[2][:20] + "\n"
    path.write_text("".join(lines), "utf-8")
    with pytest.raises(AwarenavError, match="line 3"):
        read_records(path)


def test_a_line_that_is_not_a_frame_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "truth.jsonl"
    path.write_text('{"frame": "a.png"}\n', "utf-8")
    with pytest.raises(AwarenavError, match="needs the keys frame, stamp_s"):
        read_records(path)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(AwarenavError, match=r"nothing\.jsonl"):
        read_records(tmp_path / "nothing.jsonl")


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_number_that_is_not_finite_is_never_written(value: float) -> None:
    with pytest.raises(AwarenavError, match="not finite"):
        record_line({**FRAMES[0], "stamp_s": value})
