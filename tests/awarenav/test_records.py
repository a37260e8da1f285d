"""Files of frames: read as written, and continued without the lines that are damaged."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from awarenav.errors import AwarenavError
from awarenav.records import continue_records, read_records, record_line, write_records

PERSON = {"id": 0, "position_camera_m": [0.0, 0.0, 3.0], "awareness": 0.5, "score": 0.9}
POSE = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
FRAMES = [
    {"frame": f"{k:06d}.png", "stamp_s": k / 20, "T_odom_camera": POSE, "people": [PERSON]}
    for k in range(5)
]


def changed(**values):
    return record_line({**FRAMES[2], **values})


def with_person(**values):
    return changed(people=[{**PERSON, **values}])


WHOLE = record_line(FRAMES[2])
DAMAGED = {
    "half a line, then the next": (WHOLE[:40] + record_line(FRAMES[0]), "Expecting|delimiter"),
    "no text": ("\udcff\udcfe\n", "utf-8"),
    "no frame": ('{"frame": "000002.png"}\n', "needs the keys"),
    "awareness above 1": (with_person(awareness=1.5), "awareness must lie in"),
    "NaN": (WHOLE.replace("0.5", "NaN"), "NaN is not a finite number"),
    "a pose of three rows": (changed(T_odom_camera=POSE[:3]), "T_odom_camera"),
}


@pytest.mark.parametrize("kind", DAMAGED)
def test_a_damaged_line_is_set_aside_and_its_frame_is_missing(kind, tmp_path, capsys):
    line, message = DAMAGED[kind]
    content = line.encode("utf-8", "surrogateescape")
    path = tmp_path / "truth.jsonl"
    lines = [record_line(frame).encode() for frame in FRAMES]
    path.write_bytes(b"".join([*lines[:2], content, *lines[3:]]))
    records = continue_records(path)
    assert [record["frame"] for record in records] == [FRAMES[k]["frame"] for k in (0, 1, 3, 4)]
    assert path.read_bytes() == b"".join([*lines[:2], *lines[3:]])
    assert (tmp_path / "truth.jsonl.damaged").read_bytes() == content
    told = capsys.readouterr().err
    assert "line 3 is damaged" in told
    assert re.search(message, told), told


def test_a_whole_file_stays_as_it_is_byte_for_byte(tmp_path, capsys):
    path = tmp_path / "truth.jsonl"
    write_records(path, FRAMES)
    before = path.read_bytes()
    path.write_bytes(before + record_line({**FRAMES[0], "frame": "x"}).encode()[:50])
    assert continue_records(path) == FRAMES
    assert path.read_bytes() == before
    assert not (tmp_path / "truth.jsonl.damaged").exists()
    assert not capsys.readouterr().err


def test_frames_that_cannot_be_are_set_aside(tmp_path):
    path = tmp_path / "truth.jsonl"
    write_records(path, FRAMES)
    known = {str(frame["frame"]) for frame in FRAMES[:4]}
    assert continue_records(path, known) == FRAMES[:4]
    assert json.loads((tmp_path / "truth.jsonl.damaged").read_text()) == FRAMES[4]


def test_a_file_of_something_else_is_left_alone(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("dear diary,\ntoday\n")
    with pytest.raises(AwarenavError, match="is not a file of frames"):
        continue_records(path)
    assert path.read_text() == "dear diary,\ntoday\n"


def test_two_frames_of_one_name_are_both_made_again(tmp_path):
    path = tmp_path / "truth.jsonl"
    other = record_line({**FRAMES[2], "frame": FRAMES[1]["frame"]})
    path.write_text("".join([*map(record_line, FRAMES), other, record_line(FRAMES[4])]))
    assert continue_records(path) == [FRAMES[0], *FRAMES[2:]]
    damaged = (tmp_path / "truth.jsonl.damaged").read_text()
    assert damaged == record_line(FRAMES[1]) + other


def test_records_survive_writing_and_reading(tmp_path: Path) -> None:
    path = tmp_path / "truth.jsonl"
    write_records(path, FRAMES)
    assert read_records(path) == FRAMES
    assert [entry.name for entry in tmp_path.iterdir()] == ["truth.jsonl"]


@pytest.mark.parametrize("cut", [1, 40])
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
