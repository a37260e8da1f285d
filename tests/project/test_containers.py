"""Dockerfile and development containers: versions of the lock, and files that are there."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml
from paths import ROOT

TEXT = (ROOT / "Dockerfile").read_text(encoding="utf-8")
#: One instruction a line, without comments and continued lines.
LINES = [
    line
    for line in re.sub(r"\\\n\s*", "", re.sub(r"^#.*\n", "", TEXT, flags=re.MULTILINE)).splitlines()
    if line
]
IGNORED = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
SETTINGS = sorted((ROOT / ".devcontainer").rglob("devcontainer.json"))


def stages() -> dict[str, list[str]]:
    """The instructions of each stage, in order."""
    found: dict[str, list[str]] = {}
    for line in LINES:
        if line.startswith("FROM "):
            name = line.rpartition(" AS ")[2]
            found[name] = []
        else:
            found[name].append(line)
    return found


def copied(lines: list[str]) -> list[str]:
    return [word for line in lines if line.startswith("COPY ") for word in line.split()[1:-1]]


def test_the_last_stage_is_what_runs_on_a_robot() -> None:
    assert list(stages()) == ["dev", "ros2", "robot"]


@pytest.mark.parametrize("stage", ["ros2", "robot"])
def test_every_package_comes_from_the_lock(stage: str) -> None:
    lines = stages()[stage]
    installs = [(i, line) for i, line in enumerate(lines) if "pip install" in line]
    assert len(installs) == 1
    pyproject = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    for place, line in installs:
        assert "pip install --constraint requirements.lock '.[" in line
        before = copied(lines[:place])
        assert {"requirements.lock", "pyproject.toml", "README.md", "LICENSE"} <= set(before)
        (extras,) = re.findall(r"'\.\[([\w,]+)\]'", line)
        for extra in extras.split(","):
            assert re.search(rf"^{extra} = \[$", pyproject, re.MULTILINE), extra
        (packages,) = re.findall(r'^packages = (\["perception".*\])$', pyproject, re.MULTILINE)[:1]
        assert set(json.loads(packages)) <= set(before)


def test_every_copied_path_exists_and_is_sent_to_the_builder() -> None:
    paths = {path for lines in stages().values() for path in copied(lines)}
    assert all((ROOT / path).exists() for path in paths)
    assert IGNORED[1] == "*"
    sent = {line.removeprefix("!") for line in IGNORED if line.startswith("!")}
    assert sent == paths


@pytest.mark.parametrize("stage", ["dev", "robot"])
def test_nothing_runs_as_root(stage: str) -> None:
    users = [line for line in stages()[stage] if line.startswith("USER ")]
    assert users == ["USER 1000"]


def test_the_example_with_ros_starts_the_launch_file_with_its_arguments() -> None:
    (command,) = (line for line in stages()["ros2"] if line.startswith("CMD "))
    program, verb, launch, *arguments = json.loads(command.removeprefix("CMD "))
    assert (program, verb) == ("ros2", "launch")
    path = ROOT / launch.removeprefix("/opt/awarenav/")
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    known = {each["arg"]["name"] for each in description["launch"] if "arg" in each}
    for argument in arguments:
        name, _, value = argument.partition(":=")
        assert name in known
        assert (ROOT / value.removeprefix("/opt/awarenav/")).is_file()


@pytest.mark.parametrize("path", SETTINGS, ids=lambda path: path.parent.name)
def test_a_development_container_builds_a_stage_that_exists(path: Path) -> None:
    settings = json.loads(path.read_text(encoding="utf-8"))
    build = settings["build"]
    assert (path.parent / build["dockerfile"]).resolve() == ROOT / "Dockerfile"
    assert (path.parent / build["context"]).resolve() == ROOT
    assert build["target"] in stages()


def test_the_development_container_sets_up_from_the_lock() -> None:
    assert len(SETTINGS) == 2
    settings = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    assert settings["postCreateCommand"].startswith("make setup && ")
    setup = (ROOT / "tools" / "setup_venv.sh").read_text(encoding="utf-8")
    assert "LOCK=requirements.lock" in setup
    assert settings["remoteUser"] in " ".join(stages()["dev"])
    tools = next(line for line in stages()["dev"] if "apt-get install" in line)
    assert {"git", "make"} <= set(tools.split())


def test_hadolint_finds_nothing() -> None:
    if shutil.which("hadolint") is None:
        pytest.skip("hadolint is not installed")
    done = subprocess.run(
        ["hadolint", str(ROOT / "Dockerfile")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
