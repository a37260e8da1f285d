"""Recorded people: exact at their rows, off their paths where the robot forces them, or away."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sim_tests import SimError
from sim_tests.actors.behaviour import (
    ALONE,
    Person,
    PersonMotion,
    RobotBody,
    Surroundings,
    read_recordings,
)
from sim_tests.crossing._stage import recorded_people

NO_BOXES = np.empty((0, 4))
TABLE = """t_s, id, x_m, y_m, heading_rad, head_yaw_rad
0.0, anna, 0.0, 0.0, 3.0, 0.0
0.4, anna, 0.5, 0.1, 3.1, 0.2
0.0, 7, 5.0, 5.0, ,
0.8, anna, 1.0, 0.1, -3.1, -0.4
1.0, 7, 5.0, 6.0, ,
"""


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "people.csv"
    path.write_text(TABLE)
    return path


def test_rows_are_met_exactly(table):
    anna, seven = recorded_people(table, NO_BOXES)
    assert (anna.spec.name, seven.spec.name) == ("anna", "7")
    assert anna.spec.look != seven.spec.look
    for t, x, y, heading, yaw in (
        (0.0, 0.0, 0.0, 3.0, 0.0),
        (0.4, 0.5, 0.1, 3.1, 0.2),
        (0.8, 1.0, 0.1, -3.1, -0.4),
    ):
        motion = anna.step(t, ALONE)
        np.testing.assert_allclose(motion.position_odom_m, [x, y], atol=1e-12)
        assert math.remainder(motion.heading_odom_rad - heading, math.tau) == pytest.approx(0.0)
        assert motion.head_yaw_rad == pytest.approx(yaw, abs=1e-12)


def test_between_rows_velocity_is_the_slope_and_headings_turn_the_short_way(table):
    anna, seven = recorded_people(table, NO_BOXES)
    for t in np.linspace(0.02, 0.78, 20):
        before, now, after = (anna.step(t + dt, ALONE) for dt in (-1e-5, 0.0, 1e-5))
        slope = (after.position_odom_m - before.position_odom_m) / 2e-5
        np.testing.assert_allclose(now.velocity_odom_mps, slope, atol=1e-3)
        assert 3.0 <= now.heading_odom_rad <= math.tau - 3.1 + 1e-9
    # Without headings the body faces along its path; after the rows it stands.
    assert seven.step(0.5, ALONE).heading_odom_rad == pytest.approx(math.pi / 2)
    last = seven.step(4.0, ALONE)
    np.testing.assert_allclose(last.position_odom_m, [5.0, 6.0])
    np.testing.assert_allclose(last.velocity_odom_mps, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "misses t_s, id, x_m, y_m"),
        ("t_s,id,x_m\n", "misses y_m"),
        ("t_s,id,x_m,y_m,speed\n0,a,1,1,1\n", "unknown columns 'speed'"),
        ("t_s,id,x_m,y_m,x_m\n", "the header has twice x_m"),
        ("t_s,id,x_m,y_m\n", "holds no rows"),
        ("t_s,id,x_m,y_m\n0,a,1,north\n", "line 2: y_m must be a finite number, got 'north'"),
        ("t_s,id,x_m,y_m\n0,a,1\n", "line 2: y_m must be a finite number"),
        ("t_s,id,x_m,y_m\n0,a,nan,1\n", "line 2: x_m must be a finite number"),
        ("t_s,id,x_m,y_m\n0,,1,1\n", "line 2: id is empty"),
        ("t_s,id,x_m,y_m\n0,a,1,1\n0,a,2,1\n", "two rows for t_s = 0 s"),
        ("t_s,id,x_m,y_m\n0,a,1,1\n0.1,a,9,1\n", "line 3: 'a' moves 8 m in 0.1 s"),
        (
            "t_s,id,x_m,y_m,heading_rad\n0,a,1,1,0\n1,a,2,1,\n",
            "line 3: heading_rad of 'a' is empty here",
        ),
    ],
)
def test_invalid_tables_are_refused(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(SimError, match=message):
        read_recordings(path)


STEP_S = 1.0 / 60.0
SPEED_MPS = 1.2


@pytest.fixture
def bend(tmp_path: Path) -> Path:
    """Somebody who walks 12 m along x from 1 s on, with a bend."""
    rows = ["t_s,id,x_m,y_m"]
    for tick in range(101):
        x_m = 0.1 * SPEED_MPS * tick
        rows.append(f"{1.0 + 0.1 * tick:.1f},a,{x_m:.4f},{0.3 * math.sin(0.5 * x_m):.4f}")
    path = tmp_path / "people.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def robot_at(x_m: float, y_m: float, speed_mps: float = 0.0) -> RobotBody:
    """A robot that drives towards negative x."""
    return RobotBody(x_m, y_m, math.pi, -speed_mps, 0.0, 0.36, 0.25, (x_m, y_m, 1.0))


def walk(person: Person, robot_mps: float, start_x_m: float, y_m: float) -> list[PersonMotion]:
    """Motions at 60 Hz for 18 s before a robot that comes along x."""
    motions = []
    for tick in range(round(18.0 / STEP_S)):
        t_s = tick * STEP_S
        robot = robot_at(start_x_m - robot_mps * t_s, y_m, robot_mps)
        motions.append(person.step(t_s, Surroundings(robot, (), lambda: True)))
    return motions


def gap_m(motion: PersonMotion, robot: RobotBody) -> float:
    x, y = motion.position_odom_m.tolist()
    return math.dist(robot.nearest_point_m(x, y), (x, y))


def test_a_far_robot_changes_nothing(bend: Path) -> None:
    (person,) = recorded_people(bend, NO_BOXES, reacts=True)
    (recorded,) = recorded_people(bend, NO_BOXES)
    for tick, motion in enumerate(walk(person, 1.0, 20.0, 9.0)):
        exact = recorded.step(tick * STEP_S, ALONE)
        np.testing.assert_array_equal(motion.position_odom_m, exact.position_odom_m)
        np.testing.assert_array_equal(motion.velocity_odom_mps, exact.velocity_odom_mps)
        assert motion.heading_odom_rad == pytest.approx(exact.heading_odom_rad)
    assert person.on_track


@pytest.mark.parametrize("robot_mps", [0.0, 1.2])
def test_a_person_in_the_way_goes_round_the_robot_and_comes_back_in_time(bend, robot_mps) -> None:
    (person,) = recorded_people(bend, NO_BOXES, reacts=True)
    (recorded,) = recorded_people(bend, NO_BOXES)
    start_x_m = 6.0 + robot_mps * 6.0
    motions = walk(person, robot_mps, start_x_m, 0.05)
    off_m = []
    for tick, motion in enumerate(motions):
        t_s = tick * STEP_S
        robot = robot_at(start_x_m - robot_mps * t_s, 0.05)
        assert gap_m(motion, robot) > 0.2
        exact = recorded.step(t_s, ALONE).position_odom_m
        off_m.append(float(np.linalg.norm(motion.position_odom_m - exact)))
    assert 0.2 < max(off_m) < 2.0
    # Before the robot is near, and again at the end, the recording is met.
    assert max(off_m[:60]) == 0.0
    assert max(off_m[-60:]) < 0.011
    assert person.on_track
    # As fast and as hard as people are.
    steps = np.diff([each.position_odom_m for each in motions], axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 1.61 * STEP_S + 0.011
    turns = np.diff(np.unwrap([each.heading_odom_rad for each in motions]))
    assert np.abs(turns).max() < 0.2


def test_a_displaced_person_does_not_walk_through_a_wall(bend: Path) -> None:
    walls = np.array([[-1.0, 0.7, 14.0, 0.9], [-1.0, -0.9, 14.0, -0.7]])
    (person,) = recorded_people(bend, walls, reacts=True)
    motions = walk(person, 1.0, 12.0, 0.0)
    assert not all(each.position_odom_m.tolist() == 0.0 for each in motions)
    assert max(abs(each.position_odom_m[1]) for each in motions) < 0.46


def test_a_touched_person_steps_back_and_a_held_one_stays(bend: Path) -> None:
    (person,) = recorded_people(bend, NO_BOXES, reacts=True)
    robot = robot_at(50.0, 0.0)
    around = Surroundings(robot, (), lambda: True)
    before = [person.step(tick * STEP_S, around) for tick in range(240)][-1]
    after = person.step(240 * STEP_S, replace(around, touches=((1.0, 0.0),)))
    assert after.position_odom_m[0] < before.position_odom_m[0]
    assert not person.on_track
    held = person.step(240 * STEP_S, replace(around, held=True))
    np.testing.assert_allclose(held.position_odom_m, before.position_odom_m, atol=1e-9)
    # Somebody who does not react walks on, whatever the robot does.
    (indifferent,) = recorded_people(bend, NO_BOXES)
    for event in ({}, {"touches": ((1.0, 0.0),)}, {"held": True}):
        indifferent.step(4.0, replace(around, **event))
    assert indifferent.on_track


def test_people_who_leave_are_away_before_and_after_their_rows(bend: Path) -> None:
    (person,), (stays,) = (
        recorded_people(bend, NO_BOXES, leaves=leaves) for leaves in (True, False)
    )
    for t_s, away in ((0.9, True), (1.0, False), (7.3, False), (11.0, False), (11.1, True)):
        motion, here = person.step(t_s, ALONE), stays.step(t_s, ALONE)
        assert motion.away == away
        assert not here.away
        moved = motion.position_odom_m - here.position_odom_m
        np.testing.assert_allclose(moved, [1000.0 if away else 0.0, 0.0])
        feet = np.array(motion.feet.feet)[:, :2] - np.array(here.feet.feet)[:, :2]
        np.testing.assert_allclose(feet, np.repeat([moved], 2, axis=0), atol=1e-9)
    (reacting,) = recorded_people(bend, NO_BOXES, reacts=True, leaves=True)
    motions = walk(reacting, 0.0, 6.0, 0.0)
    assert motions[0].position_odom_m[0] > 900.0
    assert motions[120].position_odom_m[0] < 5.0
    assert motions[-1].position_odom_m[0] > 900.0
