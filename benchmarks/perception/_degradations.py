"""Perception on held-out renders under what real cameras do, judged with the truth."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from awarenav.judge import judge_frames
from awarenav.records import PersonRecord, read_person
from perception import AwarenessPipeline, Camera, PersonObservation

from ._pictures import Condition, chosen_conditions, degraded_pictures, pipeline_of

#: Bounds of the figures: median and 90th percentile of the head's direction, recall, false aware.
MAX_MEDIAN_DEG: Final = 6.0
MAX_P90_DEG: Final = 20.0
MIN_RECALL: Final = 0.95
MAX_FALSE_AWARE: Final = 0.005


def estimated(observation: PersonObservation) -> PersonRecord:
    """Return an observation as the judge reads it."""
    gaze = observation.gaze_camera
    box = observation.box_xyxy_px
    return read_person(
        {
            "box_xyxy_px": None if box is None else box.tolist(),
            "position_camera_m": observation.position_camera_m.tolist(),
            "position_covariance_m2": observation.position_covariance_m2.tolist(),
            "gaze_camera": None if gaze is None else gaze.tolist(),
            "awareness": observation.awareness,
            "awareness_std": observation.awareness_std,
            "score": observation.score,
        },
        "an observation",
    )


def measure(
    conditions: Sequence[Condition], frames: int, seed: int, folder: Path | None = None
) -> dict[str, dict[str, Any]]:
    """Return the judge's metrics (:func:`awarenav.judge.judge_frames`) of each condition."""
    truth: dict[str, dict[str, list[PersonRecord]]] = {each.name: {} for each in conditions}
    found: dict[str, dict[str, list[PersonRecord]]] = {each.name: {} for each in conditions}
    pipelines: dict[Camera, AwarenessPipeline] = {}
    for condition, camera, number, rgb, record in degraded_pictures(conditions, frames, seed):
        if camera not in pipelines:
            pipelines[camera] = pipeline_of(camera, folder)
        name = str(record["frame"])
        truth[condition.name][name] = [read_person(person, name) for person in record["people"]]
        found[condition.name][name] = [
            estimated(each) for each in pipelines[camera].process(rgb, float(number))
        ]
    return {each.name: judge_frames(truth[each.name], found[each.name]) for each in conditions}


def row_of(name: str, metrics: dict[str, Any]) -> str:
    """Return a row of the table."""
    overall, detection = metrics["overall"], metrics["detection"]

    def shown(value: float | None, unit: str, factor: float = 1.0) -> str:
        return "–" if value is None else f"{factor * value:.1f}{unit}"

    return " | ".join(
        [
            f"| {name}",
            f"{overall['found']} of {overall['people']}",
            shown(overall["recall"], " %", 100.0),
            f"{detection['false_positives_per_frame']:.2f}",
            shown(overall["gaze_none"], " %", 100.0),
            shown(overall["head_median_deg"], "°"),
            shown(overall["head_p90_deg"], "°"),
            f"{overall['false_aware_count']} of {overall['unaware_judged']}",
            shown(overall["position_median"], " %", 100.0),
            shown(overall["awareness_within_1sigma"], " %", 100.0) + " |",
        ]
    )


HEADER: Final = (
    "| pictures | found | recall | false a picture | no direction | head median | head p90 "
    "| falsely aware | position / range | α within 1σ |\n" + "| --- " * 10 + "|"
)


def meets(metrics: dict[str, Any]) -> bool:
    """Return whether head direction, recall and false awareness keep their bounds."""
    overall = metrics["overall"]
    median, p90 = overall["head_median_deg"], overall["head_p90_deg"]
    recall, false_aware = overall["recall"], overall["false_aware"]
    return (
        median is not None
        and median <= MAX_MEDIAN_DEG
        and p90 <= MAX_P90_DEG
        and recall >= MIN_RECALL
        and (false_aware is None or false_aware <= MAX_FALSE_AWARE)
    )


def run(parser: argparse.ArgumentParser, chosen: argparse.Namespace) -> None:
    """Print a row for each condition."""
    wanted = chosen_conditions(parser, chosen.conditions)
    print(HEADER)
    failed = []
    for name, metrics in measure(wanted, chosen.frames, chosen.seed, chosen.networks).items():
        print(row_of(name, metrics), flush=True)
        if not meets(metrics):
            failed.append(name)
    print(
        f"\n{len(wanted) - len(failed)} of {len(wanted)} conditions keep head ≤ {MAX_MEDIAN_DEG:g}°"
        f" and ≤ {MAX_P90_DEG:g}° (90 %), recall ≥ {MIN_RECALL:.0%}, falsely aware "
        f"≤ {MAX_FALSE_AWARE:.1%}"
    )
