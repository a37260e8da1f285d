"""The work of ``awarenav tracks``."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from perception import Camera
from tracking import TrackerConfig
from tracking.smoothing import SmoothedPath

from ..errors import AwarenavError, counted
from ..files import json_text
from ._file_tracks import tracks_in_file
from ._history import TrackedRecording
from ._positions import is_positions, read_positions
from ._recording import Recording, read_recording
from ._smoothed import distances_m, smoothed_path
from ._tables import summary_lines, summary_records, write_csv
from ._tracking import track_recording
from ._truth import Truth, truth_beside_tracks

_FORMATS: Final = (".png", ".svg", ".pdf")
_CAMERA: Final = "camera.yaml"
# A camera that moves more than this from frame to frame takes single images.
_MAX_CAMERA_STEP_M: Final = 2.0
_MOST_LINES: Final = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class TracksOptions:
    """The options of ``awarenav tracks``."""

    file: Path
    out: Path
    as_json: bool
    csv: Path | None
    truth: Path | None
    config: Path | None
    ids: bool
    smooth: bool
    camera: Path | None
    most: int


def tracks_command(options: TracksOptions) -> int:
    """Run the command; return the exit status.

    Raises:
        AwarenavError: for input that cannot be used; nothing is written then.
        TrackingError: for settings that cannot be used.
        PerceptionError: for a calibration that cannot be used.
    """
    out = None if str(options.out) == "none" else options.out
    _check(options, out)
    if out is not None:
        # Only the plot needs matplotlib; without it, the command fails before any work.
        from ..figures import save_figure  # noqa: PLC0415
        from ._plot import tracks_figure  # noqa: PLC0415
    config = None if options.config is None else TrackerConfig.from_yaml(options.config)
    recording = read_file(options.file)
    camera = _camera(options) if recording.has_camera else None
    truth_recording = None if options.truth is None else read_file(options.truth)
    if options.ids:
        tracked = tracks_in_file(recording)
    else:
        tracked = track_recording(recording, config, camera)
    for remark in tracked.remarks:
        log(remark)
    if tracked.camera_jump_m > _MAX_CAMERA_STEP_M:
        log(
            f"the camera jumps by {tracked.camera_jump_m:.1f} m from frame to frame: these look "
            "like single images, in which people cannot be tracked"
        )
    truth = None
    if truth_recording is not None:
        truth = truth_beside_tracks(tracked.histories, truth_recording)
    smoothed = _smoothed(tracked, config) if options.smooth else {}
    if out is not None:
        title = _title(recording, tracked)
        figure = tracks_figure(
            tracked, title, camera=camera, truth=truth, smoothed=smoothed, most=options.most
        )
        save_figure(figure, out)
    if options.csv is not None:
        write_csv(options.csv, tracked.histories)
    _report(options, tracked, truth, out)
    return 0


def _check(options: TracksOptions, out: Path | None) -> None:
    """Refuse outputs with another suffix, or that would replace an input, and a camera too many."""
    if options.camera is not None and is_positions(options.file):
        raise AwarenavError(f"--camera cannot be used with positions, got {options.file}")
    if out is not None and out.suffix.lower() not in _FORMATS:
        raise AwarenavError(f"--out must end in {', '.join(_FORMATS)} or be none, got {out}")
    inputs = {
        path.resolve()
        for path in (options.file, options.truth, options.config, options.camera)
        if path is not None
    }
    for name, path in (("--out", out), ("--csv", options.csv)):
        if path is None:
            continue
        if path.resolve() in inputs:
            raise AwarenavError(f"{name} {path} would replace an input")
        if path.is_dir():
            raise AwarenavError(f"{name} must be a file, {path} is a folder")
    if out is not None and options.csv is not None and out.resolve() == options.csv.resolve():
        raise AwarenavError(f"--out and --csv are the same file, {out}")


def _camera(options: TracksOptions) -> Camera | None:
    """Return the camera whose field of view the tracker uses, if it is known."""
    path = options.camera
    if path is None:
        path = options.file.parent / _CAMERA
        if not path.exists():
            log(
                "no --camera and no camera.yaml beside the file: the field of view is not known, "
                "and the tracks of all unseen people are kept equally long"
            )
            return None
        log(f"the field of view is that of {path}")
    return Camera.from_yaml(path)


def read_file(path: Path) -> Recording:
    """Read frames as JSON Lines, or positions as CSV, and print remarks about what was left out."""
    recording = read_positions(path) if is_positions(path) else read_recording(path)
    for remark in recording.remarks:
        log(f"{path}: {remark}")
    return recording


def _smoothed(tracked: TrackedRecording, config: TrackerConfig | None) -> dict[int, SmoothedPath]:
    """Return the smoothed paths by id, and print how far the tracks are from them."""
    paths, apart_m = {}, []
    for history in tracked.histories:
        path = smoothed_path(history, config)
        if path is not None:
            paths[history.id] = path
            apart_m.append(distances_m(history, path))
    if apart_m:
        every = np.concatenate(apart_m)
        log(
            f"tracks and smoothed paths are {every.mean():.3f} m apart on average, "
            f"{np.percentile(every, 95.0):.3f} m in 95 % of the frames at most"
        )
    return paths


def _title(recording: Recording, tracked: TrackedRecording) -> str:
    start_s, end_s = tracked.span_s
    return (
        f"{recording.path.name}: {counted(len(tracked.histories), 'identity', 'identities')} "
        f"({tracked.source}) in {counted(len(tracked.camera_stamps_s), 'frame')}, "
        f"{end_s - start_s:.1f} s"
    )


def _report(
    options: TracksOptions, tracked: TrackedRecording, truth: Truth | None, out: Path | None
) -> None:
    """Print the table, or the JSON, and the files that were written."""
    if options.as_json:
        matches = None if truth is None else truth.matches
        print(json_text(summary_records(tracked.histories, matches)), end="")
        return
    confirmed = [each for each in tracked.histories if each.confirmed_s is not None]
    if confirmed:
        lines = summary_lines(confirmed, None if truth is None else truth.matches)
        print("\n".join(lines[: _MOST_LINES + 1]))
    if len(confirmed) > _MOST_LINES:
        print(f"and {len(confirmed) - _MOST_LINES} more; --csv has all")
    unconfirmed = len(tracked.histories) - len(confirmed)
    if unconfirmed:
        print(f"{counted(unconfirmed, 'track')} never confirmed")
    if not tracked.histories:
        print(f"no people in {counted(len(tracked.camera_stamps_s), 'frame')}")
    written = [str(path) for path in (out, options.csv) if path is not None]
    if written:
        print(f"Written to {' and '.join(written)}")


def log(text: str) -> None:
    """Print a remark on standard error."""
    print(f"awarenav tracks: {text}", file=sys.stderr)
