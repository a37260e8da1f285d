"""Another distribution that installs one of our import names is reported by its own name."""

from __future__ import annotations

import shlex
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

FOREIGN_CODE = "print('foreign code ran')\nraise SystemExit(3)\n"
# Loads the guard as our packages do; other imports may read metadata for reasons of their own.
GUARD_ALONE = """
import importlib.metadata, runpy, sys
def refuse(*_): raise AssertionError("metadata of other distributions were read")
importlib.metadata.distributions = refuse
runpy.run_path(sys.prefix + "/FOLDER/perception/_clash.py")["require_sole_owner"]("sim_tests")
"""


def foreign_wheel(folder: Path, package: str) -> Path:
    """A wheel of the distribution ``other-vision`` 9.9 that installs ``package``."""
    path = folder / "other_vision-9.9-py3-none-any.whl"
    info = "other_vision-9.9.dist-info"
    files = {
        f"{package}/__init__.py": FOREIGN_CODE,
        f"{package}/vision_tools.py": FOREIGN_CODE,
        f"{info}/METADATA": "Metadata-Version: 2.1\nName: other-vision\nVersion: 9.9\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    files[f"{info}/RECORD"] = "".join(f"{name},,\n" for name in [*files, f"{info}/RECORD"])
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


def assert_reported(done: Any, package: str, culprit: str = "other-vision 9.9") -> None:
    assert done.returncode == 1, done.stderr
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("ImportError: ")
    assert culprit in last
    assert repr(package) in last
    assert "foreign code ran" not in done.stdout


@pytest.fixture
def clash(installed: Any, wheel: Path, tmp_path: Path) -> Iterator[Callable[[str], Any]]:
    """Return a function that installs the foreign package over ours, as pip would."""
    written: list[str] = []

    def install(package: str) -> Any:
        with zipfile.ZipFile(foreign_wheel(tmp_path, package)) as archive:
            archive.extractall(installed.site)
            written.extend(archive.namelist())
        return installed

    yield install
    for name in written:
        (installed.site / name).unlink()
    with zipfile.ZipFile(wheel) as archive:
        ours = archive.namelist()
        archive.extractall(installed.site, [name for name in written if name in ours])


def test_a_package_installed_over_ours_is_reported(clash: Callable[[str], Any]) -> None:
    installed = clash("perception")
    for package in ("tracking", "nav_adapter", "sim_tests"):
        assert_reported(installed.python(f"import {package}"), "perception")
    assert_reported(installed.command("awarenav", "--help"), "perception")


def test_every_name_is_protected(clash: Callable[[str], Any]) -> None:
    installed = clash("tracking")
    assert_reported(installed.python("import sim_tests"), "tracking")
    unaffected = installed.python("import perception")
    assert unaffected.returncode == 0, unaffected.stderr


@pytest.mark.full
def test_other_installed_before_ours_and_the_remedy(
    environment: Any, wheel: Path, tmp_path: Path
) -> None:
    environment.borrow_dependencies()
    environment.pip("install", "--quiet", foreign_wheel(tmp_path, "perception"))
    environment.pip("install", "--quiet", "--no-deps", wheel)
    # The other one's modules beside ours do no harm.
    assert environment.python("import nav_adapter").returncode == 0

    # Uninstalling takes away the __init__.py that both had put there.
    environment.pip("uninstall", "--quiet", "--yes", "other-vision")
    without = environment.python("import tracking")
    assert without.returncode == 1
    _, command = without.stderr.strip().rsplit("Put it back: pip ", 1)

    environment.pip(*shlex.split(command))
    assert environment.python("import nav_adapter").returncode == 0


@pytest.mark.parametrize("file", ["perception/__init__.py", "perception.py"])
def test_stray_package_or_module_ahead_on_the_path_is_named_by_its_path(
    installed: Any, tmp_path: Path, file: str
) -> None:
    stray = tmp_path / "workspace" / file
    stray.parent.mkdir(parents=True)
    stray.write_text(FOREIGN_CODE)

    done = installed.python("import tracking", PYTHONPATH=str(tmp_path / "workspace"))

    place = str(stray).removesuffix("/__init__.py")
    assert_reported(done, "perception", f"unknown distribution at {place}.")


def test_a_good_installation_needs_no_scan(installed: Any) -> None:
    folder = installed.site.relative_to(installed.folder).as_posix()
    done = installed.python(GUARD_ALONE.replace("FOLDER", folder))
    assert done.returncode == 0, done.stderr
