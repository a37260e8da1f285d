"""Metrics of estimates of a group of people: gaze, position, awareness, and uncertainties."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.special import gammaincinv

from perception.arrays import FloatArray

from ..records import PersonRecord

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


@dataclass(frozen=True, slots=True)
class PersonFrame:
    """A person in a frame, and their estimate; None if they were not found."""

    truth: PersonRecord
    estimate: PersonRecord | None


_Pairs = Sequence[tuple[PersonRecord, PersonRecord]]


def person_metrics(group: Iterable[PersonFrame]) -> dict[str, Any]:
    """Return the metrics of a group of people who had to be found.

    Shares are from 0 to 1; a metric without people is None. ``awareness_none`` and
    ``gaze_none`` are the shares of found people without an estimate of it. ``false_aware`` is the
    share of α ≥ 0.5 among the estimated α of people whose true α is 0; people without an estimated
    α do not count, so they do not dilute it. ``aware_recognised`` is the share of people with an
    estimated α ≥ 0.5 among all people with a true α ≥ 0.5, found or not; it is 0 for an estimator
    that always returns 0.
    """
    everyone = list(group)
    found = [(each.truth, each.estimate) for each in everyone if each.estimate is not None]
    return {
        "people": len(everyone),
        "found": len(found),
        "recall": _share(len(found), len(everyone)),
        **_direction_metrics(found),
        **_position_metrics(found),
        **_awareness_metrics(everyone, found),
    }


def _direction_metrics(found: _Pairs) -> dict[str, Any]:
    """Return the errors of gaze and head direction."""
    metrics: dict[str, Any] = {
        "gaze_none": _share(sum(e.gaze_camera is None for _, e in found), len(found))
    }
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
        metrics |= {
            f"{name}_count": len(errors),
            f"{name}_median_deg": _percentile(errors, 50.0),
            f"{name}_p90_deg": _percentile(errors, 90.0),
            f"{name}_over_90deg": _share(sum(error > 90.0 for error in errors), len(errors)),
        }
    return metrics


def _position_metrics(found: _Pairs) -> dict[str, Any]:
    """Return the errors of position as shares of range, and their normalised squares (NEES)."""
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
    return {
        "position_count": len(relative),
        "position_median": _percentile(relative, 50.0),
        "position_p90": _percentile(relative, 90.0),
        "range_bias": _percentile(along, 50.0),
        "position_nees": _mean(nees),
        "position_within_1sigma": _mean(within),
    }


def _awareness_metrics(everyone: Sequence[PersonFrame], found: _Pairs) -> dict[str, Any]:
    """Return the errors of α, its calibration, and false and missed awareness."""
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
    return {
        "awareness_count": len(errors),
        "awareness_none": _share(sum(e.awareness is None for _, e in found), len(found)),
        "awareness_mae": _mean(errors),
        "awareness_mae_none_as_0": _mean(with_none_as_0),
        "awareness_within_1sigma": _mean(inside),
        "awareness_within_1sigma_count": len(inside),
        "awareness_within_1sigma_all": _mean(inside_all),
        "unaware_people": len(unaware),
        "unaware_judged": len(judged),
        "false_aware_count": false_aware,
        "false_aware": _share(false_aware, len(judged)),
        "false_aware_of_everyone": _share(false_aware, len(known)),
        "aware_people": len(aware),
        "aware_recognised": _share(recognised, len(aware)),
    }


def _estimated_alpha(each: PersonFrame) -> float | None:
    return None if each.estimate is None else each.estimate.awareness


def _mahalanobis2(error: FloatArray, covariance: FloatArray) -> float:
    try:
        return float(error @ np.linalg.solve(covariance, error))
    except np.linalg.LinAlgError:
        return math.inf if np.any(error) else 0.0  # a covariance of zeros


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _mean(values: Sequence[float] | Sequence[bool]) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _percentile(values: Sequence[float], percent: float) -> float | None:
    return float(np.percentile(values, percent)) if values else None
