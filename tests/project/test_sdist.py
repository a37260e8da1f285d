"""The source distribution holds every file of the repository, so that its tests can run."""

from __future__ import annotations

import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from paths import ROOT


@pytest.mark.slow
def test_every_file_of_the_repository_is_in_the_source_distribution(tmp_path: Path) -> None:
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode != 0:
        pytest.skip("this is not a repository of Git")
    files = {name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()}
    # fmt: off
    subprocess.run(
        [sys.executable, "-m", "build", "--sdist", "--no-isolation", "--outdir", tmp_path, ROOT],
        check=True, capture_output=True, timeout=300,
    )
    # fmt: on
    (path,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        held = {member.name.partition("/")[2] for member in archive if member.isfile()}
    assert files - held == set()
