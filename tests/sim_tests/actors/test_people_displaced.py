"""Recorded people whom the robot forces off their paths, and people who are away."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from sim_tests.actors.behaviour import (
    ALONE,
    Displaced,
    PersonMotion,
    Replayed,
    RobotBody,
    Surroundings,
    displaced_people,
    read_recordings,
    replayed_people,
)

NO_BOXES = np.empty((0, 4))
STEP_S = 1.0 / 60.0
SPEED_MPS = 1.2


@pytest.fixture
def table(tmp_path: Path) -> Path:
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


def walk(person: Displaced, robot_mps: float, start_x_m: float, y_m: float) -> list[PersonMotion]:
    """Motions at 60 Hz for 18 s before a robot that comes along x."""
    motions = []
    for tick in range(round(18.0 / STEP_S)):
        t_s = tick * STEP_S
        robot = robot_at(start_x_m - robot_mps * t_s, y_m, robot_mps)
        motions.append(person.motion(t_s, Surroundings(robot, (), lambda: True)))
    return motions


def gap_m(motion: PersonMotion, robot: RobotBody) -> float:
    x, y = motion.position_odom_m.tolist()
    return math.dist(robot.nearest_point_m(x, y), (x, y))


def test_a_far_robot_changes_nothing(table: Path) -> None:
    (person,) = displaced_people(table, NO_BOXES)
    (recorded,) = replayed_people(table)
    for tick, motion in enumerate(walk(person, 1.0, 20.0, 9.0)):
        exact = recorded.motion(tick * STEP_S, ALONE)
        np.testing.assert_array_equal(motion.position_odom_m, exact.position_odom_m)
        np.testing.assert_array_equal(motion.velocity_odom_mps, exact.velocity_odom_mps)
        assert motion.heading_odom_rad == pytest.approx(exact.heading_odom_rad)
    assert person.farthest_m == 0.0


@pytest.mark.parametrize("robot_mps", [0.0, 1.2])
def test_a_person_in_the_way_goes_round_the_robot_and_comes_back_in_time(
    table: Path, robot_mps: float
) -> None:
    (person,) = displaced_people(table, NO_BOXES)
    (recorded,) = replayed_people(table)
    start_x_m = 6.0 + robot_mps * 6.0
    motions = walk(person, robot_mps, start_x_m, 0.05)
    off_m = []
    for tick, motion in enumerate(motions):
        t_s = tick * STEP_S
        robot = robot_at(start_x_m - robot_mps * t_s, 0.05)
        assert gap_m(motion, robot) > 0.2
        exact = recorded.motion(t_s, ALONE).position_odom_m
        off_m.append(float(np.linalg.norm(motion.position_odom_m - exact)))
    assert 0.2 < max(off_m) < 2.0
    assert person.farthest_m == pytest.approx(max(off_m))
    # Before the robot is near, and again at the end, the recording is met.
    assert max(off_m[:60]) == 0.0
    assert max(off_m[-60:]) < 0.011
    assert not person.displaced
    # As fast and as hard as people are.
    steps = np.diff([each.position_odom_m for each in motions], axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 1.61 * STEP_S + 0.011
    turns = np.diff(np.unwrap([each.heading_odom_rad for each in motions]))
    assert np.abs(turns).max() < 0.2


def test_a_displaced_person_does_not_walk_through_a_wall(table: Path) -> None:
    walls = np.array([[-1.0, 0.7, 14.0, 0.9], [-1.0, -0.9, 14.0, -0.7]])
    (person,) = displaced_people(table, walls)
    motions = walk(person, 1.0, 12.0, 0.0)
    assert person.farthest_m > 0.1
    assert max(abs(each.position_odom_m[1]) for each in motions) < 0.46


def test_a_touched_person_steps_back_and_a_held_one_stays(table: Path) -> None:
    (person,) = displaced_people(table, NO_BOXES)
    robot = robot_at(50.0, 0.0)
    around = Surroundings(robot, (), lambda: True)
    before = [person.motion(tick * STEP_S, around) for tick in range(240)][-1]
    person.touch(1.0, 0.0)
    after = person.motion(240 * STEP_S, around)
    assert after.position_odom_m[0] < before.position_odom_m[0]
    assert person.displaced
    person.hold()
    held = person.motion(240 * STEP_S, around)
    np.testing.assert_allclose(held.position_odom_m, before.position_odom_m, atol=1e-9)


def test_people_who_leave_are_away_before_and_after_their_rows(table: Path) -> None:
    (recording,) = read_recordings(table)
    person, stays = Replayed(recording, leaves=True), Replayed(recording)
    for t_s, away in ((0.9, True), (1.0, False), (7.3, False), (11.0, False), (11.1, True)):
        assert person.is_away(t_s) == away
        assert not stays.is_away(t_s)
        motion, here = person.motion(t_s, ALONE), stays.motion(t_s, ALONE)
        assert motion.away == away
        moved = motion.position_odom_m - here.position_odom_m
        np.testing.assert_allclose(moved, [1000.0 if away else 0.0, 0.0])
        feet = np.array(motion.feet.feet)[:, :2] - np.array(here.feet.feet)[:, :2]
        np.testing.assert_allclose(feet, np.repeat([moved], 2, axis=0), atol=1e-9)
    (reacting,) = displaced_people(table, NO_BOXES, leaves=True)
    motions = walk(reacting, 0.0, 6.0, 0.0)
    assert motions[0].position_odom_m[0] > 900.0
    assert motions[120].position_odom_m[0] < 5.0
    assert motions[-1].position_odom_m[0] > 900.0
