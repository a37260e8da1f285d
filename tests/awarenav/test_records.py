"""Files of frames: read as written, continued but for an unfinished last line, or refused."""

from __future__ import annotations

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
    assert read_records(path) == FRAMES[:3]
    assert continue_records(path) == FRAMES[:3]
    assert f"{path}: the last line is unfinished" in capsys.readouterr().err
    with RecordFile(path) as file:
        for frame in FRAMES[3:]:
            file.add(frame)
    assert path.read_text() == WHOLE


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (WHOLE.replace('"stamp_s": 0.1,', "", 1), "line 3: a frame needs the keys frame, stamp_s"),
        (WHOLE.replace('"people": []}\n', '"peo', 1), "line 1"),
        (WHOLE + WHOLE[: WHOLE.index("\n") + 1], "two frames have the name '000000.png'"),
        ("dear diary,\ntoday\n", "line 1"),
        (None, r"truth\.jsonl"),
    ],
    ids=["key", "cut line", "twice", "prose", "absent"],
)
def test_a_damaged_file_is_refused_and_left_alone(tmp_path, text, message):
    path = tmp_path / "truth.jsonl"
    if text is not None:
        path.write_text(text)
    for read in (continue_records, read_records) if "two" not in message else (continue_records,):
        with pytest.raises(AwarenavError, match=message):
            read(path)
    assert text is None or path.read_text() == text


def test_what_cannot_be_written_is_said(tmp_path):
    with pytest.raises(AwarenavError, match="cannot write"):
        RecordFile(tmp_path / "absent" / "lines")
    for value in (float("nan"), float("inf")):
        with pytest.raises(AwarenavError, match="not finite"):
            record_line({**FRAMES[0], "stamp_s": value})
