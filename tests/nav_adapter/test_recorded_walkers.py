"""The way of people who turn to the robot, against recorded people; docs/safety.md has figures."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import pytest
from paths import ROOT
from test_recorded_reach import needs_recordings, seen_at, walks

from nav_adapter._approach import turn_of
from nav_adapter._separation import separation_from_standing_m
from nav_adapter.policies import WalkingPeople
from perception.arrays import FloatArray
from tracking import PersonTracker

TIMES_S: Final = np.array([0.3, 0.5, 0.75, 1.0, 1.5, 2.0])
BEARINGS = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
#: To the robot: it may be anywhere.
TO_ROBOT: Final = np.stack([np.cos(BEARINGS), np.sin(BEARINGS)])
CLEARANCE_M: Final = 0.10
REACTION_S: Final = 0.3


class Walker(NamedTuple):
    """One person in one frame, as the tracker shows them.

    Attributes:
        velocity_mps: (2,).
        velocity_sigma_mps: its largest standard deviation.
        nearer_m: (6, 24), how much nearer they came to a robot in each direction, less two standard
            deviations of their position; NaN after the end of the recording.
    """

    velocity_mps: FloatArray
    velocity_sigma_mps: float
    nearer_m: FloatArray


def walkers(rate_hz: float, noise_m: float) -> list[Walker]:
    """Return everybody in every frame, tracked alone."""
    rng, found = np.random.default_rng(0), []
    for recorded_s, recorded_m in walks():
        tracker = PersonTracker()
        for stamp_s in np.arange(recorded_s[0], recorded_s[-1], 1.0 / rate_hz).tolist():
            times_s = stamp_s + np.array([0.0, *TIMES_S])
            places = np.stack(
                [np.interp(times_s, recorded_s, each, right=np.nan) for each in recorded_m.T], -1
            )
            seen = seen_at(stamp_s, places[0] + rng.normal(0.0, noise_m, 2), 1.2 * noise_m + 0.01)
            tracks = tracker.update((seen,), stamp_s, np.eye(4))
            if len(tracks) != 1 or tracks[0].status != "confirmed":
                continue
            (track,) = tracks
            place_m, velocity_mps = (
                float(np.sqrt(np.linalg.eigvalsh(track.covariance_odom[part, part])[-1]))
                for part in (slice(0, 2), slice(2, 4))
            )
            nearer_m = (places[1:] - track.position_odom_m) @ TO_ROBOT - 2.0 * place_m
            found.append(Walker(track.velocity_odom_mps, velocity_mps, nearer_m))
    return found


def excess_m(people: list[Walker], rule: WalkingPeople) -> float:
    """Return by how much somebody came nearer than the rule counts, where it pays; the worst."""
    worst_m = -np.inf
    for person in people:
        closing_mps = person.velocity_mps @ TO_ROBOT
        turn = turn_of(
            closing_mps,
            np.full_like(closing_mps, rule.turn_delay_s),
            np.full_like(closing_mps, rule.velocity_sigmas * person.velocity_sigma_mps),
            np.full_like(closing_mps, REACTION_S),
            rule.human_acceleration_mps2,
        )
        human_mps = np.full(len(BEARINGS), max(1.6, float(np.linalg.norm(person.velocity_mps))))
        times_s = TIMES_S[:, None]
        ways_m = turn.nearer_m + separation_from_standing_m(
            *(0.0, human_mps, 1.0, times_s, 0.0, times_s),
            rule.human_acceleration_mps2,
            turn.delay_s,
        )
        pays = (ways_m < human_mps * times_s) & np.isfinite(person.nearer_m)
        if pays.any():
            worst_m = max(worst_m, float((person.nearer_m - ways_m)[pays].max()))
    return worst_m


def row_of_docs(title: str) -> list[float]:
    text = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith(f"| {title} |")]
    return [float(cell.replace("−", "-")) for cell in line.strip("|").split("|")[1:]]


SENSORS = [
    pytest.param("30 Hz, 1 cm", 30.0, 0.01, marks=pytest.mark.full),
    pytest.param("30 Hz, 3 cm", 30.0, 0.03, marks=pytest.mark.full),
    pytest.param("20 Hz, 5 cm", 20.0, 0.05, marks=pytest.mark.full),
    ("20 Hz, 10 cm", 20.0, 0.10),
    pytest.param("10 Hz, 8 cm", 10.0, 0.08, marks=pytest.mark.full),
]


@needs_recordings
@pytest.mark.slow
@pytest.mark.parametrize(("title", "rate_hz", "noise_m"), SENSORS)
def test_nobody_turned_faster_than_the_rule_counts(
    title: str, rate_hz: float, noise_m: float
) -> None:
    people = walkers(rate_hz, noise_m)
    assert len(people) > 4000
    shipped = excess_m(people, WalkingPeople())
    assert shipped < CLEARANCE_M
    sooner = excess_m(people, WalkingPeople(turn_delay_s=0.15))
    assert [shipped, sooner] == pytest.approx(row_of_docs(title), abs=0.02)
    assert excess_m(people, WalkingPeople(turn_delay_s=0.0, velocity_sigmas=0.0)) > CLEARANCE_M
