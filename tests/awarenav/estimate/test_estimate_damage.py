"""Estimates on a full disk and with damaged lines: the rest is kept, the frames are done again."""

from __future__ import annotations

import pytest
from full_disk import files_up_to

from awarenav.errors import AwarenavError
from awarenav.estimate._results import ResultsFile

RECORDS = [
    {"frame": f"{k:06d}.png", "stamp_s": k / 20, "T_odom_camera": None, "people": []}
    | {"settings": "abcd0123"}
    for k in range(5)
]


def write(path, records, **how):
    with ResultsFile(path, "abcd0123", **how) as results:
        for record in records:
            if record["frame"] not in results.done:
                results.add(record)
        return results.done


@pytest.fixture
def whole(tmp_path):
    write(tmp_path / "whole.jsonl", RECORDS)
    return (tmp_path / "whole.jsonl").read_bytes()


def test_a_full_disk_leaves_whole_lines_and_the_estimates_continue(tmp_path, whole):
    path = tmp_path / "estimates.jsonl"
    two = sum(map(len, whole.splitlines(keepends=True)[:2]))
    with files_up_to(two + 20), pytest.raises(AwarenavError, match="too large"):
        write(path, RECORDS)
    assert path.read_bytes() == whole[:two]
    assert len(write(path, RECORDS, resume=True)) == 2
    assert path.read_bytes() == whole


def test_a_damaged_line_is_set_aside_and_its_frame_estimated_again(tmp_path, whole, capsys):
    """A version before this one left half a line in front of the next on a full disk."""
    path = tmp_path / "estimates.jsonl"
    lines = whole.splitlines(keepends=True)
    path.write_bytes(b"".join([lines[0], lines[1][:30] + lines[2], lines[3]]))
    assert write(path, RECORDS, resume=True) == {"000000.png", "000003.png"}
    assert sorted(path.read_bytes().splitlines(keepends=True)) == lines
    assert "line 2 is damaged" in capsys.readouterr().err
    assert (tmp_path / "estimates.jsonl.damaged").read_bytes() == lines[1][:30] + lines[2]
