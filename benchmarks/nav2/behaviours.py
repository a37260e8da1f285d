"""Behaviours of Nav2 beside somebody who stands and does not look: what stops them."""

from __future__ import annotations

import contextlib
import json
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from sim_tests.crossing import CrossingResult, run_crossing
from sim_tests.crossing.planner.ros2 import python_with_ros
from sim_tests.scenario import Scenario
from sim_tests.world.errors import SimError

_BLIND: Final = ("--set", "behavior_server.simulate_ahead_time=0.0")
#: What is there to stop a behaviour, and the arguments of :mod:`benchmarks.nav2.launch` for it.
GUARDS: Final = {
    "nothing": ("--bare", *_BLIND),
    "look-ahead, scans": ("--bare",),
    "look-ahead, `people_layer`": ("--face", "grid", "--bare"),
    "collision monitor": _BLIND,
}
_PROGRESS: Final = "controller_server.progress_checker.movement_time_allowance"


class Case(NamedTuple):
    """A behaviour beside a person.

    Attributes:
        title: words of the table.
        name: of the behaviour.
        place_m: where the person stands, x (forward) and y (left) in the base frame of the robot.
        lasts_s: time to watch.
        words: arguments of :mod:`benchmarks.nav2.launch`.
    """

    title: str
    name: str
    place_m: tuple[float, float]
    lasts_s: float
    words: tuple[str, ...] = ()


#: Behaviours of the behaviour server.
CASES: Final = (
    Case(
        "Spin, 1.0 rad/s (Nav2's default)",
        "spin",
        (0.0, 0.5),
        7.0,
        ("--set", "behavior_server.max_rotational_vel=1.0"),
    ),
    Case("Spin, 0.55 rad/s", "spin", (0.0, 0.5), 9.0),
    Case("BackUp, 0.25 m/s", "backup", (-1.3, 0.0), 8.0),
    Case("DriveOnHeading, 0.25 m/s", "drive_on_heading", (1.6, 0.0), 8.0),
    Case("DriveOnHeading, 0.5 m/s", "drive_on_heading", (1.6, 0.0), 8.0, ("--speed", "0.5")),
)


def do(case: Case, words: tuple[str, ...], log: Path) -> tuple[CrossingResult, str]:
    """Do a behaviour; return the crossing, and as JSON how the action ended (empty: not yet)."""
    x_m, y_m = case.place_m
    person = {
        "name": "person",
        "route": [{"x_m": x_m, "y_m": y_m}],
        "heading_deg": 90.0,
        "glances": {"notices_within_m": 0.0},
    }
    keys = {"duration_s": case.lasts_s, "layout": "open", "robot": {"goal_x_m": 11.0}}
    scenario = Scenario.from_data({"name": case.name, "people": [person], **keys})
    with nav2("RPP", "--behaviour", case.name, *case.words, *words, log=log) as process:
        result = run_crossing(scenario, policy="balanced", planner="ros2(goal='goal_pose')")
        process.terminate()
        said = process.communicate(timeout=15.0)[0].splitlines()
    return result, next((line for line in said if line.startswith("{")), "")


def table(log: Path) -> str:
    """Do all behaviours, and return the tables of docs/nav2.md."""
    lines = ["| | " + " | ".join(GUARDS) + " |", "| --- " * (len(GUARDS) + 1) + "|"]
    limits_mps = []
    for case in CASES:
        cells = []
        for words in GUARDS.values():
            result, _ = do(case, words, log)
            cells.append(_figure(result))
            touched_s = [each.t_s for each in result.contacts]
            limits_mps += [
                each.constraints.speed_limit_mps
                for each in result.frames
                if touched_s and touched_s[0] - 0.5 < each.t_s <= touched_s[0]
            ]
        lines.append(f"| {case.title} | " + " | ".join(cells) + " |")
    highest_mps = max(limits_mps, default=0.0)
    lines += ["", f"Highest limit in the half second before a touch: {highest_mps:.2f} m/s.", ""]
    for allowance_s in (10.0, 60.0):
        case = Case("", "follow_path", (5.0, 0.0), allowance_s + 18.0)
        result, ended = do(case, ("--set", f"{_PROGRESS}={allowance_s}"), log)
        moved = [each.t_s for each in result.frames if each.robot_state.speed_mps > 0.05]
        after_s = json.loads(ended)["after_s"] if ended else float("nan")
        lines.append(
            f"FollowPath, {allowance_s:.0f} s: stands from {max(moved):.1f} s, "
            f"given up after {after_s:.1f} s, {result.min_separation_m:.2f} m left."
        )
    return "\n".join(lines)


def _figure(result: CrossingResult) -> str:
    """Return the speed of the touching point, or the smallest gap and the fastest before it."""
    if result.contacts:
        touched_mps = max(each.robot_speed_mps for each in result.contacts)
        return f"touches at {touched_mps:.2f} m/s"
    seen = [each.approaches[0] for each in result.frames]
    fastest_mps = max(each.robot_speed_mps for each in seen)
    if fastest_mps < 0.03:
        return "stands"
    return f"{result.min_separation_m:.2f} m left"


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
