"""Seconds that a policy's limits cost at least, whatever drives (docs/planners.md).

python -m benchmarks.floor --drive  # drive, and look for the fastest way: 20 minutes on two cores
python -m benchmarks.floor          # the table of the page, from benchmarks/floor.csv

The people of a driven crossing are replayed. Dynamic programming finds the fastest way beside the
straight line to the goal, at one of eleven offsets, under the limits that held there and then, with
everything known in advance. People do not answer it otherwise than they answered the drive.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import shapely
from joblib import Parallel, delayed

from benchmarks._harness import make_parser, with_figures
from nav_adapter.exporters import speed_limit_at
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from sim_tests import run_crossing
from sim_tests.crossing import CrossingFrame
from sim_tests.scenario import Scenario
from sim_tests.study.report import Table
from sim_tests.study.runs import named_scenarios

_ROOT: Final = Path(__file__).resolve().parents[1]
PAGE: Final = _ROOT / "docs" / "planners.md"
_ROWS: Final = Path(__file__).with_name("floor.csv")
_COLUMNS: Final = ("scenario", "policy", "seed", "lost_s", "floor_s")
_POLICIES: Final = ("scanner", "balanced")
_SEEDS: Final = (90, 91, 92)
_OFFSETS_M: Final = (0.0, -0.3, 0.3, -0.6, 0.6, -0.9, 0.9, -1.2, 1.2, -1.4, 1.4)
# Times, places and speeds of the search. Twice the distance of a step is a multiple of _GRID_M.
_STEP_S: Final = 0.2
_PLACES_M: Final = 0.1
_SPEED_MPS: Final = 0.1
_GRID_M: Final = 0.5 * _SPEED_MPS * _STEP_S
# The longest drive; length of a change of offset; gap to boxes and to people's bodies.
_LONGEST_S: Final = 60.0
_CHANGE_M: Final = 2.6
_GAP_M: Final = 0.05


class Way(NamedTuple):
    """A way to the goal.

    Attributes:
        places_m: (N, 2), 0.1 m apart.
        headings_rad: (N,).
        outlines: (N,) polygons of the robot.
    """

    places_m: FloatArray
    headings_rad: FloatArray
    outlines: Any


def fastest_s(limits_mps: FloatArray, gains_mps2: float, brakes_mps2: float) -> float:
    """Return the time of the fastest drive from the first place, standing, to the last.

    Limits count where a step ends. A stretch that is shorter than a step is driven over: bodies,
    with the robot's outline about them, are longer.

    Args:
        limits_mps: (times, places) limits every 0.2 s and 0.1 m; negative where a robot must not
            move. One that brakes fully may be faster.
        gains_mps2: acceleration, > 0.
        brakes_mps2: deceleration, > 0.
    """
    allowed = np.floor(limits_mps / _SPEED_MPS + 0.5).astype(np.intp)
    gains, brakes = (
        max(round(each * _STEP_S / _SPEED_MPS), 1) for each in (gains_mps2, brakes_mps2)
    )
    cells = round(_PLACES_M / _GRID_M)
    place = (np.arange((limits_mps.shape[1] - 1) * cells + 1) + cells // 2) // cells
    speeds = int(allowed.max()) + 1
    reached = np.zeros((speeds, place.size), np.bool_)
    reached[0, 0] = True
    for step in range(1, len(limits_mps)):
        limit, before = allowed[step, place], reached
        reached = np.zeros_like(before)
        for speed, was in product(range(speeds), range(speeds)):
            if -brakes <= speed - was <= gains:
                lowest = 0 if speed - was == -brakes else speed
                may = (limit >= lowest) | (speed == 0)
                moved = min(speed + was, place.size)
                reached[speed, moved:] |= before[was, : place.size - moved] & may[moved:]
        if reached[: brakes + 1, -cells:].any():
            return step * _STEP_S
    return math.inf


def ways(scenario: Scenario) -> list[Way]:
    """Return the straight way and those beside it that keep clear of racks and walls."""
    robot, boxes_odom_m = scenario.robot_profile, scenario.planner_boxes_odom_m
    start = np.array([scenario.robot.start_x_m, scenario.robot.start_y_m])
    goal = np.array([scenario.robot.goal_x_m, scenario.robot.goal_y_m])
    length_m = float(np.hypot(*(goal - start)))
    along = (goal - start) / length_m
    left = np.array([-along[1], along[0]])
    s_m = np.linspace(0.0, length_m, 500)[:, None]
    share = np.clip(np.minimum(s_m, length_m - s_m) / _CHANGE_M, 0.0, 1.0)
    racks = shapely.union_all(shapely.box(*boxes_odom_m.T))
    found = []
    for offset_m in _OFFSETS_M:
        line = start + s_m * along + offset_m * share**2 * (3.0 - 2.0 * share) * left
        driven_m = np.concatenate([[0.0], np.hypot(*np.diff(line, axis=0).T).cumsum()])
        at_m = np.arange(0.0, driven_m[-1], _PLACES_M)
        places = np.stack([np.interp(at_m, driven_m, line[:, axis]) for axis in (0, 1)], axis=1)
        headings = np.arctan2(*np.gradient(places, axis=0).T[::-1])
        c, s = np.cos(headings), np.sin(headings)
        turns = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
        outlines = shapely.polygons(robot.footprint_m @ turns + places[:, None])
        if offset_m == 0.0 or shapely.distance(outlines, racks).min() >= _GAP_M:
            found.append(Way(places, headings, outlines))
    return found


def limits_mps(frames: Sequence[CrossingFrame], way: Way) -> FloatArray:
    """Return the limits (times, places) on a way, −1 where somebody's body is."""
    poses = way.places_m[:, None], way.headings_rad[:, None]
    limits = np.array(
        [speed_limit_at(frame.constraints, *poses, dt_s=_STEP_S)[:, 0] for frame in frames]
    )
    for limit, frame in zip(limits, frames, strict=True):
        for person in frame.truth:
            body = shapely.Point(person.position_odom_m)
            if not person.away:
                limit[shapely.distance(way.outlines, body) < BODY_RADIUS_M + _GAP_M] = -1.0
    return limits


def lost_s(name: str, policy: str, seed: int) -> tuple[str, str, int, float, float]:
    """Return a row: seconds lost by the drive, and by the fastest way, over an empty hall."""
    (scenario,) = named_scenarios([name])
    scenario = scenario.draw(seed)
    among, alone = (
        run_crossing(each, policy=policy, seed=seed)
        for each in (scenario, scenario.without_people())
    )
    if among.time_to_goal_s is None or alone.time_to_goal_s is None:
        raise RuntimeError(f"{name}, {policy}, seed {seed}: the goal was not reached")
    every, times = round(scenario.control_hz * _STEP_S), round(_LONGEST_S / _STEP_S)
    frames = among.frames[::every][:times]
    robot = scenario.robot_profile
    rates = robot.max_acceleration_mps2, robot.max_deceleration_mps2
    seconds = []
    for way in ways(scenario):
        limits = limits_mps(frames, way)
        limits = np.concatenate([limits, limits[-1:].repeat(times - len(frames), axis=0)])
        empty = np.full_like(limits, robot.max_speed_mps)
        seconds.append((fastest_s(limits, *rates), fastest_s(empty, *rates)))
    fastest, (_, free) = min(each for each, _ in seconds), seconds[0]
    return name, policy, seed, among.time_to_goal_s - alone.time_to_goal_s, fastest - free


def table() -> str:
    """Return the means of the committed rows as Markdown."""
    with _ROWS.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))

    def means(**of: str) -> list[str]:
        own = [row for row in rows if all(row[key] == value for key, value in of.items())]
        return [
            f"{np.mean([float(row[column]) for row in own if row['policy'] == policy]):.1f}"
            for policy in _POLICIES
            for column in ("lost_s", "floor_s")
        ]

    names = dict.fromkeys(row["scenario"] for row in rows)
    lines = [[f"`{name}`", *means(scenario=name)] for name in names]
    columns = [f"`{policy}`, {of}" for policy in _POLICIES for of in ("driven", "floor")]
    head = dict.fromkeys(("scenario", *columns), "")
    return Table(head, [["**all**", *means()], *lines]).markdown()


def page(text: str) -> str:
    """Return the text of the page with the present table."""
    return with_figures(text, {"floor": table()})


def main() -> int:
    """Run the command."""
    parser = make_parser("benchmarks.floor", "Seconds that the limits of a policy cost at least.")
    parser.add_argument("--drive", action="store_true", help="drive anew")
    if parser.parse_args().drive:
        names = (each.name for each in named_scenarios(["all"]))
        jobs = product(names, _POLICIES, _SEEDS)
        rows = Parallel(n_jobs=2, verbose=5)(delayed(lost_s)(*job) for job in jobs)
        with _ROWS.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(_COLUMNS)
            writer.writerows([*row[:3], *(f"{each:.2f}" for each in row[3:])] for row in rows)
    PAGE.write_text(page(PAGE.read_text("utf-8")), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
