"""A twin that turns out to be a person of its own is somebody unaware."""

from __future__ import annotations

import numpy as np
import pytest
from test_tracker_twins import NOISE_M, twin_scene
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, observe

from tracking import (
    AwarenessFilterConfig,
    PersonTrack,
    PersonTracker,
    SensorConfig,
    TrackerConfig,
)
from tracking._table import TrackTable
from tracking._twins import without

REMEMBERS = TrackerConfig(awareness=AwarenessFilterConfig(noticed_memory_s=4.0))
ALPHA = 0.95


class Attentive:
    """A tracker of people who look at the robot, at 20 Hz."""

    def __init__(self, seed: int) -> None:
        # A scanner, so that noticing counts; it is silent.
        self.tracker = PersonTracker(REMEMBERS, sensors={"laser": SensorConfig()})
        self.now, self.scene = 0.0, iter(twin_scene(seed))
        self.tracks: tuple[PersonTrack, ...] = ()
        self.places: list[FloatArray] = []

    def show(self, places: list[FloatArray]) -> None:
        self.now += PERIOD_S
        self.places = places
        people = [
            observe(p, self.now, covariance_odom_m2=NOISE_M**2, awareness=ALPHA) for p in places
        ]
        self.tracks = self.tracker.update(people, self.now, CAMERA)

    @property
    def table(self) -> TrackTable:
        return self.tracker._history.latest.tracks

    def until_twin(self) -> int:
        """Go on until a frame shows a person and a twin that has looked; return the twin's row."""
        for places in self.scene:
            self.show(places)
            twins = np.flatnonzero(self.table.twins)
            if len(places) == 2 and twins.size and self.table.looked_s[twins[0]] > 0.1:
                return int(twins[0])
        raise AssertionError("no twin was found")


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_twin_that_walks_off_has_no_awareness_of_its_own(seed: int) -> None:
    people = Attentive(seed)
    row = people.until_twin()
    twin = people.table.ids[row]
    (host,) = people.tracks
    assert host.awareness_lower > 0.5
    person, other = people.places
    for step in range(1, 60):
        people.show([person, other + np.array([0.6 * PERIOD_S * step, 0.0])])
        found = [one for one in people.tracks if one.id == twin]
        if found:
            row = int(np.flatnonzero(people.table.ids == twin)[0])
            # Not more than one look, since it has been a person of its own.
            assert found[0].awareness_lower < 0.5 * host.awareness_lower
            assert people.table.looked_s[row] <= PERIOD_S
            assert found[0].noticed < 0.1
            return
    pytest.fail("the twin was never released")


def test_a_twin_that_outlives_its_person_forgets_what_it_has_noticed() -> None:
    people = Attentive(3)
    twin = people.until_twin()
    tracks = people.table
    host = int(np.searchsorted(tracks.ids, tracks.host_ids[twin]))
    # The twin has been seen later than its person.
    hits = tracks.hit_stamps_s.copy()
    hits[host] -= PERIOD_S
    gone = np.arange(len(tracks)) == host
    left = without(tracks.replaced(hit_stamps_s=hits), gone, REMEMBERS)
    row = left.ids.tolist().index(tracks.ids[twin])
    assert not left.twins[row]
    assert left.looked_s[row] == 0.0
    assert left.awareness_variances[row] == REMEMBERS.awareness.prior_std_logit**2
    assert left.awareness_bounds[row] < -4.0
    assert np.isnan(left.evidence_stamps_s[row])
