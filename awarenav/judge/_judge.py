"""Compares estimates of people with the truth: detection, gaze, position, awareness, certainty."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.special import gammaincinv

from perception.arrays import FloatArray

from ..errors import AwarenavError
from ..intervals import LEVEL, Metrics
from ..records import PersonRecord, people_by_frame, read_records
from ._detection import DetectionFrame, match_frame, precision_with_interval

#: The people of every frame, by the frame's name.
Frames = dict[str, list[PersonRecord]]

# Who has to be found: least height of the true box, and shares of the person, exclusive, that other
# things hide or that lie outside the image. Others count neither as missed nor as false positives.
_MIN_HEIGHT_PX: Final = 40.0
_MAX_OCCLUSION: Final = 0.5
_MAX_TRUNCATION: Final = 0.5
# Angles between the head's forward axis and the direction to the camera, degrees.
_FACINGS_DEG: Final = (("front", 0.0, 60.0), ("profile", 60.0, 120.0), ("back", 120.0, 180.1))
# Bins of range; the lower edge belongs to the bin.
_RANGES_M: Final = ((0.0, 1.5), (1.5, 3.0), (3.0, 4.5), (4.5, 6.0), (6.0, math.inf))
# A person with this α or more is aware.
_AWARE: Final = 0.5
# A true α below this is 0: the cone gives an exact 0, which is written with six decimals.
_ZERO: Final = 1.0e-9
# An α closer than this to 0 or 1 has a trivially small error, which says nothing of calibration.
_TRIVIAL: Final = 0.01
# Probability of a normal error within one standard deviation.
_ONE_SIGMA: Final = math.erf(math.sqrt(0.5))
# χ² with three degrees of freedom.
_NEES_1SIGMA: Final = float(2.0 * gammaincinv(1.5, _ONE_SIGMA))


def judge_files(truth: Path, estimates: Path, *, common: bool = False) -> dict[str, Any]:
    """Compare a JSON Lines file of estimates with one of truth; see :func:`judge_frames`.

    Raises:
        AwarenavError: for files that cannot be read, are in the wrong order or have no frame in
            common.
    """
    records = [read_records(path) for path in (truth, estimates)]
    # Every line of `awarenav estimate` has its settings. Two such files may be compared.
    made = [any("settings" in record for record in each) for each in records]
    if made == [True, False]:
        raise AwarenavError(f"{truth} has estimates: give the truth first, then the estimates")
    true_frames, estimated = map(people_by_frame, records, (truth, estimates))
    if not true_frames:
        raise AwarenavError(f"{truth} has no frame")
    if not true_frames.keys() & estimated.keys():
        some = [", ".join(map(repr, list(frames)[:2])) for frames in (true_frames, estimated)]
        raise AwarenavError(
            f"{truth} (frames {some[0]}, …) and {estimates} (frames {some[1] or 'none'}, …) have "
            "no frame in common: are they of the same images?"
        )
    return judge_frames(true_frames, estimated, common=common)


def judge_frames(
    truth: Frames,
    estimates: Frames,
    *,
    common: bool = False,
    min_height_px: float = _MIN_HEIGHT_PX,
) -> dict[str, Any]:
    """Return all metrics: of detection, and of people who had to be found, by facing and range.

    ``"intervals"`` repeats the groups with the 95 % interval (low, high) of each metric that is an
    estimate. An end is infinite where too few people bound the metric. The intervals take every
    person in every frame as independent of the others; only the precision resamples whole frames.

    Args:
        truth: the people of every frame.
        estimates: the estimated people of every frame. In a frame that is missing here, nobody was
            found; a frame that is missing in the truth is left out.
        common: leaves out frames that are missing in ``estimates``.
        min_height_px: least height of the true box of people who had to be found.
    """
    judged = [name for name in truth if name in estimates or not common]
    detection_frames: list[DetectionFrame] = []
    required_people: list[PersonFrame] = []
    all_people: list[PersonFrame] = []
    false_positives = 0
    for name in judged:
        people, estimated = truth[name], estimates.get(name, [])
        required = [_had_to_be_found(person, min_height_px) for person in people]
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
        "settings": {
            "min_height_px": min_height_px,
            "max_occlusion": _MAX_OCCLUSION,
            "max_truncation": _MAX_TRUNCATION,
        },
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


def _had_to_be_found(person: PersonRecord, min_height_px: float) -> bool:
    return (
        person.height_px >= min_height_px
        and person.occlusion < _MAX_OCCLUSION
        and person.truncation < _MAX_TRUNCATION
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


@dataclass(frozen=True, slots=True)
class PersonFrame:
    """A person in a frame, and their estimate; None if they were not found."""

    truth: PersonRecord
    estimate: PersonRecord | None


_Pairs = Sequence[tuple[PersonRecord, PersonRecord]]


def person_metrics(group: Iterable[PersonFrame]) -> Metrics:
    """Return the metrics of a group of people who had to be found, with their intervals.

    Shares are from 0 to 1; a metric without people is None. ``awareness_none`` and
    ``gaze_none`` are the shares of found people without an estimate of it. ``false_aware`` is the
    share of α ≥ 0.5 among the estimated α of people whose true α is 0; people without an estimated
    α do not count, so they do not dilute it. ``aware_recognised`` is the share of people with an
    estimated α ≥ 0.5 among all people with a true α ≥ 0.5, found or not; it is 0 for an estimator
    that always returns 0.
    """
    everyone = list(group)
    found = [(each.truth, each.estimate) for each in everyone if each.estimate is not None]
    metrics = Metrics()
    metrics.count("people", len(everyone))
    metrics.count("found", len(found))
    metrics.share("recall", len(found), len(everyone))
    _add_direction(metrics, found)
    _add_position(metrics, found)
    _add_awareness(metrics, everyone, found)
    return metrics


def _add_direction(metrics: Metrics, found: _Pairs) -> None:
    """Add the errors of gaze and head direction."""
    metrics.share("gaze_none", sum(e.gaze_camera is None for _, e in found), len(found))
    for name in ("gaze", "head"):
        errors = []
        for truth, estimate in found:
            true, guess = truth.gaze_camera, estimate.gaze_camera
            if name == "head":
                true = truth.head_forward_camera
                # The gaze of an estimate is the head's direction; only truth tells them apart.
                guess = (
                    guess if estimate.head_forward_camera is None else estimate.head_forward_camera
                )
            if true is not None and guess is not None:
                sine = float(np.linalg.norm(np.cross(true, guess)))
                errors.append(math.degrees(math.atan2(sine, float(true @ guess))))
        metrics.count(f"{name}_count", len(errors))
        metrics.percentile(f"{name}_median_deg", errors, 50.0)
        metrics.percentile(f"{name}_p90_deg", errors, 90.0)
        metrics.share(f"{name}_over_90deg", sum(error > 90.0 for error in errors), len(errors))


def _add_position(metrics: Metrics, found: _Pairs) -> None:
    """Add the errors of position as shares of range, and their normalised squares (NEES)."""
    relative, along, nees, within = [], [], [], []
    for truth, estimate in found:
        true, guess = truth.position_camera_m, estimate.position_camera_m
        if true is None or guess is None or not truth.range_m:
            continue
        error = guess - true
        relative.append(float(np.linalg.norm(error)) / truth.range_m)
        ray = true / truth.range_m
        along.append(float(error @ ray) / truth.range_m)
        covariance = estimate.position_covariance_m2
        if covariance is not None:
            squared = _mahalanobis2(error, covariance)
            nees.append(squared)
            within.append(squared <= _NEES_1SIGMA)
    metrics.count("position_count", len(relative))
    metrics.percentile("position_median", relative, 50.0)
    metrics.percentile("position_p90", relative, 90.0)
    metrics.percentile("range_bias", along, 50.0)
    metrics.mean("position_nees", nees)
    metrics.shares("position_within_1sigma", within)


def _add_awareness(metrics: Metrics, everyone: Sequence[PersonFrame], found: _Pairs) -> None:
    """Add the errors of α, its calibration, and false and missed awareness."""
    known = [each for each in everyone if each.truth.awareness is not None]
    errors, with_none_as_0, inside, inside_all = [], [], [], []
    for truth, estimate in found:
        if truth.awareness is None:
            continue
        with_none_as_0.append(abs((estimate.awareness or 0.0) - truth.awareness))
        if estimate.awareness is None:
            continue
        error = abs(estimate.awareness - truth.awareness)
        errors.append(error)
        if estimate.awareness_std is None:
            continue
        good = error <= math.hypot(estimate.awareness_std, truth.awareness_std or 0.0)
        inside_all.append(good)
        if any(
            _TRIVIAL < alpha < 1.0 - _TRIVIAL for alpha in (truth.awareness, estimate.awareness)
        ):
            inside.append(good)
    unaware = [each for each in known if (each.truth.awareness or 0.0) <= _ZERO]
    judged = [alpha for each in unaware if (alpha := _estimated_alpha(each)) is not None]
    false_aware = sum(alpha >= _AWARE for alpha in judged)
    aware = [each for each in known if (each.truth.awareness or 0.0) >= _AWARE]
    recognised = sum((_estimated_alpha(each) or 0.0) >= _AWARE for each in aware)
    metrics.count("awareness_count", len(errors))
    metrics.share("awareness_none", sum(e.awareness is None for _, e in found), len(found))
    metrics.mean("awareness_mae", errors)
    metrics.mean("awareness_mae_none_as_0", with_none_as_0)
    metrics.shares("awareness_within_1sigma", inside)
    metrics.count("awareness_within_1sigma_count", len(inside))
    metrics.shares("awareness_within_1sigma_all", inside_all)
    metrics.count("unaware_people", len(unaware))
    metrics.count("unaware_judged", len(judged))
    metrics.count("false_aware_count", false_aware)
    metrics.share("false_aware", false_aware, len(judged))
    metrics.share("false_aware_of_everyone", false_aware, len(known))
    metrics.count("aware_people", len(aware))
    metrics.share("aware_recognised", recognised, len(aware))


def _estimated_alpha(each: PersonFrame) -> float | None:
    return None if each.estimate is None else each.estimate.awareness


def _mahalanobis2(error: FloatArray, covariance: FloatArray) -> float:
    try:
        return float(error @ np.linalg.solve(covariance, error))
    except np.linalg.LinAlgError:
        return math.inf if np.any(error) else 0.0  # a covariance of zeros
