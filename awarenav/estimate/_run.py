"""The work of ``awarenav estimate``: people in images from any source, one line per frame."""

from __future__ import annotations

import contextlib
import queue
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

from perception import AttentionCone, PersonObservation
from perception.named import Networks
from perception.picture_notes import picture_notes
from perception.shipped import simulator_networks_warning

from ..errors import AwarenavError, counted
from ._camera import CameraChoice, fixed_camera_pose
from ._depth_files import DepthFiles
from ._estimator import FrameEstimate, PeopleEstimator
from ._networks import admit_options, choice_of_options, running_options
from ._open_source import CAMERA_NUMBER, open_source
from ._overlay import OverlayWriter
from ._results import check_results, estimate_record, open_results, settings_hash
from ._sources import ImageSource, SourceFrame

# Frames that are read ahead, and how often a reading thread is asked whether it has ended.
_AHEAD: Final = 4
_POLL_S: Final = 0.1
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


class FramePrefetcher(AbstractContextManager["FramePrefetcher"]):
    """Iterates over the frames of a source, a few of which a thread reads ahead.

    A live source never waits: its newest frame replaces one that was not taken yet. An error of the
    source is raised here, after the frames before it. On exit the thread has ended, and reads the
    source no more.

    Args:
        source: of the frames.
        limit: most frames to take; None for all.
    """

    def __init__(self, source: ImageSource, limit: int | None = None) -> None:
        self._source = source
        self._limit = limit
        self._queue: queue.Queue[SourceFrame | BaseException | None] = queue.Queue(
            1 if source.live else _AHEAD
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, name="prefetch", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[SourceFrame]:
        while (item := self._queue.get()) is not None:
            if isinstance(item, BaseException):
                raise item
            yield item

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        while self._thread.is_alive():
            with contextlib.suppress(
                queue.Empty
            ):  # a thread that waits for a free place then sees the stop
                self._queue.get_nowait()
            self._thread.join(_POLL_S)

    def _read(self) -> None:
        """Read frames into the queue until the end, the limit or an error (in the thread)."""
        last: BaseException | None = None
        try:
            for frame in islice(self._source.frames(), self._limit):
                if self._stop.is_set():
                    break
                if self._source.live and frame.image_rgb is not None:
                    with contextlib.suppress(queue.Empty):
                        self._queue.get_nowait()
                self._queue.put(frame)
        except BaseException as error:
            last = error
        self._queue.put(last)


@dataclass(slots=True)
class _Summary:
    """Counts of a run.

    Attributes:
        frames: number of frames that were estimated.
        people: number of observations in them.
        without_evidence: number of these observations without an α, by the reason.
        no_view: number of frames that show nothing, by the reason.
        problems: of frames that could not be read or estimated.
        last: the latest estimate.
    """

    frames: int = 0
    people: int = 0
    without_evidence: Counter[str] = field(default_factory=Counter)
    no_view: Counter[str] = field(default_factory=Counter)
    problems: list[str] = field(default_factory=list)
    last: FrameEstimate | None = None

    def add(self, estimate: FrameEstimate) -> None:
        """Count an estimated frame."""
        self.frames += 1
        self.people += len(estimate.observations)
        self.without_evidence.update(
            each.awareness_reason or "no reason given"
            for each in estimate.observations
            if each.awareness is None
        )
        self.last = estimate
        if estimate.no_view is not None:
            self.no_view[estimate.no_view] += 1


def estimate_command(options: Any, networks: Networks | None = None) -> int:
    """Run the command.

    Args:
        options: of the command line, as attributes.
        networks: to use instead of those that ``options`` name.

    Returns:
        Exit status: 0 success, 1 if some frames could not be read or estimated.

    Raises:
        AwarenavError: for input that cannot be used; nothing was done then.
        PerceptionError: for a network or calibration that cannot be used.
    """
    _check(options)
    with contextlib.ExitStack() as stack:
        source = open_source(options.source, topic=options.topic, fps=options.fps)
        stack.callback(source.close)
        check_results(options.out, resume=options.resume, overwrite=options.overwrite)
        overlay = None
        if options.overlay != "none":
            rate_hz, single = source.rate_hz or _SLIDESHOW_HZ, source.count == 1
            overlay = OverlayWriter(Path(options.overlay), rate_hz, AttentionCone(), single=single)
        cameras, depth = _camera_and_depth(options, source)
        # Refused before networks that the user may have to fetch.
        frames = _readable(stack.enter_context(FramePrefetcher(source, options.frames)))
        estimator, settings = _estimator(options, source, cameras, depth, networks)
        results, done = open_results(
            options.out, settings, resume=options.resume, overwrite=options.overwrite
        )
        stack.enter_context(results)
        if overlay is not None:
            stack.enter_context(overlay)
        total = options.frames
        if source.count is not None:
            total = source.count if total is None else min(source.count, total)
        bar = stack.enter_context(tqdm(total=total, desc="estimate", unit="frame", file=sys.stderr))
        drawing = stack.enter_context(ThreadPoolExecutor(1, "overlay"))
        drawn: Future[None] | None = None
        summary = _Summary()
        start_s = time.monotonic()
        for frame in frames:
            bar.update()
            if frame.name in done:
                estimator.pass_over(frame)
                continue
            estimate = _estimate(frame, estimator, summary)
            if estimate is None:
                continue
            if not summary.frames and not source.rendered and frame.image_rgb is not None:
                for note in picture_notes(frame.image_rgb):
                    _log(note)
            results.add(estimate_record(estimate, settings))
            summary.add(estimate)
            if overlay is not None:  # one is drawn while the next is estimated
                if drawn is not None:
                    drawn.result()
                drawn = drawing.submit(overlay.add, estimate)
        if drawn is not None:
            drawn.result()
        duration_s = time.monotonic() - start_s
    if summary.problems and not summary.frames and not done:
        raise AwarenavError(f"nothing could be estimated: {summary.problems[0]}")
    _report(options, summary, duration_s)
    return 1 if summary.problems else 0


def _readable(frames: Iterable[SourceFrame]) -> Iterator[SourceFrame]:
    """Return all frames, as soon as one of them shows a picture.

    Raises:
        AwarenavError: none does.
    """
    rest, problems = iter(frames), []
    for frame in rest:
        problems.append(frame)
        if frame.image_rgb is not None:
            return chain(problems, rest)
    why = problems[0].problem if problems else "there is no frame"
    raise AwarenavError(f"nothing could be estimated: {why}")


def _camera_and_depth(options: Any, source: ImageSource) -> tuple[CameraChoice, DepthFiles | None]:
    """Return the camera of a source's images, and the depth beside them."""
    depth = None
    if options.depth is not None:
        depth = DepthFiles(options.depth, source, options.frames)
    cameras = CameraChoice.of_options(options.camera, options.fov_deg, source, _log)
    if source.rectified and cameras.calibrated:
        _log("the images are rectified: P of the calibration applies, without distortion")
    for note in source.notes:
        _log(note)
    if source.untimed and options.tracks:
        _log("nothing tells the times: one image a second is assumed for speeds; give --fps")
    return cameras, depth


def _estimator(
    options: Any,
    source: ImageSource,
    cameras: CameraChoice,
    depth: DepthFiles | None,
    networks: Networks | None,
) -> tuple[PeopleEstimator, str]:
    """Return the estimator for a source, and the hash of all settings that change estimates."""
    choice = choice_of_options(options, rendered=source.rendered, log=_log)
    if networks is None:
        networks = choice.load(min_score=options.min_score, **running_options(options))
    unfit = admit_options(networks, options, rendered=source.rendered)
    if unfit:
        _log(f"{simulator_networks_warning(unfit)}: trust none of the results")
    pose = None
    if options.camera_height_m is not None:
        pose = fixed_camera_pose(options.camera_height_m, options.camera_pitch_deg)
    chosen = {name: getattr(options, name) for name in _SETTINGS}
    chosen |= choice.model_dump(exclude_none=True)
    for name in ("depth", "fps"):
        if getattr(options, name) is not None:
            chosen[name] = getattr(options, name)
    estimator = PeopleEstimator(
        networks,
        cameras,
        fixed_pose_odom_camera=pose,
        up_camera=source.up_camera,
        track=options.tracks,
        depth=depth,
        unfit=unfit,
    )
    return estimator, settings_hash(chosen)


def _estimate(
    frame: SourceFrame, estimator: PeopleEstimator, summary: _Summary
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


def _check(options: Any) -> None:
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


def _report(options: Any, summary: _Summary, duration_s: float) -> None:
    rate_hz = summary.frames / duration_s if duration_s > 0.0 else 0.0
    drawn = "" if options.overlay == "none" else f", drawn into {options.overlay}"
    print(
        f"Written to {options.out}{drawn}: {counted(summary.frames, 'frame')} ({rate_hz:.1f} per "
        f"second), {counted(summary.people, 'observation')} of people, "
        f"{_without_evidence(summary.without_evidence)}"
    )
    if summary.last is not None and summary.frames == 1:
        for person in summary.last.observations:
            print(f"  {_in_words(person)}")
    for reason, count in summary.no_view.items():
        _log(f"no view in {count} of {counted(summary.frames, 'frame')}: {reason}")
    if summary.problems:
        _log(f"{counted(len(summary.problems), 'frame')} could not be read or estimated")


def _without_evidence(reasons: Counter[str]) -> str:
    named = ", ".join(f"{reason}: {count}" for reason, count in reasons.most_common())
    text = f"{reasons.total()} of them without evidence of awareness"
    return f"{text} ({named})" if named else text


def _in_words(person: PersonObservation) -> str:
    """Return where a person is, and α or why there is none."""
    x_m, _, z_m = person.position_camera_m.tolist()
    where = f"{z_m:.1f} m ahead, {abs(x_m):.1f} m to the {'left' if x_m < 0.0 else 'right'}"
    if person.awareness is None:
        return f"{where}: no α, which is not aware ({person.awareness_reason or 'no evidence'})"
    return f"{where}: α {person.awareness:.2f} ± {person.awareness_std:.2f}"


def _log(text: str) -> None:
    """Print a message above the progress bar."""
    tqdm.write(f"awarenav estimate: {text}", file=sys.stderr)
