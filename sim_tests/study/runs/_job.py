"""One episode to run, as plain data, and the versions that its result depends on."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from importlib import metadata
from typing import Final


@dataclass(frozen=True, slots=True)
class Job:
    """One episode to run.

    Scenario, policy and fault are YAML text, so that a job gives the same episode on every worker,
    even if the files change in the meantime.

    Attributes:
        scenario: YAML of a :class:`ScenarioTemplate`.
        seed: seed of the episode.
        policy_name: name of the policy in tables.
        policy: YAML of an :class:`AwarenessPolicy`.
        planner: ``"module:Class"``, empty for the reference planner.
        perception: as for :func:`sim_tests.run_crossing`.
        fault_name: name of the fault in tables, empty for none.
        fault: YAML of a :class:`Fault`, empty for none.
    """

    scenario: str
    seed: int
    policy_name: str
    policy: str
    planner: str = ""
    perception: str = "keypoints"
    fault_name: str = ""
    fault: str = ""


_PACKAGES: Final = ("awarenav", "numpy", "scipy", "opencv-python-headless", "pybullet")


def versions() -> dict[str, str]:
    """Return the versions that results depend on, beside the jobs themselves."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # pragma: no cover - a checkout that is not installed
            found[name] = "unknown"
    return found
