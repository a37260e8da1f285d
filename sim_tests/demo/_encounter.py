"""The paper's encounter: its run, its video and its images of the three cases."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.video import VideoWriter
from nav_adapter import AwarenessPolicy
from perception import AttentionCone, Camera
from perception.arrays import ImageRgb

from ..crossing import CrossingFrame, CrossingResult, Stage, TopView, draw_camera_view, run_crossing
from ..scenario import Scenario
from ..world.camera import CameraRenderer
from ._cases import CAMERA_PERIOD_S, CASES
from ._encounter_plot import CaseImages, plot_encounter
from ._tables import write_encounter

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
    progress: Callable[[int], None] | None = None,
) -> CrossingResult:
    """Run the encounter and write its table, plot and video.

    Args:
        out: folder for ``encounter.csv``, ``encounter.png`` and ``encounter.mp4``.
        seed: seed of the perception's noise.
        video: whether to render the video, which takes most of the time with keypoints.
        perception: ``"keypoints"``, or ``"pixels"``: rendered images, through the shipped networks.
        progress: called once per frame with the number of finished frames.

    Returns:
        The crossing, with the truth and the observation of every frame.
    """
    scenario = Scenario.shipped("paper_encounter")
    # The robot of the paper asks nobody, and the worker's looks are those of the script.
    policy = AwarenessPolicy.preset("balanced").model_copy(update={"attention": None})
    with _Recorder(scenario, out / "encounter.mp4" if video else None, progress) as recorder:
        result = run_crossing(
            scenario, policy=policy, perception=perception, seed=seed, observer=recorder
        )
    write_encounter(out / "encounter.csv", result.frames, perception)
    plot_encounter(out / "encounter.png", result, recorder.images)
    return result


class _Recorder(AbstractContextManager["_Recorder"]):
    """Renders the video and the images of the three cases while the encounter runs."""

    def __init__(
        self, scenario: Scenario, path: Path | None, progress: Callable[[int], None] | None
    ) -> None:
        self._camera = scenario.camera.camera(_VIEW_SCALE)
        self._cone = AttentionCone()
        self._every = round(scenario.control_hz / _VIDEO_HZ)
        self._ticks = 0
        self._last_observed: CrossingFrame | None = None
        self._progress = progress
        self._map: TopView | None = None
        size = (2 * self._camera.width_px, self._camera.height_px)
        self._video = None if path is None else VideoWriter(path, _VIDEO_HZ, size)
        self._pending_cases = list(CASES)
        self.images: list[CaseImages] = []

    def __exit__(self, *exception: object) -> None:
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
        if self._progress is not None:
            self._progress(self._ticks)

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
