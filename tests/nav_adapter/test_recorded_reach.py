"""The reach of people who stand, against recorded people and small steps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from paths import SHARED

from nav_adapter import AwarenessPolicy
from nav_adapter.reach import Reach
from perception.arrays import FloatArray

RECORDINGS = sorted((SHARED / "data").glob("citr_*.csv"))
FRAMES_PER_S = 29.97
STILL_S, STILL_M = 0.5, 0.1
TIMES_S = np.array([0.25, 0.5, 0.75, 1.0, 1.5, 2.0])

needs_recordings = pytest.mark.skipif(not RECORDINGS, reason="recorded people are not there")


def reach_m(times_s: FloatArray, policy: AwarenessPolicy) -> FloatArray:
    """Return how far the policy expects an unaware person who stands to come."""
    rules = policy.reach
    assert rules is not None
    person = Reach(
        *(0.0, 0.0, 0.0, 0.0, policy.speed.human_speed_mps(0.0)),
        *(rules.time_constant_s, rules.delay_s),
    )
    return np.array([person.radius_m(each) for each in times_s.tolist()])


def walks() -> Iterator[tuple[FloatArray, FloatArray]]:
    """Stamps (N,) and positions (N, 2) of every recorded person."""
    for path in RECORDINGS:
        rows = np.genfromtxt(path, delimiter=",", names=True)
        for each in np.unique(rows["id"]):
            mine = np.sort(rows[rows["id"] == each], order="t_s")
            yield mine["t_s"], np.stack([mine["x_m"], mine["y_m"]], axis=1)


def excess_m(policy: AwarenessPolicy) -> list[FloatArray]:
    """Return by how much people left the middle of their reach farther than it is wide.

    For each time, of everybody within 0.1 m of their place for half a second, with the velocity of
    the last 0.2 s, which a tracker shows.
    """
    found: list[list[float]] = [[] for _ in TIMES_S]
    rules = policy.reach
    assert rules is not None
    back, latest = round(STILL_S * FRAMES_PER_S), round(0.2 * FRAMES_PER_S)
    for stamps_s, places in walks():
        for row in range(back, len(stamps_s)):
            before = places[row - back : row + 1] - places[row]
            if stamps_s[row] - stamps_s[row - back] > 1.1 * STILL_S:
                continue
            if np.linalg.norm(before, axis=1).max() > STILL_M:
                continue
            velocity = (places[row] - places[row - latest]) / (latest / FRAMES_PER_S)
            person = Reach(
                *(*places[row].tolist(), *velocity.tolist(), policy.speed.human_speed_mps(0.0)),
                *(rules.time_constant_s, rules.delay_s),
            )
            for column, time_s in enumerate(TIMES_S.tolist()):
                later = row + round(time_s * FRAMES_PER_S)
                if later < len(stamps_s):
                    middle = places[row] + velocity * person.drift_s(time_s)
                    gone_m = float(np.linalg.norm(places[later] - middle))
                    found[column].append(gone_m - person.radius_m(time_s))
    return [np.array(each) for each in found]


@needs_recordings
def test_the_reach_holds_recorded_people_who_stood() -> None:
    """``conservative`` all of them; ``balanced`` all within the clearance for 1.5 s."""
    careful = excess_m(AwarenessPolicy.preset("conservative"))
    assert min(len(each) for each in careful) > 150
    assert max(float(each.max()) for each in careful) < 0.0
    default = AwarenessPolicy.preset("balanced")
    balanced = [float(each.max()) for each in excess_m(default)]
    assert max(balanced[:3]) < 0.0
    assert max(balanced[:5]) < 0.105
    # At 2 s a robot stands. Some people walk faster than U by then.
    assert balanced[5] < 0.2
    # Not far beyond recorded people either: half a metre at a second.
    assert max(float(np.percentile(each, 99)) for each in careful) > -0.5


def test_the_reach_is_that_of_somebody_whose_speed_approaches_u() -> None:
    """In small steps: dv/dt = (U − v) / τ, begun before the present."""
    policy = AwarenessPolicy.preset("balanced")
    rules, dt_s = policy.reach, 1e-4
    assert rules is not None
    for time_s, expected in zip(TIMES_S.tolist(), reach_m(TIMES_S, policy), strict=True):
        way_m = speed_mps = 0.0
        for _ in range(round((time_s + rules.delay_s) / dt_s)):
            speed_mps += (1.5 - speed_mps) * dt_s / rules.time_constant_s
            way_m += speed_mps * dt_s
        assert way_m == pytest.approx(expected, abs=1e-3)
