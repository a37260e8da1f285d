"""Simulated scanners measure analytic walls and cylinders, and the triangles of lines of sight."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from triangle_hits import shares_met

from perception.laser import RobotMotion, scan_points
from sim_tests.actors.robot import Amr, RobotLook
from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout, box
from sim_tests.world.scanner import DIAGONAL_SCANNERS, ScannerSpec, ScanScene, SimulatedScanner
from sim_tests.world.sightlines import PlacedSurface, TriangleSet
from training.round_meshes import tube

EXACT = {"noise_std_m": 0.0, "dropout_rate": 0.0, "dark_dropout_rate": 0.0}
CENTRE = ScannerSpec(x_m=0.0, field_of_view_deg=(-180.0, 180.0), resolution_deg=0.25, **EXACT)
LEVEL = RobotMotion(1.0, np.eye(4))


class Thing:
    """A mesh that stands still in odom."""

    def __init__(self, mesh, reflectance: float = 1.0) -> None:
        surface = (mesh.vertices_m, mesh.indices.reshape(-1, 3))
        self.placed = PlacedSurface(TriangleSet([surface]), np.eye(4)[None])
        low, high = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
        self.box, self.leg_reflectance = np.array([low, high]), reflectance

    def reach_odom_m(self):
        return self.box

    def surface(self, detail):
        return self.placed


def scanner_of(*things, seed: int = 0, **spec) -> SimulatedScanner:
    settings_of = CENTRE.model_copy(update=spec)
    return SimulatedScanner(ScanScene(None, 0, things), settings_of, np.random.default_rng(seed))


def tilted(roll: float, pitch: float) -> RobotMotion:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", [roll, pitch, 0.3]).as_matrix()
    return RobotMotion(1.0, T)


@pytest.mark.parametrize("place", [(-1.5, 0.01), (0.4, 2.2)])
def test_a_cylinder_is_measured_to_the_error_of_its_facets(place) -> None:
    """A leg-sized cylinder, also behind the robot where the first and last rays meet."""
    radius, sides = 0.06, 256
    mesh = tube([(*place, z, radius, radius) for z in (1.0, 0.0)], sides)
    scan = scanner_of(Thing(mesh), scan_share=0.0).scan(LEVEL)
    angles, distance = scan.angles_rad, math.hypot(*place)
    off = np.angle(np.exp(1j * (angles - math.atan2(place[1], place[0]))))
    across = distance * np.sin(off)
    ahead = distance * np.cos(off)
    expected = np.where(
        (np.abs(across) < radius) & (ahead > 0.0),
        ahead - np.sqrt(np.maximum(radius**2 - across**2, 0.0)),
        np.inf,
    )
    # Beside a facet's middle the mesh lies inside the circle by its sagitta; at the rim of the
    # cylinder a ray may pass it altogether.
    sagitta = radius * (1.0 - math.cos(math.pi / sides))
    clear = np.abs(np.abs(across) - radius) > 0.002
    assert np.isfinite(expected[clear]).sum() > 5
    np.testing.assert_allclose(scan.ranges_m[clear], expected[clear], atol=20.0 * sagitta)


@pytest.mark.parametrize("seed", range(2))
def test_tilted_sweeps_agree_with_a_test_of_every_ray_and_triangle(seed) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(150, 1, 3)) * 2.0 + 0.5 * rng.normal(size=(150, 3, 3))
    rows = np.arange(450).reshape(-1, 3)
    thing = Thing(box((0.0, 0.0, 0.0), (20.0, 20.0, 20.0)))
    thing.placed = PlacedSurface(TriangleSet([(corners.reshape(-1, 3), rows)]), np.eye(4)[None])
    scanner = scanner_of(thing, scan_share=0.0, range_min_m=0.0, resolution_deg=0.9)
    motion = tilted(*rng.uniform(-0.4, 0.4, 2))
    scan = scanner.scan(motion)
    T = motion.T_odom_base @ scanner.mounting.T_base_scanner
    rays = np.column_stack((np.cos(scan.angles_rad), np.sin(scan.angles_rad), 0 * scan.angles_rad))
    met = [shares_met(corners, T[:3, 3], T[:3, :3] @ ray) for ray in rays]
    expected = [each[each > 0.0].min(initial=np.inf) for each in met]
    assert 50 < np.isfinite(expected).sum() < 350
    np.testing.assert_allclose(scan.ranges_m, expected, atol=1e-7)


def test_the_diagonal_scanners_see_all_around_and_not_their_robot() -> None:
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        amr = Amr(warehouse)
        warehouse.add_actor(RobotLook.of(amr))
        scene = ScanScene(warehouse.layout, 0, warehouse.actors)
        angles = []
        for spec in DIAGONAL_SCANNERS:
            scanner = SimulatedScanner(scene, spec, np.random.default_rng(0))
            scan = scanner.scan(RobotMotion(0.0, amr.T_odom_base))
            assert (scanner.hit_by == -1).all()
            points = scan_points(scan, scanner.mounting, RobotMotion(0.0, amr.T_odom_base))
            x, y = points.points_base_m[points.usable][:, :2].T
            angles.append(np.arctan2(y, x))
        sorted_angles = np.sort(np.concatenate(angles))
        assert np.diff(sorted_angles, append=sorted_angles[0] + math.tau).max() < 0.05
        inside = SimulatedScanner(
            scene, CENTRE.model_copy(update={"x_m": 0.3}), np.random.default_rng(0)
        )
        scan = inside.scan(RobotMotion(0.0, amr.T_odom_base))
        assert (inside.hit_by == 0).all()  # the robot's own body surrounds it
        assert not (scan.ranges_m > 1.0).any()


@pytest.mark.parametrize(
    ("velocity_mps", "yaw_rate_radps"), [((-0.8, 0.0), -0.5), ((0.5, 0.7), 1.2)]
)
def test_the_scanners_of_a_moving_robot_see_as_little_of_it(velocity_mps, yaw_rate_radps) -> None:
    """Its body moves with them, so that no ray starts behind its own front."""
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        amr = Amr(warehouse)
        warehouse.add_actor(RobotLook.of(amr))
        scene = ScanScene(warehouse.layout, 0, warehouse.actors)
        motion = RobotMotion(0.0, amr.T_odom_base, np.array(velocity_mps), yaw_rate_radps)
        for spec in DIAGONAL_SCANNERS:
            scanner = SimulatedScanner(scene, spec, np.random.default_rng(0))
            scan = scanner.scan(motion)
            assert (scanner.hit_by == -1).all()
            assert not np.isneginf(scan.ranges_m).any()  # nothing nearer than it measures
        # A scanner within the body sees it as if it stood still.
        within = CENTRE.model_copy(update={"x_m": 0.3})
        standing, moving = (
            SimulatedScanner(scene, within, np.random.default_rng(0)).scan(each).ranges_m
            for each in (RobotMotion(0.0, amr.T_odom_base), motion)
        )
        np.testing.assert_allclose(moving, standing)


def test_a_moving_robot_sees_a_straight_wall_once_its_motion_is_corrected() -> None:
    wall = Thing(box((4.0, 0.0, 0.5), (2.0, 8.0, 1.0)))
    motion = RobotMotion(3.0, np.eye(4), np.array([1.4, 0.0]), 0.8)
    scanner = scanner_of(wall, field_of_view_deg=(-45.0, 45.0), x_m=0.3)
    scan = scanner.scan(motion)
    assert scan.end_s == pytest.approx(3.0)
    points = scan_points(scan, scanner.mounting, motion).points_odom_m
    np.testing.assert_allclose(points[np.isfinite(points[:, 0]), 0], 3.0, atol=1e-9)
    ignored = scan_points(scan, scanner.mounting, RobotMotion(3.0, np.eye(4))).points_odom_m
    assert np.nanmax(np.abs(ignored[:, 0] - 3.0)) > 0.01


def test_noise_dropouts_and_limits_are_those_of_the_settings() -> None:
    room = box((0.0, 0.0, 0.5), (6.0, 6.0, 1.0))
    exact = scanner_of(Thing(room), scan_share=0.0).scan(LEVEL).ranges_m
    noisy = scanner_of(Thing(room), scan_share=0.0, noise_std_m=0.02, dropout_rate=0.1)
    errors = np.concatenate([noisy.scan(LEVEL).ranges_m - exact for _ in range(20)])
    lost = np.isposinf(errors)
    assert lost.mean() == pytest.approx(0.1, abs=0.01)
    assert errors[~lost].std() == pytest.approx(0.02, rel=0.03)
    assert abs(errors[~lost].mean()) < 0.001
    black = scanner_of(Thing(room, reflectance=0.0), scan_share=0.0, dark_dropout_rate=0.3)
    assert np.isposinf(black.scan(LEVEL).ranges_m).mean() == pytest.approx(0.3, abs=0.05)
    grey = scanner_of(Thing(room, reflectance=0.4), scan_share=0.0, dark_dropout_rate=0.3)
    assert np.isfinite(grey.scan(LEVEL).ranges_m).all()
    limited = scanner_of(Thing(room), scan_share=0.0, range_min_m=3.2, range_max_m=4.0)
    ranges = limited.scan(LEVEL).ranges_m
    np.testing.assert_array_equal(np.isneginf(ranges), exact < 3.2)
    np.testing.assert_array_equal(np.isposinf(ranges), exact > 4.0)
