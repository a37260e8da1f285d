"""The work of ``awarenav estimate``: people in images from any source, one line per frame."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tqdm import tqdm

from perception import AttentionCone
from perception.arrays import FloatArray
from perception.shipped import simulator_networks_warning

from ..errors import AwarenavError, counted
from ._camera import CameraChoice, fixed_camera_pose
from ._depth_files import DepthFiles
from ._estimator import FrameEstimate, Networks, PeopleEstimator
from ._networks import NetworkChoice, admit_networks, choose_networks
from ._open_source import CAMERA_NUMBER, open_source
from ._overlay_writer import OverlayWriter
from ._results import ResultsFile, estimate_record, settings_hash
from ._source import ImageSource, SourceFrame
from ._threads import BackgroundWorker, FramePrefetcher

# A run ends if none of so many frames can be estimated.
_FAILURES_BEFORE_ABORT: Final = 10
# Further problems are only counted.
_MOST_PROBLEMS_LOGGED: Final = 5
# Frames per second of a video that is made from images without a rate.
_SLIDESHOW_HZ: Final = 5.0
# The options that change the estimates, beside the choice of networks.
_SETTINGS: Final = (
    "min_score",
    "detect_every_s",
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
    depth: Path | None = None
    networks: Path | None
    detector: str
    pose: str
    head: str
    eyes: str
    person_class: int | None = None
    input_size: str | None = None
    allow_simulator_networks: bool
    min_score: float
    threads: int | None
    provider: str
    provider_options: str = ""
    detect_every_s: float = 0.0
    camera: Path | None
    fov_deg: float | None
    camera_height_m: float | None
    camera_pitch_deg: float


@dataclass(slots=True)
class EstimateSummary:
    """Counts of a run.

    Attributes:
        frames: number of frames that were estimated.
        people: number of observations in them.
        without_evidence: number of these observations without an α.
        no_view: number of frames that show nothing, by the reason.
        problems: of frames that could not be read or estimated.
        duration_s: of the run.
    """

    frames: int = 0
    people: int = 0
    without_evidence: int = 0
    no_view: Counter[str] = field(default_factory=Counter)
    problems: list[str] = field(default_factory=list)
    duration_s: float = 0.0

    def add(self, estimate: FrameEstimate) -> None:
        """Count an estimated frame."""
        self.frames += 1
        self.people += len(estimate.observations)
        self.without_evidence += sum(each.awareness is None for each in estimate.observations)
        if estimate.no_view is not None:
            self.no_view[estimate.no_view] += 1


def estimate_command(options: EstimateOptions, networks: Networks | None = None) -> int:
    """Run the command.

    Args:
        options: of the command line.
        networks: to use instead of those that ``options`` name.

    Returns:
        Exit status: 0 success, 1 if some frames could not be read or estimated.

    Raises:
        AwarenavError: for input that cannot be used; nothing was done then.
        PerceptionError: for a network or calibration that cannot be used.
    """
    _check(options)
    pose = _fixed_pose(options)
    with contextlib.ExitStack() as stack:
        source = open_source(options.source, topic=options.topic)
        until_prefetched = stack.enter_context(contextlib.ExitStack())
        until_prefetched.callback(source.close)
        depth = _depth(options, source)
        cameras = CameraChoice.of_options(options.camera, options.fov_deg, source, _log)
        if source.rectified and cameras.calibrated:
            _log("the images are rectified: P of the calibration counts, without distortion")
        for note in source.notes:
            _log(note)
        choice = NetworkChoice.of_options(options)
        if networks is None:
            networks = choose_networks(
                **choice.model_dump(),
                min_score=options.min_score,
                threads=options.threads,
                provider=options.provider,
                provider_options=options.provider_options.split(),
                detect_every_s=options.detect_every_s,
            )
        unfit = admit_networks(
            networks, rendered=source.rendered, allowed=options.allow_simulator_networks
        )
        if unfit:
            _log(f"{simulator_networks_warning(unfit)}: trust none of the results")
        estimator = PeopleEstimator(
            networks,
            cameras,
            fixed_pose_odom_camera=pose,
            track=options.tracks,
            depth=depth,
            unfit=unfit,
        )
        chosen = {name: getattr(options, name) for name in _SETTINGS} | (
            choice.model_dump(exclude_none=True)
        )
        if options.depth is not None:
            chosen["depth"] = options.depth
        settings = settings_hash(chosen)
        overlay = _overlay(options, source)
        results = stack.enter_context(
            ResultsFile(options.out, settings, resume=options.resume, overwrite=options.overwrite)
        )
        if overlay is not None:
            stack.enter_context(overlay)
        until_prefetched.pop_all()  # the prefetcher closes the source from here on
        frames = stack.enter_context(
            FramePrefetcher(source, every=options.every, limit=options.frames)
        )
        summary = run_estimate(
            frames, estimator, results, settings, overlay=overlay, total=_total(options, source)
        )
    _report(options, summary)
    return 1 if summary.problems else 0


def run_estimate(
    frames: FramePrefetcher,
    estimator: PeopleEstimator,
    results: ResultsFile,
    settings: str,
    *,
    overlay: OverlayWriter | None = None,
    total: int | None = None,
    progress: bool = True,
) -> EstimateSummary:
    """Estimate every frame, write its line and draw it; reading and drawing have their own threads.

    A frame that cannot be read or estimated is named on standard error and has no line. The caller
    closes ``frames``, ``results`` and ``overlay``; everything before an error or Ctrl-C is kept.

    Args:
        frames: of the source.
        estimator: of people.
        results: gets the lines; frames that it has already are left out.
        settings: hash of the settings.
        overlay: gets the images to draw into.
        total: number of frames for the progress bar, if known.
        progress: shows the bar.

    Raises:
        AwarenavError: if no frame could be estimated, with the reason.
    """
    summary = EstimateSummary()
    start_s = time.monotonic()
    with contextlib.ExitStack() as stack:
        bar = stack.enter_context(
            tqdm(total=total, desc="estimate", unit="frame", file=sys.stderr, disable=not progress)
        )
        drawing = None
        if overlay is not None:
            drawing = stack.enter_context(BackgroundWorker[FrameEstimate](overlay.add))
        for frame in frames:
            bar.update()
            if frame.name in results.done:
                estimator.pass_over(frame)
                continue
            estimate = _estimate(frame, estimator, summary)
            if estimate is None:
                continue
            results.add(estimate_record(estimate, settings))
            summary.add(estimate)
            if drawing is not None:
                drawing.put(estimate)
    summary.duration_s = time.monotonic() - start_s
    if summary.problems and not summary.frames and not results.done:
        raise AwarenavError(f"nothing could be estimated: {summary.problems[0]}")
    return summary


def _estimate(
    frame: SourceFrame, estimator: PeopleEstimator, summary: EstimateSummary
) -> FrameEstimate | None:
    """Return the estimate of a frame; note the problem if there is none."""
    problem = frame.problem
    if frame.image_rgb is not None:
        try:
            return estimator.estimate(frame)
        except AwarenavError as error:
            problem = f"frame {frame.name}: {error}"
            if not summary.frames and len(summary.problems) + 1 >= _FAILURES_BEFORE_ABORT:
                raise AwarenavError(
                    f"not one of the first {_FAILURES_BEFORE_ABORT} frames could be estimated: "
                    f"{problem}"
                ) from error
    summary.problems.append(problem)
    if len(summary.problems) <= _MOST_PROBLEMS_LOGGED:
        _log(problem)
    elif len(summary.problems) == _MOST_PROBLEMS_LOGGED + 1:
        _log("further frames with problems are only counted")
    return None


def _check(options: EstimateOptions) -> None:
    """Refuse options that do not go together."""
    draws_video = options.overlay.lower().endswith(".mp4")
    if options.resume and options.tracks:
        raise AwarenavError(
            "--resume cannot continue --tracks: the state of the tracker is not in the file"
        )
    if options.resume and options.detect_every_s:
        raise AwarenavError(
            "--resume cannot continue --detect-every-s: the boxes of the last image are not in "
            "the file"
        )
    if options.resume and draws_video:
        raise AwarenavError("--resume cannot continue a video; draw into a folder (--overlay DIR)")
    if options.resume and (CAMERA_NUMBER.fullmatch(options.source) or "://" in options.source):
        raise AwarenavError("--resume cannot continue a camera: its frames are gone")
    if options.camera_pitch_deg and options.camera_height_m is None:
        raise AwarenavError("--camera-pitch-deg needs --camera-height-m")
    if options.fov_deg is not None and not 1.0 <= options.fov_deg <= 179.0:
        raise AwarenavError(f"--fov-deg must lie in [1, 179] degrees, got {options.fov_deg:g}")


def _fixed_pose(options: EstimateOptions) -> FloatArray | None:
    if options.camera_height_m is None:
        return None
    if options.camera_height_m <= 0.0:
        raise AwarenavError(f"--camera-height-m must be above 0, got {options.camera_height_m:g} m")
    return fixed_camera_pose(options.camera_height_m, options.camera_pitch_deg)


def _depth(options: EstimateOptions, source: ImageSource) -> DepthFiles | None:
    if options.depth is None:
        return None
    return DepthFiles(options.depth, source, every=options.every, limit=options.frames)


def _overlay(options: EstimateOptions, source: ImageSource) -> OverlayWriter | None:
    if options.overlay == "none":
        return None
    rate_hz = (source.rate_hz or _SLIDESHOW_HZ) / options.every
    return OverlayWriter(Path(options.overlay), rate_hz, AttentionCone(), single=source.count == 1)


def _total(options: EstimateOptions, source: ImageSource) -> int | None:
    """Return the number of frames that the source will yield; None if it is not known."""
    limit = options.frames
    if source.count is None:
        return limit
    every = math.ceil(source.count / options.every)
    return every if limit is None else min(every, limit)


def _report(options: EstimateOptions, summary: EstimateSummary) -> None:
    rate_hz = summary.frames / summary.duration_s if summary.duration_s > 0.0 else 0.0
    drawn = "" if options.overlay == "none" else f", drawn into {options.overlay}"
    print(
        f"Written to {options.out}{drawn}: {counted(summary.frames, 'frame')} ({rate_hz:.1f} per "
        f"second), {counted(summary.people, 'observation')} of people, {summary.without_evidence} "
        "of them without evidence of awareness"
    )
    for reason, count in summary.no_view.items():
        _log(f"no view in {count} of {counted(summary.frames, 'frame')}: {reason}")
    if summary.problems:
        _log(f"{counted(len(summary.problems), 'frame')} could not be read or estimated")


def _log(text: str) -> None:
    """Print a message above the progress bar."""
    tqdm.write(f"awarenav estimate: {text}", file=sys.stderr)
