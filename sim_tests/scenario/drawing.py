"""Drawing of a scenario from above: hall, paths with times, and gaze directions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.figures import (
    Axes,
    Circle,
    Figure,
    MultipleLocator,
    Polygon,
    Wedge,
    new_figure,
    save_figure,
)
from perception.arrays import FloatArray

from ..actors.behaviour import PersonSpec, RecordedPath, read_recordings
from ..world.errors import SimError
from ._scenario import Scenario
from .catalogue import closest_approaches, person_plan, planned_people, robot_plan

_FORMATS: Final = (".png", ".svg", ".pdf")
_WIDTH_IN: Final = 6.8
_DPI: Final = 100
_RACK: Final = "#c9ccd1"
_ROBOT: Final = "#1f5f8b"
_FAINT: Final = "#6b7280"
_DRAWS: Final = 12
# Time between the dots along a path.
_DOT_STEP_S: Final = 2.0
# People and robot are drawn where they are this long before the closest approach.
_BEFORE_S: Final = 1.5
_SECTOR_M: Final = 1.5
_SECTOR_HALF_DEG: Final = 60.0
_BODY_M: Final = 0.25
# Space around the paths in the drawing.
_MARGIN_M: Final = 0.8
_RECORDED: Final = "#6a4c93"


def draw_scenario(name: str, out: Path) -> None:
    """Draw a scenario, a shipped one or a YAML file, into a picture, and print its path."""
    if out.suffix.lower() not in _FORMATS:
        raise SimError(f"--out must end in {', '.join(_FORMATS)}, got {out}")
    save_figure(scenario_figure(Scenario.named(name)), out)
    print(f"\nWritten: {out}")


def scenario_figure(scenario: Scenario) -> Figure:
    """Return the drawing of a scenario at its medians, with thin lines for other draws.

    People and robot stand where they would be 1.5 s before their closest approach if nobody
    reacted. Dots are 2 s apart. A sector of ±60° shows the gaze of a person: dashed while they
    glance at the robot. Recorded people are shown as their paths.
    """
    recorded = () if scenario.replay_csv is None else read_recordings(scenario.replay_csv)
    people = planned_people(scenario)
    x_min, y_min, x_max, y_max = _window(scenario, people, recorded)
    width, height = x_max - x_min, y_max - y_min
    figure = new_figure(_WIDTH_IN, max(_WIDTH_IN * height / width, 1.8) + 0.75, dpi=_DPI)
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(y_min, y_max)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(2.0))
    axes.set_xlabel("x, odom (m)")
    axes.set_ylabel("y (m)")
    axes.set_title(scenario.id, loc="left", fontweight="bold", fontsize=10)
    axes.set_title(scenario.attention, loc="right", fontsize=9, color=_FAINT)
    for corners in _hall_corners(scenario):
        axes.add_patch(Polygon(corners, fc=_RACK, ec=_FAINT, lw=0.6))
    approaches = closest_approaches(scenario).values()
    now_s = max(min(approaches)[1] - _BEFORE_S, 0.0) if approaches else 0.0
    robot_m = _draw_robot(axes, scenario, now_s)
    if scenario.distributions:
        for seed in range(_DRAWS):
            for spec in scenario.draw(seed).people:
                axes.plot(*_route(spec).T, color=_looks(spec)[0], lw=0.5, alpha=0.35)
    for spec in people:
        _draw_person(axes, spec, now_s, robot_m)
    for path in recorded:
        _draw_recorded(axes, path)
    handles, labels = axes.get_legend_handles_labels()
    shown = dict(zip(labels, handles, strict=True))  # each label once
    style: dict[str, Any] = {"ncols": 4, "fontsize": 7.5, "frameon": False, "columnspacing": 1.2}
    figure.legend(shown.values(), shown.keys(), loc="outside upper center", **style)
    return figure


def _route(spec: PersonSpec) -> FloatArray:
    return np.array([[point.x_m, point.y_m] for point in spec.route])


def _window(
    scenario: Scenario, people: Sequence[PersonSpec], recorded: Sequence[RecordedPath]
) -> tuple[float, float, float, float]:
    """Return x_min, y_min, x_max, y_max of the part to draw: the paths and what is beside them."""
    task, hall = scenario.robot, scenario.layout
    ends = np.array([[task.start_x_m, task.start_y_m], [task.goal_x_m, task.goal_y_m]])
    paths = [_route(spec) for spec in people] + [path.positions_odom_m for path in recorded]
    places = np.vstack([ends, *paths])
    low, high = places.min(axis=0) - _MARGIN_M, places.max(axis=0) + _MARGIN_M
    if not recorded:
        # Show the racks on both sides of the aisle, and cross aisles only as far as they are used.
        low[1], high[1] = np.clip(low[1], -4.8, -3.3), np.clip(high[1], 3.3, 4.8)
    x_min, y_min = np.maximum(low, (hall.x_min_m, hall.y_min_m)).tolist()
    x_max, y_max = np.minimum(high, (hall.x_max_m, hall.y_max_m)).tolist()
    return x_min, y_min, x_max, y_max


def _hall_corners(scenario: Scenario) -> Iterator[FloatArray]:
    """Yield the corners (N, 2) of racks and props."""
    for rack in scenario.layout.racks:
        x0, y0, x1, y1 = rack.box_odom_m
        yield np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    for prop in scenario.layout.props:
        yield from (np.asarray(corners) for corners in prop.corners_odom_m)


def _draw_robot(axes: Axes, scenario: Scenario, now_s: float) -> FloatArray:
    """Draw the robot with its way and goal; return its place (2,) in odom."""
    task, robot = scenario.robot, scenario.robot_profile
    times = np.arange(0.0, scenario.duration_s, _DOT_STEP_S)
    path = robot_plan(task, times, robot)
    arrived = 1 + int(np.flatnonzero((path == path[-1]).all(axis=1))[0])
    ends = np.array([[task.start_x_m, task.start_y_m], [task.goal_x_m, task.goal_y_m]])
    axes.plot(*ends.T, color=_ROBOT, lw=1.6)
    _draw_times(axes, path[:arrived], times[:arrived], _ROBOT, (0, -9))
    goal: dict[str, Any] = {"mfc": "white", "ms": 7, "zorder": 4, "label": "robot's goal"}
    axes.plot(*ends[1:].T, "s", color=_ROBOT, **goal)
    here = robot_plan(task, np.array([now_s]), robot)[0]
    heading = math.atan2(*(ends[1] - ends[0])[::-1].tolist())
    cos, sin = math.cos(heading), math.sin(heading)
    outline = robot.footprint_m @ np.array([[cos, sin], [-sin, cos]]) + here
    axes.add_patch(Polygon(outline, fc=_ROBOT, ec="black", lw=0.8, zorder=5))
    return np.asarray(here)


def _draw_person(axes: Axes, spec: PersonSpec, now_s: float, robot_m: FloatArray) -> None:
    """Draw a person's route with its dots, the body and the gaze."""
    colour, label = _looks(spec)
    corners = _route(spec)
    now, before = person_plan(spec, np.array([now_s + 0.05, now_s - 0.05]))[0]
    here = person_plan(spec, np.array([now_s]))[0][0]
    step = now - before
    if len(corners) > 1:
        axes.plot(*corners.T, color=colour, lw=1.4)
        times = np.arange(math.ceil(spec.start_s / _DOT_STEP_S) * _DOT_STEP_S, 60.0, _DOT_STEP_S)
        path, walked = person_plan(spec, times)
        moving = int(np.searchsorted(walked, walked[-1]))
        _draw_times(axes, path[:moving], times[:moving], colour, (4, 1))
        last = corners[-1] - corners[-2]
        tail = corners[-1] - 0.3 * last / np.linalg.norm(last)
        arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.2}
        axes.annotate("", corners[-1].tolist(), tail.tolist(), arrowprops=arrow)
        if np.linalg.norm(step) < 1e-6:
            step = corners[1] - corners[0]
    # The body faces along the path, backwards, or as specified while standing.
    facing = math.atan2(step[1], step[0]) + math.pi * spec.backwards
    if now.tolist() == before.tolist() and spec.heading_deg is not None:
        facing = math.radians(spec.heading_deg)
    away = facing + math.radians(spec.glances.away_yaw_deg)
    to_robot = math.atan2(*(robot_m - here)[::-1].tolist())
    if spec.glances.notices_within_m > 0.0 and spec.glances.watches:
        _draw_sector(axes, here, to_robot, colour)
    elif not spec.gaze:
        _draw_sector(axes, here, away, colour)
        if spec.glances.notices_within_m > 0.0:
            _draw_sector(axes, here, to_robot, colour, dashed=True)
    x, y = here.tolist()
    axes.add_patch(Circle((x, y), _BODY_M, fc="white", ec=colour, lw=1.8, zorder=5))
    nose = here + 1.35 * _BODY_M * np.array([math.cos(facing), math.sin(facing)])
    axes.plot([x, nose[0]], [y, nose[1]], color=colour, lw=1.8, zorder=5, label=label)


def _draw_recorded(axes: Axes, path: RecordedPath) -> None:
    """Draw a recorded path with its dots, and a ring where it begins."""
    times, places = path.times_s, path.positions_odom_m
    axes.plot(*places.T, color=_RECORDED, lw=1.2, label="recorded person")
    dots = np.arange(math.ceil(times[0] / _DOT_STEP_S) * _DOT_STEP_S, times[-1], _DOT_STEP_S)
    dotted = np.column_stack([np.interp(dots, times, places[:, axis]) for axis in (0, 1)])
    _draw_times(axes, dotted, dots, _RECORDED, (4, 1))
    x, y = places[0].tolist()
    axes.add_patch(Circle((x, y), _BODY_M, fc="white", ec=_RECORDED, lw=1.4, zorder=5))


def _draw_times(
    axes: Axes, path: FloatArray, times: FloatArray, colour: str, beside_pt: tuple[int, int]
) -> None:
    axes.plot(*path.T, "o", color=colour, ms=3.2, zorder=3)
    for (x, y), t_s in zip(path.tolist(), times, strict=True):
        axes.annotate(
            f"{t_s:g}",
            (x, y),
            xytext=beside_pt,
            textcoords="offset points",
            ha="left" if beside_pt[0] else "center",
            fontsize=6.5,
            color=colour,
            zorder=6,
            annotation_clip=True,  # those outside the drawing are left out
        )


def _draw_sector(
    axes: Axes, here: FloatArray, towards_rad: float, colour: str, *, dashed: bool = False
) -> None:
    x, y = here.tolist()
    middle = math.degrees(towards_rad)
    first, last = middle - _SECTOR_HALF_DEG, middle + _SECTOR_HALF_DEG
    look: dict[str, Any] = {"fc": colour, "alpha": 0.28}
    if dashed:
        look = {"fc": "none", "alpha": 0.8, "ls": "--"}
    axes.add_patch(Wedge((x, y), _SECTOR_M, first, last, ec=colour, lw=0.9, zorder=2, **look))


def _looks(spec: PersonSpec) -> tuple[str, str]:
    """Return the colour of a person, and what it means."""
    if spec.gaze:
        return "#0f766e", "looks as planned"
    if spec.glances.notices_within_m <= 0.0:
        return "#b3261e", "never looks at the robot"
    if spec.glances.watches:
        return "#2e7d4f", "watches the robot once noticed"
    return "#b8860b", "glances at the robot"
