"""A Nav2 that is started for crossings, in a process with ROS."""

from __future__ import annotations

import contextlib
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

from sim_tests.crossing.planner.ros2 import python_with_ros
from sim_tests.world.errors import SimError


@contextlib.contextmanager
def nav2(controller: str, *words: str, log: Path) -> Iterator[subprocess.Popen[str]]:
    """Have a Nav2 in the domain of this process until the block ends; it goes on by itself.

    Args:
        controller: the local planner.
        words: more arguments of :mod:`benchmarks.nav2.launch`.
        log: file for what the servers print.

    Raises:
        SimError: it did not start.
    """
    command = [python_with_ros(), "-m", "benchmarks.nav2.launch", controller]
    process = subprocess.Popen(
        [*command, "--log", str(log), *words],
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        time.sleep(1.0)
        if process.poll() is not None:
            raise SimError(f"Nav2 did not start; see above, and {log}")
        yield process
    finally:
        process.terminate()
        try:
            process.wait(15.0)
        except subprocess.TimeoutExpired:
            process.kill()
