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
    colours = [f"C{number}" for number in range(10)]
    next_place = 0
    names = list(falsification.spaces)
    for number, name in enumerate(names):
        scores = np.array([each.score for each in falsification.episodes if each.scenario == name])
        places = next_place + np.arange(len(scores))
        next_place += len(scores)
        colour = colours[number % len(colours)]
        with_margin = (scores < NO_MARGIN_SCORE) & (scores > CONTACT_SCORE)
        axes.scatter(places[with_margin], scores[with_margin], s=6, color=colour, alpha=0.6)
        touched = scores <= CONTACT_SCORE
        if with_margin.any():
            axes.plot(
                places[with_margin],
                np.minimum.accumulate(scores[with_margin]),
                color=colour,
                lw=1.4,
            )
        axes.scatter(
            places[touched],
            np.full(int(touched.sum()), axes.get_ylim()[0]),
            marker="x",
            color=_WORST,
        )
        axes.annotate(
            name.replace("_", " "),
            (places.mean() if len(places) else next_place, 1.0),
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
    axes.set_xlim(-0.5, max(next_place, 1) - 0.5)  # the names lie at places without a margin, too
    axes.grid(alpha=0.25)


def _draw_plan(axes: Axes, case: WorstCase) -> None:
    frames = case.result.frames
    margins = [
        min(frame.margins_m, default=math.inf) if frame.robot_state.travel_mps > 0.03 else math.inf
        for frame in frames
    ]
    worst = int(np.argmin(margins))
    if case.result.contacts:
        first = case.result.contacts[0].t_s
        worst = int(np.argmin([abs(frame.t_s - first) for frame in frames]))
    frame = frames[worst]
    for x_min, y_min, x_max, y_max in case.scenario.layout.obstacle_boxes_odom.tolist():
        axes.add_patch(Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, color=_RACK))
    way = np.array([each.robot_state.position_odom_m for each in frames])
    axes.plot(*way.T, color=_ROBOT, lw=1.5)
    heading = frame.robot_state.heading_odom_rad
    turn = np.array(
        [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
    )
    outline = case.result.robot.footprint_m @ turn.T + way[worst]
    axes.add_patch(Polygon(outline, facecolor=_ROBOT, alpha=0.8))
    rotation = frame.T_odom_camera[:2, :3]
    for row, person in enumerate(frame.truth):
        walked = np.array([each.truth[row].position_odom_m for each in frames])
        axes.plot(*walked.T, color=_PERSON, lw=1.5)
        place = person.position_odom_m
        axes.add_patch(Circle((place[0], place[1]), 0.3, color=_PERSON, alpha=0.8))
        gaze = rotation @ person.gaze_camera
        gaze = _ARROW_M * gaze / max(float(np.linalg.norm(gaze)), 1e-9)
        axes.annotate(
            "",
            xy=(place[0] + gaze[0], place[1] + gaze[1]),
            xytext=(place[0], place[1]),
            arrowprops={"arrowstyle": "->", "color": _WORST},
        )
    middle = 0.5 * (way[worst] + frame.truth[0].position_odom_m) if frame.truth else way[worst]
    axes.set_xlim(middle[0] - 4.0, middle[0] + 4.0)
    axes.set_ylim(middle[1] - 4.0, middle[1] + 4.0)
    axes.set_aspect("equal")
    record = case.record
    touched = f", {record.contact_by} touched" if record.contact_by else ""
    margin = (
        "none" if record.min_margin_unaware_m is None else f"{record.min_margin_unaware_m:.2f} m"
    )
    speed_mps = frame.robot_state.travel_mps
    if case.result.contacts:
        speed_mps = case.result.contacts[0].robot_speed_mps
    axes.set_title(
        f"{case.path.stem}: {case.episode.scenario.replace('_', ' ')}\nmargin {margin}"
        f"{touched}, at {frame.t_s:.1f} s, robot {speed_mps:.2f} m/s",
        fontsize=9,
        loc="left",
    )
    axes.set_xlabel("x odom (m)", fontsize=8)
    axes.tick_params(labelsize=8)
