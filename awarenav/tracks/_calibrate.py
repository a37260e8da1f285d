"""The work of ``awarenav tracks calibrate``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tracking import TrackerConfig
from tracking.prediction import REGION_SHARE

from ..errors import AwarenavError
from ..files import check_output, json_text, write_text
from ._calibration import HORIZONS_S, Calibration, FollowedPerson, calibrate
from ._run import log, read_file
from ._tracking import arrays_of, smoothed_path, track_recording
from ._units import refuse_other_units


def calibrate_command(
    files: Sequence[Path], out: Path, *, as_json: bool, config: Path | None, longest: float
) -> int:
    """Run the command with the options of the same names; return the exit status.

    Raises:
        AwarenavError: for input that cannot be used; nothing is written then.
        TrackingError: for settings that cannot be used, or recordings that are too short.
    """
    check_output(out, (".yaml", ".yml"), (*files, config))
    settings = None if config is None else TrackerConfig.from_yaml(config)
    people = [each for path in files for each in followed_people(path, settings)]
    horizons_s = sorted({*(each for each in HORIZONS_S if each < longest), longest})
    found = calibrate(people, horizons_s=horizons_s)
    write_text(out, found.model.yaml_text())
    rows = _rows(found)
    if as_json:
        record = {"people": list(found.people), "wanted": REGION_SHARE, "horizons": rows}
        print(json_text(record), end="")
    else:
        _print_table(rows, found)
        print(f"Written to {out}")
    return 0


def followed_people(path: Path, config: TrackerConfig | None) -> list[FollowedPerson]:
    """Return the confirmed tracks of a recording, each with its smoothed path.

    Raises:
        AwarenavError: for a recording that cannot be used, or in other units.
    """
    tracked = track_recording(read_file(path), config)
    for remark in tracked.remarks:
        log(remark)
    people = []
    for history in tracked.histories:
        path_m = smoothed_path(history, config)
        confirmed_s = history.confirmed_s
        if path_m is None or confirmed_s is None:
            continue
        end_s = float(path_m.stamps_s[-1])
        samples = [each for each in history.frames if confirmed_s <= each.stamp_s <= end_s]
        if samples:
            people.append(FollowedPerson(*arrays_of(samples), path_m))
    paths = ((each.reference.stamps_s, each.reference.states[:, :2]) for each in people)
    refuse_other_units(str(path), paths, AwarenavError)
    return people


def _print_table(rows: list[dict[str, Any]], found: Calibration) -> None:
    """Print a line per horizon, and how to read it."""
    print(
        f"{'horizon':>9s}{'factor':>9s}{'inside before':>15s}{'after':>9s}{'1st half':>10s}"
        f"{'2nd half':>10s}{'NEES/2':>9s}{'stretches':>12s}"
    )
    for row in rows:
        used, judged = row["stretches"]
        first, second = row["inside_halves"]
        print(
            f"{row['horizon_s']:7g} s{row['factor']:9.2f}{row['inside_before']:15.1%}"
            f"{row['inside']:9.1%}{first:10.1%}{second:10.1%}{row['nees_over_2']:9.2f}"
            f"{f'{used} + {judged}':>12s}"
        )
    first, second = found.people
    print(
        f"{REGION_SHARE:.1%} inside is right. Each half ({first} and {second} people) is judged by "
        "the factors of the other; the file has those of all."
    )


def _rows(found: Calibration) -> list[dict[str, Any]]:
    """Return the table as plain data."""
    return [
        {
            "horizon_s": horizon_s,
            "factor": factor,
            "inside_before": before,
            "inside": after,
            "inside_halves": halves,
            "nees_over_2": nees,
            "stretches": stretches,
        }
        for horizon_s, factor, before, after, halves, nees, stretches in zip(
            found.horizons_s.tolist(),
            found.model.std_factors,
            found.before.tolist(),
            found.coverage.tolist(),
            found.halves.T.tolist(),
            found.nees.tolist(),
            found.stretches.T.astype(int).tolist(),
            strict=True,
        )
    ]
