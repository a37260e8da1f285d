"""Files of frames: read as written, continued but for an unfinished last line, or refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from awarenav.errors import AwarenavError
from awarenav.records import RecordFile, continue_records, read_records, record_line, write_records

FRAMES = [
    {"frame": f"{k:06d}.png", "stamp_s": k / 20, "T_odom_camera": None, "people": []}
    for k in range(5)
]
WHOLE = "".join(map(record_line, FRAMES))


def test_a_file_stays_as_it_is_byte_for_byte_but_for_an_unfinished_line(tmp_path, capsys):
    path = tmp_path / "truth.jsonl"
    write_records(path, FRAMES[:3])
    assert continue_records(path) == FRAMES[:3]
    assert not capsys.readouterr().err
    path.write_text(path.read_text() + record_line(FRAMES[3])[:50])
    assert continue_records(path) == FRAMES[:3]
    assert f"{path}: the last line is unfinished" in capsys.readouterr().err
    with RecordFile(path) as file:
        for frame in FRAMES[3:]:
            file.add(frame)
    assert path.read_text() == WHOLE


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (WHOLE.replace('"stamp_s": 0.1,', "", 1), "line 3: a frame needs the keys"),
        (WHOLE.replace('"people": []}\n', '"peo', 1), "line 1"),
        (WHOLE + WHOLE[: WHOLE.index("\n") + 1], "two frames have the name '000000.png'"),
        ("dear diary,\ntoday\n", "line 1"),
    ],
)
def test_a_damaged_file_is_refused_and_left_alone(tmp_path, text, message):
    path = tmp_path / "truth.jsonl"
    path.write_text(text)
    with pytest.raises(AwarenavError, match=message):
        continue_records(path)
    assert path.read_text() == text


def test_a_file_that_cannot_be_opened_is_said(tmp_path):
    with pytest.raises(AwarenavError, match="cannot write"):
        RecordFile(tmp_path / "absent" / "lines")


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
