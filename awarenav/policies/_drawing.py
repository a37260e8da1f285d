"""A policy as a picture: what awareness changes, and by how much."""

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
_LINE: Final = "#1f5f8b"
_BACK: Final = "#d95f02"
_FAINT: Final = "#8a8f98"
_AWARENESS: Final = np.linspace(0.0, 1.0, 201)


def policy_figure(
    policies: Sequence[tuple[str, AwarenessPolicy]], robot: RobotProfile, farthest_m: float
) -> Figure:
    """One row a policy: radius, human speed, and the map of the speed limit."""
    figure = new_figure(_WIDTH_IN, _ROW_IN * len(policies) + 0.3, dpi=_DPI)
    rows = figure.subplots(len(policies), 3, squeeze=False, width_ratios=(1.0, 1.0, 1.5))
    largest_m = max(float(settled_radius_m(policy, 0.0)) for _, policy in policies)
    fastest_mps = max(float(settled_human_speed_mps(policy, 0.0)) for _, policy in policies)
    for axes, (name, policy) in zip(rows, policies, strict=True):
        _draw_radius(axes[0], policy, largest_m)
        _draw_human_speed(axes[1], policy, fastest_mps)
        drawn = _draw_limit(axes[2], policy, robot, farthest_m)
        bar = figure.colorbar(drawn, ax=axes[2], label="speed limit (m/s)")
        bar.ax.set_ylim(0.0, robot.max_speed_mps)
        axes[0].set_title(Path(name).name, loc="left", fontweight="bold")
    return figure


def _draw_radius(axes: Axes, policy: AwarenessPolicy, largest_m: float) -> None:
    axes.plot(_AWARENESS, settled_radius_m(policy, _AWARENESS), color=_LINE, lw=2.0)
    inflation = policy.inflation
    _draw_way_back(axes, inflation, float(settled_radius_m(policy, 1.0)), inflation.radius_m)
    floor_m = policy.margins.floor_m
    axes.axhline(floor_m, color=_FAINT, ls="--", lw=1.0)
    axes.text(0.02, floor_m, f"floor {floor_m:.2f} m", color=_FAINT, va="bottom", fontsize=8)
    axes.axhline(BODY_RADIUS_M, color=_FAINT, ls=":", lw=1.0)
    axes.text(0.02, BODY_RADIUS_M, "body", color=_FAINT, va="bottom", fontsize=8)
    _finish(axes, "obstacle radius (m)", largest_m)


def _draw_human_speed(axes: Axes, policy: AwarenessPolicy, fastest_mps: float) -> None:
    axes.plot(_AWARENESS, settled_human_speed_mps(policy, _AWARENESS), color=_LINE, lw=2.0)
    speed = policy.speed
    _draw_way_back(axes, speed, float(settled_human_speed_mps(policy, 1.0)), speed.human_speed_mps)
    _finish(axes, "assumed human speed (m/s)", fastest_mps)


def _draw_way_back(
    axes: Axes, policy: object, aware: float, value: Callable[[float], float]
) -> None:
    """The other branch of a policy with hysteresis: where those are who were aware before."""
    holds = getattr(policy, "holds", None)
    if not callable(holds):
        return
    held = np.array([bool(holds(alpha, True)) for alpha in _AWARENESS.tolist()])
    if not held.any():
        return
    back = np.where(held, aware, [value(alpha) for alpha in _AWARENESS.tolist()])
    axes.plot(_AWARENESS, back, color=_BACK, lw=1.5, ls="--", label="after having been aware")
    axes.legend(fontsize=8, frameon=False, loc="upper right")


def _finish(axes: Axes, label: str, highest: float) -> None:
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.12 * highest if highest > 0.0 else 1.0)
    axes.set_xlabel("awareness, lower bound")
    axes.set_ylabel(label)
    axes.grid(alpha=0.25)


def _draw_limit(
    axes: Axes, policy: AwarenessPolicy, robot: RobotProfile, farthest_m: float
) -> QuadMesh:
    distance_m = np.linspace(0.0, farthest_m, 241)
    limit: FloatArray = settled_speed_limit_mps(policy, robot, distance_m[:, None], _AWARENESS)
    drawn = axes.pcolormesh(
        _AWARENESS,
        distance_m,
        limit,
        cmap="viridis",
        vmin=0.0,
        vmax=1.2 * robot.max_speed_mps,  # white lines do not show on the map's brightest yellow
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
    return drawn
