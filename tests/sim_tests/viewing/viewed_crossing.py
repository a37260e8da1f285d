"""A short crossing that tests watch."""

from __future__ import annotations

from sim_tests.conditions import Conditions
from sim_tests.crossing import CrossingFrame, CrossingResult, Stage, run_crossing
from sim_tests.scenario import Scenario
from sim_tests.viewing import CameraPictures, CrossingRecorder

SHORT = """
name: short
description: A robot drives 0.6 m past a person who walks towards it.
duration_s: 2.0
control_hz: 20.0
layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}
camera: {width_px: 640, height_px: 400}
robot: {goal_x_m: 0.6}
people:
  - name: walks
    route: [{x_m: 4.0, y_m: -0.8}, {x_m: 3.2, y_m: -0.8}]
    speed_mps: 0.4
    glances: {notices_within_m: 0.0}
"""
CONDITIONS = Conditions("short", 0, "balanced", "ReferencePlanner", "truth")


def record(
    *, camera: bool = True, text: str = SHORT, perception: str = "keypoints"
) -> tuple[CrossingRecorder, CrossingResult, list[CrossingFrame]]:
    """Return the recorder, the result and the frames of the crossing."""
    pictures = CameraPictures(2.0) if camera else None
    recorder = CrossingRecorder(CONDITIONS, pictures=pictures)
    frames: list[CrossingFrame] = []

    def observe(frame: CrossingFrame, stage: Stage) -> None:
        frames.append(frame)
        recorder(frame, stage)

    scenario = Scenario.from_text(text).draw(0)
    result = run_crossing(scenario, policy="balanced", perception=perception, observer=observe)
    return recorder, result, frames
