"""Closed-loop crossings of a mobile robot and people in PyBullet.

Needs the extra ``awarenav[sim]``; names are imported when they are first used, so that the command
line can say so where it is missing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import _clash  # noqa: F401 - first: refuses a foreign package of one of our names

if TYPE_CHECKING:
    from ._crossing import CrossingFrame, CrossingResult, StraightOn, run_crossing
    from ._errors import SimError
    from ._keypoint_camera import KeypointNoise
    from ._scenario import Scenario, shipped_scenarios
    from ._scenario_template import ScenarioTemplate
    from ._warehouse import Warehouse
    from .people._worker import Worker
    from .pictures._renderer import CameraRenderer
    from .pictures._simulated_camera import SimulatedCamera
    from .robot._amr import NOVA_CARTER
    from .robot._planner import LocalPlanner, SamplingPlanner

__all__ = [
    "NOVA_CARTER",
    "CameraRenderer",
    "CrossingFrame",
    "CrossingResult",
    "KeypointNoise",
    "LocalPlanner",
    "SamplingPlanner",
    "Scenario",
    "ScenarioTemplate",
    "SimError",
    "SimulatedCamera",
    "StraightOn",
    "Warehouse",
    "Worker",
    "run_crossing",
    "shipped_scenarios",
]

_HOMES = {
    "NOVA_CARTER": "robot._amr",
    "CameraRenderer": "pictures._renderer",
    "CrossingFrame": "_crossing",
    "CrossingResult": "_crossing",
    "KeypointNoise": "_keypoint_camera",
    "LocalPlanner": "robot._planner",
    "SamplingPlanner": "robot._planner",
    "Scenario": "_scenario",
    "ScenarioTemplate": "_scenario_template",
    "SimError": "_errors",
    "SimulatedCamera": "pictures._simulated_camera",
    "StraightOn": "_crossing",
    "Warehouse": "_warehouse",
    "Worker": "people._worker",
    "run_crossing": "_crossing",
    "shipped_scenarios": "_scenario",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
