"""The command for a missing extra installs from where this installation came from."""

from __future__ import annotations

import json
import shlex
from importlib import metadata
from pathlib import Path

import pytest

from perception import installation
from perception.installation import install_command, missing_simulator, reinstall_command


@pytest.fixture
def installed_from(tmp_path, monkeypatch):
    """Put an installation with the given record of PEP 610 first on the import path."""

    def install(record: dict[str, object] | str | None) -> None:
        info = tmp_path / "awarenav-9.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: awarenav\nVersion: 9\n")
        if record is not None:
            text = record if isinstance(record, str) else json.dumps(record)
            (info / "direct_url.json").write_text(text)
        monkeypatch.syspath_prepend(str(tmp_path))
        assert metadata.version("awarenav") == "9"

    return install


WHEEL = "file:///srv/awarenav-9-py3-none-any.whl"


@pytest.mark.parametrize(
    ("record", "extras", "wanted"),
    [
        (None, "sim", ["awarenav[sim]"]),  # from an index
        (
            {"url": "file:///srv/my%20robot", "dir_info": {"editable": True}},
            "sim,bench",
            ["-e", "/srv/my robot[sim,bench]"],
        ),
        ({"url": "file:///srv/robot", "dir_info": {"editable": False}}, "", ["/srv/robot"]),
        ({"url": WHEEL, "archive_info": {}}, "ros2", [f"awarenav[ros2] @ {WHEEL}"]),
        (
            {
                "url": "https://example.org/awarenav.git",
                "vcs_info": {"vcs": "git", "commit_id": "abc"},
            },
            "",
            ["awarenav @ git+https://example.org/awarenav.git@abc"],
        ),
        # A damaged record falls back to the name.
        ("{", "viz", ["awarenav[viz]"]),
        ("[]", "viz", ["awarenav[viz]"]),
        ('{"url": 3}', "viz", ["awarenav[viz]"]),
    ],
)
def test_the_command_installs_from_where_this_one_came_from(installed_from, record, extras, wanted):
    installed_from(record)
    assert shlex.split(install_command(extras)) == ["pip", "install", *wanted]
    if record is None:
        assert reinstall_command() == "pip install --force-reinstall --no-deps awarenav"


def test_a_checkout_that_is_not_installed(monkeypatch):
    def nothing(name: str) -> None:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(installation, "distribution", nothing)
    root = Path(installation.__file__).parents[1]
    assert shlex.split(install_command("sim")) == ["pip", "install", "-e", f"{root}[sim]"]


def test_a_python_without_a_wheel_of_pybullet_is_told_the_way_to_another() -> None:
    install = install_command("sim,bench")
    assert missing_simulator("joblib", (3, 11)).endswith(f"'sim': {install}")
    later = missing_simulator("pybullet", (3, 12))
    assert "this Python 3.12" in later
    assert f"uv venv --python 3.11 && . .venv/bin/activate && uv {install}`" in later
