"""Drawing of a scenario from above: hall, paths with times, and gaze directions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.figures import (
    Axes,
    Circle,
    Figure,
    Image,
    MultipleLocator,
    Polygon,
    Rectangle,
    Wedge,
    new_figure,
    save_figure,
)
from perception.arrays import FloatArray

from ...actors.behaviour import PersonSpec, RecordedPath, WorkerScript, read_recordings
from ...world.errors import SimError
from .._scenario import Scenario
from .._template import ScenarioTemplate
from ._plans import closest_approaches, person_plan, planned_people, robot_plan

_WIDTH_IN: Final = 6.8
_DPI: Final = 100
_COLOURS: Final = 96
_RACK: Final = "#c9ccd1"
_PROP: Final = "#a98f6b"
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
# Colours of people who watch the robot, glance at it, or never look; sectors also differ by fill.
_WATCHES: Final = "#2e7d4f"
_GLANCES: Final = "#b8860b"
_NEVER: Final = "#b3261e"
_RECORDED: Final = "#6a4c93"


def scenario_figure(template: ScenarioTemplate) -> Figure:
    """Return the drawing of a scenario at its medians, with thin lines for other draws.

    People and robot stand where they would be 1.5 s before their closest approach if nobody
    reacted. Dots are 2 s apart. A sector of ±60° shows the gaze of a person. Recorded people are
    shown as their paths.
    """
    scenario = template.median()
    recorded = () if scenario.replay_csv is None else read_recordings(scenario.replay_csv)
    x_min, y_min, x_max, y_max = _window(scenario, recorded)
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
    axes.set_title(template.id, loc="left", fontweight="bold", fontsize=10)
    axes.set_title(template.attention, loc="right", fontsize=9, color=_FAINT)
    _draw_hall(axes, scenario)
    now_s = _drawn_time_s(scenario)
    _draw_robot(axes, scenario, now_s)
    robot_m = robot_plan(scenario.robot, np.array([now_s]), scenario.robot_profile)[0]
    others = [template.for_seed(seed).people for seed in range(_DRAWS)]
    for number, spec in enumerate(planned_people(scenario)):
        for people in others:
            _draw_route(axes, people[number], faint=True)
        _draw_person(axes, spec, now_s, robot_m)
    for script in scenario.workers:
        _draw_worker(axes, script, now_s, scenario.duration_s, robot_m)
    for recording in recorded:
        _draw_recorded(axes, recording)
    _draw_legend(figure, axes, scenario)
    return figure


def save_drawing(figure: Figure, path: Path) -> None:
    """Write a drawing; the file appears whole or not at all.

    A PNG gets a palette, which makes it a third of the size.

    Raises:
        SimError: for a file that cannot be written.
    """
    if path.suffix.lower() != ".png":
        save_figure(figure, path)
        return
    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    image = Image.open(drawn).convert("RGB")
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        image.quantize(_COLOURS, dither=Image.Dither.NONE).save(part, "PNG", optimize=True)
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        part.unlink(missing_ok=True)


def _window(
    scenario: Scenario, recorded: Sequence[RecordedPath]
) -> tuple[float, float, float, float]:
    """Return x_min, y_min, x_max, y_max of the part to draw: the paths and what is beside them."""
    task, hall = scenario.robot, scenario.layout
    places = [(task.start_x_m, task.start_y_m), (task.goal_x_m, task.goal_y_m)]
    places += [(point.x_m, point.y_m) for person in scenario.people for point in person.route]
    places += [(point.x_m, point.y_m) for script in scenario.workers for point in script.path]
    corners = np.vstack([np.array(places), *(path.positions_odom_m for path in recorded)])
    low, high = corners.min(axis=0) - _MARGIN_M, corners.max(axis=0) + _MARGIN_M
    if not recorded:
        # Show the racks on both sides of the aisle, and cross aisles only as far as they are used.
        low[1], high[1] = np.clip(low[1], -4.8, -3.3), np.clip(high[1], 3.3, 4.8)
    x_min, y_min = np.maximum(low, (hall.x_min_m, hall.y_min_m)).tolist()
    x_max, y_max = np.minimum(high, (hall.x_max_m, hall.y_max_m)).tolist()
    return x_min, y_min, x_max, y_max


def _drawn_time_s(scenario: Scenario) -> float:
    approaches = closest_approaches(scenario).values()
    return max(min(approaches)[1] - _BEFORE_S, 0.0) if approaches else 0.0


def _draw_hall(axes: Axes, scenario: Scenario) -> None:
    for rack in scenario.layout.racks:
        x, y, *_ = rack.box_odom_m
        axes.add_patch(Rectangle((x, y), rack.length_m, rack.width_m, fc=_RACK, ec=_FAINT, lw=0.6))
    for prop in scenario.layout.props:
        for corners in prop.corners_odom_m:
            axes.add_patch(Polygon(corners, fc=_PROP, ec=_FAINT, lw=0.6))


def _draw_robot(axes: Axes, scenario: Scenario, now_s: float) -> None:
    task, robot = scenario.robot, scenario.robot_profile
    times = np.arange(0.0, scenario.duration_s, _DOT_STEP_S)
    path = robot_plan(task, times, robot)
    arrived = 1 + int(np.flatnonzero((path == path[-1]).all(axis=1))[0])
    axes.plot(
        [task.start_x_m, task.goal_x_m], [task.start_y_m, task.goal_y_m], color=_ROBOT, lw=1.6
    )
    _draw_times(axes, path[:arrived], times[:arrived], _ROBOT, below=True)
    axes.plot(task.goal_x_m, task.goal_y_m, "s", color=_ROBOT, mfc="white", ms=7, zorder=4)
    here = robot_plan(task, np.array([now_s]), robot)[0]
    heading = math.atan2(task.goal_y_m - task.start_y_m, task.goal_x_m - task.start_x_m)
    cos, sin = math.cos(heading), math.sin(heading)
    outline = robot.footprint_m @ np.array([[cos, sin], [-sin, cos]]) + here
    axes.add_patch(Polygon(outline, fc=_ROBOT, ec="black", lw=0.8, zorder=5))


def _draw_route(axes: Axes, spec: PersonSpec, *, faint: bool) -> None:
    corners = np.array([[point.x_m, point.y_m] for point in spec.route])
    colour = _colour(spec)
    if len(corners) == 1:
        axes.plot(*corners[0], ".", color=colour, alpha=0.35 if faint else 1.0, ms=3)
        return
    axes.plot(*corners.T, color=colour, lw=0.5 if faint else 1.4, alpha=0.35 if faint else 1.0)


def _draw_person(axes: Axes, spec: PersonSpec, now_s: float, robot_m: FloatArray) -> None:
    _draw_route(axes, spec, faint=False)

    def place(t_s: float) -> FloatArray:
        return np.asarray(person_plan(spec, np.array([t_s]))[0][0])

    here = place(now_s)
    if len(spec.route) > 1:
        times = np.arange(math.ceil(spec.start_s / _DOT_STEP_S) * _DOT_STEP_S, 60.0, _DOT_STEP_S)
        path, walked = person_plan(spec, times)
        moving = int(np.searchsorted(walked, walked[-1]))
        _draw_times(axes, path[:moving], times[:moving], _colour(spec))
        _draw_arrow(axes, np.array([[point.x_m, point.y_m] for point in spec.route]), spec)
    facing = _facing_rad(spec, place, now_s)
    glances = spec.glances
    away = facing + math.radians(glances.away_yaw_deg)
    to_robot = math.atan2(*(robot_m - here)[::-1].tolist())
    if glances.notices_within_m <= 0.0:
        _draw_sector(axes, here, away, _NEVER)
    elif glances.watches:
        _draw_sector(axes, here, to_robot, _WATCHES)
    else:
        _draw_sector(axes, here, away, _GLANCES)
        _draw_sector(axes, here, to_robot, _GLANCES, dashed=True)
    _draw_body(axes, here, facing, _colour(spec))


def _draw_worker(
    axes: Axes, script: WorkerScript, now_s: float, until_s: float, robot_m: FloatArray
) -> None:
    times = np.arange(0.0, until_s, 0.1)
    motions = [script.motion(float(t)) for t in times]
    path = np.array([motion.position_odom_m for motion in motions])
    axes.plot(*path.T, color=_GLANCES, lw=1.4)
    every = round(_DOT_STEP_S / 0.1)
    last = min(round(script.path[-1].t_s / 0.1) + 1, len(times))
    _draw_times(axes, path[:last:every], times[:last:every], _GLANCES)
    now = script.motion(now_s)
    here = now.position_odom_m
    to_robot = math.atan2(*(robot_m - here)[::-1].tolist())
    gaze, _ = script.gaze_angles(now_s, now.heading_odom_rad, (to_robot, 0.0))
    _draw_sector(axes, here, gaze, _GLANCES)
    _draw_body(axes, here, now.heading_odom_rad, _GLANCES)


def _draw_recorded(axes: Axes, path: RecordedPath) -> None:
    """Draw a recorded path with its dots, and a ring where it begins."""
    times, places = path.times_s, path.positions_odom_m
    axes.plot(*places.T, color=_RECORDED, lw=1.2)
    dots = np.arange(math.ceil(times[0] / _DOT_STEP_S) * _DOT_STEP_S, times[-1], _DOT_STEP_S)
    dotted = np.column_stack([np.interp(dots, times, places[:, axis]) for axis in (0, 1)])
    _draw_times(axes, dotted, dots, _RECORDED)
    x, y = places[0].tolist()
    axes.add_patch(Circle((x, y), _BODY_M, fc="white", ec=_RECORDED, lw=1.4, zorder=5))


def _draw_times(
    axes: Axes, path: FloatArray, times: FloatArray, colour: str, *, below: bool = False
) -> None:
    axes.plot(*path.T, "o", color=colour, ms=3.2, zorder=3)
    for place, t_s in zip(path, times, strict=True):
        axes.annotate(
            f"{t_s:g}",
            (float(place[0]), float(place[1])),
            xytext=(0, -9) if below else (4, 1),
            textcoords="offset points",
            ha="center" if below else "left",
            fontsize=6.5,
            color=colour,
            zorder=6,
            annotation_clip=True,  # those outside the drawing are left out
        )


def _draw_arrow(axes: Axes, corners: FloatArray, spec: PersonSpec) -> None:
    last = corners[-1] - corners[-2]
    axes.annotate(
        "",
        corners[-1].tolist(),
        (corners[-1] - 0.3 * last / np.linalg.norm(last)).tolist(),
        arrowprops={"arrowstyle": "-|>", "color": _colour(spec), "lw": 1.2},
    )


def _draw_sector(
    axes: Axes, here: FloatArray, towards_rad: float, colour: str, *, dashed: bool = False
) -> None:
    middle = math.degrees(towards_rad)
    axes.add_patch(
        Wedge(
            (float(here[0]), float(here[1])),
            _SECTOR_M,
            middle - _SECTOR_HALF_DEG,
            middle + _SECTOR_HALF_DEG,
            fc="none" if dashed else colour,
            ec=colour,
            alpha=0.8 if dashed else 0.28,
            lw=0.9,
            ls="--" if dashed else "-",
            zorder=2,
        )
    )


def _draw_body(axes: Axes, here: FloatArray, facing_rad: float, colour: str) -> None:
    x, y = here.tolist()
    axes.add_patch(Circle((x, y), _BODY_M, fc="white", ec=colour, lw=1.8, zorder=5))
    nose = here + 1.35 * _BODY_M * np.array([math.cos(facing_rad), math.sin(facing_rad)])
    axes.plot([x, float(nose[0])], [y, float(nose[1])], color=colour, lw=1.8, zorder=5)


def _facing_rad(spec: PersonSpec, place: Callable[[float], FloatArray], now_s: float) -> float:
    """Return the heading of the body: along the path, backwards, or as specified while standing."""
    step = place(now_s + 0.05) - place(now_s - 0.05)
    if float(np.linalg.norm(step)) < 1e-6:
        if spec.heading_deg is not None:
            return math.radians(spec.heading_deg)
        if len(spec.route) == 1:
            return 0.0
        first, second = spec.route[:2]
        step = np.array([second.x_m - first.x_m, second.y_m - first.y_m])
    along = math.atan2(*step[::-1].tolist())
    return along + math.pi if spec.backwards else along


def _colour(spec: PersonSpec) -> str:
    if spec.glances.notices_within_m <= 0.0:
        return _NEVER
    return _WATCHES if spec.glances.watches else _GLANCES


def _draw_legend(figure: Figure, axes: Axes, scenario: Scenario) -> None:
    """Draw the legend of the colours that occur."""
    present = [_colour(spec) for spec in scenario.people]
    texts = {
        _WATCHES: "watches the robot once noticed",
        _GLANCES: "glances at the robot" if scenario.people else "scripted gaze",
        _NEVER: "never looks at the robot",
    }
    if scenario.workers:
        present.append(_GLANCES)
    axes.plot([], [], color=_ROBOT, marker="s", mfc="white", label="robot and its goal")
    for colour, text in texts.items():
        if colour in present:
            axes.plot([], [], color=colour, marker="o", mfc="white", label=text)
    if scenario.replay_csv is not None:
        axes.plot([], [], color=_RECORDED, marker="o", mfc="white", label="recorded person")
    figure.legend(
        loc="outside upper center", ncols=4, fontsize=7.5, frameon=False, columnspacing=1.2
    )
