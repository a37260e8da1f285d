"""A scan that contradicts the map shows that the robot is elsewhere: nobody is part of the map."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from laser_scenes import laser_scan, points_of, pose, ranges_of, two_legs

from perception.laser import LegDetector, LegDetectorConfig, MapCells, ScanPoints, StaticMap

ONCE = LegDetectorConfig(learn=False)
PILLARS = [(3.0, 2.0, 0.3), (-4.0, -2.5, 0.3), (1.0, -3.5, 0.2)]
SIDE_M = 0.05


def map_cells() -> MapCells:
    """Return the map of the room and its pillars, as a scanner would have drawn it."""
    angles = np.linspace(-math.pi, math.pi, 20_000)
    ranges = ranges_of([], angles)
    drawn = [ranges[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))]
    ring = np.column_stack((np.cos(angles[::50]), np.sin(angles[::50])))
    drawn += [np.array([x, y]) + radius * ring for x, y, radius in PILLARS]
    cells = np.unique(np.floor(np.concatenate(drawn) / SIDE_M), axis=0)
    return MapCells((cells + 0.5) * SIDE_M, SIDE_M)


CELLS = map_cells()


def held(T: np.ndarray) -> StaticMap:
    """Return the map where localisation has it in odom."""
    return CELLS.near(T, np.zeros(2), 15.0)


def seen(people=(), place=(0.0, 0.0, 0.0), seed: int = 0, rays: int = 721) -> ScanPoints:
    """Return a scan of the room, with people, from a place in it."""
    x, y, yaw = place
    low = math.degrees(yaw) - 135.0
    circles = [*PILLARS, *(leg for person in people for leg in two_legs(*person))]
    scan = laser_scan(circles, low=low, noise=0.015, seed=seed, origin=(x, y), rays=rays)
    return points_of(scan, (x, y, 0.0))


places = st.tuples(st.floats(-2.5, 2.5), st.floats(-1.0, 2.0), st.floats(-math.pi, math.pi))


@settings(max_examples=60, deadline=None)
@given(places, st.integers(0, 999), st.integers(0, 8), st.floats(-math.pi, math.pi))
def test_people_and_an_error_within_the_margin_contradict_nothing(place, seed, crowd, way) -> None:
    rng = np.random.default_rng(seed)
    x, y, _ = place
    around = rng.uniform(-math.pi, math.pi, crowd)
    people = [(x + 1.5 * math.cos(a), y + 1.5 * math.sin(a), a) for a in around]
    off = pose(0.06 * math.cos(way), 0.06 * math.sin(way), 0.005)
    assert held(off).is_contradicted(seen(people, place, seed)) is False


@settings(max_examples=60, deadline=None)
@given(places, st.integers(0, 999), st.floats(0.6, 3.0), st.floats(-math.pi, math.pi))
def test_a_map_beside_its_place_is_contradicted(place, seed, off_m, way) -> None:
    """By a scanner all around, to which every side of the room shows."""
    off = pose(off_m * math.cos(way), off_m * math.sin(way), 0.0)
    points = seen([], place, seed, rays=960)
    assert held(off).is_contradicted(points) is True


@settings(max_examples=20, deadline=None)
@given(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-3.1, 3.1), st.booleans())
def test_the_judgement_does_not_depend_on_the_odom_frame(x, y, yaw, lost) -> None:
    T = pose(x, y, yaw)
    in_map = pose(1.2, -0.9, 0.0) if lost else np.eye(4)
    scan = laser_scan(PILLARS, noise=0.015)
    points = points_of(scan, (x, y, yaw))
    moved = CELLS.near(T @ in_map, np.array([x, y]), 15.0)
    assert moved.is_contradicted(points) is lost


def test_too_little_of_a_map_tells_nothing() -> None:
    one = MapCells(np.array([[4.0, 0.0], [4.0, SIDE_M]]), SIDE_M).near(np.eye(4), np.zeros(2), 15.0)
    assert one.is_contradicted(seen()) is None


def test_somebody_under_a_pillar_of_a_lost_map_is_found() -> None:
    """They are part of the map only while the map is where it is in truth."""
    person = (2.0, 0.5, 0.0)
    off = pose(person[0] - 3.0, person[1] - 2.0, 0.0)
    points = seen([person])
    assert len(LegDetector(ONCE).detect(points)) == 1
    lost = LegDetector(ONCE, static_map=held(off))
    (found,) = lost.detect(points)
    assert lost.map_contradicted
    assert np.allclose(found.position_odom_m, person[:2], atol=0.15)
    lost.static_map = held(np.eye(4))
    assert len(lost.detect(points)) == 1
    assert not lost.map_contradicted
