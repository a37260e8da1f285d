"""Crossings as data: hall, robot task, camera, people, and distributions of their numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._distributions import Choice, Distribution, Integers, read_distribution
    from ._files import SCENARIO_SETS, shipped_scenarios
    from ._networks import load_networks
    from ._scenario import CameraSpec, RobotTask, Scenario

__getattr__ = lazy_page(__name__, __file__)
