"""Files that appear whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from awarenav.errors import AwarenavError
from awarenav.files import atomic_path, write_text


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
