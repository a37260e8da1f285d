"""The set-up of `make setup`: a short account of what it does, its log, and its repair."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from paths import ROOT

pytest.importorskip("ensurepip", reason="the set-up needs the modules venv and ensurepip")

MAX_LINES = 10
BACKEND = """
import zipfile

def build_editable(folder, settings=None, metadata=None):
    name = "home-1.0-py3-none-any.whl"
    with zipfile.ZipFile(folder + "/" + name, "w") as wheel:
        wheel.writestr("home-1.0.dist-info/METADATA", "Metadata-Version: 2.1\\nName: home\\nVersion: 1.0\\n")
        wheel.writestr("home-1.0.dist-info/WHEEL", "Wheel-Version: 1.0\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n")
        wheel.writestr("home-1.0.dist-info/RECORD", "")
    return name
"""  # noqa: E501 - as files have it
PROJECT = """
[build-system]
requires = []
build-backend = "backend"
backend-path = ["."]
[project]
name = "home"
version = "1.0"
"""


def add_wheel(folder: Path, name: str) -> str:
    """Write an empty package; return its line in the lock."""
    path = folder / f"{name}-1.0-py3-none-any.whl"
    info = f"{name}-1.0.dist-info"
    with zipfile.ZipFile(path, "w") as wheel:
        wheel.writestr(f"{name}.py", "")
        wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\n")
        wheel.writestr(f"{info}/RECORD", "")
    return f"{name} @ {path.as_uri()}"


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checkout")
    (folder / "tools").mkdir()
    shutil.copy(ROOT / "tools" / "setup_venv.sh", folder / "tools")
    (folder / "pyproject.toml").write_text(PROJECT)
    (folder / "backend.py").write_text(BACKEND)
    lines = [add_wheel(folder, f"small{number}") for number in range(4)]
    lines.append("    # via home")
    lines.append(f"{lines[0]} ; python_version < '3'")
    (folder / "requirements.lock").write_text("\n".join(lines) + "\n")
    return folder


def set_up(checkout: Path) -> subprocess.CompletedProcess[str]:
    """Run the set-up with pip; a uv on PATH is hidden."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    return subprocess.run(
        ["sh", "tools/setup_venv.sh"],
        cwd=checkout,
        env=environment | {"PATH": "/usr/bin:/bin", "PYTHON": sys.executable},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.slow
def test_a_set_up_says_what_it_takes_and_how_far_it_is_in_few_lines(checkout: Path) -> None:
    done = set_up(checkout)
    lines = done.stdout.splitlines()
    assert done.returncode == 0, done.stdout
    assert len(lines) <= MAX_LINES
    assert all(line.startswith("setup: ") for line in lines)
    assert "installing 4 pinned packages with pip" in lines[1]
    assert "MB to download" in lines[1]
    assert [line for line in lines if "fetched" in line] == [
        f"setup: fetched {number} of 4 packages" for number in (2, 3, 4)
    ]
    imported = [checkout / ".venv/bin/python", "-c", "import small0, small3"]
    assert subprocess.run(imported, check=False).returncode == 0
    assert "Successfully installed" in (checkout / ".venv/setup.log").read_text()
    again = set_up(checkout)
    assert (again.returncode, again.stdout) == (0, "")
    (packages,) = (checkout / ".venv/lib").glob("python3.*/site-packages")
    record = packages / "awarenav-1.0.dist-info/direct_url.json"
    record.parent.mkdir()
    for text, said in (('{"dir_info": {"editable": true}}', ""), ('{"dir_info": {}}', "a copy")):
        record.write_text(text)
        repaired = set_up(checkout)
        assert repaired.returncode == 0, repaired.stdout
        assert said in repaired.stdout if said else not repaired.stdout
    shutil.rmtree(record.parent)


@pytest.mark.full
def test_a_failure_shows_the_end_of_the_log_and_the_next_run_repairs_it(checkout: Path) -> None:
    lock = checkout / "requirements.lock"
    good = lock.read_text()
    absent = checkout / "absent-1.0-py3-none-any.whl"
    lock.write_text(f"{good}absent @ {absent.as_uri()}\n")
    failed = set_up(checkout)
    assert failed.returncode == 1
    assert "failed with exit status 1" in failed.stdout
    assert str(checkout / ".venv/setup.log") in failed.stdout
    assert "ERROR" in failed.stdout
    assert absent.name in failed.stdout
    assert len(failed.stdout.splitlines()) <= MAX_LINES + 14
    lock.write_text(good)
    repaired = set_up(checkout)
    assert repaired.returncode == 0, repaired.stdout
    assert "an earlier set-up was interrupted" in repaired.stdout
    assert set_up(checkout).stdout == ""
