"""Time that the stages of a frame take."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Literal

from .networks import NETWORK_TIME


@dataclass(frozen=True, slots=True)
class StageTimings:
    """Wall-clock times of the stages of one frame.

    Attributes:
        detector_s: time of the detector, including the preparation of its input and the reading of
            its output.
        pose_s: the same for the pose estimator.
        head_pose_s: the same for the head pose estimator, and the eye estimator if there is one.
        rest_s: time of everything else: checks, positions, face evidence, awareness.
        networks_s: the part of all this in runs of ONNX networks. Networks that do not run in ONNX
            Runtime are not included.
    """

    detector_s: float = 0.0
    pose_s: float = 0.0
    head_pose_s: float = 0.0
    rest_s: float = 0.0
    networks_s: float = 0.0

    @property
    def total_s(self) -> float:
        """Time of the whole frame."""
        return self.detector_s + self.pose_s + self.head_pose_s + self.rest_s


class StageClock:
    """Measures the stages of one frame; it starts when it is made."""

    def __init__(self) -> None:
        self._since_s = perf_counter()
        self._networks_before_s = NETWORK_TIME.elapsed_s
        self._times_s = {"detector": 0.0, "pose": 0.0, "head_pose": 0.0, "rest": 0.0}

    def count(self, stage: Literal["detector", "pose", "head_pose", "rest"]) -> None:
        """Count the time since the last call, or since the start, to a stage."""
        now_s = perf_counter()
        self._times_s[stage] += now_s - self._since_s
        self._since_s = now_s

    def timings(self) -> StageTimings:
        """Return what has been counted."""
        return StageTimings(
            **{f"{stage}_s": time_s for stage, time_s in self._times_s.items()},
            networks_s=NETWORK_TIME.elapsed_s - self._networks_before_s,
        )
