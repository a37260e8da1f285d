"""The robot follows its commands within its limits, driven by wheels that do not slip."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from nav_adapter import RobotState
from sim_tests import SimError
from sim_tests.actors.robot import CAMERA_FORWARD_M, CAMERA_HEIGHT_M, NOVA_CARTER, Amr
from sim_tests.world import Warehouse
from sim_tests.world.bullet import pybullet
from sim_tests.world.hall import WarehouseLayout

A_MPS2 = NOVA_CARTER.max_acceleration_mps2


@pytest.fixture
def hall() -> Iterator[Warehouse]:
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        yield warehouse


def _drive(
    warehouse: Warehouse, amr: Amr, duration_s: float, speed_mps: float, yaw_rate_radps: float = 0.0
) -> list[RobotState]:
    amr.command(speed_mps, yaw_rate_radps)
    states = []
    for _ in range(round(duration_s / warehouse.physics_dt_s)):
        amr.advance(warehouse.physics_dt_s)
        warehouse.step()
        states.append(amr.state(warehouse.time_s))
    return states


def _trapezoid(t_s: np.ndarray, speed_mps: float) -> np.ndarray:
    """Return the distance at constant acceleration up to ``speed_mps``."""
    ramp_s = speed_mps / A_MPS2
    return np.where(t_s < ramp_s, 0.5 * A_MPS2 * t_s**2, speed_mps * t_s - 0.5 * speed_mps * ramp_s)


@pytest.mark.parametrize(("speed_mps", "duration_s"), [(0.15, 12.0), (1.5, 4.1)])
def test_follows_the_ideal_trapezoid_straight_ahead(hall, speed_mps, duration_s) -> None:
    amr = Amr(hall, (-2.0, 0.0))
    states = _drive(hall, amr, duration_s, speed_mps)
    t = np.array([state.stamp_s for state in states])
    positions = np.array([state.position_odom_m for state in states])
    np.testing.assert_allclose(positions[:, 0] + 2.0, _trapezoid(t, speed_mps), atol=0.01)
    assert np.abs(positions[:, 1]).max() < 0.01
    assert states[-1].speed_mps == pytest.approx(speed_mps, rel=0.02)
    assert np.abs([state.heading_odom_rad for state in states]).max() < math.radians(0.2)


@pytest.mark.parametrize("speed_mps", [0.5, 1.5])
def test_stops_within_its_braking_distance(hall: Warehouse, speed_mps: float) -> None:
    amr = Amr(hall, (-2.0, 0.0))
    start = _drive(hall, amr, 2.5, speed_mps)[-1].position_odom_m
    states = _drive(hall, amr, 2.0, 0.0)
    way = float(np.linalg.norm(states[-1].position_odom_m - start))
    ideal = speed_mps**2 / (2.0 * NOVA_CARTER.max_deceleration_mps2)
    assert ideal - 0.01 < way < ideal + 0.01
    assert abs(states[-1].speed_mps) < 1e-3


def test_drives_a_circle_of_the_commanded_radius(hall: Warehouse) -> None:
    amr = Amr(hall, (2.0, -1.0))
    states = _drive(hall, amr, 9.0, 0.8, 0.8)
    points = np.array([state.position_odom_m for state in states[-1500:]])
    # Least-squares circle: x² + y² = 2 a x + 2 b y + c.
    design = np.column_stack([2.0 * points, np.ones(len(points))])
    (a, b, c), *_ = np.linalg.lstsq(design, (points**2).sum(axis=1), rcond=None)
    assert math.sqrt(c + a * a + b * b) == pytest.approx(1.0, abs=0.01)


def test_collision_shapes_fill_the_published_outline(hall: Warehouse) -> None:
    amr = Amr(hall)
    low, high = (
        np.array(corner)
        for corner in zip(
            *(
                pybullet.getAABB(amr.body, link, physicsClientId=hall.client)
                for link in range(-1, 2)
            ),
            strict=True,
        )
    )
    extent = np.array([high.max(axis=0), -low.min(axis=0)])[:, :2]
    # PyBullet pads its boxes by a contact margin of 2 cm.
    np.testing.assert_allclose(extent, [[0.3625, 0.25], [0.3625, 0.25]], atol=0.03)
    footprint = NOVA_CARTER.footprint_m
    np.testing.assert_allclose(np.ptp(footprint, axis=0), (0.725, 0.500))
    np.testing.assert_allclose(footprint.mean(axis=0), 0.0, atol=1e-12)
    masses = [
        pybullet.getDynamicsInfo(amr.body, link, physicsClientId=hall.client)[0]
        for link in range(-1, 2)
    ]
    assert sum(masses) == pytest.approx(98.0)


def test_camera_looks_along_the_heading_from_its_post(hall: Warehouse) -> None:
    amr = Amr(hall, (1.0, 2.0), math.pi / 2)
    np.testing.assert_allclose(
        amr.T_odom_camera[:3, 3], (1.0, 2.0 + CAMERA_FORWARD_M, CAMERA_HEIGHT_M), atol=1e-6
    )
    np.testing.assert_allclose(amr.T_odom_camera[:3, 2], (0.0, 1.0, 0.0), atol=1e-6)  # z: ahead
    np.testing.assert_allclose(amr.T_odom_camera[:3, 1], (0.0, 0.0, -1.0), atol=1e-6)  # y: down
    assert np.linalg.det(amr.T_base_camera) == pytest.approx(1.0)


def test_commands_beyond_the_limits_are_clipped(hall: Warehouse) -> None:
    amr = Amr(hall, (-2.0, 0.0))
    assert _drive(hall, amr, 2.0, 99.0)[-1].speed_mps == pytest.approx(1.5, rel=0.02)
    _drive(hall, amr, 2.0, 0.0)
    assert _drive(hall, amr, 1.5, 0.0, 99.0)[-1].yaw_rate_radps == pytest.approx(1.5, rel=0.02)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), "fast", None])
def test_invalid_commands_are_refused_and_change_nothing(hall: Warehouse, bad: object) -> None:
    amr, twin = Amr(hall, (0.0, -1.5)), Amr(hall, (0.0, 1.5))
    for robot in (amr, twin):
        robot.command(0.5, 0.1)
    with pytest.raises(SimError, match="speed_mps"):
        amr.command(bad, 0.0)  # type: ignore[arg-type]
    with pytest.raises(SimError, match="yaw_rate_radps"):
        amr.command(0.0, bad)  # type: ignore[arg-type]
    with pytest.raises(SimError, match="dt_s"):
        amr.advance(bad)  # type: ignore[arg-type]
    for _ in range(60):
        for robot in (amr, twin):
            robot.advance(hall.physics_dt_s)
        hall.step()
    assert amr.state(0.0).speed_mps == pytest.approx(twin.state(0.0).speed_mps, abs=1e-3)
    with pytest.raises(SimError, match="position_odom_m"):
        Amr(hall, (0.0, bad))
