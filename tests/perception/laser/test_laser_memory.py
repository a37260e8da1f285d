"""Maps and the occupancy memory: walls become known, people who stand still do not."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from laser_scenes import laser_scan, points_of

from perception.laser import OccupancyMemory, StaticMap

POST = (2.0, 0.5, 0.08)


def watched(memory: OccupancyMemory, circles, start_s: float, end_s: float, person=None) -> None:
    """Let the memory see a room at 20 Hz."""
    for stamp in np.arange(start_s, end_s - 1e-9, 0.05):
        points = points_of(laser_scan(circles, noise=0.01, seed=int(1e3 * stamp), stamp_s=stamp))
        near = points.ranges_m < 3.0 if person else np.zeros(len(points.usable), dtype=bool)
        memory.update(points, near)


def front(post=POST) -> np.ndarray:
    """Return the point of a post that is nearest to the scanner."""
    place = np.array(post[:2])
    return (place * (1.0 - post[2] / np.linalg.norm(place)))[None]


def test_what_always_stood_there_becomes_static() -> None:
    memory = OccupancyMemory()
    watched(memory, [POST], 0.0, 0.8)
    assert not (memory.known(front()) < 0).any()
    watched(memory, [POST], 0.8, 4.0)
    assert (memory.known(front()) < 0).all()
    # A wall beyond 6 m is not learned: so far away legs look like posts, and posts like legs.
    assert not (memory.known(np.array([[6.0, 0.3], [-6.0, 9.0]])) < 0).any()
    # A person who was taken for a post is soon one again, however long that was.
    watched(memory, [POST], 4.0, 30.0)
    watched(memory, [POST], 30.0, 31.5, person=True)
    assert not (memory.known(front()) < 0).any()


def test_what_has_come_never_becomes_static() -> None:
    memory = OccupancyMemory()
    watched(memory, [], 0.0, 3.0)
    assert (memory.known(front()) > 0).all()
    watched(memory, [POST], 3.0, 12.0)
    assert not (memory.known(front()) < 0).any()


def test_somebody_who_stands_still_is_not_learned_as_a_post() -> None:
    memory = OccupancyMemory()
    watched(memory, [POST], 0.0, 20.0, person=True)
    assert not (memory.known(front()) < 0).any()


def test_two_legs_are_remembered_for_five_seconds_where_they_were() -> None:
    memory = OccupancyMemory()
    memory.note_two_legs(np.array([[2.0, 0.5]]), 100.0)
    places = np.array([[2.0, 0.5], [2.15, 0.4], [2.6, 0.5]])
    assert memory.had_two_legs(places, 104.0).tolist() == [True, True, False]
    assert not memory.had_two_legs(places, 106.0).any()
    assert not memory.had_two_legs(places, 99.0).any()  # a clock that was set back


def test_the_memory_follows_the_robot_and_keeps_what_it_knows() -> None:
    memory = OccupancyMemory()
    watched(memory, [POST], 0.0, 4.0)
    for k in range(30):
        origin = (-0.5 * k, 0.0)
        scan = laser_scan([POST], origin=origin, stamp_s=4.0 + 0.25 * k)
        points = points_of(scan, (*origin, 0.0))
        memory.update(points, np.zeros(len(points.usable), dtype=bool))
    assert (memory.known(front()) < 0).all()
    far = laser_scan([POST], stamp_s=20.0)
    memory.update(points_of(far, (200.0, 0.0, 0.0)), np.zeros(len(far), dtype=bool))
    assert not (memory.known(front()) < 0).any()  # 200 m away it is forgotten


def test_a_clock_that_is_set_back_does_not_stop_the_memory() -> None:
    memory = OccupancyMemory()
    nobody = np.zeros(721, dtype=bool)
    assert memory.update(points_of(laser_scan([POST], stamp_s=1e6)), nobody)
    assert memory.update(points_of(laser_scan([POST], stamp_s=5.0)), nobody)


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.floats(0.0, 0.5), st.floats(0.05, 0.4))
def test_a_map_holds_what_lies_within_its_margin(seed, margin, side) -> None:
    rng = np.random.default_rng(seed)
    occupied = rng.random((12, 17)) < 0.1
    origin = rng.normal(size=2)
    held = StaticMap(occupied, origin, side, margin)
    points = origin + rng.uniform(-1.0, 18.0, (200, 2)) * side
    rows, columns = np.nonzero(occupied)
    low = origin + np.column_stack((columns, rows)) * side
    away = np.maximum(low[None] - points[:, None], points[:, None] - (low[None] + side))
    distance = np.maximum(away, 0.0).max(axis=2, initial=0.0).min(axis=1, initial=np.inf)
    inside = ((points >= origin) & (points < origin + np.array([17, 12]) * side)).all(axis=1)
    got = held.holds(points)
    assert got[inside & (distance <= margin - 1e-9)].all()
    assert not got[distance > margin + side].any()
    assert not got[~inside].any()
    assert not held.holds(np.array([[np.nan, 0.5], [np.inf, 0.5]])).any()
