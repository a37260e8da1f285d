"""Goals by actions: the process with rclpy that speaks to Nav2, as a seat uses it."""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import shutil
import subprocess
import sys
import threading
from collections import deque
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from ....world.errors import SimError

_PROBE: Final = "import rclpy, nav2_msgs.action"
_PROBE_S: Final = 30.0
_LINES: Final = 8


class Actions:
    """A process with rclpy that sends goals to Nav2's action servers.

    Args:
        domain: ``ROS_DOMAIN_ID``.
        kind: ``"follow_path"`` or ``"navigate_to_pose"``.

    Raises:
        SimError: no Python with rclpy was found.
    """

    def __init__(self, domain: int, kind: str) -> None:
        client = Path(__file__).with_name("_client.py")
        self._process = subprocess.Popen(
            [python_with_ros(), str(client), kind],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        self._said: dict[str, Any] = {}
        self._errors: deque[str] = deque(maxlen=_LINES)
        for read in (self._read_lines, self._read_errors):
            threading.Thread(target=read, daemon=True).start()
        atexit.register(self.close)

    def begin(self) -> None:
        """Forget the last goal, and let Nav2 clear its costmaps."""
        self._said = {}
        self._tell(do="begin")

    def missing(self) -> str:
        """Return what is not there yet, since :meth:`begin`; empty for nothing.

        Raises:
            SimError: the process has ended.
        """
        if self.has_ended:
            raise SimError(f"the client of Nav2's actions has ended: {' '.join(self._errors)}")
        return str(self._said.get("missing", "the client of its actions has not begun"))

    @property
    def refused(self) -> str:
        """The action whose server refused a goal last, since :meth:`begin`; empty for none."""
        return str(self._said.get("refused", ""))

    @property
    def has_ended(self) -> bool:
        """True once the process has ended."""
        return self._process.poll() is not None

    def go(self, **goal: Any) -> None:
        """Send a goal: ``x``, ``y``, ``yaw``, and the straight ``path`` [[x, y], …]."""
        self._tell(do="go", **goal)

    def stop(self) -> None:
        """Cancel the goal."""
        with contextlib.suppress(SimError):
            self._tell(do="stop")

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(OSError, ValueError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        try:
            self._process.wait(3.0)
        except subprocess.TimeoutExpired:
            self._process.kill()

    def _tell(self, **line: Any) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(line) + "\n")
            self._process.stdin.flush()
        except OSError as cause:
            raise SimError(
                f"the client of Nav2's actions has ended: {' '.join(self._errors)}"
            ) from cause

    def _read_lines(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            with contextlib.suppress(json.JSONDecodeError):
                self._said |= json.loads(line)

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self._errors.append(line.strip())


_KEPT: Final[dict[tuple[int, str], Actions]] = {}


def actions_of(domain: int, kind: str) -> Actions:
    """Return the client of this process, which is kept from episode to episode while it lives."""
    kept = _KEPT.get((domain, kind))
    if kept is None or kept.has_ended:
        kept = _KEPT[domain, kind] = Actions(domain, kind)
    return kept


@lru_cache(maxsize=1)
def python_with_ros() -> str:
    """Return a Python that has rclpy and nav2_msgs: this one, one on the path, or the system's.

    Raises:
        SimError: none has.
    """
    folders = [*os.environ.get("PATH", "").split(os.pathsep), "/usr/bin"]
    found = (shutil.which("python3", path=folder) for folder in folders)
    for python in dict.fromkeys([sys.executable, *found]):
        if python:
            probe = subprocess.run(
                [python, "-c", _PROBE], capture_output=True, timeout=_PROBE_S, check=False
            )
            if probe.returncode == 0:
                return python
    raise SimError(
        "goals by action need rclpy and nav2_msgs, which no python3 here can import: source your "
        "ROS environment first (source /opt/ros/DISTRO/setup.bash), or send the goal on the topic "
        "goal_pose (planner 'ros2'), which needs no ROS"
    )
