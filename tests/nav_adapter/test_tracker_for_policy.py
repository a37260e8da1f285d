"""A tracker for a policy has all that the policy's rules need."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from pathlib import Path

import pytest
from paths import ROOT

from nav_adapter import AwarenessPolicy
from tracking import AwarenessFilterConfig, TrackerConfig, TrackingError


@pytest.mark.parametrize("name", ["balanced", "assertive", "conservative", "blind"])
def test_a_rule_that_needs_the_tracker_has_what_it_needs(name: str) -> None:
    policy = AwarenessPolicy.preset(name)
    assert TrackerConfig.for_policy(policy) == TrackerConfig(awareness=policy.filter)


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

    config = TrackerConfig.for_policy(Mine(AwarenessFilterConfig(memory_s=2.0)))
    assert config.awareness.memory_s == 2.0
    with pytest.raises(TrackingError, match="policy must be an AwarenessPolicy, got str"):
        TrackerConfig.for_policy("balanced")  # type: ignore[arg-type]


def test_no_code_passes_a_part_of_what_a_policy_needs() -> None:
    folders = ("docs", "examples", "perception", "nav_adapter", "awarenav", "sim_tests")
    files = [ROOT / "README.md"]
    for folder, kind in itertools.product(folders, ("py", "md", "ipynb")):
        files += (ROOT / folder).rglob(f"*.{kind}")
    printed = [path for path in files if "TrackerConfig.for_policy(policy)" in path.read_text()]
    assert {"README.md", "planners.md", "plug_into_planner.py"} <= {path.name for path in printed}
    parts = re.compile(r"awareness=\w*policy\w*\.filter")
    assert [path.name for path in files if parts.search(path.read_text())] == []
