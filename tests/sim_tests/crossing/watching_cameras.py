"""Cameras without a stage, whose people a test makes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from nav_adapter import RobotState
from sim_tests.crossing.faults import EpisodeFaults
from sim_tests.crossing.sensors import CameraSensor, KeypointNoise, SensorSetup, World
from sim_tests.scenario import CameraSpec
from sim_tests.world.camera import CameraTiming


def setup_on(
    stage: Any, faults: EpisodeFaults | None = None, seed: int = 0, **more: Any
) -> SensorSetup:
    """The parts of sensors on a stage; keypoints of everybody in view."""
    faults = faults or EpisodeFaults(None, seed, stage.scenario.camera.camera())
    noise = KeypointNoise(miss_rate=0.0)
    return SensorSetup(stage=stage, seed=seed, faults=faults, noise=noise, **more)


class Watching(CameraSensor):
    """A camera whose people a watcher sees, with an ``observe`` of the world."""

    def __init__(
        self,
        watcher: Any,
        faults: EpisodeFaults | None = None,
        timing: CameraTiming | None = None,
        seed: int = 0,
    ) -> None:
        spec = CameraSpec(timing=timing or CameraTiming())
        stage: Any = SimpleNamespace(scenario=SimpleNamespace(camera=spec))
        super().__init__(setup_on(stage, faults, seed))
        self.watcher = watcher

    def observe(self, view: int, world: World) -> Any:
        return self.watcher.observe(world)


def world_at(t_s: float, T_odom_camera: np.ndarray | None = None) -> World:
    """Return a world without people."""
    T = np.eye(4) if T_odom_camera is None else T_odom_camera
    return World(t_s, T, T, (), RobotState(t_s, (0.0, 0.0), 0.0, 0.0, 0.0))
