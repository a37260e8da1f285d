"""Drawings of policies: radius and U over awareness, speed limit over awareness and distance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy, RobotProfile
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ..figures import Axes, Figure, QuadMesh, new_figure
from ._effect import BESIDE_M, effect_of

_DPI: Final = 160
# Text of 10 points is 11 px high where a page shows the figure 780 px wide.
_WIDTH_IN: Final = 9.8
_ROW_IN: Final = 2.9
_LINE_COLOUR: Final = "#1f5f8b"
_LIMIT_COLOUR: Final = "#6b7079"
_AWARENESS: Final = np.linspace(0.0, 1.0, 26)
_DISTANCE_M: Final = np.linspace(0.0, 6.0, 61)
# Index of the α at which contours are labelled.
_LABELLED: Final = 3


def policy_figure(policies: Sequence[tuple[str, AwarenessPolicy]], robot: RobotProfile) -> Figure:
    """Draw one row per policy: radius, U, and maps of the limit for people ahead and beside.

    Args:
        policies: with their names.
        robot: whose speed is limited.
    """
    figure = new_figure(_WIDTH_IN, _ROW_IN * len(policies) + 0.3, dpi=_DPI)
    rows = figure.subplots(len(policies), 4, squeeze=False, width_ratios=(1.0, 1.0, 1.3, 1.3))
    effects = [effect_of(policy, robot, _AWARENESS, _DISTANCE_M) for _, policy in policies]
    max_radius_m = max(float(effect.radius_m.max()) for effect in effects)
    max_speed_mps = max(float(effect.human_speed_mps.max()) for effect in effects)
    for axes, (name, policy), effect in zip(rows, policies, effects, strict=True):
        floor_m = policy.margins.floor_m
        _draw_line(axes[0], effect.radius_m, "radius (m)", max_radius_m)
        for height_m, text, up in ((floor_m, "floor", True), (BODY_RADIUS_M, "body", False)):
            axes[0].axhline(height_m, color=_LIMIT_COLOUR, ls="--", lw=1.0)
            where = {"xytext": (3, 3 if up else -3), "textcoords": "offset points"}
            va = "bottom" if up else "top"
            note = f"{text} {height_m:.2f} m"
            axes[0].annotate(note, (0.0, height_m), color=_LIMIT_COLOUR, va=va, **where)
        _draw_line(axes[1], effect.human_speed_mps, "U (m/s)", max_speed_mps)
        _draw_limit(axes[2], effect.ahead_mps, robot)
        limit_map = _draw_limit(axes[3], effect.beside_mps, robot)
        bar = figure.colorbar(limit_map, ax=axes[3], label="speed limit (m/s)")
        bar.ax.set_ylim(0.0, robot.max_speed_mps)
        axes[0].set_title(Path(name).name, loc="left", fontweight="bold")
        axes[2].set_title("limit, straight ahead", loc="left", fontsize=10)
        axes[3].set_title(f"limit, {BESIDE_M:g} m beside", loc="left", fontsize=10)
    return figure


def _draw_line(axes: Axes, values: FloatArray, label: str, highest: float) -> None:
    axes.plot(_AWARENESS, values, color=_LINE_COLOUR, lw=2.0)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.12 * highest if highest > 0.0 else 1.0)
    axes.set_xlabel("awareness, at least")
    axes.set_ylabel(label)
    axes.grid(alpha=0.25)


def _draw_limit(axes: Axes, limit_mps: FloatArray, robot: RobotProfile) -> QuadMesh:
    """Draw the map of the speed limit (A, D) over awareness and distance."""
    limit = limit_mps.T
    limit_map = axes.pcolormesh(
        _AWARENESS,
        _DISTANCE_M,
        limit,
        cmap="viridis",
        vmin=0.0,
        vmax=1.2 * robot.max_speed_mps,  # white lines are not visible on the brightest yellow
        shading="nearest",
        rasterized=True,
    )
    steps = np.array([0.01, 0.25, 0.5, 0.75, 1.0 - 1e-6]) * robot.max_speed_mps
    # The labels stand at the left, where every contour is that crosses the unaware level.
    unaware = limit[:, _LABELLED]
    met = [step for step in steps.tolist() if unaware[0] < step <= float(unaware.max())]
    if float(limit.max()) > float(limit.min()):
        lines = axes.contour(_AWARENESS, _DISTANCE_M, limit, steps, colors="white", linewidths=1.0)
        texts = ["stop", *(f"{step:.2f}" for step in steps[1:-1].tolist()), "max"]
        places = [(_AWARENESS[_LABELLED], _DISTANCE_M[int((unaware >= x).argmax())]) for x in met]
        fmt = dict(zip(lines.levels, texts, strict=True))
        if met:
            axes.clabel(lines, met, fmt=fmt, fontsize=9, manual=places)
    axes.set_xlabel("awareness, at least")
    axes.set_ylabel("distance ahead (m)")
    return limit_map
