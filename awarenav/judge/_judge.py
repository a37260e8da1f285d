"""Compares estimates of people with the truth about them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

from ..errors import AwarenavError
from ..records import PersonRecord, people_by_frame, read_records
from ._detection import DetectionFrame, match_frame, precision_with_interval
from ._intervals import LEVEL, Metrics
from ._metrics import PersonFrame, person_metrics

#: The people of every frame, by the frame's name.
Frames = dict[str, list[PersonRecord]]

# Who has to be found: least height of the true box, and shares of the person, exclusive, that other
# things hide or that lie outside the image. Others count neither as missed nor as false positives.
_SETTINGS: Final = {"min_height_px": 40.0, "max_occlusion": 0.5, "max_truncation": 0.5}
# Angles between the head's forward axis and the direction to the camera, degrees.
_FACINGS_DEG: Final = (("front", 0.0, 60.0), ("profile", 60.0, 120.0), ("back", 120.0, 180.1))
# Bins of range; the lower edge belongs to the bin.
_RANGES_M: Final = ((0.0, 1.5), (1.5, 3.0), (3.0, 4.5), (4.5, 6.0), (6.0, math.inf))


def judge_files(truth: Path, estimates: Path, *, common: bool = False) -> dict[str, Any]:
    """Compare a JSON Lines file of estimates with one of truth; see :func:`judge_frames`.

    Raises:
        AwarenavError: for files that cannot be read or have no frame in common.
    """
    true_frames, estimated = (
        people_by_frame(read_records(path), path) for path in (truth, estimates)
    )
    if not true_frames:
        raise AwarenavError(f"{truth} has no frame")
    if not true_frames.keys() & estimated.keys():
        some = [", ".join(map(repr, list(frames)[:2])) for frames in (true_frames, estimated)]
        raise AwarenavError(
            f"{truth} (frames {some[0]}, …) and {estimates} (frames {some[1] or 'none'}, …) have "
            "no frame in common: are they of the same images?"
        )
    return judge_frames(true_frames, estimated, common=common)


def judge_frames(truth: Frames, estimates: Frames, *, common: bool = False) -> dict[str, Any]:
    """Return all metrics: of detection, and of people who had to be found, by facing and range.

    ``"intervals"`` repeats the groups with the 95 % interval (low, high) of each metric that is an
    estimate. An end is infinite where too few people bound the metric. The intervals take every
    person in every frame as independent of the others; only the precision resamples whole frames.

    Args:
        truth: the people of every frame.
        estimates: the estimated people of every frame. In a frame that is missing here, nobody was
            found; a frame that is missing in the truth is left out.
        common: leaves out frames that are missing in ``estimates``.
    """
    judged = [name for name in truth if name in estimates or not common]
    detection_frames: list[DetectionFrame] = []
    required_people: list[PersonFrame] = []
    all_people: list[PersonFrame] = []
    false_positives = 0
    for name in judged:
        people, estimated = truth[name], estimates.get(name, [])
        required = [_had_to_be_found(person) for person in people]
        detection_frames.append((people, required, estimated))
        partner, ghosts = match_frame(people, required, estimated)
        false_positives += ghosts
        for index, person in enumerate(people):
            estimate = estimated[partner[index]] if index in partner else None
            all_people.append(PersonFrame(person, estimate))
            if required[index]:
                required_people.append(all_people[-1])
    overall, everyone = person_metrics(required_people), person_metrics(all_people)
    by_facing = {
        name: person_metrics(_between(required_people, _facing_deg, low, high))
        for name, low, high in _FACINGS_DEG
    }
    by_range = {
        f"{low:g} to {high:g}" if math.isfinite(high) else f"{low:g} and more": person_metrics(
            _between(required_people, _range_m, low, high)
        )
        for low, high in _RANGES_M
    }
    detection = _detection_metrics(detection_frames, false_positives, overall)
    everybody = ("people", "found", "unaware_judged", "false_aware_count", "false_aware")
    return {
        "settings": dict(_SETTINGS),
        "frames": {
            "judged": len(judged),
            "without_estimates": sum(name not in estimates for name in judged),
            "unknown": sum(name not in truth for name in estimates),
        },
        "detection": detection.values,
        "overall": overall.values,
        "hidden_and_small_too": {name: everyone.values[name] for name in everybody},
        "by_facing": {name: group.values for name, group in by_facing.items()},
        "by_range_m": {name: group.values for name, group in by_range.items()},
        "intervals": {
            "level": LEVEL,
            "detection": detection.intervals,
            "overall": overall.intervals,
            "hidden_and_small_too": {
                name: ends for name, ends in everyone.intervals.items() if name in everybody
            },
            "by_facing": {name: group.intervals for name, group in by_facing.items()},
            "by_range_m": {name: group.intervals for name, group in by_range.items()},
        },
    }


def _detection_metrics(
    frames: Sequence[DetectionFrame], false_positives: int, overall: Metrics
) -> Metrics:
    """Return the metrics of detection.

    Args:
        frames: truth and estimates.
        false_positives: number of estimates of nobody.
        overall: metrics of the people who had to be found.
    """
    metrics = Metrics()
    metrics.add("ap50", *precision_with_interval(frames))
    metrics.share("recall", overall.values["found"], overall.values["people"])
    metrics.count("false_positives", false_positives)
    metrics.rate("false_positives_per_frame", false_positives, len(frames))
    return metrics


def _had_to_be_found(person: PersonRecord) -> bool:
    return (
        person.height_px >= _SETTINGS["min_height_px"]
        and person.occlusion < _SETTINGS["max_occlusion"]
        and person.truncation < _SETTINGS["max_truncation"]
    )


def _facing_deg(person: PersonRecord) -> float | None:
    facing = person.facing_rad
    return None if facing is None else math.degrees(facing)


def _range_m(person: PersonRecord) -> float | None:
    return person.range_m


def _between(
    people: Sequence[PersonFrame],
    value_of: Callable[[PersonRecord], float | None],
    low: float,
    high: float,
) -> list[PersonFrame]:
    """Return the people whose true value lies from ``low`` to below ``high``."""
    values = ((each, value_of(each.truth)) for each in people)
    return [each for each, value in values if value is not None and low <= value < high]
