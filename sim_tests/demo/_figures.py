"""The plot of the crossings with and without awareness."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.figures import new_figure

from ..crossing import CrossingFrame, CrossingResult

_COLOURS: Final = ("#8a8f98", "#b3261e", "#2e7d4f", "#d9822b")
_STYLES: Final = ("-", "-", "-", "--")


def plot_comparison(path: Path, rows: Sequence[tuple[str, CrossingResult]]) -> None:
    """Draw what the robot knew and did in each crossing, over its position along the aisle.

    Args:
        path: the PNG file.
        rows: name and result of each crossing.
    """
    figure = new_figure(11.0, 6.4)
    panels = figure.subplots(3, 1, sharex=True)
    for (label, result), colour, style in zip(rows, _COLOURS, _STYLES, strict=False):
        along = [float(frame.robot_state.position_odom_m[0]) for frame in result.frames]
        speed = [frame.robot_state.speed_mps for frame in result.frames]
        time = "" if result.time_to_goal_s is None else f": {result.time_to_goal_s:.1f} s"
        panels[0].plot(along, speed, style, color=colour, label=f"{label}{time}")
        if result.frames[0].truth:
            bound = [_lowest_bound(frame) for frame in result.frames]
            radius = [_largest_radius(frame) for frame in result.frames]
            panels[1].plot(along, bound, style, color=colour)
            panels[2].plot(along, radius, style, color=colour)
    for axes, name in zip(
        panels,
        ("robot speed (m/s)", "awareness, lower bound", "obstacle radius (m)"),
        strict=True,
    ):
        axes.set_title(name, fontsize=10, loc="left")
        axes.grid(alpha=0.25)
        axes.set_ylim(bottom=0.0)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    panels[1].set_ylim(0.0, 1.0)
    panels[2].set_xlabel("robot's way along the aisle (m); gaps: nobody tracked")
    figure.savefig(path, dpi=110)


def _lowest_bound(frame: CrossingFrame) -> float:
    obstacles = frame.constraints.obstacles
    return min((obstacle.awareness_lower for obstacle in obstacles), default=np.nan)


def _largest_radius(frame: CrossingFrame) -> float:
    obstacles = frame.constraints.obstacles
    return max((obstacle.radius_m for obstacle in obstacles), default=np.nan)
