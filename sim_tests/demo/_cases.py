"""The three cases of the paper's encounter, and their values in a crossing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from perception import PersonObservation

from ..crossing import CrossingFrame, CrossingResult
from ..crossing.eyes import PIXEL_RATE_HZ

#: Longest time between two images of the slowest camera of an encounter, with a margin.
CAMERA_PERIOD_S: Final = 1.1 / PIXEL_RATE_HZ


@dataclass(frozen=True, slots=True)
class EncounterCase:
    """A row of the paper's table: awareness and position of the worker at one time."""

    t_s: float
    awareness: float
    d_fwd_m: float
    d_lat_m: float
    meaning: str


#: Table I of the paper.
CASES: Final = (
    EncounterCase(5.65, 0.34, 2.77, -1.04, "partial awareness"),
    EncounterCase(10.00, 0.00, 2.13, 0.92, "no awareness"),
    EncounterCase(16.25, 0.88, 2.05, -0.15, "full awareness"),
)


def case_values(
    result: CrossingResult,
) -> list[tuple[EncounterCase, str, float | None, float | None, float | None]]:
    """Return α, d_fwd and d_lat of each case, for the truth and for the perception."""
    rows: list[tuple[EncounterCase, str, float | None, float | None, float | None]] = []
    for case in CASES:
        frame = _frame_at(result, case.t_s)
        true = frame.truth[0]
        rows.append((case, "truth", true.awareness, true.d_fwd_m, true.d_lat_m))
        observation = _observation_near(result, case.t_s)
        name = result.perception
        if observation is None:
            rows.append((case, name, None, None, None))
        else:
            position = observation.position_camera_m
            rows.append(
                (case, name, observation.awareness, float(position[2]), -float(position[0]))
            )
    return rows


def _frame_at(result: CrossingResult, t_s: float) -> CrossingFrame:
    """Return the frame closest in time."""
    return min(result.frames, key=lambda frame: abs(frame.t_s - t_s))


def _observation_near(result: CrossingResult, t_s: float) -> PersonObservation | None:
    """Return the first worker's observation in the image closest in time; None without one."""
    near = (frame for frame in result.frames if abs(frame.t_s - t_s) <= CAMERA_PERIOD_S)
    seen = [
        (abs(frame.t_s - t_s), observation)
        for frame in near
        if (observation := frame.observation_of(0)) is not None
    ]
    return min(seen, key=lambda each: each[0])[1] if seen else None
