"""The paper's encounter: its run, its video and its images of the three cases."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from tqdm import tqdm

from awarenav.files import csv_number, write_csv
from awarenav.video import VideoWriter
from nav_adapter import AwarenessPolicy
from perception import AttentionCone, Camera
from perception.arrays import ImageRgb

from ..crossing import CrossingFrame, CrossingResult, Stage, TopView, draw_camera_view, run_crossing
from ..scenario import Scenario
from ..world.camera import CameraRenderer
from ..world.errors import SimError
from ._encounter_plot import (
    CAMERA_PERIOD_S,
    CASES,
    CaseImages,
    EncounterCase,
    EncounterValues,
    observed_values,
    plot_encounter,
    true_values,
)

_VIDEO_HZ: Final = 15
_VIEW_SCALE: Final = 1.0 / 3.0
_MAP_WINDOW_M: Final = (-0.9, -2.05, 5.5, 1.95)
_EYE_CAMERA_FOV_RAD: Final = np.radians(75.0)
# The eye camera sits at the front of the eyes, so that the worker's own face is not in its view.
_EYE_FORWARD_M: Final = 0.08


def run_encounter(
    out: Path,
    *,
    seed: int = 0,
    video: bool = True,
    perception: str = "keypoints",
) -> CrossingResult:
    """Run the encounter and write its table, plot and video.

    Args:
        out: folder for ``encounter.csv``, ``encounter.png`` and ``encounter.mp4``.
        seed: seed of the perception's noise.
        video: whether to render the video, which takes most of the time with keypoints.
        perception: ``"keypoints"``, or ``"pixels"``: rendered images, through the shipped networks.

    Returns:
        The crossing, with the truth and the observation of every frame.
    """
    scenario = Scenario.shipped("paper_encounter")
    # The robot of the paper asks nobody, and the worker looks as planned.
    policy = AwarenessPolicy.preset("balanced").model_copy(update={"attention": None})
    with _Recorder(scenario, out / "encounter.mp4" if video else None) as recorder:
        result = run_crossing(
            scenario, policy=policy, perception=perception, seed=seed, observer=recorder
        )
    _write_table(out / "encounter.csv", result)
    plot_encounter(out / "encounter.png", result, recorder.images)
    return result


class _Recorder(AbstractContextManager["_Recorder"]):
    """Renders the video and the images of the three cases while the encounter runs."""

    def __init__(self, scenario: Scenario, path: Path | None) -> None:
        self._camera = scenario.camera.camera(_VIEW_SCALE)
        self._cone = AttentionCone()
        self._every = round(scenario.control_hz / _VIDEO_HZ)
        self._ticks = 0
        self._last_observed: CrossingFrame | None = None
        total = round(scenario.duration_s * scenario.control_hz)
        self._bar = tqdm(total=total, desc="encounter", unit="frame", disable=None, file=sys.stderr)
        self._map: TopView | None = None
        size = (2 * self._camera.width_px, self._camera.height_px)
        self._video = None if path is None else VideoWriter(path, _VIDEO_HZ, size)
        self._pending_cases = list(CASES)
        self.images: list[CaseImages] = []

    def __exit__(self, *exception: object) -> None:
        self._bar.close()
        if self._video is not None:
            self._video.close()

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        if frame.observations:
            self._last_observed = frame
        if self._map is None:
            size = (self._camera.width_px, self._camera.height_px)
            self._map = TopView(stage, size, _MAP_WINDOW_M)
        self._map.watch(frame)
        half_tick = 0.5 / stage.scenario.control_hz
        case = next((c for c in self._pending_cases if abs(c.t_s - frame.t_s) <= half_tick), None)
        filming = self._video is not None and self._ticks % self._every == 0
        if filming or case is not None:
            renderer = CameraRenderer(stage.warehouse)
            image = renderer.rgb(self._camera, frame.T_odom_camera)
            drawn = draw_camera_view(
                image, self._camera, self._with_last_observations(frame), stage, self._cone
            )
            if case is not None:
                self._pending_cases.remove(case)
                self.images.append(CaseImages(case, frame, drawn, _eye_view(stage, self._camera)))
            if filming and self._video is not None:
                above = self._map.draw(frame, stage, self._cone)
                self._video.add(np.hstack([drawn, above]))
        self._ticks += 1
        self._bar.update()

    def _with_last_observations(self, frame: CrossingFrame) -> CrossingFrame:
        """Return the frame with the observations of the last image, unless they are too old."""
        last = self._last_observed
        if last is None or frame.t_s - last.t_s > CAMERA_PERIOD_S:
            return frame
        return replace(
            frame, observations=last.observations, observed_workers=last.observed_workers
        )


def _eye_view(stage: Stage, like: Camera) -> ImageRgb:
    """Return the view of the first worker: an image of a camera at the eyes along the gaze."""
    pose = np.array(stage.workers[0].T_odom_eyes)
    pose[:3, 3] += _EYE_FORWARD_M * pose[:3, 2]
    camera = Camera.from_fov(like.width_px, like.height_px, float(_EYE_CAMERA_FOV_RAD))
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
