"""Sensors of a robot: when images arrive, and a camera that measures depth."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from watching_cameras import Watching, setup_on, world_at

from perception import PersonObservation
from perception.anthropometry import MEAN_STATURE_M
from sim_tests import Scenario, conditions, run_crossing
from sim_tests.conditions import CAMERAS, OTHER_SENSORS, Perception
from sim_tests.crossing import Stage
from sim_tests.crossing.sensors import Sensor, SensorSetup, Sighting, World, sensor_class
from sim_tests.world.camera import CameraTiming
from tracking import SensorConfig


@pytest.mark.parametrize("name", [*CAMERAS, *OTHER_SENSORS])
def test_every_name_is_that_of_a_sensor(name: str) -> None:
    assert issubclass(sensor_class(name), Sensor)
    assert Perception.named(name) == (name,)


class _Counting:
    """Sees nobody and records the stamps at which it looks."""

    def __init__(self) -> None:
        self.looked_s: list[float] = []

    def observe(self, world: World) -> tuple[()]:
        self.looked_s.append(world.t_s)
        return ()


def test_a_camera_delivers_late_what_it_saw_at_the_stamp() -> None:
    eyes = _Counting()
    timing = CameraTiming(rate_hz=10.0, latency_s=0.12, drop_rate=0.25)
    camera = Watching(eyes, timing=timing, seed=2)
    delivered = []
    for tick in range(200):
        now = tick / 20.0
        pose = np.eye(4) * (1.0 + tick)
        for sighting in camera.look(world_at(now, pose)):
            assert now - sighting.stamp_s == pytest.approx(0.15)  # the first tick after 0.12 s
            assert sighting.T_odom_camera[0, 0] == pytest.approx(1.0 + 20.0 * sighting.stamp_s)
            delivered.append(sighting.stamp_s)
    # Lost frames are not looked at; at most two are still to be delivered at the end.
    assert eyes.looked_s[: len(delivered)] == delivered
    assert len(eyes.looked_s) - len(delivered) <= 2
    assert len(delivered) == pytest.approx(75, abs=15)


CHILD = """
name: child
description: A child and an adult stand ahead of the robot.
duration_s: 1.0
layout: open
robot: {goal_x_m: 8.0}
people:
  - {name: child, stature_m: 1.1, route: [{x_m: 4.0, y_m: 0.6}], heading_deg: 180.0}
  - {name: adult, stature_m: 1.8, route: [{x_m: 5.0, y_m: -0.8}], heading_deg: 150.0}
"""


def test_a_depth_camera_measures_how_far_a_child_is(tmp_path) -> None:
    """A camera alone takes it for an adult farther away."""
    (path := tmp_path / "child.yaml").write_text(CHILD)
    scenario = Scenario.from_yaml(path)
    errors = {}
    for name in ("keypoints", "depth"):
        with Stage(scenario, renderer="auto") as stage:
            setup = setup_on(stage)
            T = stage.amr.T_odom_camera
            truth = stage.truth(setup.cone, T)
            (image,) = sensor_class(name)(setup).look(World(0.0, T, T, truth, stage.amr.state(0.0)))
        errors[name] = {
            worker: np.linalg.norm(each.position_camera_m - truth[worker].position_camera_m)
            for each, worker in image.observations
        }
    assert scenario.people[0].stature_m < MEAN_STATURE_M
    assert errors["keypoints"][0] > 1.0
    assert max(errors["depth"].values()) < 0.15


@pytest.mark.slow
def test_an_episode_with_a_depth_camera_repeats() -> None:
    scenario = Scenario.shipped("standing_in_aisle").model_copy(update={"duration_s": 1.0})
    first, second = (
        run_crossing(scenario, policy="balanced", perception="depth+scanner") for _ in range(2)
    )
    assert [frame.command for frame in first.frames] == [frame.command for frame in second.frames]
    assert any(frame.observations for frame in first.frames)
    assert any(len(frame.scan_points_odom_m) for frame in first.frames)


def test_a_new_sensor_is_one_class_and_its_name(monkeypatch) -> None:
    """A sonar, which hears people on all sides: it is in the tracker, the table and the options."""

    class Sonar(Sensor, name="sonar"):
        def __init__(self, setup: SensorSetup) -> None:
            self.tracked = {"sonar": SensorConfig()}

        def look(self, world: World) -> tuple[Sighting, ...]:
            heard = (
                PersonObservation(
                    world.t_s, each.position_camera_m, 0.01 * np.eye(3), None, None, None, 0.9
                )
                for each in world.truth
            )
            people = tuple((each, number) for number, each in enumerate(heard))
            return (Sighting(world.t_s, world.T_odom_camera_known, people, sensor="sonar"),)

    monkeypatch.setitem(sys.modules, f"{Sensor.__module__.rpartition('.')[0]}._sonar", Sonar)
    monkeypatch.setattr(conditions, "OTHER_SENSORS", (*OTHER_SENSORS, "sonar"))
    assert Perception.of("keypoints", "camera+sonar").name == "keypoints+sonar"
    behind = {"start_heading_deg": 180.0, "goal_x_m": -1.0}
    scenario = Scenario.shipped("standing_in_aisle")
    scenario = scenario.model_copy(
        update={"duration_s": 0.5, "robot": scenario.robot.model_copy(update=behind)}
    )
    for perception, known in (("keypoints", False), ("keypoints+sonar", True)):
        result = run_crossing(scenario, policy="balanced", perception=perception)
        assert bool(result.frames[-1].tracks) is known
        # Hearing people is no view of what is ahead.
        assert not any(frame.observations for frame in result.frames)
