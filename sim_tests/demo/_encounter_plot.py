"""The plot of the paper's encounter: images of its three cases, and quantities over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.drawing import awareness_colour
from awarenav.figures import Axes, new_figure
from perception import PersonObservation
from perception.arrays import FloatArray, ImageRgb

from ..crossing import CrossingFrame, CrossingResult
from ..crossing.eyes import PIXEL_RATE_HZ

_TRUTH_COLOUR: Final = "#1f4e79"
_PERCEPTION_COLOUR: Final = "#d9822b"
_BOUND_COLOUR: Final = "#7fb77e"

#: Longest time between two images of the slowest camera of an encounter, with a margin.
CAMERA_PERIOD_S: Final = 1.1 / PIXEL_RATE_HZ


@dataclass(frozen=True, slots=True)
class EncounterCase:
    """A row of the paper's table: awareness and position of the worker at one time."""

    t_s: float
    awareness: float
    d_fwd_m: float
    d_lat_m: float
    meaning: str


#: Table I of the paper.
CASES: Final = (
    EncounterCase(5.65, 0.34, 2.77, -1.04, "partial awareness"),
    EncounterCase(10.00, 0.00, 2.13, 0.92, "no awareness"),
    EncounterCase(16.25, 0.88, 2.05, -0.15, "full awareness"),
)


@dataclass(frozen=True, slots=True, eq=False)
class CaseImages:
    """One case of the encounter: its frame, and the views of the robot and of the worker."""

    case: EncounterCase
    frame: CrossingFrame
    robot_view: ImageRgb
    eye_view: ImageRgb


#: α, d_fwd (m) and d_lat (m, left positive); None where nothing is known.
EncounterValues = tuple[float | None, float | None, float | None]
_TITLES: Final = (
    "awareness score α",
    "forward distance d_fwd (m)",
    "lateral offset d_lat (m), left positive",
)


def true_values(frame: CrossingFrame) -> EncounterValues:
    """Return the true values of the worker."""
    true = frame.truth[0]
    return true.awareness, true.d_fwd_m, true.d_lat_m


def observed_values(observation: PersonObservation | None) -> EncounterValues:
    """Return the values of an observation of the worker; all None for no observation."""
    if observation is None:
        return None, None, None
    right_m, _, forward_m = observation.position_camera_m.tolist()
    return observation.awareness, forward_m, -right_m


def plot_encounter(path: Path, result: CrossingResult, images: Sequence[CaseImages]) -> None:
    """Plot the encounter: images of the three cases, and awareness and position over time.

    Args:
        path: the PNG file.
        result: the encounter.
        images: images of each case.
    """
    figure = new_figure(16.0, 6.9)
    grid = figure.add_gridspec(2, 6, height_ratios=[1.0, 1.9])
    for column, case_images in enumerate(images):
        for side, (image, name) in enumerate(
            ((case_images.robot_view, "robot's camera"), (case_images.eye_view, "worker's eyes"))
        ):
            axes = figure.add_subplot(grid[0, 2 * column + side])
            title = f"({column + 1}) {case_images.case.t_s:.2f} s: {case_images.case.meaning}"
            _show_image(axes, image, title if side == 0 else "", name)
            _colour_frame(axes, case_images.frame.truth[0].awareness)
    time = np.array([frame.t_s for frame in result.frames])
    true = np.array([true_values(frame) for frame in result.frames], dtype=float)
    seen = [observed_values(frame.observation_of(0)) for frame in result.frames]
    observed = np.array(seen, dtype=float)
    paper = [(case.awareness, case.d_fwd_m, case.d_lat_m) for case in CASES]
    for index, title in enumerate(_TITLES):
        axes = figure.add_subplot(grid[1, 2 * index : 2 * index + 2])
        label = f"from {result.perception}"
        with_gaps = _with_gaps(time, observed[:, index])
        axes.plot(*with_gaps, color=_PERCEPTION_COLOUR, lw=0.7, label=label)
        if index == 0:
            _plot_bound(axes, result, time)
        axes.plot(time, true[:, index], color=_TRUTH_COLOUR, lw=1.4, label="truth")
        _mark_cases(axes, [values[index] for values in paper])
        axes.set_title(title, fontsize=10, loc="left")
        axes.set_xlabel("time (s)")
        axes.grid(alpha=0.25)
        axes.legend(fontsize=8, loc="best")
    figure.savefig(path, dpi=110)


def _show_image(axes: Axes, image: ImageRgb, title: str, name: str) -> None:
    axes.imshow(image)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, loc="left", fontsize=10)
    axes.set_xlabel(name, fontsize=9)


def _colour_frame(axes: Axes, awareness: float) -> None:
    red, green, blue = awareness_colour(awareness)
    for spine in axes.spines.values():
        spine.set_color((red / 255.0, green / 255.0, blue / 255.0))
        spine.set_linewidth(2.0)


def _mark_cases(axes: Axes, paper: Sequence[float]) -> None:
    """Mark the times of the cases, and the paper's value at each."""
    times = [case.t_s for case in CASES]
    axes.plot(times, paper, "o", mfc="none", mec="black", ms=8, label="paper")
    for number, case in enumerate(CASES, start=1):
        axes.axvline(case.t_s, color="0.8", lw=0.8, zorder=0)
        axes.annotate(
            f"({number})",
            (case.t_s, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(2, -11),
            textcoords="offset points",
            fontsize=8,
            color="0.35",
        )


def _plot_bound(axes: Axes, result: CrossingResult, time: FloatArray) -> None:
    """Plot the highest lower bound of all tracks, which the robot acts on."""
    highest = (
        max((each.awareness_lower for each in f.tracks), default=None) for f in result.frames
    )
    lower = np.array([np.nan if each is None else each for each in highest])
    axes.fill_between(time, 0.0, lower, color=_BOUND_COLOUR, alpha=0.45, lw=0, label="lower bound")
    axes.set_ylim(-0.02, 1.05)


def _with_gaps(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the finite values with a NaN where images are missing for two periods or more."""
    finite = np.isfinite(values)
    times, finite_values = time[finite], values[finite].copy()
    breaks = np.flatnonzero(np.diff(times) > 2.0 * CAMERA_PERIOD_S) + 1
    return np.insert(times, breaks, times[breaks]), np.insert(finite_values, breaks, np.nan)
