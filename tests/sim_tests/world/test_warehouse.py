"""The warehouse: collision boxes, physics in closed form, independent and repeatable worlds."""

from __future__ import annotations

import importlib.util
import re
import sys

import numpy as np
import pytest

from perception import Camera
from perception.installation import install_command
from sim_tests.actors.body import Worker
from sim_tests.actors.robot import Amr
from sim_tests.world import GRAVITY_MPS2, ROBOT_GROUP, Warehouse, bullet
from sim_tests.world.bullet import pybullet
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.errors import MissingSimulatorError
from sim_tests.world.hall import LAYOUTS, WarehouseLayout


def _ball(warehouse: Warehouse, position_m: tuple[float, float, float]) -> int:
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_SPHERE, radius=0.1, physicsClientId=warehouse.client
    )
    ball = pybullet.createMultiBody(
        1.0, shape, basePosition=position_m, physicsClientId=warehouse.client
    )
    pybullet.changeDynamics(
        ball, -1, linearDamping=0.0, restitution=0.0, physicsClientId=warehouse.client
    )
    pybullet.setCollisionFilterGroupMask(
        ball, -1, ROBOT_GROUP, -1, physicsClientId=warehouse.client
    )
    return int(ball)


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_planners_boxes_are_those_of_the_physics(name: str) -> None:
    layout = WarehouseLayout.named(name)
    rng = np.random.default_rng(0)
    low, high = (layout.x_min_m, layout.y_min_m), (layout.x_max_m, layout.y_max_m)
    points = rng.uniform(low, high, (400, 2))
    with Warehouse(layout) as warehouse:
        hits = pybullet.rayTestBatch(
            [(*point, 10.0) for point in points.tolist()],
            [(*point, -1.0) for point in points.tolist()],
            physicsClientId=warehouse.client,
        )
        boxes = warehouse.obstacle_boxes_odom
    tops = np.array([hit[3][2] for hit in hits])
    under = np.all((points[:, None] > boxes[:, :2]) & (points[:, None] < boxes[:, 2:]), axis=2)
    expected = np.where(under, layout.obstacle_heights_m, 0.0).max(axis=1)
    assert 20 < np.count_nonzero(expected) < 380
    np.testing.assert_allclose(tops, expected, atol=1e-6)


def test_a_ball_falls_as_newton_says_and_stays_on_the_floor() -> None:
    with Warehouse() as warehouse:
        ball = _ball(warehouse, (0.0, 0.0, 2.1))
        steps = 120
        for _ in range(steps):
            warehouse.step()
        height = pybullet.getBasePositionAndOrientation(ball, physicsClientId=warehouse.client)[0][
            2
        ]
        # Semi-implicit Euler: n (n + 1) / 2 steps of g dt² instead of n² / 2.
        fallen = 0.5 * steps * (steps + 1) * GRAVITY_MPS2 * warehouse.physics_dt_s**2
        assert warehouse.time_s == pytest.approx(0.5)
        assert height == pytest.approx(2.1 - fallen, abs=1e-6)
        for _ in range(240):
            warehouse.step()
        position, _ = pybullet.getBasePositionAndOrientation(ball, physicsClientId=warehouse.client)
        assert position[2] == pytest.approx(0.1, abs=1e-3)


def _run() -> bytes:
    """Return the poses and one image of a drive past a worker, as bytes."""
    with Warehouse() as warehouse:
        amr, worker = Amr(warehouse), Worker(warehouse, 1.8)
        amr.command(1.2, 0.2)
        trace = []
        for step in range(120):
            if step % 4 == 0:
                worker.place((3.0, 1.0 - 0.01 * step), -1.5, 0.01 * step, 1.2, 0.3, 0.1)
            amr.advance(warehouse.physics_dt_s)
            warehouse.step()
            trace.append(amr.T_odom_camera)
        camera = Camera.from_fov(160, 120, 1.0)
        view = CameraRenderer(warehouse).render(camera, amr.T_odom_camera)
        return np.array(trace).tobytes() + view.rgb.tobytes() + view.depth_m.tobytes()


def test_same_inputs_give_the_same_bytes_whatever_other_worlds_do() -> None:
    first_run = _run()
    with Warehouse(WarehouseLayout.named("open")) as other:
        _ball(other, (1.0, 0.0, 0.5))
        other.step()
        assert _run() == first_run
        other.step()
        assert other.time_s == pytest.approx(2 * other.physics_dt_s)


def test_a_missing_simulator_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)
    assert bullet.__file__ is not None
    spec = importlib.util.spec_from_file_location("sim_tests.world.bullet_again", bullet.__file__)
    assert spec is not None
    assert spec.loader is not None
    again = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(again)
    for first_use in (again.require_pybullet, lambda: again.pybullet.connect):
        with pytest.raises(MissingSimulatorError, match=re.escape(install_command("sim,bench"))):
            first_use()
