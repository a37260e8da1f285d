"""What makes a scenario impossible to act out, and whether robot and people meet in it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from .._line_of_sight import crosses_boxes
from .._scenario import Scenario
from .._scenario_template import ScenarioTemplate
from ..robot._amr import NOVA_CARTER
from ._plan import closest_approaches

#: Robot and person are in conflict if their centres would come nearer than this.
CONFLICT_M: Final = 1.0


@dataclass(frozen=True, slots=True)
class Meetings:
    """How near robot and people would come in many draws if nobody reacted.

    Attributes:
        share: of the draws in which somebody is nearer than :data:`CONFLICT_M`.
        median_m: of the smallest distance between centres.
        median_s: of the time at which that is.
        draws: number of draws.
    """

    share: float
    median_m: float
    median_s: float
    draws: int


def meetings(template: ScenarioTemplate, draws: int = 200) -> Meetings | None:
    """The meetings of a scenario over seeds 0, 1, …; None where nobody has a plan of their own."""
    varies = bool(template.parameters())
    found = []
    for seed in range(draws if varies else 1):
        nearest = closest_approaches(template.for_seed(seed))
        if not nearest:
            return None
        found.append(min(nearest.values()))
    apart = np.array(found)
    return Meetings(
        float(np.mean(apart[:, 0] < CONFLICT_M)),
        float(np.median(apart[:, 0])),
        float(np.median(apart[:, 1])),
        len(found),
    )


def problems(scenario: Scenario) -> tuple[str, ...]:
    """What cannot be: people and robot in racks or outside the hall, missing files."""
    hall = scenario.layout
    boxes = hall.obstacle_boxes_odom
    inner = (hall.x_min_m, hall.y_min_m, hall.x_max_m, hall.y_max_m)
    task = scenario.robot
    start, goal = (task.start_x_m, task.start_y_m), (task.goal_x_m, task.goal_y_m)
    reach = NOVA_CARTER.circumscribed_radius_m
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
            if not _inside(here, boxes, 0.0) and crosses_boxes(grown, here, [there])[0]:
                found.append(
                    f"people: {person.name}: the way from route point {number} to {number + 1} "
                    f"leads through or within {BODY_RADIUS_M:g} m of a rack, a prop or a wall"
                )
    for number, script in enumerate(scenario.workers):
        for waypoint in script.path:
            what = f"workers: {number}: the place at {waypoint.t_s:g} s"
            found += _place_problems(what, (waypoint.x_m, waypoint.y_m), boxes, inner, 0.0)
    if scenario.replay_csv is not None and not Path(scenario.replay_csv).is_file():
        found.append(f"replay_csv: there is no file {scenario.replay_csv}")
    return tuple(dict.fromkeys(found))


def _place_problems(
    what: str,
    place_m: tuple[float, float],
    boxes: FloatArray,
    inner: tuple[float, float, float, float],
    room_m: float,
) -> list[str]:
    x, y = place_m
    if not (inner[0] <= x <= inner[2] and inner[1] <= y <= inner[3]):
        return [
            f"{what} at ({x:g}, {y:g}) m is outside the hall, x {inner[0]:g} to {inner[2]:g} m, "
            f"y {inner[1]:g} to {inner[3]:g} m"
        ]
    if _inside(place_m, boxes, room_m):
        return [
            f"{what} at ({x:g}, {y:g}) m is in, or nearer than {room_m:g} m to, a rack, a prop or "
            "a wall"
        ]
    return []


def _inside(place_m: tuple[float, float], boxes: FloatArray, room_m: float) -> bool:
    place = np.array(place_m)
    outside = np.maximum(np.maximum(boxes[:, :2] - place, place - boxes[:, 2:]), 0.0)
    return bool((np.linalg.norm(outside, axis=1) < max(room_m, 1e-9)).any())
