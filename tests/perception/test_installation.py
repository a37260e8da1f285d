"""The command for a missing extra installs from where this installation came from."""

from __future__ import annotations

import json
import shlex
from importlib import metadata
from pathlib import Path

import pytest

from perception import installation
from perception.installation import install_command, reinstall_command


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


def test_from_an_index(installed_from):
    installed_from(None)
    assert install_command("sim") == "pip install 'awarenav[sim]'"
    assert reinstall_command() == "pip install --force-reinstall --no-deps awarenav"


@pytest.mark.parametrize(("editable", "option"), [(True, "-e "), (False, "")])
def test_from_a_checkout(installed_from, editable, option):
    installed_from({"url": "file:///srv/my%20robot", "dir_info": {"editable": editable}})
    command = install_command("sim,bench")
    assert command == f"pip install {option}'/srv/my robot[sim,bench]'"
    assert shlex.split(command)[-1] == "/srv/my robot[sim,bench]"


def test_from_an_archive(installed_from):
    installed_from({"url": "file:///srv/awarenav-9-py3-none-any.whl", "archive_info": {}})
    assert shlex.split(install_command("ros2"))[2:] == [
        "awarenav[ros2] @ file:///srv/awarenav-9-py3-none-any.whl"
    ]


def test_from_a_repository(installed_from):
    vcs = {"vcs": "git", "commit_id": "abc"}
    installed_from({"url": "https://example.org/awarenav.git", "vcs_info": vcs})
    assert shlex.split(install_command())[2:] == [
        "awarenav @ git+https://example.org/awarenav.git@abc"
    ]


@pytest.mark.parametrize("record", ["{", "[]", '{"url": 3}'])
def test_a_damaged_record_falls_back_to_the_name(installed_from, record):
    installed_from(record)
    assert install_command("viz") == "pip install 'awarenav[viz]'"


def test_a_checkout_that_is_not_installed(monkeypatch):
    def nothing(name: str) -> None:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(installation, "distribution", nothing)
    root = Path(installation.__file__).parents[1]
    assert shlex.split(install_command("sim")) == ["pip", "install", "-e", f"{root}[sim]"]
