"""Robots as data, and bodies that are moved within their limits."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import shapely
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import ROOT
from pydantic import ValidationError

from nav_adapter import RobotProfile
from nav_adapter.ros2 import CameraMount
from sim_tests import NOVA_CARTER, SimError, Warehouse, Worker
from sim_tests.actors.robot import KinematicRobot, RobotModel, shipped_robots
from sim_tests.world.hall import WarehouseLayout

KINEMATIC = [name for name in shipped_robots() if name != "nova_carter"]
FORKLIFT = RobotModel.shipped("forklift")
OMNI = RobotModel.shipped("omni")
STEP_S = 1.0 / 240.0


def outline(robot: KinematicRobot) -> shapely.Polygon:
    state = robot.state(0.0)
    c, s = math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)
    turned = robot.model.outline_m @ np.array([[c, s], [-s, c]])
    return shapely.Polygon(turned + state.position_odom_m)


@pytest.mark.parametrize("name", KINEMATIC)
def test_a_robot_survives_yaml_and_sees_around_itself(name: str, tmp_path) -> None:
    model = RobotModel.shipped(name)
    model.to_yaml(tmp_path / "robot.yaml")
    assert RobotModel.of(tmp_path / "robot.yaml") == model
    body = shapely.Polygon(model.outline_m)
    for scanner in model.scanners:  # just outside the body, so that it does not see itself
        assert 0.0 < body.distance(shapely.Point(scanner.x_m, scanner.y_m)) < 0.03
    # The union of the fields of view holds every direction.
    directions = np.arange(0, 360)
    seen = np.zeros(360, dtype=bool)
    for scanner in model.scanners:
        low, high = np.array(scanner.field_of_view_deg) + scanner.yaw_deg
        seen |= (directions - low) % 360 <= high - low
    assert seen.all()
    assert body.covers(shapely.Point(model.camera_m[:2]))


@pytest.mark.parametrize("page", ["nav2/robot.yaml", "nav2.md", "tutorials/nav2-*.md"])
def test_the_robot_of_the_documents_is_the_simulated_one(page: str) -> None:
    (path,) = (ROOT / "docs").glob(page)
    text = path.read_text()
    blocks = re.findall(r"^```yaml\n(.*?)^```", text, re.M | re.S) or [text]
    (robot,) = [each for block in blocks if "scanners" in (each := yaml.safe_load(block))]
    own = RobotModel.shipped("nova_carter")
    mounts = [(*each.pop("position_base_m"), each.pop("yaw_deg")) for each in robot["scanners"]]
    assert mounts == [(each.x_m, each.y_m, each.z_m, each.yaw_deg) for each in own.scanners]
    assert not any(each.get("upside_down") for each in robot["scanners"])
    if "camera" in robot:
        mount = CameraMount.model_validate(robot["camera"])
        assert mount == CameraMount(position_base_m=list(own.camera_m))
    for name in robot.keys() - {"scanners", "camera"}:
        assert np.array_equal(robot[name], getattr(own.profile, name)), name


def test_unusable_robots_are_refused_with_a_reason() -> None:
    with pytest.raises(SimError, match="did you mean 'forklift'"):
        RobotModel.of("forklft")
    with pytest.raises(SimError, match="max_yaw_rate_radps"):
        RobotModel.of(RobotProfile(NOVA_CARTER.footprint_m, 1.0, 1.0, 1.0, 0.3))
    data = FORKLIFT.model_dump()
    with pytest.raises(ValidationError, match="min_turning_radius_m"):
        RobotModel.model_validate({**data, "min_turning_radius_m": None})
    part = {"low_m": (0.0, 0.0, 0.1), "high_m": (2.0, 0.1, 0.5)}
    with pytest.raises(ValidationError, match="within footprint_m"):
        RobotModel.model_validate({**data, "parts": [part]})


twists = st.lists(
    st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-1.5, 1.5)),
    min_size=1,
    max_size=5,
)


@settings(max_examples=8, deadline=None)
@given(st.sampled_from(KINEMATIC), twists)
def test_a_body_moves_within_the_limits_of_its_profile(name: str, commands: list) -> None:
    model = RobotModel.shipped(name)
    profile = model.profile
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        robot = KinematicRobot(warehouse, model, (4.0, 0.0), 0.3)
        most = max(profile.max_acceleration_mps2, profile.max_deceleration_mps2) * STEP_S
        before = robot.state(0.0)
        for forward, yaw_rate, left in commands:
            robot.command(forward, yaw_rate, left)
            for _ in range(24):
                robot.advance(STEP_S)
                now = robot.state(0.0)
                change = now.speed_mps - before.speed_mps, now.lateral_mps - before.lateral_mps
                assert math.hypot(*change) <= most + 1e-9
                assert now.travel_mps <= profile.max_speed_mps + 1e-9
                assert abs(now.yaw_rate_radps) <= model.max_yaw_rate_radps + 1e-9
                if profile.min_turning_radius_m is not None:
                    curve = abs(now.speed_mps) / profile.min_turning_radius_m
                    assert abs(now.yaw_rate_radps) <= curve + 1e-9
                if profile.drive != "holonomic":
                    assert now.lateral_mps == 0.0
                travelled = now.position_odom_m - before.position_odom_m
                np.testing.assert_allclose(
                    np.linalg.norm(travelled), now.travel_mps * STEP_S, atol=1e-9
                )
                before = now


def test_a_holonomic_robot_moves_sideways_along_its_left(hall) -> None:
    robot = KinematicRobot(hall, OMNI, (0.0, 0.0), 0.5)
    robot.command(0.0, 0.0, 0.6)
    for _ in range(480):
        robot.advance(STEP_S)
    state = robot.state(2.0)
    assert state.velocity_base_mps == pytest.approx([0.0, 0.6])
    np.testing.assert_allclose(state.velocity_odom_mps, robot.motion.velocity_mps)
    along = state.position_odom_m / np.linalg.norm(state.position_odom_m)
    np.testing.assert_allclose(along, [-math.sin(0.5), math.cos(0.5)], atol=1e-6)


def test_a_rack_stops_a_robot_once(hall) -> None:
    robot = KinematicRobot(hall, FORKLIFT, (4.0, 2.0), 0.5 * math.pi)
    robot.command(1.0, 0.0)
    for _ in range(1200):
        robot.advance(STEP_S)
    racks = shapely.union_all(shapely.box(*hall.obstacle_boxes_odom.T))
    assert robot.bumps == 1
    assert robot.driven_mps == 0.0
    assert 0.0 <= outline(robot).distance(racks) < 0.01
    robot.command(-0.5, 0.0)
    for _ in range(240):
        robot.advance(STEP_S)
    assert outline(robot).distance(racks) > 0.1


@pytest.mark.parametrize("heading_rad", [0.0, 0.7])
def test_people_touch_the_outline_where_it_is_and_not_beside_it(hall, heading_rad: float) -> None:
    """At the tips of the forks, 0.85 m behind the base origin, and 1.25 m ahead of it."""
    robot = KinematicRobot(hall, FORKLIFT, (1.0, 0.0), heading_rad)
    worker = Worker(hall, 1.75)
    forward = np.array([math.cos(heading_rad), math.sin(heading_rad)])
    for edge_m, side in ((1.25, 1.0), (-0.85, -1.0)):
        for gap_m, touches in ((0.35, False), (-0.05, True)):
            place = np.array([1.0, 0.0]) + (edge_m + side * gap_m) * forward
            worker.place(place, heading_rad, 0.0, 0.0, 0.0, 0.0)
            assert robot.touches(worker.body) is touches
