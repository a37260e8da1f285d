"""tools/release.py: what does not agree with a tag is named, and the notes are the changelog's."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

import awarenav
from tools.release import notes, problems

TAG = f"v{awarenav.__version__}"
FILES = ("awarenav/__init__.py", "CHANGELOG.md", "CITATION.cff", "CITATION.bib")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    (tmp_path / "awarenav").mkdir()
    for name in FILES:
        shutil.copy2(ROOT / name, tmp_path / name)
    return tmp_path


def test_this_checkout_is_ready_and_the_command_prints_the_notes() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tools.release", TAG],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "### Added" in done.stdout
    assert "## [" not in done.stdout


def test_another_tag_is_refused(copy: Path) -> None:
    (problem,) = problems(copy, "v9.9.9")
    assert problem == f"the tag must be {TAG}, as awarenav/__init__.py says, got v9.9.9"


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("CITATION.cff", "version: 0", "version: 9", "CITATION.cff must have 'version:"),
        ("CITATION.cff", "date-released: 2", "date-released: 1", "must have 'date-released:"),
        ("CITATION.bib", "{0.", "{9.", "CITATION.bib must have 'version = {"),
        ("CHANGELOG.md", f"## [{TAG[1:]}]", "## [9.9]", "must have a section"),
    ],
)
def test_a_file_that_was_forgotten_is_named(
    copy: Path, file: str, old: str, new: str, message: str
) -> None:
    text = (copy / file).read_text(encoding="utf-8")
    assert old in text
    (copy / file).write_text(text.replace(old, new, 1), encoding="utf-8")
    (problem,) = problems(copy, TAG)
    assert message in problem


def test_notes_end_where_the_next_version_begins() -> None:
    changelog = "# C\n\n## [Unreleased]\n\n- x\n\n## [1.1.0] - d\n\n- a\n\n## [1.0.0] - d\n\n- b\n"
    assert notes(changelog, "1.1.0") == "- a\n"
    assert notes(changelog, "1.0.0") == "- b\n"
    with pytest.raises(ValueError, match="no section for 2"):
        notes(changelog, "2.0.0")
