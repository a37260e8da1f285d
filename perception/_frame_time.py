"""Time that frames take, and how the detector may look for a frame to take less."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Final, Literal

from ._carried_boxes import MAX_DETECT_EVERY_S
from .networks import NETWORK_TIME

#: Times between two looks of the detector to choose from.
INTERVALS_S: Final = (0.0, 0.1, 0.15, MAX_DETECT_EVERY_S)

# Share of the budget that frames may take on average before the detector looks less often, and the
# share that it must stay below before it looks more often, for so many images in a row.
_TOO_MUCH: Final = 0.95
_ENOUGH_LEFT: Final = 0.80
_PATIENCE: Final = 20
# Weight of the newest time in the running means. The first frames of a process are slow.
_NEW: Final = 0.15
_WARM_UP: Final = 3


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
        detector_share: pixels of the detector's input, as a share of its whole input. Below 1 a
            frame budget has made it smaller, and people far away may be missed.
    """

    detector_s: float = 0.0
    pose_s: float = 0.0
    head_pose_s: float = 0.0
    rest_s: float = 0.0
    networks_s: float = 0.0
    detector_share: float = 1.0

    @property
    def total_s(self) -> float:
        """Time of the whole frame."""
        return self.detector_s + self.pose_s + self.head_pose_s + self.rest_s

    @property
    def outside_s(self) -> float:
        """Time of the whole frame without the runs of ONNX networks."""
        return self.total_s - self.networks_s


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


class FrameBudget:
    """Chooses the time between two looks of the detector, and then the size of its input.

    It starts with every image and the whole input. The running means of the detector's time, and of
    the time of everything else, say what a frame takes on average with each choice. The interval
    grows at once when that is too much, and where the longest one is not enough, the input gets
    smaller. Both go back one step at a time when enough is left.

    Args:
        budget_s: time for a frame, and so the period of frames, > 0.
        shares: pixels of the inputs to choose from, as shares of the whole one, largest first. The
            detector's time is taken to be proportional to them.
    """

    def __init__(self, budget_s: float, shares: Sequence[float] = (1.0,)) -> None:
        self._budget_s, self._shares = budget_s, tuple(shares)
        self._levels = [
            *((every_s, 0) for every_s in INTERVALS_S),
            *((INTERVALS_S[-1], size) for size in range(1, len(self._shares))),
        ]
        self._level = self._patience = self._frames = 0
        self._detector_s: float | None = None
        self._rest_s: float | None = None

    @property
    def every_s(self) -> float:
        """Time between two looks of the detector; 0 is every image."""
        return self._levels[self._level][0]

    @property
    def size(self) -> int:
        """Number of the input in use, from 0 for the whole one."""
        return self._levels[self._level][1]

    @property
    def share(self) -> float:
        """Pixels of the input in use, as a share of the whole one."""
        return self._shares[self.size]

    def unused(self) -> FrameBudget:
        """Return the same budget before its first frame."""
        return FrameBudget(self._budget_s, self._shares)

    def mean_s(self, level: int) -> float:
        """Return the mean time of a frame with a choice: intervals first, then smaller inputs."""
        every_s, size = self._levels[level]
        # Frames come no faster than the budget says; slow ones come later.
        looks = min(self._budget_s / every_s, 1.0) if every_s > 0.0 else 1.0
        return (self._rest_s or 0.0) + looks * self._shares[size] * (self._detector_s or 0.0)

    def record(self, detector_s: float | None, rest_s: float) -> None:
        """Take the times of a frame.

        Args:
            detector_s: time of the detector with the input in use; None if it did not look.
            rest_s: time of everything else.
        """
        self._frames += 1
        if self._frames <= _WARM_UP:
            return
        if detector_s is not None:
            self._detector_s = _mean(self._detector_s, detector_s / self.share)
        self._rest_s = _mean(self._rest_s, rest_s)
        if self._detector_s is None:
            return
        while (
            self._level + 1 < len(self._levels)
            and self.mean_s(self._level) > _TOO_MUCH * self._budget_s
        ):
            self._level, self._patience = self._level + 1, 0
        if self._level and self.mean_s(self._level - 1) < _ENOUGH_LEFT * self._budget_s:
            self._patience += 1
            if self._patience >= _PATIENCE:
                self._level, self._patience = self._level - 1, 0
        else:
            self._patience = 0


def _mean(mean: float | None, new: float) -> float:
    return new if mean is None else (1.0 - _NEW) * mean + _NEW * new
