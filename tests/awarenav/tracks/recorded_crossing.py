"""A crossing written as the files of a recording: camera.yaml, truth.jsonl and estimates.jsonl."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from awarenav.records import Record, write_records
from sim_tests import Scenario, run_crossing
from sim_tests.crossing import CrossingFrame


def record_crossing(scenario: Scenario, folder: Path, *, seed: int = 0) -> None:
    """Run a crossing with the keypoint camera and write what it saw and what was so.

    The camera of the scenario must be a perfect one: a frame a control cycle, without delay.
    """
    result = run_crossing(scenario, policy="balanced", perception="keypoints", seed=seed)
    scenario.camera.camera(1.0).to_yaml(folder / "camera.yaml")
    write_records(folder / "truth.jsonl", [_frame(frame, _truth(frame)) for frame in result.frames])
    write_records(
        folder / "estimates.jsonl", [_frame(frame, _seen(frame)) for frame in result.frames]
    )


def _frame(frame: CrossingFrame, people: list[dict[str, Any]]) -> Record:
    return {
        "frame": f"{round(frame.t_s * 1000.0):06d}",
        "stamp_s": frame.t_s,
        "T_odom_camera": frame.T_odom_camera.tolist(),
        "people": people,
    }


def _truth(frame: CrossingFrame) -> list[dict[str, Any]]:
    return [
        {
            "id": worker,
            "box_xyxy_px": None,
            "position_camera_m": view.position_camera_m.tolist(),
            "gaze_camera": view.gaze_camera.tolist(),
            "awareness": view.awareness,
            "awareness_std": 0.0,
            "keypoints": {},
        }
        for worker, view in enumerate(frame.truth)
    ]


def _seen(frame: CrossingFrame) -> list[dict[str, Any]]:
    return [
        {
            "id": None,
            "box_xyxy_px": None if each.box_xyxy_px is None else each.box_xyxy_px.tolist(),
            "position_camera_m": each.position_camera_m.tolist(),
            "position_covariance_m2": each.position_covariance_m2.tolist(),
            "gaze_camera": None if each.gaze_camera is None else each.gaze_camera.tolist(),
            "awareness": each.awareness,
            "awareness_std": each.awareness_std,
            "score": each.score,
            "keypoints": {},
        }
        for each in frame.observations
    ]
