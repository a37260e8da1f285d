"""Crossings as a Gymnasium environment, and planners made of learned policies.

Importing this page registers ``awarenav/Crossing-v0`` with Gymnasium, the extra ``awarenav[gym]``.
``gymnasium.make("sim_tests.learning:awarenav/Crossing-v0")`` imports it, in any process. A
:class:`PolicyPlanner` and a :class:`LearnedPlanner` do not need Gymnasium.

Workers that come from a fork server, as those of Stable-Baselines3's ``SubprocVecEnv``, know the
name too: the server imports this page, unless it was running before.
"""

from __future__ import annotations

import multiprocessing
from importlib.util import find_spec
from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._environment import CrossingEnv, RewardWeights
    from ._network_policy import LearnedPlanner, NetworkPolicy
    from ._policy_planner import ObservationEncoder, PolicyPlanner, command_of


# The name in Gymnasium's registry.
_ENVIRONMENT_ID = "awarenav/Crossing-v0"

if find_spec("gymnasium") is not None:
    from gymnasium.envs.registration import register

    register(_ENVIRONMENT_ID, entry_point="sim_tests.learning:CrossingEnv")
    # Gymnasium reads no entry points since 1.0, so a worker knows only what its process imports.
    if "forkserver" in multiprocessing.get_all_start_methods():
        multiprocessing.set_forkserver_preload(["__main__", __name__])

__getattr__ = lazy_page(__name__, __file__)
