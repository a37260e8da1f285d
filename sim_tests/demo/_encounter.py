"""The paper's encounter: its run, its video, its table, and its plot with images of three cases."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from tqdm import tqdm

from awarenav.drawing import DARK, WHITE, Font, awareness_colour
from awarenav.figures import Axes, new_figure
from awarenav.files import csv_number, write_csv
from awarenav.video import VideoWriter
from perception import Camera, PersonObservation
from perception.arrays import FloatArray, ImageRgb

from ..crossing import CrossingFrame, CrossingResult, Stage, run_crossing
from ..scenario import Scenario
from ..world.camera import CameraRenderer
from ..world.errors import SimError
from ._camera_film import CAMERA_PERIOD_S, OverlayCamera

_TRUTH_COLOUR: Final = "#1f4e79"
_PERCEPTION_COLOUR: Final = "#d9822b"
_BOUND_COLOUR: Final = "#7fb77e"


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
_TITLES: Final = ("awareness α", "ahead, d_fwd (m)", "to the left, d_lat (m)")
# At a width of 390 px these letters have a size of 12 px.
_TEXT_PT: Final = 17


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
    """Plot the encounter: images of the three cases, and awareness and position over time."""
    figure = new_figure(7.8, 14.2)
    halves = figure.subfigures(2, 1, squeeze=False, height_ratios=[1.0, 1.5])
    pictures, curves = halves.ravel()
    views = pictures.subplots(2, len(images), squeeze=False)
    for number, each in enumerate(images):
        alpha = each.frame.truth[0].awareness
        title = f"({number + 1}) {each.case.t_s:.2f} s\n{each.case.meaning}"
        _show_image(views[0, number], each.robot_view, alpha, title)
        _show_image(views[1, number], each.eye_view, alpha)
    for row, name in zip(views, ("robot sees", "worker sees"), strict=True):
        row[0].set_ylabel(name, fontsize=_TEXT_PT)
    time = np.array([frame.t_s for frame in result.frames])
    true = np.array([true_values(frame) for frame in result.frames], dtype=float)
    seen = [observed_values(frame.observation_of(0)) for frame in result.frames]
    observed = np.array(seen, dtype=float)
    paper = [(case.awareness, case.d_fwd_m, case.d_lat_m) for case in CASES]
    panels = curves.subplots(len(_TITLES), 1, sharex=True)
    for index, (axes, title) in enumerate(zip(panels, _TITLES, strict=True)):
        with_gaps = _with_gaps(time, observed[:, index])
        axes.plot(*with_gaps, color=_PERCEPTION_COLOUR, lw=1.0, label=f"from {result.perception}")
        if index == 0:
            _plot_bound(axes, result, time)
        axes.plot(time, true[:, index], color=_TRUTH_COLOUR, lw=2.0, label="truth")
        _mark_cases(axes, [values[index] for values in paper], named=index == 0)
        axes.set_title(title, fontsize=_TEXT_PT, loc="left", pad=28 if index == 0 else 6)
        axes.tick_params(labelsize=_TEXT_PT)
        axes.grid(alpha=0.25)
    panels[-1].set_xlabel("time (s)", fontsize=_TEXT_PT)
    lines, names = panels[0].get_legend_handles_labels()
    curves.legend(lines, names, fontsize=_TEXT_PT, loc="outside lower center", ncols=2)
    figure.savefig(path, dpi=100)


def _show_image(axes: Axes, image: ImageRgb, alpha: float, title: str = "") -> None:
    axes.imshow(image)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, loc="left", fontsize=_TEXT_PT)
    red, green, blue = awareness_colour(alpha)
    for spine in axes.spines.values():
        spine.set_color((red / 255.0, green / 255.0, blue / 255.0))
        spine.set_linewidth(4.0)


def _mark_cases(axes: Axes, paper: Sequence[float], *, named: bool) -> None:
    """Mark the times of the cases, and the paper's value at each; their numbers stand above."""
    times = [case.t_s for case in CASES]
    axes.plot(times, paper, "o", mfc="none", mec="black", mew=2.0, ms=12, label="paper")
    for number, case in enumerate(CASES, start=1):
        axes.axvline(case.t_s, color="0.7", lw=1.0, zorder=0)
        if named:
            place = (case.t_s, 1.01)
            across = axes.get_xaxis_transform()
            axes.text(*place, f"({number})", transform=across, fontsize=_TEXT_PT, ha="center")


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


_VIDEO_HZ: Final = 10
# Width and height of each half of the video, and height of the line of text above.
_HALF_PX: Final = (480, 360)
_HEAD_PX: Final = 40
_HEADS: Final = ("What the robot sees", "What the worker sees")
# Pictures of the cases have twice the size at which they are shown.
_CASE_PX: Final = (480, 480)
_CASE_TEXT_PX: Final = 64
_TEXT_PX: Final = 24
_ROBOT_VIEW_RAD: Final = math.radians(80.0)
_EYE_VIEW_RAD: Final = math.radians(75.0)
# The eye camera sits at the front of the eyes, so that the worker's own face is not in its view.
_EYE_FORWARD_M: Final = 0.08


def run_encounter(
    out: Path, *, seed: int = 0, video: bool = True, perception: str = "keypoints"
) -> CrossingResult:
    """Run the encounter and write its table, plot and video."""
    scenario = Scenario.shipped("paper_encounter")
    with _Recorder(scenario, out / "encounter.mp4" if video else None) as recorder:
        result = run_crossing(
            scenario, policy="balanced", perception=perception, seed=seed, observer=recorder
        )
    _write_table(out / "encounter.csv", result)
    plot_encounter(out / "encounter.png", result, recorder.images)
    return result


class _Recorder(AbstractContextManager["_Recorder"]):
    """Renders the video and the images of the three cases while the encounter runs."""

    def __init__(self, scenario: Scenario, path: Path | None) -> None:
        self._of_video = OverlayCamera(Camera.from_fov(*_HALF_PX, _ROBOT_VIEW_RAD), _TEXT_PX)
        case_camera = Camera.from_fov(*_CASE_PX, _ROBOT_VIEW_RAD)
        self._of_cases = OverlayCamera(case_camera, _CASE_TEXT_PX)
        self._every = round(scenario.control_hz / _VIDEO_HZ)
        self._ticks = 0
        total = round(scenario.duration_s * scenario.control_hz)
        self._bar = tqdm(total=total, desc="encounter", unit="frame", disable=None, file=sys.stderr)
        size = (2 * _HALF_PX[0], _HALF_PX[1] + _HEAD_PX)
        self._video = None if path is None else VideoWriter(path, _VIDEO_HZ, size)
        self._pending_cases = list(CASES)
        self.images: list[CaseImages] = []

    def __exit__(self, *exception: object) -> None:
        self._bar.close()
        if self._video is not None:
            self._video.close()

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        for overlay in (self._of_video, self._of_cases):
            overlay.watch(frame)
        half_tick = 0.5 / stage.scenario.control_hz
        case = next((c for c in self._pending_cases if abs(c.t_s - frame.t_s) <= half_tick), None)
        if case is not None:
            self._pending_cases.remove(case)
            seen = self._of_cases.draw(frame, stage).rgb
            self.images.append(CaseImages(case, frame, seen, _eye_view(stage, _CASE_PX)))
        if self._video is not None and self._ticks % self._every == 0:
            seen = self._of_video.draw(frame, stage).rgb
            self._video.add(_side_by_side(seen, _eye_view(stage, _HALF_PX)))
        self._ticks += 1
        self._bar.update()


def _side_by_side(*halves: ImageRgb) -> ImageRgb:
    """Return images of one size side by side, with a line of text above each."""
    head: ImageRgb = np.full((_HEAD_PX, sum(each.shape[1] for each in halves), 3), DARK, np.uint8)
    for number, text in enumerate(_HEADS):
        Font(28, weight=600).write(head, text, (number * _HALF_PX[0] + 10, 6), WHITE)
    return np.vstack([head, np.hstack(halves)])


def _eye_view(stage: Stage, size_px: tuple[int, int]) -> ImageRgb:
    """Return the view of the first worker: an image of a camera at the eyes along the gaze."""
    pose = np.array(stage.workers[0].T_odom_eyes)
    pose[:3, 3] += _EYE_FORWARD_M * pose[:3, 2]
    camera = Camera.from_fov(*size_px, _EYE_VIEW_RAD)
    return CameraRenderer(stage.warehouse).rgb(camera, pose)


def case_values(result: CrossingResult) -> list[tuple[EncounterCase, str, EncounterValues]]:
    """Return α, d_fwd and d_lat of each case, for the truth and for the perception.

    The observation is that of the image closest in time to the case.
    """
    rows = []
    for case in CASES:
        off_s = [abs(frame.t_s - case.t_s) for frame in result.frames]
        seen = [
            (off, number)
            for number, off in enumerate(off_s)
            if off <= CAMERA_PERIOD_S and result.frames[number].observation_of(0) is not None
        ]
        observation = result.frames[min(seen)[1]].observation_of(0) if seen else None
        rows.append((case, "truth", true_values(result.frames[int(np.argmin(off_s))])))
        rows.append((case, result.perception, observed_values(observation)))
    return rows


def encounter_table(result: CrossingResult) -> str:
    """Return the three cases of the encounter beside the paper's values, as text."""
    lines = [f"{'case':27s}{'':11s}{'alpha':>8s}{'d_fwd':>9s}{'d_lat':>9s}", "-" * 64]
    for case, perception, (alpha, forward, lateral) in case_values(result):
        if perception == "truth":
            lines.append(
                f"{case.t_s:5.2f} s {case.meaning:19s}{'paper':11s}{case.awareness:8.2f}"
                f"{case.d_fwd_m:7.2f} m{case.d_lat_m:7.2f} m"
            )
        cells = [
            "-" if value is None else f"{value:.2f}{unit}"
            for value, unit in ((alpha, ""), (forward, " m"), (lateral, " m"))
        ]
        lines.append(f"{'':27s}{perception:11s}{cells[0]:>8s}{cells[1]:>9s}{cells[2]:>9s}")
    return "\n".join(lines)


def _write_table(path: Path, result: CrossingResult) -> None:
    """Write ``encounter.csv``: of each frame the truth, then the perception.

    A frame without an observation, or without evidence of awareness, has empty cells.
    """
    rows = (
        [csv_number(frame.t_s), name, *map(csv_number, values)]
        for frame in result.frames
        for name, values in (
            ("truth", true_values(frame)),
            (result.perception, observed_values(frame.observation_of(0))),
        )
    )
    header = ("t_s", "perception", "awareness", "d_fwd_m", "d_lat_m")
    write_csv(path, header, rows, SimError)
