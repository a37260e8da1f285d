"""One episode to run: plain data, the same on every worker.

Which versions a run's results depend on.
"""

from __future__ import annotations

import platform
from dataclasses import dataclass
from importlib import metadata
from typing import Final


@dataclass(frozen=True, slots=True)
class Job:
    """One episode to run.

    Scenario, policy and fault are held as YAML text, so that a job means the same wherever it runs
    and whatever the files become meanwhile.

    Attributes:
        scenario: YAML of a :class:`Scenario`.
        seed: of the episode.
        policy_name: what tables call the policy.
        policy: YAML of an :class:`AwarenessPolicy`.
        planner: ``"module:Class"``, empty for the reference planner.
        perception: ``"truth"``, ``"keypoints"``, or ``"pixels"``.
        fault_name: what tables call the fault, empty for none.
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
    """What results depend on, beside the jobs themselves."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # pragma: no cover - a checkout on the path
            found[name] = "unknown"
    return found
