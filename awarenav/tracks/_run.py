"""``awarenav tracks`` from its options to its last line."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from perception import Camera
from tracking import TrackerConfig

from ..errors import AwarenavError
from ..files import json_text
from ._follow import follow
from ._given_ids import given_tracks
from ._history import TrackRun, camera_jump_m
from ._recording import Recording, count, read_recording
from ._tables import summary_lines, summary_records, write_csv
from ._truth import Truth, matched_truth

_FORMATS: Final = (".png", ".svg", ".pdf")
_CAMERA: Final = "camera.yaml"
_JUMP_M: Final = 2.0
# More lines than this are for --csv.
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
    camera: Path | None
    most: int


def tracks_command(options: TracksOptions) -> int:
    """Run the command and return its exit status.

    Raises:
        AwarenavError: for input that cannot be used; nothing is written then.
        TrackingError: for settings that cannot be used.
        PerceptionError: for a calibration that cannot be used.
    """
    out = None if str(options.out) == "none" else options.out
    _check(options, out)
    if out is not None:
        # Tables need no matplotlib; a plot says at once that it is missing.
        from ..figures import save_figure  # noqa: PLC0415
        from ._plot import tracks_figure  # noqa: PLC0415
    config = None if options.config is None else TrackerConfig.from_yaml(options.config)
    camera = _camera(options)
    recording = _read(options.file)
    truth_recording = None if options.truth is None else _read(options.truth)
    run = given_tracks(recording) if options.ids else follow(recording, config, camera)
    for remark in run.remarks:
        say(remark)
    if (jump_m := camera_jump_m(run)) > _JUMP_M:
        say(
            f"the camera jumps by {jump_m:.1f} m from frame to frame: these look like single "
            "pictures, in which nobody can be followed"
        )
    truth = None if truth_recording is None else matched_truth(run.histories, truth_recording)
    if out is not None:
        title = _title(recording, run)
        figure = tracks_figure(run, title, camera=camera, truth=truth, most=options.most)
        save_figure(figure, out)
    if options.csv is not None:
        write_csv(options.csv, run.histories)
    _report(options, run, truth, out)
    return 0


def _check(options: TracksOptions, out: Path | None) -> None:
    """Refuse outputs that are no files of their kind, or that would replace an input."""
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
            raise AwarenavError(f"{name} {path} would replace what is read")
        if path.is_dir():
            raise AwarenavError(f"{name} must be a file, {path} is a folder")
    if out is not None and options.csv is not None and out.resolve() == options.csv.resolve():
        raise AwarenavError(f"--out and --csv are the same file, {out}")


def _camera(options: TracksOptions) -> Camera | None:
    path = options.camera
    if path is None:
        path = options.file.parent / _CAMERA
        if not path.exists():
            say(
                "no --camera and no camera.yaml beside the file: nobody knows where the camera can "
                "see, and all who are not seen are kept equally long"
            )
            return None
        say(f"the field of view is that of {path}")
    return Camera.from_yaml(path)


def _read(path: Path) -> Recording:
    recording = read_recording(path)
    for remark in recording.remarks:
        say(f"{path}: {remark}")
    return recording


def _title(recording: Recording, run: TrackRun) -> str:
    start_s, end_s = run.span_s
    return (
        f"{recording.path.name}: {count(len(run.histories), 'identity', 'identities')} "
        f"({run.source}) in {count(len(run.camera_stamps_s), 'frame')}, {end_s - start_s:.1f} s"
    )


def _report(options: TracksOptions, run: TrackRun, truth: Truth | None, out: Path | None) -> None:
    if options.as_json:
        matches = None if truth is None else truth.matches
        print(json_text(summary_records(run.histories, matches)), end="")
        return
    confirmed = [each for each in run.histories if each.confirmed_s is not None]
    if confirmed:
        lines = summary_lines(confirmed, None if truth is None else truth.matches)
        print("\n".join(lines[: _MOST_LINES + 1]))
    if len(confirmed) > _MOST_LINES:
        print(f"and {len(confirmed) - _MOST_LINES} more; --csv has all")
    fleeting = len(run.histories) - len(confirmed)
    if fleeting:
        print(f"{count(fleeting, 'track')} never confirmed")
    if not run.histories:
        print(f"no people in {count(len(run.camera_stamps_s), 'frame')}")
    written = [str(path) for path in (out, options.csv) if path is not None]
    if written:
        print(f"Written to {' and '.join(written)}")


def say(text: str) -> None:
    """Tell the user something beside the results."""
    print(f"awarenav tracks: {text}", file=sys.stderr)
