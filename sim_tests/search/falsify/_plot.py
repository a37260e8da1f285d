"""The plot of a falsification: the course of the search, and the worst cases from above."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from awarenav.errors import counted
from awarenav.figures import Circle, Polygon, Rectangle, new_figure, save_figure

from ._search import CONTACT_SCORE, NO_MARGIN_SCORE, Falsification
from ._worst_cases import WorstCase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PANELS: Final = 3
_ROBOT: Final = "#1f5fa8"
_PERSON: Final = "#d9822b"
_WORST: Final = "#b3261e"
_RACK: Final = "#c9ced4"
_ARROW_M: Final = 0.7


def draw_falsification(
    falsification: Falsification, cases: Sequence[WorstCase], path: Path
) -> None:
    """Draw the scores in the order of the search, and up to three worst cases from above."""
    figure = new_figure(13.0, 8.0)
    grid = figure.add_gridspec(2, _PANELS, height_ratios=(1.0, 1.2))
    _draw_course(figure.add_subplot(grid[0, :]), falsification)
    for column, case in enumerate(cases[:_PANELS]):
        axes = figure.add_subplot(grid[1, column])
        _draw_plan(axes, case)
        if column == 0:
            axes.plot([], [], color=_ROBOT, label="robot")
            axes.plot([], [], color=_PERSON, label="person, gaze red")
            axes.legend(loc="lower left", fontsize=8)
    save_figure(figure, path)


def _draw_course(axes: Axes, falsification: Falsification) -> None:
    """Draw the scores by scenario, the lowest so far as a line, and contacts as crosses."""
    places, names = 0, list(falsification.spaces)
    for number, name in enumerate(names):
        scores = np.array([each.score for each in falsification.episodes if each.scenario == name])
        x = places + np.arange(len(scores))
        places += len(scores)
        colour = f"C{number % 10}"
        touched = scores <= CONTACT_SCORE
        margins = (scores < NO_MARGIN_SCORE) & ~touched
        axes.scatter(x[margins], scores[margins], s=6, color=colour, alpha=0.6)
        if margins.any():
            lowest = np.minimum.accumulate(scores[margins])
            axes.plot(x[margins], lowest, color=colour, lw=1.4)
        bottom = np.full(int(touched.sum()), axes.get_ylim()[0])
        axes.scatter(x[touched], bottom, marker="x", color=_WORST)
        axes.annotate(
            name.replace("_", " "),
            (x.mean(), 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, -4),
            textcoords="offset points",
            rotation=90 if len(names) > 4 else 0,
            ha="center",
            va="top",
            fontsize=7,
            color=colour,
        )
    axes.axhline(0.0, color=_WORST, lw=0.8, ls="--")
    settings = falsification.settings
    label = " with its floor taken away (UNSAFE)" if settings.unsafe_no_floor else ""
    axes.set_title(
        f"{counted(len(falsification.episodes), 'episode')} against {settings.policy_name}{label}: "
        f"{falsification.contacts} with a contact with people who had not looked (crosses)",
        loc="left",
        fontsize=10,
    )
    axes.set_xlabel("episode, by scenario in the order of the search")
    axes.set_ylabel("smallest margin of unaware people (m)")
    axes.set_xlim(-0.5, places - 0.5)  # the names lie at places without a margin, too
    axes.grid(alpha=0.25)


def _draw_plan(axes: Axes, case: WorstCase) -> None:
    """Draw ways, robot, people and gazes at the first contact, or at the smallest margin."""
    frames, contacts, record = case.result.frames, case.result.contacts, case.record
    margins = [
        min(frame.margins_m, default=math.inf) if frame.robot_state.travel_mps > 0.03 else math.inf
        for frame in frames
    ]
    worst = int(np.argmin(margins))
    if contacts:
        worst = int(np.argmin([abs(frame.t_s - contacts[0].t_s) for frame in frames]))
    frame = frames[worst]
    for x_min, y_min, x_max, y_max in case.scenario.layout.obstacle_boxes_odom.tolist():
        axes.add_patch(Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, color=_RACK))
    way = np.array([each.robot_state.position_odom_m for each in frames])
    axes.plot(*way.T, color=_ROBOT, lw=1.5)
    heading = frame.robot_state.heading_odom_rad
    cos, sin = math.cos(heading), math.sin(heading)
    outline = case.result.robot.footprint_m @ np.array([[cos, sin], [-sin, cos]]) + way[worst]
    axes.add_patch(Polygon(outline, facecolor=_ROBOT, alpha=0.8))
    for row, person in enumerate(frame.truth):
        walked = np.array([each.truth[row].position_odom_m for each in frames])
        axes.plot(*walked.T, color=_PERSON, lw=1.5)
        place, gaze = person.position_odom_m, frame.T_odom_camera[:2, :3] @ person.gaze_camera
        axes.add_patch(Circle((place[0], place[1]), 0.3, color=_PERSON, alpha=0.8))
        end = place + _ARROW_M * gaze / max(float(np.linalg.norm(gaze)), 1e-9)
        arrow = {"arrowstyle": "->", "color": _WORST}
        axes.annotate("", xy=tuple(end), xytext=tuple(place), arrowprops=arrow)
    middle = 0.5 * (way[worst] + frame.truth[0].position_odom_m) if frame.truth else way[worst]
    axes.set_xlim(middle[0] - 4.0, middle[0] + 4.0)
    axes.set_ylim(middle[1] - 4.0, middle[1] + 4.0)
    axes.set_aspect("equal")
    margin_m, touched = record.min_margin_unaware_m, record.contact_by
    speed_mps = contacts[0].robot_speed_mps if contacts else frame.robot_state.travel_mps
    axes.set_title(
        f"{case.path.stem}: {case.episode.scenario.replace('_', ' ')}\n"
        f"margin {'none' if margin_m is None else f'{margin_m:.2f} m'}"
        f"{f', {touched} touched' if touched else ''}, at {frame.t_s:.1f} s, robot "
        f"{speed_mps:.2f} m/s",
        fontsize=9,
        loc="left",
    )
    axes.set_xlabel("x odom (m)", fontsize=8)
    axes.tick_params(labelsize=8)
