"""The picture of docs/safety.md: a robot passes somebody at its limit, and the reach grows.

python -m tools.docs_site.reach_picture                 # into docs/images/reach.png
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.figures import Axes, Circle, Polygon, new_figure, save_figure
from nav_adapter import AwarenessPolicy, RobotProfile, RobotState
from nav_adapter.limit import Course, course_of, limit_mps
from nav_adapter.reach import Reach
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

FILE: Final = Path(__file__).parents[2] / "docs" / "images" / "reach.png"
FOOTPRINT_M: Final = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
TIMES_S: Final = (0.0, 0.5, 1.0, 1.5)
PLACE_M: Final = (2.2, 1.6)
_ROWS: Final = (("has not noticed", 0.0), ("has noticed", 1.0))
_ROBOT: Final = "#1f77b4"
_PERSON: Final = "#c44e52"


def stop_s(course: Course, speed_mps: float) -> float:
    """Return when a robot stands that brakes after its reaction time."""
    return course.reaction_s + speed_mps / course.deceleration_mps2


def way_m(course: Course, speed_mps: float, time_s: float) -> float:
    """Return how far it has come by then."""
    moving_s = min(time_s, stop_s(course, speed_mps))
    braked_s = max(moving_s - course.reaction_s, 0.0)
    return speed_mps * moving_s - 0.5 * course.deceleration_mps2 * braked_s**2


def swept(course: Course, off_rad: float, first_m: float, last_m: float) -> FloatArray:
    """Return the corners (4, 2) of all footprints between two ways on one course of the fan."""
    turn = math.atan2(course.sin, course.cos) + off_rad
    cos, sin = math.cos(turn), math.sin(turn)
    front, rear = course.front_m + last_m, course.rear_m + first_m
    x = np.array([front, rear, rear, front])
    y = np.array([1.0, 1.0, -1.0, -1.0]) * course.half_m
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)


def draw(axes: Axes, person: Reach, course: Course, speed_mps: float, time_s: float) -> None:
    """Draw the robot on three courses of its fan, what it has swept, and the person's reach."""
    fan_rad = math.atan2(course.fan_sin, course.fan_cos)
    way = way_m(course, speed_mps, time_s)
    for off_rad in (-fan_rad, fan_rad, 0.0):
        trail = swept(course, off_rad, 0.0, way)
        axes.add_patch(Polygon(trail, facecolor=_ROBOT, alpha=0.15, linewidth=0.0))
        here = swept(course, off_rad, way, way)
        axes.add_patch(Polygon(here, fill=False, edgecolor=_ROBOT, linewidth=1.0))
    middle, grown = (person.x_m, person.y_m), person.radius_m(time_s)
    for radius_m, style in ((grown + person.margin_m, "-"), (grown + BODY_RADIUS_M, ":")):
        axes.add_patch(Circle(middle, radius_m, fill=False, edgecolor=_PERSON, ls=style))
    axes.add_patch(Circle(middle, grown + person.margin_m, color=_PERSON, alpha=0.12, linewidth=0))
    axes.add_patch(Circle(middle, BODY_RADIUS_M, color=_PERSON, alpha=0.7, linewidth=0))
    stands = time_s >= stop_s(course, speed_mps)
    axes.text(-0.5, -1.7, f"{time_s:g} s{', the robot stands' if stands else ''}", fontsize=9)
    axes.text(-0.5, -2.1, f"r = {grown:.2f} m", fontsize=9, color=_PERSON)
    axes.set(xlim=(-0.7, 4.0), ylim=(-2.3, 3.4), aspect="equal")
    axes.tick_params(labelsize=7)


def main() -> int:
    """Draw the picture; return 0."""
    policy = AwarenessPolicy.preset("balanced")
    assert policy.reach is not None
    robot = RobotProfile(FOOTPRINT_M, 1.5, 1.0, 1.0, 0.3)
    state = RobotState(0.0, np.zeros(2), 0.0, 1.0, 0.0)
    course = course_of(robot, state, math.radians(policy.reach.turn_deg))
    figure = new_figure(9.0, 5.2)
    panels = figure.subplots(len(_ROWS), len(TIMES_S), sharex=True, sharey=True)
    for (title, alpha), row in zip(_ROWS, panels, strict=True):
        person = Reach(
            *(*PLACE_M, 0.0, 0.0, policy.speed.human_speed_mps(alpha)),
            policy.reach.time_constant_s,
            policy.reach.delay_s,
            margin_m=policy.margins.floor_m,
        )
        speed_mps = min(limit_mps(person, course), robot.max_speed_mps)
        row[0].set_ylabel(f"{title}\nlimit {speed_mps:.2f} m/s", fontsize=9)
        for axes, time_s in zip(row, TIMES_S, strict=True):
            draw(axes, person, course, speed_mps, time_s)
    save_figure(figure, FILE)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
