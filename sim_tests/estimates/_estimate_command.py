"""``awarenav estimate`` from its options to its last line."""

from __future__ import annotations

import argparse
import contextlib
import math
from pathlib import Path

from perception import AttentionCone, Camera
from perception.arrays import FloatArray

from .._errors import SimError
from ._camera_choice import CameraChoice
from ._estimate import EstimateSummary, run_estimate, say
from ._network_choice import choose_networks
from ._open_source import open_source
from ._overlay_file import OverlayFile
from ._people_estimator import Networks, PeopleEstimator
from ._read_ahead import ReadAhead
from ._results_file import ResultsFile, settings_mark
from ._source_frame import ImageSource
from ._standing_camera import standing_pose

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


def estimate_command(options: argparse.Namespace, networks: Networks | None = None) -> int:
    """Run the command.

    Args:
        options: of the parser.
        networks: that work instead of those named by ``options``.

    Returns:
        Exit status: 0 well, 1 when some frames could not be read or estimated.

    Raises:
        SimError: for input that cannot be used; nothing was done then.
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


def _check(options: argparse.Namespace) -> None:
    drawn_into_video = options.overlay.lower().endswith(".mp4")
    if options.resume and options.tracks:
        raise SimError("--resume cannot continue --tracks: who was followed is not in the file")
    if options.resume and drawn_into_video:
        raise SimError("--resume cannot continue a video; draw into a folder (--overlay DIR)")
    if options.resume and (options.source.isdigit() or "://" in options.source):
        raise SimError("--resume cannot continue a camera: its frames have gone by")
    if options.camera_pitch_deg and options.camera_height_m is None:
        raise SimError("--camera-pitch-deg needs --camera-height-m")
    if options.fov_deg is not None and not 1.0 <= options.fov_deg <= 179.0:
        raise SimError(f"--fov-deg must lie in [1, 179] degrees, got {options.fov_deg:g}")


def _standing_pose(options: argparse.Namespace) -> FloatArray | None:
    if options.camera_height_m is None:
        return None
    if options.camera_height_m <= 0.0:
        raise SimError(f"--camera-height-m must be above 0, got {options.camera_height_m:g} m")
    return standing_pose(options.camera_height_m, options.camera_pitch_deg)


def _calibration(options: argparse.Namespace, source: ImageSource) -> Camera | None:
    if options.camera is not None:
        return Camera.from_yaml(options.camera)
    return None if options.fov_deg is not None else source.camera


def _overlay(options: argparse.Namespace, source: ImageSource) -> OverlayFile | None:
    if options.overlay == "none":
        return None
    rate_hz = (source.rate_hz or _SLIDES_HZ) / options.every
    return OverlayFile(Path(options.overlay), rate_hz, AttentionCone(), single=source.count == 1)


def _total(options: argparse.Namespace, source: ImageSource) -> int | None:
    limit: int | None = options.frames
    if source.count is None:
        return limit
    every = math.ceil(source.count / int(options.every))
    return every if limit is None else min(every, limit)


def _report(options: argparse.Namespace, summary: EstimateSummary) -> None:
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
