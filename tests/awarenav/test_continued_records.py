"""A file of frames that is continued: damaged lines are set aside, all others stay as they are."""

from __future__ import annotations

import json
import re

import pytest

from awarenav.errors import AwarenavError
from awarenav.records import continue_records, record_line, write_records

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
    "a list": ("[1]\n", "needs the keys"),
    "awareness above 1": (with_person(awareness=1.5), "awareness must lie in"),
    "score below 0": (with_person(score=-0.1), "score must lie in"),
    "a box of three": (with_person(box_xyxy_px=[1.0, 2.0, 3.0]), "box_xyxy_px"),
    "NaN": (WHOLE.replace("0.5", "NaN"), "NaN is not a finite number"),
    "no stamp": (changed(stamp_s="now"), "stamp_s"),
    "a pose of three rows": (changed(T_odom_camera=POSE[:3]), "T_odom_camera"),
    "no people": (changed(people=3), "people must be a list"),
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
