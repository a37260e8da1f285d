"""Properties of all measures: the world's axes and people who are away change no row."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_scenes import crossing, straight, walking

from nav_adapter.rigid import Motion
from sim_tests.crossing._separations import Approach, ContactEvent
from sim_tests.study.measures import COLUMNS, measure

T_S = np.round(np.arange(0.0, 3.001, 0.05), 2)

places = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
velocities = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
#: Two people, and the turns, shifts and mirrors of a world.
people = st.lists(st.tuples(places, velocities), min_size=1, max_size=2)
robots = st.tuples(st.floats(-0.5, 1.5), st.floats(-0.5, 0.5), st.floats(-1.5, 1.5))
worlds = st.tuples(
    st.floats(-math.pi, math.pi), st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.booleans()
)


def row(robot, walks, world=(0.0, 0.0, 0.0, False), away=0):
    """The row of a robot on a curve among people who walk on, in a world that is moved.

    Everybody touches the robot once; the last ones of ``away`` people are never there.
    """
    angle, x_m, y_m, mirrored = world
    side, frame = -1.0 if mirrored else 1.0, Motion(x_m, y_m, angle)

    def placed(x, y):
        return frame.point(x, side * y)

    def turned(x, y):
        return Motion(0.0, 0.0, angle, x, side * y).velocity_mps

    def drives(t):
        now = Motion(0.0, 0.0, 0.4, *robot).at(t)
        return (
            *placed(now.x_m, now.y_m),
            angle + side * now.heading_rad,
            *(now.forward_mps, side * now.left_mps, side * now.yaw_rate_radps),
        )

    contacts = [
        ContactEvent(1.0 + i, i, Approach(0.0, turned(1.0, 0.0), turned(*robot[:2]), turned(*v)))
        for i, (_, v) in enumerate(walks)
    ]
    moved = [walking(placed(*place), turned(*velocity)) for place, velocity in walks]
    result = crossing(
        T_S,
        drives,
        [*moved, *[lambda t: None] * away],
        looks=lambda t, person: 0.5 * person < t % 2.0 < 1.0,
        tracked=lambda t, person: (0.6, 0.5),
        contacts=contacts,
        time_without_people_s=2.5,
        length_without_people_m=2.0,
    )
    return measure(result)


@settings(max_examples=25, deadline=None)
@given(robots, people, worlds)
def test_no_measure_depends_on_the_axes_of_the_world(robot, walks, world) -> None:
    # A speed on the edge between standing and moving may be rounded to either side.
    robot = tuple(round(value, 1) for value in robot)
    before, after = row(robot, walks), row(robot, walks, world)
    for name, column in COLUMNS.items():
        value, other = getattr(before, name), getattr(after, name)
        if column.kind == "number" and value is not None:
            assert other == pytest.approx(value, rel=1e-3, abs=1e-4), name
        else:
            assert other == value, name


@settings(max_examples=15, deadline=None)
@given(robots, people, st.integers(1, 2))
def test_people_who_are_away_change_no_measure(robot, walks, away) -> None:
    assert row(robot, walks, away=away) == row(robot, walks)


def test_somebody_who_leaves_counts_while_there() -> None:
    def leaves(t):
        return (2.0, 0.0, 0.0, 0.0) if t < 1.0 else None

    stays = walking((2.0, 0.0), (0.0, 0.0))
    left, stayed = (measure(crossing(T_S, straight(0.5), [person])) for person in (leaves, stays))
    assert left.min_separation_m == pytest.approx(2.0 - 0.5 * 0.95 - 0.3625 - 0.3)
    assert stayed.min_separation_m < left.min_separation_m
    assert 0.0 < left.step_out_never < stayed.step_out_never
    assert left.personal_s < stayed.personal_s
