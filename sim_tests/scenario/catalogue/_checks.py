"""Checks of a scenario: people or robot inside racks or outside the hall, missing files."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ...world import crosses_boxes
from ...world.errors import SimError
from .._scenario import Scenario
from .._template import ScenarioTemplate

#: Draws of a scenario that are checked.
CHECKED_DRAWS: Final = 100


def template_problems(template: ScenarioTemplate) -> tuple[str, ...]:
    """Return what makes draws of a scenario impossible, each with the first seed that shows it."""
    first: dict[str, str] = {}
    for seed in range(CHECKED_DRAWS if template.parameters() else 1):
        try:
            found = scenario_problems(template.for_seed(seed))
        except SimError as error:
            found = (str(error),)
        for problem in found:
            # The same problem with other numbers is reported once.
            first.setdefault(re.sub(r"[-\d.]+", "", problem), f"{problem} (seed {seed})")
    return tuple(first.values())


def scenario_problems(scenario: Scenario) -> tuple[str, ...]:
    """Return what makes a scenario impossible, one sentence per problem."""
    hall = scenario.layout
    boxes = hall.obstacle_boxes_odom
    inner = (hall.x_min_m, hall.y_min_m, hall.x_max_m, hall.y_max_m)
    task = scenario.robot
    start, goal = (task.start_x_m, task.start_y_m), (task.goal_x_m, task.goal_y_m)
    reach = scenario.robot_profile.circumscribed_radius_m  # room to turn
    found = [
        *_place_problems("the robot's start", start, boxes, inner, reach),
        *_place_problems("the robot's goal", goal, boxes, inner, reach),
    ]
    grown = boxes + BODY_RADIUS_M * np.array([-1.0, -1.0, 1.0, 1.0])
    for person in scenario.people:
        corners = [(point.x_m, point.y_m) for point in person.route]
        for number, corner in enumerate(corners):
            what = f"people: {person.name}: route point {number}"
            found += _place_problems(what, corner, boxes, inner, BODY_RADIUS_M)
        for number, (here, there) in enumerate(itertools.pairwise(corners)):
            if not _within(here, boxes, 0.0) and crosses_boxes(grown, here, [there])[0]:
                found.append(
                    f"people: {person.name}: the path from route point {number} to {number + 1} "
                    f"leads through or within {BODY_RADIUS_M:g} m of a rack, a prop or a wall"
                )
    if scenario.replay_csv is not None and not Path(scenario.replay_csv).is_file():
        found.append(f"replay_csv: there is no file {scenario.replay_csv}")
    return tuple(dict.fromkeys(found))


def _place_problems(
    what: str,
    place_m: tuple[float, float],
    boxes: FloatArray,
    inner: tuple[float, float, float, float],
    clearance_m: float,
) -> list[str]:
    x, y = place_m
    if not (inner[0] <= x <= inner[2] and inner[1] <= y <= inner[3]):
        return [
            f"{what} at ({x:g}, {y:g}) m is outside the hall, x {inner[0]:g} to {inner[2]:g} m, "
            f"y {inner[1]:g} to {inner[3]:g} m"
        ]
    if _within(place_m, boxes, clearance_m):
        return [
            f"{what} at ({x:g}, {y:g}) m is in, or nearer than {clearance_m:g} m to, a rack, "
            "a prop or a wall"
        ]
    return []


def _within(place_m: tuple[float, float], boxes: FloatArray, clearance_m: float) -> bool:
    """Return whether a place is in a box or closer than ``clearance_m`` to one."""
    place = np.array(place_m)
    outside = np.maximum(np.maximum(boxes[:, :2] - place, place - boxes[:, 2:]), 0.0)
    return bool((np.linalg.norm(outside, axis=1) < max(clearance_m, 1e-9)).any())
