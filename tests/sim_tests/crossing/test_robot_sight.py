"""Collision bodies far from the robot are left behind, and lines of sight do not notice it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from sim_tests.actors.body import Worker
from sim_tests.actors.robot import Amr
from sim_tests.crossing._audience import RobotSight, near_robot
from sim_tests.world import Warehouse, sees
from sim_tests.world.bullet import pybullet
from sim_tests.world.hall import WarehouseLayout


@pytest.fixture
def hall() -> Iterator[Warehouse]:
    with Warehouse(WarehouseLayout.named("crossing")) as warehouse:
        yield warehouse


def body_x_m(worker: Worker) -> float:
    return float(pybullet.getBasePositionAndOrientation(worker.body, worker.client)[0][0])


def test_a_body_left_behind_follows_when_it_is_asked_for(hall: Warehouse) -> None:
    worker, other = (Worker(hall, position_odom_m=(2.0, 0.0)) for _ in range(2))
    worker.place((5.0, 0.0), 0.3, 0.4, 1.2, collides=False)
    other.place((5.0, 0.0), 0.3, 0.4, 1.2)
    assert worker.collision_left_behind
    assert body_x_m(worker) == pytest.approx(2.0, abs=0.1)
    assert np.array_equal(worker.eyes_odom_m, other.eyes_odom_m)
    assert np.array_equal(worker.keypoints_odom_m, other.keypoints_odom_m)
    worker.place_collision_body()
    assert not worker.collision_left_behind
    assert body_x_m(worker) == body_x_m(other)
    states = [
        pybullet.getJointStatesMultiDof(each.body, list(range(15)), each.client)
        for each in (worker, other)
    ]
    assert states[0] == states[1]


def test_a_person_who_has_walked_into_the_line_hides_the_robot(hall: Warehouse) -> None:
    amr = Amr(hall, (0.0, 0.0))
    looks, blocks = (Worker(hall, position_odom_m=(6.0, y_m)) for y_m in (0.0, 3.0))
    sight = RobotSight(amr, (looks, blocks))
    looks.place((6.0, 0.0), np.pi, collides=False)
    assert sight.seen_by(looks)
    blocks.place((3.0, 0.0), np.pi / 2, collides=False)
    assert not sight.seen_by(looks)
    # One who has walked on does not hide it any more, although their body was left behind.
    blocks.place((3.0, 4.0), np.pi / 2, collides=False)
    assert sight.seen_by(looks)


def test_lines_of_sight_are_those_of_bodies_in_place(hall: Warehouse) -> None:
    rng = np.random.default_rng(0)
    amr = Amr(hall, (0.0, 0.0))
    left_behind = [Worker(hall) for _ in range(5)]
    sight = RobotSight(amr, left_behind)
    for _ in range(6):
        for worker in left_behind:
            worker.place(rng.uniform(-6.0, 6.0, 2), rng.uniform(-3.0, 3.0), collides=False)
        found = [sight.seen_by(worker) for worker in left_behind]
        for worker in left_behind:
            worker.place_collision_body()
        camera = amr.T_odom_camera[:3, 3]
        assert found == [sees(each, camera, frozenset({amr.body})) for each in left_behind]


def test_a_body_left_behind_near_the_robot_counts_as_near(hall: Warehouse) -> None:
    worker = Worker(hall, position_odom_m=(1.0, 0.0))
    assert near_robot(worker, (9.0, 0.0), (0.0, 0.0))
    worker.place((9.0, 0.0), 0.0)
    assert not near_robot(worker, (9.5, 0.0), (0.0, 0.0))
    assert near_robot(worker, (3.0, 0.0), (0.0, 0.0))
