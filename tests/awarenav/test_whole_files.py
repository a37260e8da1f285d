"""Files and lines that appear whole or not at all, also on a full disk."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from full_disk import files_up_to

from awarenav.errors import AwarenavError
from awarenav.files import atomic_path, write_text
from awarenav.line_files import LineFile


def test_a_parent_that_is_a_file_is_a_clear_error(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("here")
    for path in (file / "table.csv", file / "folder" / "table.csv"):
        with pytest.raises(AwarenavError, match=f"cannot write {path}: ") as caught:
            write_text(path, "text")
        assert isinstance(caught.value.__cause__, OSError)
    assert file.read_text() == "here"


def test_a_block_that_fails_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "table.csv"
    write_text(path, "old")

    def fail() -> None:
        with atomic_path(path) as part:
            part.write_text("half")
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert path.read_text() == "old"
    assert list(path.parent.iterdir()) == [path]


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
