"""The work of ``awarenav tracks``: the plot, and the tracks as text, JSON and CSV."""

from __future__ import annotations

import io
import math
import sys
from collections.abc import Sequence
from csv import writer as csv_writer
from pathlib import Path
from typing import Any, Final

import numpy as np

from perception import Camera
from tracking import TrackerConfig

from ..errors import AwarenavError, counted
from ..files import check_output, check_plot, csv_number, json_text, write_text
from ._history import TrackedRecording, TrackHistory, TrackSample
from ._recording import Recording, is_positions, read_positions, read_recording
from ._smoothing import SmoothedPath
from ._tracking import distances_m, smoothed_path, track_recording, tracks_in_file
from ._truth import Truth, match_truth, person_ids_text, true_people

#: Columns of the CSV file: one row per track and frame; empty for what is not known.
CSV_COLUMNS: Final = (
    *("stamp_s", "id", "status", "seen", "x_odom_m", "y_odom_m", "vx_odom_mps", "vy_odom_mps"),
    *("x_std_m", "y_std_m", "awareness", "awareness_std", "awareness_lower"),
    *("measured_awareness", "measured_awareness_std"),
)
_CAMERA: Final = "camera.yaml"
# A camera that moves more than this from frame to frame takes single images.
_MAX_CAMERA_STEP_M: Final = 2.0
_MOST_LINES: Final = 50


def tracks_command(
    file: Path,
    out: Path | None,
    *,
    as_json: bool,
    csv: Path | None,
    truth: Path | None,
    config: Path | None,
    smooth: bool,
    ids: bool,
    camera: Path | None,
    most: int,
) -> int:
    """Run the command with the options of the same names; return the exit status.

    Raises:
        AwarenavError: for input that cannot be used; nothing is written then.
        TrackingError: for settings that cannot be used.
        PerceptionError: for a calibration that cannot be used.
    """
    if camera is not None and is_positions(file):
        raise AwarenavError(f"--camera cannot be used with positions, got {file}")
    inputs = (file, truth, config, camera)
    check_plot(out, inputs)
    if csv is not None:
        check_output(csv, (), inputs, option="--csv")
        if out is not None and out.resolve() == csv.resolve():
            raise AwarenavError(f"--out and --csv are the same file, {out}")
    if out is not None:
        from ..figures import save_figure  # noqa: PLC0415 - slow
        from ._plot import tracks_figure  # noqa: PLC0415
    settings = None if config is None else TrackerConfig.from_yaml(config)
    recording = read_file(file)
    view = _camera(file, camera) if recording.has_camera else None
    true = None if truth is None else read_file(truth)
    tracked = tracks_in_file(recording) if ids else track_recording(recording, settings, view)
    for remark in tracked.remarks:
        log(remark)
    if tracked.camera_jump_m > _MAX_CAMERA_STEP_M:
        log(
            f"the camera jumps by {tracked.camera_jump_m:.1f} m from frame to frame: these look "
            "like single images, in which people cannot be tracked"
        )
    beside = None
    if true is not None:
        people = true_people(true)
        beside = Truth(people, match_truth(tracked.histories, people))
    paths = _smoothed(tracked, settings) if smooth else {}
    if out is not None:
        title = _title(recording, tracked)
        save_figure(
            tracks_figure(tracked, title, camera=view, truth=beside, smoothed=paths, most=most),
            out,
        )
    if csv is not None:
        _write_csv(csv, tracked.histories)
    if as_json:
        print(json_text(_summaries(tracked.histories, beside)), end="")
    else:
        _print_table(tracked, beside)
        if written := [str(path) for path in (out, csv) if path is not None]:
            print(f"Written to {' and '.join(written)}")
    return 0


def _camera(file: Path, given: Path | None) -> Camera | None:
    """Return the camera whose field of view the tracker uses, if it is known."""
    if given is not None:
        return Camera.from_yaml(given)
    beside = file.parent / _CAMERA
    if not beside.exists():
        log(
            "no --camera and no camera.yaml beside the file: the field of view is not known, "
            "and the tracks of all unseen people are kept equally long"
        )
        return None
    log(f"the field of view is that of {beside}")
    return Camera.from_yaml(beside)


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


def _summaries(histories: Sequence[TrackHistory], truth: Truth | None) -> list[dict[str, Any]]:
    """Return the life, the frames and the awareness of each track; NaN for what is not known."""
    summaries = []
    for history in histories:
        alpha = history.mean("awareness")
        if not math.isfinite(alpha):  # there is no filter
            alpha = history.mean("measured_awareness")
        summary: dict[str, Any] = {
            "id": history.id,
            "born_s": history.born_s,
            "confirmed_s": history.confirmed_s,
            "died_s": history.died_s,
            "seen_frames": history.seen_frames,
            "coasted_frames": len(history.frames) - history.seen_frames,
            "mean_awareness": alpha,
            "mean_awareness_lower": history.mean("awareness_lower"),
        }
        if truth is not None:
            summary["person"] = person_ids_text(truth.matches.get(history.id, []))
        summaries.append(summary)
    return summaries


def _print_table(tracked: TrackedRecording, truth: Truth | None) -> None:
    """Print a line per confirmed track, and the number of the others."""
    confirmed = [each for each in tracked.histories if each.confirmed_s is not None]
    header = ["id", "born (s)", "confirmed (s)", "died (s)", "seen", "coasted", "mean α", "lower"]
    rows = [header if truth is None else [*header, "person"]]
    rows += [list(map(_cell, each.values())) for each in _summaries(confirmed, truth)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows[: _MOST_LINES + 1] if confirmed else ():
        print("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)))
    if len(confirmed) > _MOST_LINES:
        print(f"and {len(confirmed) - _MOST_LINES} more; --csv has all")
    if unconfirmed := len(tracked.histories) - len(confirmed):
        print(f"{counted(unconfirmed, 'track')} never confirmed")
    if not tracked.histories:
        print(f"no people in {counted(len(tracked.camera_stamps_s), 'frame')}")


def _cell(value: Any) -> str:
    """Return a value of a summary as text: numbers with two decimals, a dash for unknown ones."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _write_csv(path: Path, histories: Sequence[TrackHistory]) -> None:
    """Write a CSV file with one row per track and frame, in the order of stamps and ids."""
    samples = [(each.stamp_s, history.id, each) for history in histories for each in history.frames]
    samples.sort(key=lambda row: row[:2])
    text = io.StringIO()
    writer = csv_writer(text, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    writer.writerows(_csv_row(id, sample) for _, id, sample in samples)
    write_text(path, text.getvalue())


def _csv_row(id: int, sample: TrackSample) -> list[object]:
    """Return the row of a sample, in the order of :data:`CSV_COLUMNS`."""
    velocity, covariance = sample.velocity_odom_mps, sample.position_covariance_m2
    numbers = (
        *sample.position_odom_m.tolist(),
        *((None, None) if velocity is None else velocity.tolist()),
        *((None, None) if covariance is None else np.sqrt(np.diagonal(covariance)).tolist()),
        sample.awareness,
        sample.awareness_std,
        sample.awareness_lower,
        sample.measured_awareness,
        sample.measured_awareness_std,
    )
    # The stamp has all its digits, so that rows can be joined with the frames of the file.
    seen = str(sample.seen).lower()
    return [repr(sample.stamp_s), id, sample.status, seen, *map(csv_number, numbers)]


def log(text: str) -> None:
    """Print a remark on standard error."""
    print(f"awarenav tracks: {text}", file=sys.stderr)
