"""Lines are appended whole or not at all, also to a full disk, and damaged ones are set aside."""

from __future__ import annotations

import os

import pytest
from full_disk import files_up_to

from awarenav.errors import AwarenavError
from awarenav.line_files import DamagedLine, LineFile, set_aside


def test_a_short_write_on_a_full_disk_loses_no_half_line(tmp_path):
    path = tmp_path / "lines"
    with LineFile(path) as file:
        file.add("first line\n")
        with files_up_to(16), pytest.raises(AwarenavError, match=r"cannot write .*lines: File too"):
            file.add("second line\n")
        assert path.read_bytes() == b"first line\n"
        file.add("third line\n")
    assert path.read_bytes() == b"first line\nthird line\n"


def test_a_line_that_the_system_takes_in_parts_is_whole(tmp_path, monkeypatch):
    write = os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, bytes(data[:3])))
    with LineFile(tmp_path / "lines") as file:
        file.add("a line of several parts\n")
    assert (tmp_path / "lines").read_bytes() == b"a line of several parts\n"


def test_a_file_that_cannot_be_opened_is_said(tmp_path):
    with pytest.raises(AwarenavError, match="cannot write"):
        LineFile(tmp_path / "absent" / "lines")


def test_damaged_lines_are_kept_beside_the_file_and_named(tmp_path, capsys):
    path = tmp_path / "lines"
    for number in (3, 4):
        set_aside(path, [DamagedLine(number, b"\xff half", "not text")], "made again")
    assert (tmp_path / "lines.damaged").read_bytes() == b"\xff half\n" * 2
    told = capsys.readouterr().err
    assert "line 3 is damaged: not text" in told
    assert "lines.damaged; made again" in told
    set_aside(path, [], "made again")
    assert not capsys.readouterr().err
