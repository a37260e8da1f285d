"""A tracker for a policy has all that the policy's rules need."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

from nav_adapter import AwarenessPolicy
from perception import PersonObservation
from sim_tests.crossing import named_policy
from tracking import (
    AwarenessFilterConfig,
    PersonTracker,
    SensorConfig,
    TrackerConfig,
    TrackingError,
)

T_ODOM_CAMERA = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1.0]])


def somebody_who_stands(stamp_s: float, noise_m: np.ndarray) -> tuple[PersonObservation, ...]:
    return (
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([0.0, 0.2, 3.0]) + noise_m,
            position_covariance_m2=1e-4 * np.eye(3),
            gaze_camera=None,
            awareness=None,
            awareness_std=None,
            score=0.9,
        ),
    )


def moved_m(config: TrackerConfig) -> float:
    """Return how far somebody who has stood for 2 s may have moved."""
    tracker = PersonTracker(config, sensors={"laser": SensorConfig()})
    rng = np.random.default_rng(0)
    for tick in range(81):
        people = somebody_who_stands(0.025 * tick, rng.normal(0.0, 0.008, 3))
        tracks = tracker.update(people, 0.025 * tick, T_ODOM_CAMERA, sensor="laser")
    return tracks[0].moved_m


@pytest.mark.parametrize("name", ["balanced", "assertive", "conservative", "blind", "scanner"])
def test_a_rule_that_needs_the_tracker_has_what_it_needs(name: str) -> None:
    policy = named_policy(name)[1]
    config = TrackerConfig.for_policy(policy)
    assert config == TrackerConfig(
        awareness=policy.filter, standing_window_s=policy.standing_window_s
    )
    needs = policy.rules.standing is not None and policy.rules.standing.delay_from_tracks
    assert math.isfinite(moved_m(config)) == needs
    assert math.isinf(moved_m(TrackerConfig(awareness=policy.filter)))


def test_a_policy_of_ones_own_sets_the_tracker(tmp_path: Path) -> None:
    policy = AwarenessPolicy.preset("balanced")
    path = tmp_path / "mine.yaml"
    policy.to_yaml(path)
    path.write_text(re.sub(r"\bmemory_s: .*", "memory_s: 1.5", path.read_text(), count=1))
    own = AwarenessPolicy.from_yaml(path)
    assert TrackerConfig.for_policy(own).awareness.memory_s == own.filter.memory_s == 1.5


def test_any_object_with_the_needs_of_a_policy_will_do() -> None:
    @dataclass(frozen=True)
    class Mine:
        filter: AwarenessFilterConfig
        standing_window_s: float | None

    config = TrackerConfig.for_policy(Mine(AwarenessFilterConfig(memory_s=2.0), 0.7))
    assert (config.awareness.memory_s, config.standing_window_s) == (2.0, 0.7)
    with pytest.raises(TrackingError, match="policy must be an AwarenessPolicy, got str"):
        TrackerConfig.for_policy("balanced")  # type: ignore[arg-type]


def test_no_code_passes_a_part_of_what_a_policy_needs() -> None:
    folders = ("docs", "examples", "perception", "nav_adapter", "awarenav", "sim_tests")
    files = [ROOT / "README.md"]
    for folder, kind in itertools.product(folders, ("py", "md", "ipynb")):
        files += (ROOT / folder).rglob(f"*.{kind}")
    printed = [path for path in files if "TrackerConfig.for_policy(policy)" in path.read_text()]
    assert {"README.md", "plug-it-into-your-planner.md", "plug_into_planner.py"} <= {
        path.name for path in printed
    }
    parts = re.compile(r"awareness=\w*policy\w*\.filter")
    assert [path.name for path in files if parts.search(path.read_text())] == []
