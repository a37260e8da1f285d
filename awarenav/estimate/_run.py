"""``awarenav estimate``: people in pictures from anywhere, one line a frame.

``awarenav estimate`` from its options to its last line.
"""

from __future__ import annotations

import contextlib
import math
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tqdm import tqdm

from nav_adapter import NavError
from perception import AttentionCone, Camera, PerceptionError
from perception.arrays import FloatArray
from tracking import TrackingError

from ..errors import AwarenavError
from ._camera import CameraChoice, fixed_camera_pose
from ._estimator import FrameEstimate, Networks, PeopleEstimator
from ._networks import choose_networks
from ._open_source import open_source
from ._overlay_file import OverlayFile
from ._results import ResultsFile, estimate_record, settings_mark
from ._source import ImageSource, SourceFrame
from ._threads import ReadAhead, WriteBehind

# What goes wrong with one frame; everything else ends the run.
_FRAME_ERRORS: Final = (PerceptionError, AwarenavError, TrackingError, NavError)
# When not one of so many frames could be estimated, none will be.
_HOPELESS: Final = 10
_SAID: Final = 5


@dataclass(slots=True)
class EstimateSummary:
    """What came of a run.

    Attributes:
        frames: estimated.
        people: observations in them.
        without_evidence: of these, those without an α.
        problems: of frames that could not be read or estimated.
        duration_s: of the run.
    """

    frames: int = 0
    people: int = 0
    without_evidence: int = 0
    problems: list[str] = field(default_factory=list)
    duration_s: float = 0.0

    def count(self, estimate: FrameEstimate) -> None:
        """Take one frame into account."""
        self.frames += 1
        self.people += len(estimate.observations)
        self.without_evidence += sum(each.awareness is None for each in estimate.observations)


def run_estimate(
    frames: ReadAhead,
    estimator: PeopleEstimator,
    results: ResultsFile,
    mark: str,
    *,
    overlay: OverlayFile | None = None,
    total: int | None = None,
    progress: bool = True,
) -> EstimateSummary:
    """Estimate every frame, write its line and draw it; reading and drawing run beside.

    A frame that cannot be read or estimated is named on standard error and has no line. The caller
    closes ``frames``, ``results`` and ``overlay``; what was done up to an error or Ctrl-C is whole.

    Args:
        frames: of the source.
        estimator: of people.
        results: where lines go; frames that are in it already are left out.
        mark: of the settings.
        overlay: where drawn pictures go.
        total: for the progress bar, if it is known.
        progress: shows the bar.

    Raises:
        AwarenavError: when no frame at all could be estimated, saying why.
    """
    summary = EstimateSummary()
    start_s = time.monotonic()
    with contextlib.ExitStack() as stack:
        bar = stack.enter_context(
            tqdm(total=total, desc="estimate", unit="frame", file=sys.stderr, disable=not progress)
        )
        drawing = None
        if overlay is not None:
            drawing = stack.enter_context(WriteBehind[FrameEstimate](overlay.add))
        for frame in frames:
            bar.update()
            if frame.name in results.done:
                continue
            estimate = _estimate(frame, estimator, summary)
            if estimate is None:
                continue
            results.add(estimate_record(estimate, mark))
            summary.count(estimate)
            if drawing is not None:
                drawing.put(estimate)
    summary.duration_s = time.monotonic() - start_s
    if summary.problems and not summary.frames and not results.done:
        raise AwarenavError(f"nothing could be estimated: {summary.problems[0]}")
    return summary


def _estimate(
    frame: SourceFrame, estimator: PeopleEstimator, summary: EstimateSummary
) -> FrameEstimate | None:
    problem = frame.problem
    if frame.image_rgb is not None:
        try:
            return estimator.estimate(frame)
        except _FRAME_ERRORS as error:
            problem = f"frame {frame.name}: {error}"
            if not summary.frames and len(summary.problems) + 1 >= _HOPELESS:
                raise AwarenavError(
                    f"not one of the first {_HOPELESS} frames could be estimated: {problem}"
                ) from error
    summary.problems.append(problem)
    if len(summary.problems) <= _SAID:
        say(problem)
    elif len(summary.problems) == _SAID + 1:
        say("more frames with problems are counted, not named")
    return None


def say(text: str) -> None:
    """Tell the user something beside the progress bar."""
    tqdm.write(f"awarenav estimate: {text}", file=sys.stderr)


# Pictures a second of a video of pictures that have no rate of their own.
_SLIDES_HZ = 5.0
# Options that make one file's lines unlike another's.
_SETTINGS = (
    "detector",
    "pose",
    "head",
    "min_score",
    "camera",
    "fov_deg",
    "camera_height_m",
    "camera_pitch_deg",
    "topic",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateOptions:
    """The options of ``awarenav estimate``."""

    source: str
    out: Path
    resume: bool
    overwrite: bool
    overlay: str
    tracks: bool
    every: int
    frames: int | None
    topic: str | None
    detector: str
    pose: str
    head: str
    min_score: float
    threads: int | None
    provider: str
    camera: Path | None
    fov_deg: float | None
    camera_height_m: float | None
    camera_pitch_deg: float


def estimate_command(options: EstimateOptions, networks: Networks | None = None) -> int:
    """Run the command.

    Args:
        options: of the parser.
        networks: that work instead of those named by ``options``.

    Returns:
        Exit status: 0 well, 1 when some frames could not be read or estimated.

    Raises:
        AwarenavError: for input that cannot be used; nothing was done then.
        PerceptionError: for a network or calibration that cannot be used.
    """
    _check(options)
    pose = _standing_pose(options)
    with contextlib.ExitStack() as stack:
        source = open_source(options.source, topic=options.topic)
        frames_given = stack.enter_context(contextlib.ExitStack())
        frames_given.callback(source.close)
        cameras = CameraChoice(_calibration(options, source), options.fov_deg, say)
        estimator = PeopleEstimator(
            choose_networks(
                options.detector,
                options.pose,
                options.head,
                min_score=options.min_score,
                threads=options.threads,
                provider=options.provider,
            )
            if networks is None
            else networks,
            cameras,
            standing_pose_odom_camera=pose,
            track=options.tracks,
        )
        mark = settings_mark({name: getattr(options, name) for name in _SETTINGS})
        overlay = _overlay(options, source)
        results = stack.enter_context(
            ResultsFile(options.out, mark, resume=options.resume, overwrite=options.overwrite)
        )
        if overlay is not None:
            stack.enter_context(overlay)
        frames_given.pop_all()  # closes the source from here on
        frames = stack.enter_context(ReadAhead(source, every=options.every, limit=options.frames))
        summary = run_estimate(
            frames, estimator, results, mark, overlay=overlay, total=_total(options, source)
        )
    _report(options, summary)
    return 1 if summary.problems else 0


def _check(options: EstimateOptions) -> None:
    drawn_into_video = options.overlay.lower().endswith(".mp4")
    if options.resume and options.tracks:
        raise AwarenavError(
            "--resume cannot continue --tracks: who was followed is not in the file"
        )
    if options.resume and drawn_into_video:
        raise AwarenavError("--resume cannot continue a video; draw into a folder (--overlay DIR)")
    if options.resume and (options.source.isdigit() or "://" in options.source):
        raise AwarenavError("--resume cannot continue a camera: its frames have gone by")
    if options.camera_pitch_deg and options.camera_height_m is None:
        raise AwarenavError("--camera-pitch-deg needs --camera-height-m")
    if options.fov_deg is not None and not 1.0 <= options.fov_deg <= 179.0:
        raise AwarenavError(f"--fov-deg must lie in [1, 179] degrees, got {options.fov_deg:g}")


def _standing_pose(options: EstimateOptions) -> FloatArray | None:
    if options.camera_height_m is None:
        return None
    if options.camera_height_m <= 0.0:
        raise AwarenavError(f"--camera-height-m must be above 0, got {options.camera_height_m:g} m")
    return fixed_camera_pose(options.camera_height_m, options.camera_pitch_deg)


def _calibration(options: EstimateOptions, source: ImageSource) -> Camera | None:
    if options.camera is not None:
        return Camera.from_yaml(options.camera)
    return None if options.fov_deg is not None else source.camera


def _overlay(options: EstimateOptions, source: ImageSource) -> OverlayFile | None:
    if options.overlay == "none":
        return None
    rate_hz = (source.rate_hz or _SLIDES_HZ) / options.every
    return OverlayFile(Path(options.overlay), rate_hz, AttentionCone(), single=source.count == 1)


def _total(options: EstimateOptions, source: ImageSource) -> int | None:
    limit = options.frames
    if source.count is None:
        return limit
    every = math.ceil(source.count / options.every)
    return every if limit is None else min(every, limit)


def _report(options: EstimateOptions, summary: EstimateSummary) -> None:
    rate = summary.frames / summary.duration_s if summary.duration_s > 0.0 else 0.0
    drawn = "" if options.overlay == "none" else f", drawn into {options.overlay}"
    print(
        f"Written to {options.out}{drawn}: {_count(summary.frames, 'frame')} ({rate:.1f} a "
        f"second), {_count(summary.people, 'observation')} of people, {summary.without_evidence} "
        "of them without evidence of awareness"
    )
    if summary.problems:
        say(f"{_count(len(summary.problems), 'frame')} could not be read or estimated")


def _count(number: int, name: str) -> str:
    return f"{number} {name}" if number == 1 else f"{number} {name}s"
