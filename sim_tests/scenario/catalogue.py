"""Scenarios listed, described and checked without a crossing: the plans if nobody reacted."""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.files import json_text
from nav_adapter import RobotProfile
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ..actors.behaviour import PersonSpec, Route
from ..actors.robot import NOVA_CARTER
from ..world import crosses_boxes
from ..world.errors import SimError
from ._distributions import Choice, Distribution
from ._files import SCENARIO_SETS, shipped_scenarios
from ._scenario import RobotTask, Scenario

#: Robot and person are in conflict if their centres would come closer than this.
CONFLICT_M: Final = 1.0
#: Draws of a scenario that are checked.
CHECKED_DRAWS: Final = 100
_STEP_S: Final = 0.02


def robot_plan(task: RobotTask, t_s: FloatArray, robot: RobotProfile = NOVA_CARTER) -> FloatArray:
    """Return the positions (T, 2) in odom of a robot that drives straight to its goal and stops.

    It accelerates to its maximum speed, or to the speed of the task; braking is not modelled.
    """
    start = np.array([task.start_x_m, task.start_y_m])
    goal = np.array([task.goal_x_m, task.goal_y_m])
    length = float(np.linalg.norm(goal - start))
    speed = task.straight_on_speed_mps or robot.max_speed_mps
    speed_up_s = np.minimum(t_s, speed / robot.max_acceleration_mps2)
    driven = 0.5 * robot.max_acceleration_mps2 * speed_up_s**2 + speed * (t_s - speed_up_s)
    share = np.minimum(driven / max(length, 1e-9), 1.0)
    return np.asarray(start + share[:, None] * (goal - start))


def person_plan(spec: PersonSpec, t_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the positions (T, 2) in odom and the walked lengths (T,) of a person's plan.

    The person walks the route at the planned speed, with its pauses, and turns back if planned.
    """
    route = Route.from_spec(spec)
    # Knots of walked length over time; the length is constant in a pause.
    times, lengths = [spec.start_s], [0.0]
    stops = [(each.at_m, each.for_s) for each in spec.pauses if each.at_m < route.length_m]
    for at_m, for_s in (*sorted(stops), (route.length_m, 0.0)):
        times.append(times[-1] + (at_m - lengths[-1]) / spec.speed_mps)
        times.append(times[-1] + for_s)
        lengths += [at_m, at_m]
    walked = np.interp(t_s, times, lengths)
    return np.array([route.point(along_m) for along_m in walked.tolist()]), walked


def planned_people(scenario: Scenario) -> tuple[PersonSpec, ...]:
    """Return the people, with a planned start for those who set off as the robot comes."""
    t_s = np.arange(0.0, scenario.duration_s, _STEP_S)
    robot = robot_plan(scenario.robot, t_s, scenario.robot_profile)
    reach_m = float(scenario.robot_profile.footprint_m[:, 0].max())
    planned = []
    for spec in scenario.people:
        if spec.sets_off_within_m is not None:
            first, second = (np.array([point.x_m, point.y_m]) for point in spec.route[:2])
            ux, uy = (second - first) / max(float(np.linalg.norm(second - first)), 1e-9)
            gaps_m = np.abs((robot - first) @ np.array([-uy, ux])) - reach_m
            near = np.flatnonzero((gaps_m <= spec.sets_off_within_m) & (t_s >= spec.start_s))
            start_s = float(t_s[near[0]]) if len(near) else scenario.duration_s
            planned.append(spec.model_copy(update={"start_s": start_s, "sets_off_within_m": None}))
        else:
            planned.append(spec)
    return tuple(planned)


def closest_approaches(scenario: Scenario) -> dict[str, tuple[float, float]]:
    """Return how close the robot would come to each person if nobody reacted, and when.

    Robot and people keep to their plans; only the time until the robot reaches its goal counts.

    Returns:
        By name: distance of the centres in metres and
        time in seconds.
    """
    t_s = np.arange(0.0, scenario.duration_s, _STEP_S)
    robot = robot_plan(scenario.robot, t_s, scenario.robot_profile)
    arrived = np.flatnonzero((robot == robot[-1]).all(axis=1))[0] + 1
    t_s, robot = t_s[:arrived], robot[:arrived]
    paths = {spec.name: person_plan(spec, t_s)[0] for spec in planned_people(scenario)}
    closest = {}
    for name, path in paths.items():
        distances = np.linalg.norm(path - robot, axis=1)
        row = int(distances.argmin())
        closest[name] = (float(distances[row]), float(t_s[row]))
    return closest


@dataclass(frozen=True, slots=True)
class ApproachStatistics:
    """Closest approaches of robot and people over many draws of a scenario, if nobody reacted.

    Attributes:
        conflict_share: share of the draws in which somebody comes closer than :data:`CONFLICT_M`.
        median_distance_m: median of the smallest distance between centres.
        median_time_s: median of the time of that distance.
        draws: number of draws.
    """

    conflict_share: float
    median_distance_m: float
    median_time_s: float
    draws: int


def approach_statistics(scenario: Scenario, draws: int = 200) -> ApproachStatistics | None:
    """Return the statistics over seeds 0, 1, …; None for a scenario without planned people."""
    varies = bool(scenario.distributions)
    closest = []
    for seed in range(draws if varies else 1):
        approaches = closest_approaches(scenario.draw(seed))
        if not approaches:
            return None
        closest.append(min(approaches.values()))
    rows = np.array(closest)
    return ApproachStatistics(
        float(np.mean(rows[:, 0] < CONFLICT_M)),
        float(np.median(rows[:, 0])),
        float(np.median(rows[:, 1])),
        len(closest),
    )


def drawn_problems(scenario: Scenario) -> tuple[str, ...]:
    """Return what makes draws of a scenario impossible, each with the first seed that shows it."""
    first: dict[str, str] = {}
    for seed in range(CHECKED_DRAWS if scenario.distributions else 1):
        try:
            problems = scenario_problems(scenario.draw(seed))
            found = [f"{problem} (seed {seed})" for problem in problems]
        except SimError as error:  # it names the seed
            found = [str(error)]
        for problem in found:
            # The same problem with other numbers is reported once.
            first.setdefault(re.sub(r"[-\d.]+", "", problem), problem)
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
        found += _problems_of_stops(person)
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


def _problems_of_stops(person: PersonSpec) -> list[str]:
    """Return the turn and the pauses that a person never comes to, which would do nothing."""
    way_m, turn_m = Route.from_spec(person).length_m, person.turns_back_at_m
    stops = [(f"the pause at_m {pause.at_m:g}", pause.at_m) for pause in person.pauses]
    if turn_m is not None:
        stops.insert(0, (f"turns_back_at_m {turn_m:g}", turn_m))
    return [
        f"people: {person.name}: {what} is not before the end of the way of {way_m:.4g} m: make "
        "it smaller, or leave it out"
        for what, at_m in stops
        if at_m >= way_m
    ]


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


def list_command(*, as_json: bool = False) -> int:
    """Print the shipped scenarios, set by set."""
    sets = {name: [*map(Scenario.shipped, shipped_scenarios(name))] for name in SCENARIO_SETS}
    if as_json:
        rows = [_list_row(each, name) for name, scenarios in sets.items() for each in scenarios]
        print(json_text(rows), end="")
        return 0
    width = max(len(scenario.id) for scenarios in sets.values() for scenario in scenarios)
    for name, scenarios in sets.items():
        print(f"{'' if name == SCENARIO_SETS[0] else chr(10)}--scenario {name}")
        print(f"{'scenario':{width}}  attention  people  varies")
        for scenario in scenarios:
            counts = f"{len(scenario.people):6}  {len(scenario.distributions):6}"
            print(f"{scenario.id:{width}}  {scenario.attention:9}  {counts}")
            print(textwrap.indent(textwrap.fill(scenario.description, 76), "    "))
    return 0


def _list_row(scenario: Scenario, scenario_set: str) -> dict[str, Any]:
    return {
        "set": scenario_set,
        "name": scenario.name,
        "version": scenario.version,
        "attention": scenario.attention,
        "people": len(scenario.people),
        "varies": len(scenario.distributions),
        "description": scenario.description,
    }


def show_command(name: str, *, yaml: bool, seed: int | None) -> int:
    """Print one scenario, in words or as YAML."""
    scenario = Scenario.named(name)
    if seed is not None and not yaml:
        raise SimError("--seed needs --yaml: the description covers all draws of a scenario")
    if yaml:
        text = scenario.to_text() if seed is None else scenario.draw(seed).to_text()
        print(text, end="")
    else:
        print("\n".join(description_lines(scenario)))
    return 0


def description_lines(scenario: Scenario) -> list[str]:
    """Return the description: the task, the people, what varies, and the closest approach."""
    task = scenario.robot
    lines = [
        f"{scenario.id} ({scenario.attention})",
        scenario.description,
        "",
        f"robot   from ({task.start_x_m:g}, {task.start_y_m:g}) m to ({task.goal_x_m:g}, "
        f"{task.goal_y_m:g}) m within {scenario.duration_s:g} s",
        *(f"person  {_person_text(person)}" for person in scenario.people),
    ]
    if scenario.replay_csv is not None:
        lines.append(f"replay  {scenario.replay_csv}")
    if scenario.distributions:
        lines += ["", "varies"]
        width = max(map(len, scenario.distributions))
        lines += [
            f"  {path:{width}}  {distribution_text(distribution)}"
            for path, distribution in scenario.distributions.items()
        ]
    statistics = approach_statistics(scenario)
    if statistics is not None:
        draws = "the scenario" if statistics.draws == 1 else f"{statistics.draws} draws"
        lines += [
            "",
            f"if nobody reacted: centres nearer than {CONFLICT_M:g} m in "
            f"{statistics.conflict_share:.0%} of {draws}, {statistics.median_distance_m:.2f} m at "
            f"{statistics.median_time_s:.1f} s in the median",
        ]
    return lines


def distribution_text(distribution: Distribution) -> str:
    """Return a short description of a distribution."""
    low, high = distribution.bounds
    if isinstance(distribution, Choice):
        return f"one of {', '.join(f'{value:g}' for value in distribution.values)}"
    kind = type(distribution).__name__.lower()
    return f"{low:g} to {high:g}, median {distribution.median:.3g} ({kind})"


def names_of_sets(names: Sequence[str]) -> list[str]:
    """Return names and files with the names of a set's scenarios in place of the set's."""
    return [
        each
        for name in names
        for each in (shipped_scenarios(name) if name in SCENARIO_SETS else [name])
    ]


def _start_text(spec: PersonSpec) -> str:
    if spec.sets_off_within_m is None:
        return f"{spec.start_s:.1f} s"
    return f"when the robot is {spec.sets_off_within_m:.1f} m from that line"


def _person_text(spec: PersonSpec) -> str:
    first, last = spec.route[0], spec.route[-1]
    walks = (
        f"stands at ({first.x_m:.3g}, {first.y_m:.3g}) m"
        if len(spec.route) == 1
        else f"walks from ({first.x_m:.3g}, {first.y_m:.3g}) to ({last.x_m:.3g}, {last.y_m:.3g}) m "
        f"at {spec.speed_mps:.2f} m/s from {_start_text(spec)}"
    )
    glances = spec.glances
    if spec.gaze:
        looks = "looks as planned"
    elif glances.notices_within_m <= 0.0:
        looks = "never looks at the robot"
    else:
        looks = "watches" if glances.watches else "glances at"
        looks += f" the robot within {glances.notices_within_m:g} m"
    extras = [
        text
        for text, holds in (
            ("backwards", spec.backwards),
            ("pauses", bool(spec.pauses)),
            ("turns back", spec.turns_back_at_m is not None),
            (spec.activity.replace("_", " "), spec.activity != "none"),
        )
        if holds
    ]
    return ", ".join([f"{spec.name}: {walks}", *extras, looks])
