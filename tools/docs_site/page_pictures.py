"""Pictures of the pages about safety, Nav2 and Gymnasium.

python -m tools.docs_site.page_pictures             # all, into docs/images
python -m tools.docs_site.page_pictures reach       # one
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from awarenav.drawing import awareness_colour
from awarenav.figures import Axes, Circle, Figure, Image, Line2D, Patch, Polygon, new_figure
from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from nav_adapter.course import Course, course_of
from nav_adapter.exporters import CostmapPainter
from nav_adapter.limit import limit_mps
from nav_adapter.reach import Reach
from nav_adapter.rigid import Motion
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from sim_tests.learning import CrossingEnv
from tracking import PersonTrack

FOLDER: Final = Path(__file__).parents[2] / "docs" / "images"
_FOOTPRINT_M: Final = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
_ROBOT: Final = "#1f5f8b"
# At a width of 390 px these letters have a size of 11 and 12 px.
_SMALL_PT: Final = 16
_TEXT_PT: Final = 17
_WIDTH_IN: Final = 7.8
_COLOURS: Final = 96


def _robot() -> RobotProfile:
    return RobotProfile(_FOOTPRINT_M, 1.5, 1.0, 1.0, 0.3)


def _colour(alpha: float) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in awareness_colour(alpha))


_PLACE_M: Final = (2.2, 1.6)
_ROWS: Final = (("has not noticed", 0.0), ("has noticed", 1.0))


def reach_figure() -> Figure:
    """Return a robot that brakes from its limit beside somebody, at three times, in two rows."""
    policy, robot = AwarenessPolicy.preset("balanced"), _robot()
    course = course_of(robot, Motion(0.0, 0.0, 0.0, 1.0), math.radians(policy.reach.turn_deg))
    figure = new_figure(_WIDTH_IN, 7.1)
    panels = figure.subplots(2, 3, sharex=True, sharey=True)
    for (title, alpha), row in zip(_ROWS, panels, strict=True):
        human_mps = policy.speed.human_speed_mps(alpha)
        person = Reach(
            *(*_PLACE_M, 0.0, 0.0, human_mps),
            policy.reach.time_constant_s,
            policy.reach.delay_s,
            margin_m=policy.margins.floor_m,
            within_m=policy.margins.within_m(human_mps, policy.speed.human_speed_mps(0.0)),
        )
        speed_mps = min(limit_mps(person, course), robot.max_speed_mps)
        row[0].set_ylabel(f"{title}:\nlimit {speed_mps:.2f} m/s", fontsize=_TEXT_PT)
        stop_s = course.reaction_s + speed_mps / course.deceleration_mps2
        for axes, time_s in zip(row, (0.0, 0.5 * stop_s, stop_s), strict=True):
            _draw_reach(axes, person, course, speed_mps, time_s, _colour(alpha))
            stands = ": stands" if time_s == stop_s else ""
            axes.set_title(f"{time_s:.1f} s{stands}", fontsize=_TEXT_PT, loc="left")
    for axes in panels[-1]:
        axes.set_xlabel("x (m)", fontsize=_SMALL_PT)
    signs = (
        Patch(fc=_ROBOT, alpha=0.35, label="the robot, and what it sweeps"),
        Line2D([], [], color="0.25", ls=":", label="where the body can be by then"),
        Line2D([], [], color="0.25", label="the same with clearance"),
    )
    figure.legend(handles=signs, fontsize=_SMALL_PT, loc="outside lower center", frameon=False)
    return figure


def _draw_reach(
    axes: Axes,
    person: Reach,
    course: Course,
    speed_mps: float,
    time_s: float,
    colour: tuple[float, ...],
) -> None:
    """Draw the robot on three courses of its fan, what it has swept, and the person's reach."""
    braked_s = max(time_s - course.reaction_s, 0.0)
    way_m = speed_mps * time_s - 0.5 * course.deceleration_mps2 * braked_s**2
    fan_rad = math.atan2(course.fan_sin, course.fan_cos)
    for off_rad in (-fan_rad, fan_rad, 0.0):
        trail = _swept(course, off_rad, 0.0, way_m)
        axes.add_patch(Polygon(trail, fc=_ROBOT, alpha=0.15, lw=0.0))
        here = _swept(course, off_rad, way_m, way_m)
        axes.add_patch(Polygon(here, fill=False, ec=_ROBOT, lw=1.5))
    middle, grown_m = (person.x_m, person.y_m), person.radius_m(time_s)
    outer_m = grown_m + person.margin_after_m(time_s)
    for radius_m, style in ((outer_m, "-"), (grown_m + BODY_RADIUS_M, ":")):
        axes.add_patch(Circle(middle, radius_m, fill=False, ec=colour, ls=style, lw=2.0))
    axes.add_patch(Circle(middle, outer_m, color=colour, alpha=0.15, lw=0))
    axes.add_patch(Circle(middle, BODY_RADIUS_M, color=colour, lw=0))
    axes.set(xlim=(-0.9, 4.1), ylim=(-1.3, 3.7), aspect="equal", xticks=(0, 2, 4), yticks=(0, 2))
    axes.tick_params(labelsize=_SMALL_PT)


def _swept(course: Course, off_rad: float, first_m: float, last_m: float) -> FloatArray:
    """Return the corners (4, 2) of all footprints between two ways on one course of the fan."""
    turn = math.atan2(course.sin, course.cos) + off_rad
    cos, sin = math.cos(turn), math.sin(turn)
    front, rear = course.front_m + last_m, course.rear_m + first_m
    x = np.array([front, rear, rear, front])
    y = np.array([1.0, 1.0, -1.0, -1.0]) * course.half_m
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)


_RESOLUTION_M: Final = 0.05
_MAP_M: Final = (-1.0, -2.0, 9.0, 2.0)
_GOAL_M: Final = (8.5, 0.0)
#: Place (m) and lower bound of α of the people of the costmap.
_PEOPLE: Final = ((2.6, 0.9, 0.9), (6.0, -0.9, 0.0))


def nav2_figure() -> Figure:
    """Return a costmap with two people, the circles of the bridge and a path of least cost."""
    constraints = _constraints()
    x_min, y_min, x_max, y_max = _MAP_M
    rows, columns = (round((b - a) / _RESOLUTION_M) for a, b in ((y_min, y_max), (x_min, x_max)))
    costmap = np.zeros((rows, columns), np.uint8)
    costmap[:6], costmap[-6:] = 254, 254  # racks
    CostmapPainter(costmap, (x_min, y_min), _RESOLUTION_M, inscribed_radius_m=0.25).update(
        constraints
    )
    figure = new_figure(_WIDTH_IN, 4.9)
    axes = figure.subplots()
    axes.imshow(costmap, origin="lower", extent=(x_min, x_max, y_min, y_max), cmap="Greys")
    axes.plot(*_path(costmap).T, color=_ROBOT, lw=3.0)
    axes.add_patch(Polygon(_FOOTPRINT_M, fc=_ROBOT, ec="white", lw=1.0, zorder=3))
    for each in constraints.obstacles:
        colour, middle = _colour(each.awareness_lower), tuple(each.center_odom_m)
        axes.add_patch(Circle(middle, each.radius_m, fill=False, ec=colour, lw=3.5))
        axes.add_patch(Circle(middle, BODY_RADIUS_M, color=colour, lw=0, zorder=3))
    axes.set_xlabel("x, odom (m)", fontsize=_SMALL_PT)
    axes.set_ylabel("y (m)", fontsize=_SMALL_PT)
    axes.tick_params(labelsize=_SMALL_PT)
    signs = (
        Line2D([], [], marker="o", ls="", ms=12, color=_colour(0.9), label="has noticed it"),
        Line2D([], [], marker="o", ls="", ms=12, color=_colour(0.0), label="has not"),
        Line2D([], [], color="0.45", lw=3.0, label="ring: /awarenav/circles"),
        Line2D([], [], color=_ROBOT, lw=3.0, label="robot, path"),
    )
    figure.legend(
        handles=signs, fontsize=_SMALL_PT, loc="outside lower center", ncols=2, frameon=False
    )
    axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max))
    axes.set_title("local costmap", fontsize=_TEXT_PT, loc="left")
    return figure


def _constraints() -> NavConstraints:
    """Return the constraints of the people of the costmap, after two seconds beside them."""
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), _robot())
    for tick in range(21):
        stamp_s = 0.1 * tick
        tracks = [_track(number, stamp_s) for number in range(len(_PEOPLE))]
        state = RobotState(stamp_s, np.zeros(2), 0.0, 0.8, 0.0)
        constraints = adapter.update(tracks, state, stamp_s)
    return constraints


def _track(number: int, stamp_s: float) -> PersonTrack:
    x_m, y_m, lower = _PEOPLE[number]
    return PersonTrack(
        id=number + 1,
        stamp_s=stamp_s,
        status="confirmed",
        position_odom_m=(x_m, y_m),
        velocity_odom_mps=(0.0, 0.0),
        covariance_odom=np.diag([0.001, 0.001, 0.004, 0.004]),
        awareness=lower,
        awareness_std=0.02,
        awareness_lower=lower,
        height_m=1.75,
        time_since_seen_s=0.0,
    )


def _path(costmap: FloatArray) -> FloatArray:
    """Return a path (N, 2) of least cost through the free cells, from the robot to the goal."""
    rows, columns = costmap.shape
    cells = np.arange(rows * columns).reshape(rows, columns)
    free, weight = costmap < 253, 1.0 + costmap / 25.0
    starts, ends, costs = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here = (slice(0, rows - down), slice(max(-right, 0), columns - max(right, 0)))
        there = (slice(down, rows), slice(max(right, 0), columns - max(-right, 0)))
        passable = free[here] & free[there]
        starts.append(cells[here][passable])
        ends.append(cells[there][passable])
        mean = 0.5 * (weight[here] + weight[there])[passable]
        costs.append(mean * math.hypot(down, right))
    edges = np.concatenate(costs), (np.concatenate(starts), np.concatenate(ends))
    graph = coo_matrix(edges, shape=(cells.size, cells.size)).tocsr()

    def cell(x_m: float, y_m: float) -> int:
        column, row = (
            int((at - low) / _RESOLUTION_M) for at, low in zip((x_m, y_m), _MAP_M[:2], strict=True)
        )
        return int(cells[row, column])

    begin, end = cell(0.0, 0.0), cell(*_GOAL_M)
    _, before = dijkstra(graph, directed=False, indices=begin, return_predecessors=True)
    found = [end]
    while found[-1] != begin:
        found.append(int(before[found[-1]]))
    row, column = np.divmod(found[::-1], columns)
    places = np.stack([column, row], axis=1) * _RESOLUTION_M + np.array(_MAP_M[:2])
    return np.asarray(places + 0.5 * _RESOLUTION_M)


_STEPS: Final = 80


def gymnasium_figure() -> Figure:
    """Return a step of the environment as ``render`` draws it."""
    environment = CrossingEnv("steps_out_in_aisle", perception="keypoints", render_mode="rgb_array")
    environment.reset(seed=0)
    for _ in range(_STEPS):
        environment.step(np.array([0.5, 0.0], np.float32))
        picture = environment.render()
    assert picture is not None
    height, width = picture.shape[:2]
    environment.close()
    figure = new_figure(width / 100.0, height / 100.0, constrained=False)
    figure.figimage(picture)
    return figure


FIGURES: Final = {"reach": reach_figure, "nav2_costmap": nav2_figure, "gymnasium": gymnasium_figure}


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description="Make the pictures of pages.")
    parser.add_argument("pictures", nargs="*", choices=[*FIGURES, []], help="default: all")
    for name in parser.parse_args(arguments).pictures or FIGURES:
        path = FOLDER / f"{name}.png"
        FIGURES[name]().savefig(path)
        small = Image.open(path).convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
        small.save(path, "PNG", optimize=True)
        print(f"{name}: {path.stat().st_size / 1e3:.0f} kB", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
