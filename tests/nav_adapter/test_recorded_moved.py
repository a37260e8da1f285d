"""The delay of each person's own track against recorded people who set off."""

from __future__ import annotations

import numpy as np
import pytest
from test_recorded_reach import RECORDINGS, TIMES_S, reach_m, seen_at, walks

from nav_adapter.policies import StandingPeople
from perception.arrays import FloatArray
from tracking import PersonTracker, TrackerConfig

RATE_HZ, NOISE_M = 60.0, 0.008
# No least delay: the track's own alone.
RULE = StandingPeople(start_delay_s=0.0, standing_below_mps=0.0, delay_from_tracks=True)


def stood() -> list[tuple[float, FloatArray]]:
    """Delay and ways (6,) after :data:`TIMES_S` of everybody whose track says how far they moved.

    The recordings are too short for a window of 1 s; half a second knows less and is looser.
    """
    rng, found = np.random.default_rng(0), []
    for recorded_s, recorded_m in walks():
        stamps_s = np.arange(recorded_s[0], recorded_s[-1], 1.0 / RATE_HZ)
        places = np.stack(
            [np.interp(stamps_s, recorded_s, recorded_m[:, axis]) for axis in (0, 1)], axis=1
        )
        back = round(0.3 * RATE_HZ)
        if np.linalg.norm(places[back:] - places[:-back], axis=1).min() > 0.08:
            continue
        tracker = PersonTracker(TrackerConfig(standing_window_s=0.5))
        for row, (stamp_s, place) in enumerate(zip(stamps_s.tolist(), places, strict=True)):
            seen = seen_at(stamp_s, place + rng.normal(0.0, NOISE_M, 2), 0.02)
            tracks = tracker.update((seen,), stamp_s, np.eye(4))
            if len(tracks) == 1 and np.isfinite(tracks[0].moved_m):
                later = [row + round(time_s * RATE_HZ) for time_s in TIMES_S.tolist()]
                ways = [
                    float(np.linalg.norm(places[index] - place)) if index < len(places) else np.nan
                    for index in later
                ]
                delay_s = RULE.delay_s(0.0, tracks[0].moved_m, tracks[0].moved_age_s)
                found.append((delay_s, np.array(ways)))
    return found


@pytest.mark.slow
@pytest.mark.skipif(not RECORDINGS, reason="recorded people are not there")
def test_nobody_gets_farther_than_from_their_own_delay_and_a_short_one_for_all_fails() -> None:
    everybody = stood()
    assert len(everybody) > 150
    excess = np.array([ways - reach_m(TIMES_S, 2.0, delay_s) for delay_s, ways in everybody])
    assert np.nanmax(excess) < -0.05
    fixed = np.array([ways - reach_m(TIMES_S, 2.0, 0.1) for _, ways in everybody])
    assert np.nanmax(fixed) > 0.05
    delays = np.array([delay_s for delay_s, _ in everybody])
    assert 0.15 < np.median(delays) < 0.25
