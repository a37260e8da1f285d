"""The paper's encounter: run it, keep its pictures, plot it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from awarenav.drawing import awareness_colour
from awarenav.figures import new_figure
from awarenav.video import VideoWriter
from perception import AttentionCone, Camera, PersonObservation
from perception.arrays import FloatArray

from ..crossing import CrossingFrame, CrossingResult, Stage, TopView, draw_camera_view, run_crossing
from ..crossing.eyes import PIXEL_RATE_HZ
from ..scenario import Scenario
from ..world.camera import CameraRenderer
from ._tables import write_encounter

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class EncounterCase:
    """A row of the paper's table: where the worker is at a time and how aware."""

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

_VIDEO_HZ: Final = 15
_VIEW_SCALE: Final = 1.0 / 3.0
_MAP_WINDOW_M: Final = (-0.9, -2.05, 5.5, 1.95)
_EYE_CAMERA_FOV_RAD: Final = np.radians(75.0)
# The eye camera sits at the front of the eyes, so that the worker's own face is not in its view.
_EYE_FORWARD_M: Final = 0.08
# Of the slowest camera that an encounter is seen with, and a little.
_CAMERA_PERIOD_S: Final = 1.1 / PIXEL_RATE_HZ


@dataclass(frozen=True, slots=True, eq=False)
class _CasePictures:
    case: EncounterCase
    frame: CrossingFrame
    robot_view: Image
    eye_view: Image


def run_encounter(
    out: Path,
    *,
    seed: int = 0,
    video: bool = True,
    perception: str = "keypoints",
    progress: Callable[[int], None] | None = None,
) -> CrossingResult:
    """Run the encounter and write its table, plot and video.

    Args:
        out: folder for ``encounter.csv``, ``encounter.png`` and ``encounter.mp4``.
        seed: of the perception's noise.
        video: whether to render the video, which takes most of the time from keypoints.
        perception: ``"keypoints"``, or ``"pixels"``: rendered, through the shipped networks.
        progress: called once a frame with the number of frames done.

    Returns:
        The crossing, with every frame's truth and observation.
    """
    scenario = Scenario.shipped("paper_encounter")
    recorder = _Recorder(scenario, out / "encounter.mp4" if video else None, progress)
    try:
        result = run_crossing(
            scenario, policy="balanced", perception=perception, seed=seed, observer=recorder
        )
    finally:
        recorder.close()
    write_encounter(out / "encounter.csv", result.frames, perception)
    _plot(out / "encounter.png", result, recorder.pictures)
    return result


def case_values(
    result: CrossingResult,
) -> list[tuple[EncounterCase, str, float | None, float | None, float | None]]:
    """For each case and perception: α, d_fwd and d_lat at the frame of the paper's time."""
    rows: list[tuple[EncounterCase, str, float | None, float | None, float | None]] = []
    for case in CASES:
        frame = frame_at(result, case.t_s)
        true = frame.truth[0]
        rows.append((case, "truth", true.awareness, true.d_fwd_m, true.d_lat_m))
        seen = _observation_near(result, case.t_s)
        name = result.perception
        if seen is None:
            rows.append((case, name, None, None, None))
        else:
            position = seen.position_camera_m
            rows.append((case, name, seen.awareness, float(position[2]), -float(position[0])))
    return rows


def frame_at(result: CrossingResult, t_s: float) -> CrossingFrame:
    """The frame nearest in time."""
    return min(result.frames, key=lambda frame: abs(frame.t_s - t_s))


def _observation_near(result: CrossingResult, t_s: float) -> PersonObservation | None:
    """What was seen of the first worker in the camera's frame nearest in time."""
    near = (frame for frame in result.frames if abs(frame.t_s - t_s) <= _CAMERA_PERIOD_S)
    seen = [
        (abs(frame.t_s - t_s), observation)
        for frame in near
        if (observation := frame.observation_of(0)) is not None
    ]
    return min(seen, key=lambda each: each[0])[1] if seen else None


class _Recorder:
    """Renders video frames and the pictures of the three cases while the encounter runs."""

    def __init__(
        self, scenario: Scenario, path: Path | None, progress: Callable[[int], None] | None
    ) -> None:
        self._camera = scenario.camera.camera(_VIEW_SCALE)
        self._cone = AttentionCone()
        self._every = round(scenario.control_hz / _VIDEO_HZ)
        self._ticks = 0
        self._seen: CrossingFrame | None = None
        self._progress = progress
        self._map: TopView | None = None
        size = (2 * self._camera.width_px, self._camera.height_px)
        self._video = None if path is None else VideoWriter(path, _VIDEO_HZ, size)
        self._waiting = list(CASES)
        self.pictures: list[_CasePictures] = []

    def close(self) -> None:
        if self._video is not None:
            self._video.close()

    def _with_last_seen(self, frame: CrossingFrame) -> CrossingFrame:
        """The frame with what the last camera frame showed, while that is fresh."""
        seen = self._seen
        if seen is None or frame.t_s - seen.t_s > _CAMERA_PERIOD_S:
            return frame
        return replace(
            frame, observations=seen.observations, observed_workers=seen.observed_workers
        )

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        if frame.observations:
            self._seen = frame
        if self._map is None:
            size = (self._camera.width_px, self._camera.height_px)
            self._map = TopView(stage, size, _MAP_WINDOW_M)
        half_tick = 0.5 / stage.scenario.control_hz
        case = next((c for c in self._waiting if abs(c.t_s - frame.t_s) <= half_tick), None)
        filming = self._video is not None and self._ticks % self._every == 0
        if filming or case is not None:
            renderer = CameraRenderer(stage.warehouse)
            picture = renderer.rgb(self._camera, frame.T_odom_camera)
            drawn = draw_camera_view(
                picture, self._camera, self._with_last_seen(frame), stage, self._cone
            )
            if case is not None:
                self._waiting.remove(case)
                self.pictures.append(
                    _CasePictures(case, frame, drawn, _eye_view(stage, self._camera))
                )
            if filming and self._video is not None:
                above = self._map.draw(frame, stage, self._cone)
                self._video.add(np.hstack([drawn, above]))
        self._ticks += 1
        if self._progress is not None:
            self._progress(self._ticks)


def _eye_view(stage: Stage, like: Camera) -> Image:
    """What the first worker sees: a camera at the eyes along the gaze."""
    pose = np.array(stage.workers[0].T_odom_eyes)
    pose[:3, 3] += _EYE_FORWARD_M * pose[:3, 2]
    camera = Camera.from_fov(like.width_px, like.height_px, float(_EYE_CAMERA_FOV_RAD))
    return CameraRenderer(stage.warehouse).rgb(camera, pose)


def _column(result: CrossingResult, pick: Callable[[CrossingFrame], float | None]) -> FloatArray:
    return np.array([np.nan if (v := pick(f)) is None else v for f in result.frames], dtype=float)


def _seen(pick: Callable[[FloatArray], float]) -> Callable[[CrossingFrame], float | None]:
    def of(frame: CrossingFrame) -> float | None:
        observation = frame.observation_of(0)
        return None if observation is None else pick(observation.position_camera_m)

    return of


def _plot(path: Path, result: CrossingResult, pictures: list[_CasePictures]) -> None:
    figure = new_figure(16.0, 6.9)
    grid = figure.add_gridspec(2, 6, height_ratios=[1.0, 1.9])
    for column, pair in enumerate(pictures):
        for side, (image, name) in enumerate(
            ((pair.robot_view, "robot's camera"), (pair.eye_view, "worker's eyes"))
        ):
            axes = figure.add_subplot(grid[0, 2 * column + side])
            axes.imshow(image)
            axes.set_xticks([])
            axes.set_yticks([])
            title = f"({column + 1}) {pair.case.t_s:.2f} s: {pair.case.meaning}"
            axes.set_title(title if side == 0 else "", loc="left", fontsize=10)
            axes.set_xlabel(name, fontsize=9)
            red, green, blue = awareness_colour(pair.frame.truth[0].awareness)
            for spine in axes.spines.values():
                spine.set_color((red / 255.0, green / 255.0, blue / 255.0))
                spine.set_linewidth(2.0)
    time = np.array([frame.t_s for frame in result.frames])
    panels: tuple[
        tuple[
            str,
            Callable[[CrossingFrame], float | None],
            Callable[[CrossingFrame], float | None],
            Callable[[EncounterCase], float],
        ],
        ...,
    ] = (
        (
            "awareness score α",
            lambda f: f.truth[0].awareness,
            lambda f: None if (o := f.observation_of(0)) is None else o.awareness,
            lambda c: c.awareness,
        ),
        (
            "forward distance d_fwd (m)",
            lambda f: f.truth[0].d_fwd_m,
            _seen(lambda p: float(p[2])),
            lambda c: c.d_fwd_m,
        ),
        (
            "lateral offset d_lat (m), left positive",
            lambda f: f.truth[0].d_lat_m,
            _seen(lambda p: -float(p[0])),
            lambda c: c.d_lat_m,
        ),
    )
    for index, (name, true, seen, of_case) in enumerate(panels):
        axes = figure.add_subplot(grid[1, 2 * index : 2 * index + 2])
        axes.plot(
            *_frames_of_camera(time, _column(result, seen)), color="#d9822b", lw=0.7,
            label=f"from {result.perception}",
        )  # fmt: skip
        if index == 0:
            _plot_bound(axes, result, time)
        axes.plot(time, _column(result, true), color="#1f4e79", lw=1.4, label="truth")
        axes.plot(
            [c.t_s for c in CASES], [of_case(c) for c in CASES], "o", mfc="none", mec="black",
            ms=8, label="paper",
        )  # fmt: skip
        for number, case in enumerate(CASES, start=1):
            axes.axvline(case.t_s, color="0.8", lw=0.8, zorder=0)
            axes.annotate(
                f"({number})", (case.t_s, 1.0), xycoords=("data", "axes fraction"),
                xytext=(2, -11), textcoords="offset points", fontsize=8, color="0.35",
            )  # fmt: skip
        axes.set_title(name, fontsize=10, loc="left")
        axes.set_xlabel("time (s)")
        axes.grid(alpha=0.25)
        axes.legend(fontsize=8, loc="best")
    figure.savefig(path, dpi=110)


def _frames_of_camera(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The values that there are, with a gap where the camera had nothing for longer than usual."""
    there = np.isfinite(values)
    times, seen = time[there], values[there].copy()
    breaks = np.flatnonzero(np.diff(times) > 2.0 * _CAMERA_PERIOD_S) + 1
    return np.insert(times, breaks, times[breaks]), np.insert(seen, breaks, np.nan)


def _plot_bound(axes: Axes, result: CrossingResult, time: FloatArray) -> None:
    """The lower bound that the robot acts on, of the first person's confirmed track."""
    lower = _column(
        result,
        lambda f: max((track.awareness_lower for track in f.tracks), default=None),
    )
    axes.fill_between(time, 0.0, lower, color="#7fb77e", alpha=0.45, lw=0, label="lower bound")
    axes.set_ylim(-0.02, 1.05)
