"""Drawings of policies: radius, human speed and speed limit over awareness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.settled import settled_human_speed_mps, settled_radius_m, settled_speed_limit_mps
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ..figures import Axes, Figure, QuadMesh, new_figure

_DPI: Final = 130
_WIDTH_IN: Final = 12.0
_ROW_IN: Final = 3.4
_LINE_COLOUR: Final = "#1f5f8b"
_HYSTERESIS_COLOUR: Final = "#d95f02"
_LIMIT_COLOUR: Final = "#8a8f98"
_AWARENESS: Final = np.linspace(0.0, 1.0, 201)


def policy_figure(
    policies: Sequence[tuple[str, AwarenessPolicy]], robot: RobotProfile, farthest_m: float
) -> Figure:
    """Draw one row per policy: radius, human speed, and a map of the speed limit.

    Args:
        policies: with their names.
        robot: whose speed is limited.
        farthest_m: end of the distance axis.
    """
    figure = new_figure(_WIDTH_IN, _ROW_IN * len(policies) + 0.3, dpi=_DPI)
    rows = figure.subplots(len(policies), 3, squeeze=False, width_ratios=(1.0, 1.0, 1.5))
    max_radius_m = max(float(settled_radius_m(policy, 0.0)) for _, policy in policies)
    max_speed_mps = max(float(settled_human_speed_mps(policy, 0.0)) for _, policy in policies)
    for axes, (name, policy) in zip(rows, policies, strict=True):
        _draw_radius(axes[0], policy, max_radius_m)
        _draw_human_speed(axes[1], policy, max_speed_mps)
        limit_map = _draw_limit(axes[2], policy, robot, farthest_m)
        bar = figure.colorbar(limit_map, ax=axes[2], label="speed limit (m/s)")
        bar.ax.set_ylim(0.0, robot.max_speed_mps)
        axes[0].set_title(Path(name).name, loc="left", fontweight="bold")
    return figure


def _draw_radius(axes: Axes, policy: AwarenessPolicy, max_radius_m: float) -> None:
    axes.plot(_AWARENESS, settled_radius_m(policy, _AWARENESS), color=_LINE_COLOUR, lw=2.0)
    inflation = policy.inflation
    _draw_hysteresis(axes, inflation, float(settled_radius_m(policy, 1.0)), inflation.radius_m)
    floor_m = policy.margins.floor_m
    axes.axhline(floor_m, color=_LIMIT_COLOUR, ls="--", lw=1.0)
    axes.text(0.02, floor_m, f"floor {floor_m:.2f} m", color=_LIMIT_COLOUR, va="bottom", fontsize=8)
    axes.axhline(BODY_RADIUS_M, color=_LIMIT_COLOUR, ls=":", lw=1.0)
    axes.text(0.02, BODY_RADIUS_M, "body", color=_LIMIT_COLOUR, va="bottom", fontsize=8)
    _label_axes(axes, "obstacle radius (m)", max_radius_m)


def _draw_human_speed(axes: Axes, policy: AwarenessPolicy, max_speed_mps: float) -> None:
    axes.plot(_AWARENESS, settled_human_speed_mps(policy, _AWARENESS), color=_LINE_COLOUR, lw=2.0)
    speed = policy.speed
    _draw_hysteresis(
        axes, speed, float(settled_human_speed_mps(policy, 1.0)), speed.human_speed_mps
    )
    _label_axes(axes, "assumed human speed (m/s)", max_speed_mps)


def _draw_hysteresis(
    axes: Axes, policy: object, aware: float, value: Callable[[float], float]
) -> None:
    """Draw the second branch of a policy with hysteresis: people who were aware before.

    Args:
        axes: to draw into.
        policy: has a method ``holds`` if it has hysteresis.
        aware: value for an aware person.
        value: function of awareness, without hysteresis.
    """
    holds = getattr(policy, "holds", None)
    if not callable(holds):
        return
    held = np.array([bool(holds(alpha, True)) for alpha in _AWARENESS.tolist()])
    if not held.any():
        return
    second = np.where(held, aware, [value(alpha) for alpha in _AWARENESS.tolist()])
    axes.plot(
        _AWARENESS,
        second,
        color=_HYSTERESIS_COLOUR,
        lw=1.5,
        ls="--",
        label="after having been aware",
    )
    axes.legend(fontsize=8, frameon=False, loc="upper right")


def _label_axes(axes: Axes, label: str, highest: float) -> None:
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.12 * highest if highest > 0.0 else 1.0)
    axes.set_xlabel("awareness, lower bound")
    axes.set_ylabel(label)
    axes.grid(alpha=0.25)


def _draw_limit(
    axes: Axes, policy: AwarenessPolicy, robot: RobotProfile, farthest_m: float
) -> QuadMesh:
    """Draw the map of the speed limit over awareness and distance."""
    distance_m = np.linspace(0.0, farthest_m, 241)
    limit: FloatArray = settled_speed_limit_mps(policy, robot, distance_m[:, None], _AWARENESS)
    limit_map = axes.pcolormesh(
        _AWARENESS,
        distance_m,
        limit,
        cmap="viridis",
        vmin=0.0,
        vmax=1.2 * robot.max_speed_mps,  # white lines are not visible on the brightest yellow
        shading="nearest",
        rasterized=True,
    )
    steps = np.array([0.01, 0.25, 0.5, 0.75, 1.0 - 1e-6]) * robot.max_speed_mps
    if float(limit.max()) > float(limit.min()):
        lines = axes.contour(_AWARENESS, distance_m, limit, steps, colors="white", linewidths=1.0)
        texts = ["stop", *(f"{step:.2f}" for step in steps[1:-1].tolist()), "maximum"]
        axes.clabel(lines, fmt=dict(zip(lines.levels, texts, strict=True)), fontsize=8)
    axes.set_xlabel("awareness, lower bound")
    axes.set_ylabel("distance to the body (m)")
    return limit_map
