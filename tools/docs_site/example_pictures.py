"""Pictures of the gallery's examples: what each passes to its planner, as it runs.

    python -m tools.docs_site.example_pictures               # all, into docs/images/examples
    python -m tools.docs_site.example_pictures mppi_cost     # one

An example runs as it is; the calls of `NavAdapter.update` and `PersonTracker.update` are recorded.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import io
import runpy
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np

from awarenav.drawing import awareness_colour
from awarenav.figures import Axes, Circle, Figure, Image, Polygon, new_figure
from nav_adapter import NavAdapter, NavConstraints, RobotState
from perception.anthropometry import BODY_RADIUS_M
from sim_tests import NOVA_CARTER, Scenario, run_crossing
from tracking import PersonTrack, PersonTracker

ROOT: Final = Path(__file__).parents[2]
FOLDER: Final = ROOT / "docs" / "images" / "examples"
#: Planners that cross in PyBullet: module and class in examples/planners.
PLANNERS: Final = {
    "velocity_obstacles": "VelocityObstaclePlanner",
    "reciprocal_velocity": "ReciprocalVelocity",
    "dynamic_window": "DynamicWindow",
    "path_integral": "PathIntegral",
    "model_predictive": "ModelPredictivePlanner",
}
_WIDTH_IN: Final = 7.2
_HEIGHT_IN: Final = 2.7
_COLOURS: Final = 64
# Examples without a planner.
_ROBOTS: Final = {"ros2_robot"}
_SHOWN: Final = 7
_ROBOT: Final = "#1f5f8b"
_LIMIT: Final = "#b3261e"
_INK: Final = "#3a3f47"


@dataclass
class Recording:
    """The calls of adapter and tracker while an example runs."""

    constraints: list[tuple[RobotState, NavConstraints]] = field(default_factory=list)
    tracks: list[tuple[PersonTrack, ...]] = field(default_factory=list)


@contextlib.contextmanager
def recorded() -> Iterator[Recording]:
    """Record the results of the adapter and of the tracker."""
    recording = Recording()
    adapt, track = NavAdapter.update, PersonTracker.update

    @functools.wraps(adapt)
    def adapter_update(self: NavAdapter, tracks: Any, state: Any, *more: Any, **named: Any) -> Any:
        result = adapt(self, tracks, state, *more, **named)
        recording.constraints.append((state, result))
        return result

    @functools.wraps(track)
    def tracker_update(self: PersonTracker, *given: Any, **named: Any) -> Any:
        result = track(self, *given, **named)
        recording.tracks.append(result)
        return result

    with (
        patch.object(NavAdapter, "update", adapter_update),
        patch.object(PersonTracker, "update", tracker_update),
    ):
        yield recording


def record_example(name: str) -> Recording:
    """Run an example and return its recording."""
    with recorded() as recording, contextlib.redirect_stdout(io.StringIO()):
        if name in PLANNERS:
            make = getattr(import_module(f"examples.planners.{name}"), PLANNERS[name])
            scenario = Scenario.shipped("crossing_attentive").draw(0)
            planner = make(NOVA_CARTER, static_boxes_odom_m=scenario.planner_boxes_odom_m)
            run_crossing(scenario, policy="balanced", planner=planner)
            return recording
        folder = str(ROOT / "examples")
        with patch.object(sys, "path", [folder, *sys.path]), patch.object(sys, "argv", [name]):
            runpy.run_path(f"{folder}/{name}.py", run_name="__main__")
    return recording


def figure_of(recording: Recording) -> Figure:
    """Return a map with the obstacles, beside speed, limit and radius over time."""
    figure = new_figure(_WIDTH_IN, _HEIGHT_IN)
    above, over_time = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    if recording.constraints:
        _draw_map(above, recording)
        _draw_speeds(over_time, recording)
    else:
        _draw_tracks(above, recording)
        _draw_awareness(over_time, recording)
    return figure


def _draw_map(axes: Axes, recording: Recording) -> None:
    states = [state for state, _ in recording.constraints]
    way = np.array([state.position_odom_m for state in states])
    axes.plot(*way.T, color=_ROBOT, lw=1.5)
    moments = np.unique(np.linspace(0, len(states) - 1, _SHOWN).round().astype(int))
    for number in moments:
        state, constraints = recording.constraints[number]
        heading = state.heading_odom_rad
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        outline = NOVA_CARTER.footprint_m @ turn.T + state.position_odom_m
        axes.add_patch(Polygon(outline, fc=_ROBOT, ec="none", alpha=0.55))
        for obstacle in constraints.obstacles:
            colour = _colour(obstacle.awareness_lower)
            centre = tuple(obstacle.center_odom_m)
            axes.add_patch(Circle(centre, obstacle.radius_m, fc=colour, ec="none", alpha=0.15))
            axes.add_patch(Circle(centre, obstacle.radius_m, fc="none", ec=colour, lw=1.0))
            axes.add_patch(Circle(centre, BODY_RADIUS_M, fc=_INK, ec="none", alpha=0.6))
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    _label(axes, "x, odom (m)", "y (m)")


def _draw_speeds(axes: Axes, recording: Recording) -> None:
    times = [constraints.stamp_s for _, constraints in recording.constraints]
    axes.plot(times, [s.speed_mps for s, _ in recording.constraints], color=_ROBOT, label="speed")
    limits = [constraints.speed_limit_mps for _, constraints in recording.constraints]
    axes.plot(times, limits, color=_LIMIT, lw=1.0, ls="--", label="limit")
    radii = [
        max((each.radius_m for each in constraints.obstacles), default=np.nan)
        for _, constraints in recording.constraints
    ]
    axes.plot(times, radii, color=_INK, lw=1.0, ls=":", label="largest radius")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=7, frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    _label(axes, "time (s)", "m/s, m")


def _draw_tracks(axes: Axes, recording: Recording) -> None:
    for tracks in recording.tracks:
        for track in tracks:
            axes.plot(*track.position_odom_m, ".", ms=5, color=_colour(track.awareness_lower))
    axes.set_aspect("equal", adjustable="datalim")
    _label(axes, "x, odom (m)", "y (m)")


def _draw_awareness(axes: Axes, recording: Recording) -> None:
    tracks = [track for tracks in recording.tracks for track in tracks]
    times = [track.stamp_s for track in tracks]
    axes.plot(times, [track.awareness for track in tracks], color=_ROBOT, label="α")
    lower = [track.awareness_lower for track in tracks]
    axes.plot(times, lower, color=_INK, lw=1.0, ls=":", label="lower bound")
    axes.set_ylim(0.0, 1.0)
    axes.legend(fontsize=7, frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    _label(axes, "time (s)", "awareness")


def _label(axes: Axes, across: str, up: str) -> None:
    axes.set_xlabel(across, fontsize=8)
    axes.set_ylabel(up, fontsize=8)
    axes.tick_params(labelsize=7)


def _colour(alpha: float) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in awareness_colour(alpha))


def example_names() -> tuple[str, ...]:
    """Return the names of all examples of a planner, those with other projects' planners last."""
    own = {path.stem for path in (ROOT / "examples").glob("*.py")} - _ROBOTS
    return (*sorted(own), *PLANNERS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description="Make the pictures of the examples.")
    parser.add_argument("examples", nargs="*", help="default: all")
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in parser.parse_args(arguments).examples or example_names():
        stream = io.BytesIO()
        figure_of(record_example(name)).savefig(stream, format="png")
        image = Image.open(stream).convert("RGB")
        path = FOLDER / f"{name}.png"
        image.quantize(_COLOURS, dither=Image.Dither.NONE).save(path, "PNG", optimize=True)
        print(f"{name}: {path.stat().st_size / 1e3:.0f} kB", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
